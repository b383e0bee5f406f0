//! The board's own image at its serial lines: weights over the command link, then a drive through
//! the sensor line.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use firmware::app::{Config, Hardware};
use firmware::configuration::record::{self, Record as Configured};
use firmware::configuration::{Configuration, Sensor};
use firmware::control::{Mode, Window};
use firmware::model::IMAGES_LEN;
use firmware::wire::command::{
    self, Counters, Estimate, Health, MAX_CHUNK, MAX_PACKET, Request, Reset, Response,
};
use firmware::wire::framer::LONGEST;
use firmware::wire::{Fields, ImuFormat};
use host_device::hil::not_in_real_time;

use crate::drive::Record;
use crate::images::Board;
use crate::live::{Live, through};
use crate::memory::Memory;
use crate::replay::{Input, nets};
use crate::software::on_desktop;

/// How often a request is sent, twice a second.
const TRIES: usize = 40;

/// Traffic of a board on its lines.
#[derive(Debug)]
pub struct Served {
    /// Number of sensor records sent to it.
    pub samples: usize,
    /// Bytes sent to the navigation computer.
    pub sent: Vec<u8>,
    /// What the library on the desktop sends for the same input.
    pub expected: Vec<u8>,
    /// Its health at the end.
    pub health: Health,
    /// Its memory at the end.
    pub memory: Memory,
}

/// The requests that configure a board with `record`.
fn upload(record: &[u8]) -> Vec<Request<'_>> {
    let pieces = record.chunks(MAX_CHUNK).enumerate();
    let mut requests: Vec<Request> = pieces
        .map(|(index, bytes)| Request::WriteConfiguration {
            offset: (index * MAX_CHUNK) as u32,
            bytes,
        })
        .collect();
    let length = record.len() as u32;
    requests.push(Request::CommitConfiguration { length });
    requests
}

/// A configuration for tests, whose samples do not come in real time.
fn record() -> Configured {
    let mut configuration = Configuration::default();
    not_in_real_time(&mut configuration);
    record::encode(&configuration)
}

/// The packets that configure a board.
///
/// # Errors
/// None.
pub fn configure(configuration: &Configuration) -> Result<Vec<Vec<u8>>> {
    packets(&upload(&record::encode(configuration)))
}

/// The packets that configure a board and set a mode.
///
/// # Errors
/// None.
pub fn mode(mode: Mode) -> Result<Vec<Vec<u8>>> {
    let record = record();
    let mut requests = upload(&record);
    requests.push(Request::SetMode(mode));
    packets(&requests)
}

fn packets(requests: &[Request]) -> Result<Vec<Vec<u8>>> {
    let numbered = requests.iter().enumerate();
    numbered
        .map(|(number, request)| packet_of(number as u8, request))
        .collect()
}

/// The packets that configure a board, load both networks and switch the correction on.
///
/// # Errors
/// None with the committed networks.
pub fn set_up() -> Result<Vec<Vec<u8>>> {
    loaded(&record(), Mode::Frozen)
}

/// The packets of [`set_up`] for another unit and another mode.
///
/// # Errors
/// None with the committed networks.
pub fn set_up_configured(configuration: &Configuration, mode: Mode) -> Result<Vec<Vec<u8>>> {
    loaded(&record::encode(configuration), mode)
}

fn loaded(record: &[u8], mode: Mode) -> Result<Vec<Vec<u8>>> {
    let mut images = [0; IMAGES_LEN];
    nets().write_images(0, &mut images);
    let mut requests = upload(record);
    for (index, bytes) in images.chunks(MAX_CHUNK).enumerate() {
        let offset = (index * MAX_CHUNK) as u32;
        requests.push(Request::WriteImage { offset, bytes });
    }
    let length = IMAGES_LEN as u32;
    requests.push(Request::CommitImage { length });
    requests.push(Request::SetMode(mode));
    packets(&requests)
}

/// A request as it goes over the command link.
///
/// # Errors
/// It is too long for a packet.
pub fn packet_of(number: u8, request: &Request) -> Result<Vec<u8>> {
    let mut buffer = [0; MAX_PACKET];
    let packet = command::encode(number, request, &mut buffer);
    Ok(packet
        .map_err(|error| anyhow::anyhow!("{error:?}"))?
        .to_vec())
}

