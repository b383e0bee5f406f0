//! Hardware in the loop: a simulated drive into a board's lines, and what it sends against software in the loop, bit by bit.
//!
//! A first second goes through in mode bypass, so that the board knows the format, whatever it did before. Then, over the command
//! link if there is one, it gets networks that remember and mode frozen, and in the end what it had before. Without the command
//! link the board is taken to be as it starts, in mode bypass.

mod command;
mod drive;
mod judge;
mod port;
mod software;
mod stream;
#[cfg(test)]
mod tests;

pub use drive::{Drive, Input, Record, drive, drive_from, pvt, sensor};
pub use judge::{Frames, Latency, Verdict};
pub use port::Port;

use crate::error::Error;
use command::Link;
use firmware::control::Mode;
use firmware::wire::ImuFormat;
use firmware::wire::command::{Counters, Request};
use serde::Serialize;
use software::Software;
use std::io;
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use stream::{Lines, Run};

/// The first part of the drive, which tells the board its format, microseconds.
const LEAD_US: u32 = 1_000_000;
/// How often it is sent: a board that looked for another format gives that up only after 4096 bytes.
const LEADS: u32 = 3;

/// What to run where.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Port at the board's sensor line.
    pub imu: String,
    /// Port at its navigation line.
    pub nav: String,
    /// Port at its receiver line.
    pub gnss: Option<String>,
    /// Port at its command link.
    pub command: Option<String>,
    /// Bit rate of all but the receiver's line; means nothing to a socket.
    pub baud: u32,
    /// Bit rate of the receiver's line.
    pub gnss_baud: u32,
    /// What the sensor speaks.
    pub format: ImuFormat,
    /// Length of the drive, s.
    pub seconds: u32,
    /// As fast as the lines take it, not in real time.
    pub fast: bool,
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Version of the firmware, if the command link was used.
    pub firmware: Option<String>,
    /// Whether words were corrected: with the command link.
    pub corrected: bool,
    /// The stream.
    pub verdict: Verdict,
    /// From handing a frame over to the arrival of its last byte.
    pub latency: Option<Latency>,
    /// Times that the board heard nothing for too long in this run: the host was late, and a block of the networks was given up.
    pub silences: Option<u32>,
    /// Good fixes that the board took in this run.
    pub fixes: Option<u32>,
    /// Share of the board's busiest second since power-on in which its processor did not sleep, %.
    pub busiest_percent: Option<f64>,
    /// Whether the run ended before its time.
    pub interrupted: bool,
}

impl Report {
    /// Whether the stream is what it should be.
    ///
    /// # Errors
    /// It is not; `nav` is the port it came from.
    pub fn check(&self, nav: &str) -> Result<(), Error> {
        let Some(at) = self.verdict.first_difference else {
            return Ok(());
        };
        let (came, words) = (self.verdict.came, self.verdict.words);
        let (problem, remedy) = if came < words && self.verdict.different_words == words - came {
            (
                format!("the board fell silent after {came} of {words} words"),
                "check power and cables; a serial line of this computer loses bytes with --fast",
            )
        } else {
            (
                format!("the stream differs from software in the loop from byte {at} on"),
                "if silences or damage are reported, check the line and run on a quieter computer; else flash this version of \
                 the firmware",
            )
        };
        Err(Error::Option {
            option: format!("--nav {nav}"),
            problem,
            remedy: remedy.into(),
        })
    }
}

/// What the board is to go back to.
struct Before {
    mode: Mode,
    images: Vec<u8>,
    counters: Counters,
}

/// What is asked for from outside while it runs.
#[derive(Clone, Copy)]
pub struct Control<'a> {
    /// Set: end early; what came until then is still judged.
    pub stop: &'a AtomicBool,
    /// Told how many bytes have come of how many.
    pub progress: &'a (dyn Fn(usize, usize) + Sync),
}

/// Runs a drive through a board.
///
/// # Errors
/// A port does not open or breaks, the board is silent, does not understand, or does not answer; each with its port.
pub fn run(setup: &Setup, control: Control<'_>) -> Result<Report, Error> {
    let drive = drive(setup.format, setup.seconds)?;
    let mut lines = open(setup)?;
    let mut link = match &setup.command {
        Some(name) => Some(Link::new(Port::open("--command", name, setup.baud)?, name)),
        None => None,
    };
    let version = link.as_mut().map(Link::version).transpose()?;
    let before = link.as_mut().map(remember).transpose()?;
    let found = through(setup, &drive, &mut lines, link.as_mut(), control);
    // restored whatever happened; the first problem is the one told
    let after = match (&mut link, &before) {
        (Some(link), Some(before)) => Some(restore(link, before)),
        _ => None,
    };
    let busiest = link.as_mut().map(Link::health).transpose()?;
    let mut report = found?;
    report.busiest_percent = busiest
        .and_then(|health| health.busiest)
        .map(|permille| f64::from(permille) / 10.0);
    if let (Some(after), Some(before)) = (after.transpose()?, before) {
        let before = before.counters;
        report.silences = Some(after.silences.wrapping_sub(before.silences));
        report.fixes = Some(after.good_fixes.wrapping_sub(before.good_fixes));
    }
    report.firmware = version.map(|version| {
        let [major, minor, patch] = version.firmware;
        format!("{major}.{minor}.{patch}")
    });
    Ok(report)
}

fn open(setup: &Setup) -> Result<Lines, Error> {
    let gnss = setup.gnss.as_ref();
    Ok(Lines {
        imu: Port::open("--imu", &setup.imu, setup.baud)?,
        nav: Port::open("--nav", &setup.nav, setup.baud)?,
        gnss: gnss
            .map(|name| Port::open("--gnss", name, setup.gnss_baud))
            .transpose()?,
    })
}

