//! Compares what the board sent with software in the loop: bytes, frames, samples, and the result
//! of navigating with them.

use super::drive::{Drive, Input, sensor};
use super::stream::Gathered;
use firmware::sample::RawSample;
use firmware::wire::framer::Kind;
use firmware::wire::{Framer, ImuFormat, Reading};
use host_core::inertial::sins::{Increment, NavState, Sins};
use nalgebra::Vector3;
use serde::Serialize;

/// The frames of a stream, and the bytes between them.
#[derive(Debug, Default)]
pub struct Frames {
    /// Good frames with samples.
    pub readings: Vec<Reading>,
    /// Bytes outside good messages.
    pub garbage: usize,
    /// Messages with a wrong checksum.
    pub bad_checksums: usize,
}

impl Frames {
    /// Finds the frames of a stream.
    #[must_use]
    pub fn of(format: ImuFormat, bytes: &[u8]) -> Self {
        let mut framer = Framer::new(format);
        let mut frames = Self::default();
        for piece in bytes.chunks(64) {
            framer.push(piece);
            while let Some(event) = framer.next_event() {
                match event.kind() {
                    Kind::Frame => {
                        let frame = event.frame();
                        let reading = frame.and_then(|frame| frame.read().ok());
                        frames.readings.extend(reading);
                    }
                    Kind::Other | Kind::Long => {}
                    Kind::BadChecksum => {
                        frames.bad_checksums += 1;
                        frames.garbage += event.bytes().len();
                    }
                    Kind::Garbage | Kind::Unknown => frames.garbage += event.bytes().len(),
                }
            }
        }
        frames.garbage += framer.pending();
        frames
    }
}

/// Time on the host's clock from when a frame is handed to the port until its last byte returns. It
/// includes ports, lines and the operating system.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Latency {
    /// Least, ms.
    pub min_ms: f64,
    /// Median, ms.
    pub median_ms: f64,
    /// 99th percentile, ms.
    pub p99_ms: f64,
    /// Most, ms.
    pub max_ms: f64,
}

/// Comparison of the stream with software in the loop.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// Samples expected.
    #[serde(rename = "words")]
    pub expected: usize,
    /// Samples received.
    #[serde(rename = "came")]
    pub received: usize,
    /// Whether all bytes are those of software in the loop.
    pub equal: bool,
    /// Number of the first byte that differs.
    pub first_difference: Option<usize>,
    /// Samples that differ or are missing.
    #[serde(rename = "different_words")]
    pub different: usize,
    /// Samples whose counter or time is not that of the sensor, and missing ones.
    pub counter_errors: usize,
    /// Messages with a wrong checksum.
    pub bad_checksums: usize,
    /// Bytes outside good messages.
    pub garbage_bytes: usize,
    /// Horizontal error at the end of free inertial navigation with the stream, m.
    pub stream_error_m: f64,
    /// The same error with software in the loop, m.
    pub software_error_m: f64,
    /// Whether both navigations end in the same state, bit for bit.
    pub navigation_equal: bool,
}

/// Compares the bytes `received` with those `expected`. `sent` are the bytes of the sensor in this
/// part of the drive, `lead` those before it.
#[must_use]
pub fn verdict(
    drive: &Drive,
    lead: &[u8],
    sent: &[u8],
    received: &[u8],
    expected: &[u8],
) -> Verdict {
    let format = drive.format;
    let [sent, stream, software] =
        [sent, received, expected].map(|bytes| Frames::of(format, bytes));
    let lead = Frames::of(format, lead);
    let pairs = || stream.readings.iter().zip(&software.readings);
    let missing = software.readings.len().abs_diff(stream.readings.len());
    let counters = stream.readings.iter().zip(&sent.readings);
    let wrong = counters.filter(|(a, b)| (a.counter, a.time) != (b.counter, b.time));
    let difference = received.iter().zip(expected).position(|(a, b)| a != b);
    let shorter = received.len().min(expected.len());
    let [by_stream, by_software] =
        [&stream, &software].map(|frames| navigate(drive, &[&lead.readings, &frames.readings]));
    let error = |nav: &NavState, samples: usize| {
        let epoch = (lead.readings.len() + samples) / drive.session.samples_per_epoch();
        let truth = drive.session.reference.get(epoch);
        truth.map_or(f64::NAN, |truth| {
            nav.position.ned_from(&truth.position).xy().norm()
        })
    };
    Verdict {
        expected: software.readings.len(),
        received: stream.readings.len(),
        equal: received == expected,
        first_difference: difference.or((received.len() != expected.len()).then_some(shorter)),
        different: pairs().filter(|(a, b)| a.sample != b.sample).count() + missing,
        counter_errors: wrong.count() + missing,
        bad_checksums: stream.bad_checksums,
        garbage_bytes: stream.garbage,
        stream_error_m: error(&by_stream, stream.readings.len()),
        software_error_m: error(&by_software, software.readings.len()),
        navigation_equal: bits(&by_stream) == bits(&by_software),
    }
}

/// Free inertial navigation from the true initial state of the drive.
fn navigate(drive: &Drive, pieces: &[&[Reading]]) -> NavState {
    let mut sins = Sins::new(drive.session.reference[0]);
    let dt = drive.session.dt;
    for reading in pieces.iter().copied().flatten() {
        sins.step(&increment(drive, &reading.sample), dt);
    }
    sins.nav
}

/// A sample in SI.
fn increment(drive: &Drive, sample: &RawSample) -> Increment {
    let lsb = &drive.session.lsb;
    match sample {
        RawSample::Counts { gyro, accel } => Increment {
            dtheta: Vector3::from(gyro.map(f64::from)) * lsb.rad,
            dv: Vector3::from(accel.map(f64::from)) * lsb.mps,
        },
        RawSample::Floats { gyro, accel } => {
            let [rad, mps] = sensor(drive.format).unit;
            Increment {
                dtheta: Vector3::from(gyro.map(f64::from)) * rad,
                dv: Vector3::from(accel.map(f64::from)) * mps,
            }
        }
    }
}

fn bits(nav: &NavState) -> Vec<u64> {
    let position = [nav.position.lat, nav.position.lon, nav.position.h];
    let all = position.iter().chain(nav.velocity.iter());
    all.chain(nav.q_bn.coords.iter())
        .map(|x| x.to_bits())
        .collect()
}

/// Latency of a run, if anything was received. `ends` is how many bytes are expected up to and
/// including the answer to each record of the sensor.
#[must_use]
pub fn latency(gathered: &Gathered, ends: &[usize]) -> Option<Latency> {
    let mut received = gathered.received.iter().peekable();
    let mut all: Vec<f64> = Vec::new();
    for (sent, end) in gathered.sent.iter().zip(ends) {
        while received.next_if(|(total, _)| total < end).is_some() {}
        if let Some((_, at)) = received.peek() {
            all.push(at.saturating_duration_since(*sent).as_secs_f64() * 1e3);
        }
    }
    all.sort_by(f64::total_cmp);
    let last = all.len().checked_sub(1)?;
    let at = |share: f64| all[(last as f64 * share).round() as usize];
    Some(Latency {
        min_ms: at(0.0),
        median_ms: at(0.5),
        p99_ms: at(0.99),
        max_ms: at(1.0),
    })
}

/// The bytes of the records of the sensor.
#[must_use]
pub fn sensor_bytes(records: &[super::drive::Record]) -> Vec<u8> {
    let sensor = records
        .iter()
        .filter(|record| record.input == Input::Sensor);
    sensor
        .flat_map(|record| record.bytes.iter().copied())
        .collect()
}