/// Lets `board` learn from one reference while it receives the STIM300's `records`, use what it has
/// learnt, read it back and store it. These are all operations that need much stack. Returns its
/// memory at the end and the number of references it reports as used.
///
/// # Errors
/// QEMU or the board do not answer, or a request is refused.
pub fn learn_from_reference(
    board: Board,
    image: &Path,
    records: &[Record],
) -> Result<(Memory, u32)> {
    let mut live = Live::start(board, image)?;
    let set_up = set_up()?;
    let mut number = set_up.len() as u8;
    obey(&mut live, &set_up)?;
    let mut request = |live: &mut Live, request: &Request| -> Result<Option<Estimate>> {
        number += 1;
        answer(&mut live.command, number, &packet_of(number, request)?)
    };
    let stream = |live: &mut Live, records: &[Record]| -> Result<()> {
        let words = records
            .iter()
            .filter(|record| record.input == Input::Sensor);
        let bytes: Vec<u8> = words.flat_map(|record| record.bytes.clone()).collect();
        let sent = through(&live.sensor, &bytes, &live.navigation, bytes.len())?;
        ensure!(sent.len() == bytes.len(), "{} bytes came", sent.len());
        Ok(())
    };
    request(&mut live, &Request::SetMode(Mode::Learn))?;
    let (first, rest) = records.split_at(records.len() / 2);
    stream(&mut live, first)?;
    let estimate = request(&mut live, &Request::GetEstimate)?;
    let window = estimate.and_then(|estimate| estimate.window);
    let (first, last) = window.context("no window is closed")?;
    let reference = Window {
        first,
        last,
        angle: [1e-3; 3],
        velocity: [0.0, 0.0, -98.0],
        angle_sigma: 1.0,
        velocity_sigma: 1e3,
    };
    request(&mut live, &Request::Reference(reference))?;
    stream(&mut live, rest)?;
    let used = request(&mut live, &Request::GetEstimate)?.map_or(0, |estimate| estimate.used);
    let (offset, length) = (0, MAX_CHUNK as u16);
    request(&mut live, &Request::ReadLearnt { offset, length })?;
    request(&mut live, &Request::CommitLearnt)?;
    request(&mut live, &Request::ReadImage { offset, length })?;
    request(&mut live, &Request::SetMode(Mode::Bypass))?;
    request(&mut live, &Request::StoreImage)?;
    Ok((live.memory()?, used))
}

/// Starts `board`, sets it up, sends it the sensor's and the receiver's `records`, and reads what
/// it sends.
///
/// # Errors
/// QEMU or the board do not answer, or a request is refused.
pub fn serve(board: Board, image: &Path, records: &[Record]) -> Result<Served> {
    let mut live = Live::start(board, image)?;
    let set_up = set_up()?;
    obey(&mut live, &set_up)?;
    let expected = expected(set_up, records);
    let of = |wanted: Input| -> Vec<u8> {
        let wanted = records.iter().filter(|record| record.input == wanted);
        wanted.flat_map(|record| record.bytes.clone()).collect()
    };
    live.gnss.write_all(&of(Input::Gnss))?;
    let sent = through(
        &live.sensor,
        &of(Input::Sensor),
        &live.navigation,
        expected.len(),
    )?;
    Ok(Served {
        samples: records
            .iter()
            .filter(|record| record.input == Input::Sensor)
            .count(),
        sent,
        expected,
        health: health(&mut live.command)?,
        memory: live.memory()?,
    })
}

/// Sends the board these packets, one after another, and expects that each is done.
///
/// # Errors
/// The board does not answer, or refuses one.
pub fn obey(live: &mut Live, packets: &[Vec<u8>]) -> Result<()> {
    for (number, bytes) in packets.iter().enumerate() {
        ask(&mut live.command, number as u8, bytes)?;
    }
    Ok(())
}

/// What the library on the desktop sends for these records behind these packets.
#[must_use]
pub fn expected(packets: Vec<Vec<u8>>, records: &[Record]) -> Vec<u8> {
    let commands = packets.into_iter().map(|bytes| Record {
        input: Input::Command,
        at_us: 0,
        bytes,
    });
    let input: Vec<_> = commands.chain(records.iter().cloned()).collect();
    on_desktop(Config::unconfigured(Hardware::DESKTOP), &input).sent
}

/// The configuration of a device that cuts through the frames of the first simulated sensor of this
/// format.
#[must_use]
pub fn cut_through(format: ImuFormat) -> Configuration {
    let sensor = &format.simulated()[0];
    let mut settings = sensor.settings();
    settings.stim300.ask = false;
    let mut configuration = Configuration {
        sensor: Some(Sensor::Stream(format.settings(&settings))),
        rate: f64::from(sensor.rate),
        ..Configuration::default()
    };
    configuration.lines.cut_through = true;
    not_in_real_time(&mut configuration);
    configuration
}

