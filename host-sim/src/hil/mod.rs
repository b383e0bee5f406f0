//! Hardware in the loop: sends a simulated drive into the lines of a board, and compares what the
//! board sends with software in the loop, bit for bit.
//!
//! The first second passes in mode bypass, so that the board detects the format whatever it did
//! before. Then, if there is a command link, the board gets recurrent networks and mode frozen, and
//! in the end what it had before. Without a command link the board must be in mode bypass, as it is
//! after power-on.

mod drive;
mod judge;
mod software;
mod stream;
#[cfg(test)]
mod tests;

pub use drive::{Drive, Input, Record, drive, drive_from};
pub use judge::{Latency, Verdict};

use crate::device::{Link, Port, images, set_up};
use crate::error::Error;
use firmware::control::Mode;
use firmware::wire::ImuFormat;
use firmware::wire::command::{Counters, Request};
use judge::Frames;
use serde::Serialize;
use software::Software;
use std::io;
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use stream::{Lines, Run};

/// Length of the first part of the drive, on which the board detects the format, microseconds.
const LEAD_US: u32 = 1_000_000;
/// How often that part is sent. A board that expects another format gives it up after 4096 bytes.
const LEADS: u32 = 3;

/// What to run where.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Port at the sensor line of the board.
    pub imu: String,
    /// Port at the navigation line of the board.
    pub nav: String,
    /// Port at the receiver line of the board.
    pub gnss: Option<String>,
    /// Port at the command link of the board.
    pub command: Option<String>,
    /// Bit rate of all lines but that of the receiver. Sockets ignore it.
    pub baud: u32,
    /// Bit rate of the receiver line.
    pub gnss_baud: u32,
    /// Format of the sensor.
    pub format: ImuFormat,
    /// Length of the drive, s.
    pub seconds: u32,
    /// Whether to send as fast as the lines accept it instead of in real time.
    pub fast: bool,
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Version of the firmware, with a command link.
    pub firmware: Option<String>,
    /// Whether samples were corrected, which takes a command link.
    pub corrected: bool,
    /// How the stream compares.
    pub verdict: Verdict,
    /// Latency, if anything was received.
    pub latency: Option<Latency>,
    /// How often in this run the board received nothing for too long, because the host was late.
    /// Each time the networks abandon a block.
    pub silences: Option<u32>,
    /// Good fixes that the board received in this run.
    pub fixes: Option<u32>,
    /// Load of the processor of the board in its busiest second since power-on, %.
    pub busiest_percent: Option<f64>,
    /// Whether the user ended the run early.
    pub interrupted: bool,
}

impl Report {
    /// Checks that the stream equals software in the loop.
    ///
    /// # Errors
    /// It differs. The message names `nav`, the port of the stream.
    pub fn check(&self, nav: &str) -> Result<(), Error> {
        let Some(at) = self.verdict.first_difference else {
            return Ok(());
        };
        let (received, expected) = (self.verdict.received, self.verdict.expected);
        let missing = expected.saturating_sub(received);
        let (problem, remedy) = if missing > 0 && self.verdict.different == missing {
            (
                format!("the board fell silent after {received} of {expected} samples"),
                "check power and cables; with --fast a serial line loses bytes",
            )
        } else {
            (
                format!("the stream differs from software in the loop from byte {at} on"),
                "if silences or damage are reported, check the line and use a less busy computer; \
                 otherwise flash this version of the firmware",
            )
        };
        Err(Error::Option {
            option: format!("--nav {nav}"),
            problem,
            remedy: remedy.into(),
        })
    }
}

/// State of the board that is restored after the run.
struct Before {
    mode: Mode,
    images: Vec<u8>,
    counters: Counters,
}

/// How the caller controls a run.
#[derive(Clone, Copy)]
pub struct Control<'a> {
    /// Ends the run early when set. What was received until then is still compared.
    pub stop: &'a AtomicBool,
    /// Called with the number of bytes received and of bytes expected.
    pub progress: &'a (dyn Fn(usize, usize) + Sync),
}

