//! Software in the loop: the firmware library on the desktop over a recording, and the `replay`
//! image over the same.

use std::fs;
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use firmware::app::{Config, Hardware};
use firmware::configuration::Configuration;
use firmware::link::uart::Uart;
use firmware::wire::ImuFormat;
use vectors::Digest;

use crate::drive::{Record, hex, recording, timed_recording};
use crate::machine::{Clock, Machine, run_in};
use crate::protocol::set_up;
use crate::replay::{Cost, Input, Learnt, Pace, Replay, Wires, learning_config};
use firmware::learn::{FixLearner, FixMemory, Settings};

/// Bytes sent to the navigation computer, and their cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Number of samples received.
    pub samples: u32,
    /// Everything sent.
    pub sent: Vec<u8>,
    /// FNV-1a of `sent`.
    pub digest: u64,
    /// Instructions; none on the desktop, where there is no counter.
    pub cost: Option<Instructions>,
    /// What was learnt, if anything was.
    pub learnt: Learnt,
}

/// Instructions, those of the interrupts and a pass for the clock included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instructions {
    /// Mean of all work for a sample.
    pub per_sample: f64,
    /// All work for the most expensive sample: the first one, which starts the correction.
    pub worst_sample: f64,
    /// As `worst_sample`, without the first samples: a sample that ends a block, so both networks
    /// step.
    pub worst_later: f64,
    /// From the interrupt of the last byte of a sample's frame to the first byte sent, the longest.
    pub latency: f64,
    /// The longest single pass.
    pub pass: f64,
    /// Number of samples before it.
    pub pass_at: u32,
    /// At pace [`Pace::Time`]: how long a frame was in the device at most, from its last byte to
    /// the first byte sent, us.
    pub late_us: f64,
    /// Number of samples before it.
    pub late_at: u32,
}

/// What the desktop sends for these frames, set up as a new board is, hexadecimal.
///
/// # Panics
/// A request does not fit into a packet.
#[must_use]
pub fn desktops(frames: &[Record]) -> String {
    let set_up = set_up().expect("requests").into_iter();
    let requests = set_up.map(|bytes| Record {
        input: Input::Command,
        at_us: 0,
        bytes,
    });
    let input: Vec<_> = requests.chain(frames.iter().cloned()).collect();
    hex(&on_desktop(Config::unconfigured(Hardware::DESKTOP), &input).sent)
}

/// Runs the library on the desktop.
#[must_use]
pub fn on_desktop(config: Config, records: &[Record]) -> Outcome {
    let lines = [Uart::new(), Uart::new()];
    over(
        Replay::new(config, Pace::Record, Wires::plain(&lines)),
        records,
    )
}

/// Runs the library on the desktop with learning from fixes.
#[must_use]
pub fn learning_on_desktop(format: ImuFormat, records: &[Record]) -> Outcome {
    learner_on_desktop(learning_config(format), records)
}

/// As [`learning_on_desktop`], with a device that is configured for its sensor.
#[must_use]
pub fn configured_on_desktop(configuration: &Configuration, records: &[Record]) -> Outcome {
    learner_on_desktop(Config::of(configuration), records)
}

fn learner_on_desktop(config: Config, records: &[Record]) -> Outcome {
    let memory = Box::leak(Box::new(FixMemory::ZEROED));
    let learner = Box::leak(Box::new(FixLearner::new(memory, Settings::MEDIUM)));
    let lines = [Uart::new(), Uart::new()];
    let wires = Wires::plain(&lines);
    over(
        Replay::with_learner(config, Pace::Record, wires, Some(learner)),
        records,
    )
}

fn over(mut replay: Replay, records: &[Record]) -> Outcome {
    replay.begin();
    let mut sent = Vec::new();
    for record in records {
        sent.extend_from_slice(replay.record(record.input, record.at_us, &record.bytes));
    }
    Outcome {
        samples: replay.cost().records,
        digest: digest(&sent),
        sent,
        cost: None,
        learnt: replay.learnt(),
    }
}

