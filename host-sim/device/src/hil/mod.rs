//! Hardware in the loop: sends a simulated drive into the lines of a board, and compares what the
//! board sends with software in the loop, bit for bit.
//!
//! With a command link, the board gets the unit's configuration and the first second passes in mode
//! bypass. Then it gets recurrent networks and mode frozen. In the end its previous state is
//! restored. Without a command link the board must be in mode bypass, as it is without a
//! configuration.

pub mod blackbox;
mod board;
mod drive;
mod judge;
mod memory;
pub mod simulated;
mod software;
mod stream;
#[cfg(test)]
mod tests;

pub use drive::{Drive, Input, Record, drive, drive_configured, drive_from, pvt};
pub use judge::{Latency, Verdict};
pub use memory::{MemoryFlash, MemoryLine, SetClock};
pub use software::nets as networks;

use crate::device::{Link, Port, configure, images, set_up};
use board::Before;
use firmware::configuration::{Configuration, Sensor, SerialLines};
use firmware::control::Mode;
use firmware::wire::ImuFormat;
use firmware::wire::command::key::Secret;
use host_core::error::Error;
use host_core::simulator::imu::ImuSpec;
use judge::Frames;
use serde::Serialize;
use software::Software;
use std::io;
use std::sync::atomic::AtomicBool;
use stream::{Lines, Run};

/// Length of the first part of the drive, on which the board detects the format, microseconds.
const LEAD_US: u32 = 1_000_000;
/// Number of times that this part is sent. A board that expects another format gives that format up
/// after 4096 bytes.
const LEADS: u32 = 3;

/// Settings of a run: ports, configuration and drive.
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
    /// The board's key, if it has one.
    pub key: Option<Secret>,
    /// Bit rate of the command link. Sockets ignore it.
    pub baud: u32,
    /// Configuration of the board, with the bit rates of the other lines.
    pub configuration: Configuration,
    /// Format of the sensor, where the configuration leaves it open.
    pub format: ImuFormat,
    /// Errors of the simulated sensor; those of the medium laser-gyro IMU if `None`.
    pub errors: Option<ImuSpec>,
    /// Length of the drive, s.
    pub seconds: u32,
    /// Whether to send as fast as the lines accept it instead of in real time.
    pub fast: bool,
}

/// Result of a run.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Version of the firmware, with a command link.
    pub firmware: Option<String>,
    /// Whether samples were corrected, which takes a command link.
    pub corrected: bool,
    /// Comparison of the stream with software in the loop.
    pub verdict: Verdict,
    /// Latency, if anything was received.
    pub latency: Option<Latency>,
    /// Number of times in this run that the board received nothing for too long, because the host
    /// was late. Each time the networks abandon a block.
    pub silences: Option<u32>,
    /// Good fixes that the board received in this run.
    pub fixes: Option<u32>,
    /// Load of the processor of the board in its busiest second since power-on, %.
    pub busiest_percent: Option<f64>,
    /// Whether the board retains the configuration of the run until it is switched off, because it
    /// had none before that could be restored.
    pub stays_configured: bool,
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
        Err(Error::differs(format!("--nav {nav}"), problem, remedy))
    }
}

/// The longest silence that a configuration may allow, microseconds.
const LONGEST_SILENCE_US: u32 = 10_000_000;

/// Configures a board for a drive that is not sent in real time: it has no rate, and its pauses
/// come from this computer, not from the sensor.
pub fn not_in_real_time(configuration: &mut Configuration) {
    configuration.correction.check_rate = false;
    configuration.correction.silence_us = LONGEST_SILENCE_US;
}

/// The caller's control of a run.
#[derive(Clone, Copy)]
pub struct Control<'a> {
    /// Ends the run early when set. What was received until then is still compared.
    pub stop: &'a AtomicBool,
    /// Called with the number of bytes received and of bytes expected.
    pub progress: &'a (dyn Fn(usize, usize) + Sync),
}

impl Setup {
    /// Format of the sensor's frames.
    fn format(&self) -> ImuFormat {
        match &self.configuration.sensor {
            Some(Sensor::Stream(settings)) => settings.format(),
            Some(Sensor::Spi(_)) | None => self.format,
        }
    }

    /// The board's configuration during the run: it starts in mode bypass, and the axes of the
    /// simulated sensor are the vehicle's.
    fn for_the_run(&self) -> Configuration {
        let mut configuration = self.configuration.clone();
        configuration.correction.mode = Mode::Bypass;
        if self.fast {
            not_in_real_time(&mut configuration);
        }
        configuration.in_body_axes()
    }
}