/// What the board has now; it is in mode bypass afterwards.
fn remember(link: &mut Link) -> Result<Before, Error> {
    let before = Before {
        mode: link.health()?.mode,
        images: link.images()?,
        counters: link.counters()?,
    };
    link.order(&Request::SetMode(Mode::Bypass))?;
    Ok(before)
}

/// Back to what it had; its counters at the end of the run.
fn restore(link: &mut Link, before: &Before) -> Result<Counters, Error> {
    let counters = settled(link)?;
    link.order(&Request::SetMode(Mode::Bypass))?;
    link.orders(&command::set_up(&before.images, before.mode))?;
    Ok(counters)
}

/// The counters once no more fixes arrive: the receiver's line is slower than the sensor's, and the last ones may be on it.
fn settled(link: &mut Link) -> Result<Counters, Error> {
    let mut last = link.counters()?;
    for _ in 0..10 {
        std::thread::sleep(Duration::from_millis(200));
        let now = link.counters()?;
        if now.good_fixes == last.good_fixes {
            return Ok(now);
        }
        last = now;
    }
    Ok(last)
}

fn through(
    setup: &Setup,
    drive: &Drive,
    lines: &mut Lines,
    link: Option<&mut Link>,
    control: Control<'_>,
) -> Result<Report, Error> {
    let split = drive.records.partition_point(|r| r.at_us <= LEAD_US);
    let (lead, rest) = drive.records.split_at(split);
    let broken = |error: io::Error| Error::Option {
        option: format!("--imu {} --nav {}", setup.imu, setup.nav),
        problem: format!("a line broke ({error})"),
        remedy: "check cables and power, and that nobody else uses the ports".into(),
    };
    let mut software = Software::new();
    let mut run = Run {
        fast: setup.fast,
        stop: control.stop,
        progress: &|_| {},
    };
    lines.drain().map_err(broken)?;
    introduce(setup, lines, lead, &run).map_err(|problem| match problem {
        Problem::Broken(error) => broken(error),
        Problem::Silent => silent(setup),
        Problem::Noise(bytes) => noise(setup, bytes),
    })?;
    replies(&mut software, lead);
    let corrected = link.is_some();
    if let Some(link) = link {
        let images = command::images(&software::nets());
        let requests = command::set_up(&images, Mode::Frozen);
        link.orders(&requests)?;
        requests
            .iter()
            .for_each(|request| software.command(request));
    }
    let (expected, ends) = replies(&mut software, rest);
    let progress = |came| (control.progress)(came, expected.len());
    run.progress = &progress;
    let gathered = run.through(lines, rest, expected.len()).map_err(broken)?;
    let interrupted = run.stopped();
    // an interrupted run is judged by what was sent
    let sent = gathered.sent.len();
    let end = if interrupted {
        sent.checked_sub(1).map_or(0, |last| ends[last])
    } else {
        expected.len()
    };
    let lead = judge::sensor_bytes(lead);
    let bytes = judge::sensor_bytes(rest);
    Ok(Report {
        firmware: None,
        corrected,
        verdict: judge::verdict(drive, &lead, &bytes, &gathered.bytes, &expected[..end]),
        latency: judge::latency(&gathered, &ends),
        silences: None,
        fixes: None,
        busiest_percent: None,
        interrupted,
    })
}

/// Why the first second did not come through.
enum Problem {
    Broken(io::Error),
    Silent,
    Noise(usize),
}

/// Sends the first second until it comes through.
fn introduce(
    setup: &Setup,
    lines: &mut Lines,
    lead: &[Record],
    run: &Run<'_>,
) -> Result<(), Problem> {
    let bytes = judge::sensor_bytes(lead);
    let mut came = 0;
    for _ in 0..LEADS {
        let gathered = run
            .through(lines, lead, bytes.len())
            .map_err(Problem::Broken)?;
        came += gathered.bytes.len();
        let frames = Frames::of(setup.format, &gathered.bytes).readings.len();
        if run.stopped() || (frames > 0 && bytes.ends_with(&gathered.bytes)) {
            return Ok(());
        }
    }
    Err(if came == 0 {
        Problem::Silent
    } else {
        Problem::Noise(came)
    })
}

fn silent(setup: &Setup) -> Error {
    Error::Option {
        option: format!("--nav {}", setup.nav),
        problem: format!("nothing comes although frames go into {}", setup.imu),
        remedy: "check that the board runs, that --imu and --nav are not exchanged, and the bit rate of both (--baud)".into(),
    }
}

fn noise(setup: &Setup, bytes: usize) -> Error {
    Error::Option {
        option: format!("--nav {}", setup.nav),
        problem: format!("{bytes} bytes came that are not the {:?} frames sent into {}", setup.format, setup.imu),
        remedy: "check that both ends have the same bit rate (--baud), that the board expects this --format, and that it is in \
                 mode bypass when no --command is given"
            .into(),
    }
}

/// What software in the loop sends for the sensor's records, and where the answer to each ends.
fn replies(software: &mut Software, records: &[Record]) -> (Vec<u8>, Vec<usize>) {
    let mut bytes = Vec::new();
    let mut ends = Vec::new();
    for record in records
        .iter()
        .filter(|record| record.input == Input::Sensor)
    {
        bytes.extend(software.sensor(record.at_us, &record.bytes));
        ends.push(bytes.len());
    }
    (bytes, ends)
}