/// The `replay` image on `machine`; with [`Clock::Instructions`] the cost is known.
///
/// # Errors
/// QEMU fails or takes longer than `limit`; the image fails; its output is not understood or does
/// not match its digest.
pub fn on_target(
    image: &Path,
    machine: Machine,
    format: ImuFormat,
    (pace, clock, learns): (Pace, Clock, bool),
    records: &[Record],
    limit: Duration,
) -> Result<Outcome> {
    let recording = recording(format, pace, learns, records)?;
    run_recording(image, machine, clock, &recording, limit)
}

/// As [`on_target`] at pace [`Pace::Time`], where the device learns and is configured for its
/// sensor: the arguments of [`configured`](crate::replay::configured).
///
/// # Errors
/// As [`on_target`].
pub fn timed_on_target(
    image: &Path,
    machine: Machine,
    sensor: (ImuFormat, u8, u16),
    records: &[Record],
    limit: Duration,
) -> Result<Outcome> {
    let recording = timed_recording(sensor, records)?;
    run_recording(image, machine, Clock::Instructions, &recording, limit)
}

fn run_recording(
    image: &Path,
    machine: Machine,
    clock: Clock,
    recording: &[u8],
    limit: Duration,
) -> Result<Outcome> {
    let directory = tempfile::tempdir()?;
    fs::write(directory.path().join("input"), recording)?;
    let run = run_in(directory.path(), machine, image, clock, limit)?;
    ensure!(
        run.code == Some(0),
        "exit code {:?}\n{}",
        run.code,
        run.output
    );
    let value = |name: &str| -> Result<u64> {
        let line = run.output.lines().find_map(|line| line.strip_prefix(name));
        let text = line.with_context(|| format!("no `{name}` in\n{}", run.output))?;
        Ok(text.trim().parse()?)
    };
    let sent = fs::read(directory.path().join("output"))?;
    let digest = value("digest ")?;
    ensure!(
        self::digest(&sent) == digest && sent.len() as u64 == value("bytes ")?,
        "the file is not what the image says it has written"
    );
    let cost = Cost {
        records: u32::try_from(value("records ")?)?,
        total: value("total ")?,
        worst: u32::try_from(value("worst ")?)?,
        later: u32::try_from(value("later ")?)?,
        latency: u32::try_from(value("latency ")?)?,
        pass: u32::try_from(value("pass ")?)?,
        pass_at: u32::try_from(value("pass_at ")?)?,
        late: u32::try_from(value("late ")?)?,
        late_at: u32::try_from(value("late_at ")?)?,
    };
    let learnt = Learnt {
        weights: value("weights ")?,
        fixes: u32::try_from(value("fixes ")?)?,
        winner: u32::try_from(value("winner ")?)?,
    };
    let tick = machine.instructions_per_tick();
    let instructions = Instructions {
        per_sample: cost.total as f64 * tick / f64::from(cost.records.max(1)),
        worst_sample: f64::from(cost.worst) * tick,
        worst_later: f64::from(cost.later) * tick,
        latency: f64::from(cost.latency) * tick,
        pass: f64::from(cost.pass) * tick,
        pass_at: cost.pass_at,
        late_us: f64::from(cost.late) * 1e-3,
        late_at: cost.late_at,
    };
    Ok(Outcome {
        samples: cost.records,
        sent,
        digest,
        cost: (clock == Clock::Instructions).then_some(instructions),
        learnt,
    })
}

/// FNV-1a.
#[must_use]
pub fn digest(bytes: &[u8]) -> u64 {
    let mut digest = Digest::new();
    bytes.iter().for_each(|&byte| digest.byte(byte));
    digest.value()
}

/// Number of the sensor's bytes that a corrected stream changes; the streams have the same length.
///
/// # Errors
/// The streams have different lengths.
pub fn changed(records: &[Record], sent: &[u8]) -> Result<usize> {
    let came: Vec<u8> = records
        .iter()
        .filter(|record| record.input == Input::Sensor)
        .flat_map(|record| record.bytes.iter().copied())
        .collect();
    ensure!(
        came.len() == sent.len(),
        "{} bytes came, {} were sent",
        came.len(),
        sent.len()
    );
    Ok(came.iter().zip(sent).filter(|(a, b)| a != b).count())
}