/// Runs a drive through a board.
///
/// # Errors
/// A port does not open or breaks; the board is silent, refuses the configuration, does not
/// understand the format, or does not answer. Each message names the port.
pub fn run(setup: &Setup, control: Control<'_>) -> Result<Report, Error> {
    let errors = setup.errors.clone().map_or_else(drive::medium, Ok)?;
    let standstill_s = 10;
    let seconds = [setup.seconds, standstill_s];
    let drive = drive_configured(&setup.configuration, setup.format, &errors, seconds)?;
    let mut lines = open(setup)?;
    let Some(name) = &setup.command else {
        return send_drive(setup, &drive, &mut lines, None, control);
    };
    let mut link = Link::open("--command", name, setup.baud)?.with_key(setup.key);
    let version = link.version()?;
    let before = Before::of(&mut link)?;
    let result = run_configured(setup, &drive, &mut lines, &mut link, control);
    // restored even after a failure; the first failure is reported
    let restored = before.restore(&mut link);
    let mut report = result?;
    restored?;
    let [major, minor, patch] = version.firmware;
    report.firmware = Some(format!("{major}.{minor}.{patch}"));
    report.stays_configured = before.was_unconfigured();
    Ok(report)
}

/// Configures the board and runs the drive through it.
fn run_configured(
    setup: &Setup,
    drive: &Drive,
    lines: &mut Lines,
    link: &mut Link,
    control: Control<'_>,
) -> Result<Report, Error> {
    configure(link, &setup.for_the_run())?;
    // a board that had this configuration already does not reset its counters
    let begun = link.counters()?;
    let mut report = send_drive(setup, drive, lines, Some(link), control)?;
    let fixes = drive.records.iter().filter(|r| r.input == Input::Gnss);
    let sent = lines.gnss.as_ref().map_or(0, |_| fixes.count());
    let ended = board::settled(link, &begun, sent)?;
    let busiest = link.health()?.busiest;
    report.silences = Some(ended.silences.wrapping_sub(begun.silences));
    report.fixes = Some(ended.good_fixes.wrapping_sub(begun.good_fixes));
    report.busiest_percent = busiest.map(|permille| f64::from(permille) / 10.0);
    Ok(report)
}

fn open(setup: &Setup) -> Result<Lines, Error> {
    let lines = &setup.configuration.lines;
    let receiver = SerialLines {
        sensor_baud: lines.receiver_baud,
        ..SerialLines::DEFAULT
    };
    let gnss = setup.gnss.as_ref();
    Ok(Lines {
        imu: Port::open_as("--imu", &setup.imu, lines)?,
        nav: Port::open_as("--nav", &setup.nav, lines)?,
        gnss: gnss
            .map(|name| Port::open_as("--gnss", name, &receiver))
            .transpose()?,
    })
}

/// Sends the drive through the board and compares.
fn send_drive(
    setup: &Setup,
    drive: &Drive,
    lines: &mut Lines,
    mut link: Option<&mut Link>,
    control: Control<'_>,
) -> Result<Report, Error> {
    let split = drive.records.partition_point(|r| r.at_us <= LEAD_US);
    let (lead, rest) = drive.records.split_at(split);
    let broken = |error: io::Error| Error::Option {
        option: format!("--imu {} --nav {}", setup.imu, setup.nav),
        problem: format!("a line broke ({error})"),
        remedy: "check cables and power, and that no other program uses the ports".into(),
    };
    let mut software = Software::new(&setup.for_the_run());
    let mut run = Run {
        fast: setup.fast,
        stop: control.stop,
        progress: &|_| {},
    };
    lines.drain().map_err(broken)?;
    introduce(setup, lines, lead, &run, link.as_deref_mut()).map_err(|problem| match problem {
        Problem::Broken(error) => broken(error),
        Problem::Link(error) => error,
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
        stays_configured: false,
        interrupted,
    })
}

/// Why the first second of the drive did not pass through the board.
enum Problem {
    Broken(io::Error),
    Link(Error),
    Silent,
    Noise(usize),
}

/// Sends the first second until it passes. All bytes pass, valid or not, so a board that can be
/// asked must also have counted frames: it may still expect the format of the run before.
fn introduce(
    setup: &Setup,
    lines: &mut Lines,
    lead: &[Record],
    run: &Run<'_>,
    mut link: Option<&mut Link>,
) -> Result<(), Problem> {
    let mut counted = || match &mut link {
        Some(link) => link.counters().map(|counters| Some(counters.frames)),
        None => Ok(None),
    };
    let bytes = judge::sensor_bytes(lead);
    let mut received = 0;
    for _ in 0..LEADS {
        let before = counted().map_err(Problem::Link)?;
        let gathered = run
            .through(lines, lead, bytes.len())
            .map_err(Problem::Broken)?;
        received += gathered.bytes.len();
        let frames = Frames::of(setup.format(), &gathered.bytes).readings.len();
        let known = before.is_none() || counted().map_err(Problem::Link)? != before;
        if run.stopped() || (known && frames > 0 && bytes.ends_with(&gathered.bytes)) {
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
            setup.format(),
            setup.imu
        ),
        remedy: "check that both ends have the same bit rate (--baud), that the board expects \
                 this --format, and that it is in mode bypass if no --command is given"
            .into(),
    }
}

/// Bytes that software in the loop sends for the records of the sensor, and their count after each
/// record.
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