/// Repeats a request until it is answered, and expects "done". Bytes sent before a board has opened
/// its lines are lost, so a request may arrive twice.
fn ask(line: &mut TcpStream, number: u8, request: &[u8]) -> Result<()> {
    let estimate = answer(line, number, request)?;
    ensure!(estimate.is_none(), "the board answers {estimate:?}");
    Ok(())
}

/// Repeats a request until it is answered by "done", by an image, or by an estimate, which is
/// returned.
fn answer(line: &mut TcpStream, number: u8, request: &[u8]) -> Result<Option<Estimate>> {
    line.set_read_timeout(Some(Duration::from_millis(500)))?;
    for _ in 0..TRIES {
        line.write_all(request)?;
        while let Some(mut packet) = packet(line)? {
            match command::decode::<Response>(&mut packet) {
                Ok((answered, Response::Done | Response::Image { .. })) if answered == number => {
                    return Ok(None);
                }
                Ok((answered, Response::Estimate(estimate))) if answered == number => {
                    return Ok(Some(estimate));
                }
                Ok((answered, _)) if answered < number => {} // to the second of two equal requests
                other => bail!("the board answers {other:?}"),
            }
        }
    }
    bail!("no answer to request {number} after {TRIES} times")
}

/// The board's health, asked until it answers.
///
/// # Errors
/// As [`serve`].
pub fn health(line: &mut TcpStream) -> Result<Health> {
    state(line, &Request::GetHealth, |answer| match answer {
        Response::Health(health) => Some(health),
        _ => None,
    })
}

/// Its counters.
///
/// # Errors
/// As [`serve`].
pub fn counters(line: &mut TcpStream) -> Result<Counters> {
    state(line, &Request::GetCounters, |answer| match answer {
        Response::Counters(counters) => Some(counters),
        _ => None,
    })
}

/// Why the board started; it is asked until it answers.
///
/// # Errors
/// As [`serve`].
pub fn reset(line: &mut TcpStream) -> Result<Reset> {
    state(line, &Request::GetReset, |answer| match answer {
        Response::Reset(reset) => Some(reset),
        _ => None,
    })
}

fn state<T>(
    line: &mut TcpStream,
    request: &Request,
    of: impl Fn(Response) -> Option<T>,
) -> Result<T> {
    let mut buffer = [0; MAX_PACKET];
    let request = command::encode(0, request, &mut buffer);
    let request = request.map_err(|error| anyhow::anyhow!("{error:?}"))?;
    line.set_read_timeout(Some(Duration::from_millis(500)))?;
    for _ in 0..TRIES {
        line.write_all(request)?;
        if let Some(mut packet) = packet(line)? {
            let answer = command::decode::<Response>(&mut packet).ok();
            // another answer is late, to a request before
            if let Some(state) = answer.and_then(|(_, answer)| of(answer)) {
                return Ok(state);
            }
        }
    }
    bail!("no answer after {TRIES} times")
}

/// One packet of the command link; `None` when nothing comes.
fn packet(line: &mut TcpStream) -> Result<Option<Vec<u8>>> {
    let mut packet = Vec::new();
    let mut byte = [0];
    while packet.last() != Some(&0) {
        match line.read(&mut byte) {
            Ok(0) => bail!("the command link is closed"),
            Ok(_) => packet.push(byte[0]),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                return Ok(None);
            }
            Err(error) => return Err(error.into()),
        }
        ensure!(packet.len() <= MAX_PACKET, "a packet without end");
    }
    Ok(Some(packet))
}

/// Bytes of the sensor in a drive through serial lines that carry 10 to 30 kB/s.
const DRIVE_BYTES: u32 = 32_000;

/// All formats, and seconds of drive that make some blocks of one second each, and not many bytes.
#[must_use]
pub fn drives() -> Vec<(ImuFormat, u32)> {
    let seconds = |format: ImuFormat| {
        let sensor = &format.simulated()[0];
        let frame = (sensor.emit)(&Fields::default(), &mut [0; LONGEST]).unwrap_or(LONGEST);
        DRIVE_BYTES / (sensor.rate * frame as u32)
    };
    let formats = ImuFormat::ALL.into_iter();
    formats
        .map(|format| (format, seconds(format).max(2)))
        .collect()
}