/// Runs a drive through a board.
///
/// # Errors
/// A port does not open or breaks; the board is silent, does not understand the format, or does not
/// answer. Each message names the port.
pub fn run(setup: &Setup, control: Control<'_>) -> Result<Report, Error> {
    let drive = drive(setup.format, setup.seconds)?;
    let mut lines = open(setup)?;
    let mut link = match &setup.command {
        Some(name) => Some(Link::open("--command", name, setup.baud)?),
        None => None,
    };
    let version = link.as_mut().map(Link::version).transpose()?;
    let before = link.as_mut().map(remember).transpose()?;
    let result = send_drive(setup, &drive, &mut lines, link.as_mut(), control);
    // restore the board even after a failure; the first failure is reported
    let after = match (&mut link, &before) {
        (Some(link), Some(before)) => Some(restore(link, before)),
        _ => None,
    };
    let busiest = link.as_mut().map(Link::health).transpose()?;
    let mut report = result?;
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

/// Reads the state of the board and puts it into mode bypass.
fn remember(link: &mut Link) -> Result<Before, Error> {
    let before = Before {
        mode: link.health()?.mode,
        images: link.images()?,
        counters: link.counters()?,
    };
    link.order(&Request::SetMode(Mode::Bypass))?;
    Ok(before)
}

/// Restores the state of the board. Returns its counters at the end of the run.
fn restore(link: &mut Link, before: &Before) -> Result<Counters, Error> {
    let counters = settled(link)?;
    link.order(&Request::SetMode(Mode::Bypass))?;
    link.orders(&set_up(&before.images, before.mode))?;
    Ok(counters)
}

/// The counters once no more fixes arrive: the receiver line is slower than the sensor line and may
/// still carry the last ones.
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

/// Sends the drive through the board and compares.
fn send_drive(
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
        remedy: "check cables and power, and that no other program uses the ports".into(),
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
        let images = images(&software::nets());
        let requests = set_up(&images, Mode::Frozen);
        link.orders(&requests)?;
        requests
            .iter()
            .for_each(|request| software.command(request));
    }
    let (expected, ends) = replies(&mut software, rest);
    let progress = |received| (control.progress)(received, expected.len());
    run.progress = &progress;
    let gathered = run.through(lines, rest, expected.len()).map_err(broken)?;
    let interrupted = run.stopped();
    // an interrupted run is compared as far as it was sent
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

/// Why the first second did not pass.
enum Problem {
    Broken(io::Error),
    Silent,
    Noise(usize),
}

/// Sends the first second until it passes.
fn introduce(
    setup: &Setup,
    lines: &mut Lines,
    lead: &[Record],
    run: &Run<'_>,
) -> Result<(), Problem> {
    let bytes = judge::sensor_bytes(lead);
    let mut received = 0;
    for _ in 0..LEADS {
        let gathered = run
            .through(lines, lead, bytes.len())
            .map_err(Problem::Broken)?;
        received += gathered.bytes.len();
        let frames = Frames::of(setup.format, &gathered.bytes).readings.len();
        if run.stopped() || (frames > 0 && bytes.ends_with(&gathered.bytes)) {
            return Ok(());
        }
    }
    Err(if received == 0 {
        Problem::Silent
    } else {
        Problem::Noise(received)
    })
}

fn silent(setup: &Setup) -> Error {
    Error::Option {
        option: format!("--nav {}", setup.nav),
        problem: format!("nothing arrives although frames go into {}", setup.imu),
        remedy: "check that the board runs, that --imu and --nav are not exchanged, \
                 and the bit rate of both (--baud)"
            .into(),
    }
}

fn noise(setup: &Setup, bytes: usize) -> Error {
    Error::Option {
        option: format!("--nav {}", setup.nav),
        problem: format!(
            "{bytes} bytes arrived that are not the {:?} frames sent into {}",
            setup.format, setup.imu
        ),
        remedy: "check that both ends have the same bit rate (--baud), that the board expects \
                 this --format, and that it is in mode bypass if no --command is given"
            .into(),
    }
}

/// What software in the loop sends for the records of the sensor, and how many bytes it has sent
/// after each.
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
