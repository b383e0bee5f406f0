//! What the board sent against software in the loop: frame by frame, word by word, and navigated.

use super::drive::{Drive, Input, sensor};
use super::stream::Gathered;
use crate::inertial::sins::{Increment, NavState, Sins};
use firmware::sample::RawSample;
use firmware::wire::framer::Kind;
use firmware::wire::{Framer, ImuFormat, Reading};
use nalgebra::Vector3;
use serde::Serialize;

/// The stream's frames, and what was between them.
#[derive(Debug, Default)]
pub struct Frames {
    /// Good frames with words.
    pub readings: Vec<Reading>,
    /// Bytes of no message, or of a damaged one.
    pub garbage: usize,
    /// Messages with a wrong checksum.
    pub bad_checksums: usize,
}

impl Frames {
    /// Takes a stream apart.
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
                    Kind::Other => {}
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

/// Host clock, from a frame's handing over to the arrival of its last byte: ports, lines and operating system are in it.
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

/// How the stream compares.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// Frames with words that should have come.
    pub words: usize,
    /// ... and that came.
    pub came: usize,
    /// All bytes are those of software in the loop.
    pub equal: bool,
    /// First byte that is not.
    pub first_difference: Option<usize>,
    /// Frames whose words differ, missing ones included.
    pub different_words: usize,
    /// Frames whose counter or time is not the sensor's.
    pub counter_errors: usize,
    /// Messages with a wrong checksum.
    pub bad_checksums: usize,
    /// Bytes of no message.
    pub garbage_bytes: usize,
    /// Horizontal error at the end of a navigation fed with the stream, m.
    pub stream_error_m: f64,
    /// ... and with software in the loop.
    pub software_error_m: f64,
    /// Whether both end in the same state, bit for bit.
    pub navigation_equal: bool,
}

/// Compares; `lead` are the bytes that went before, from the start of the drive, `sent` the sensor's.
#[must_use]
pub fn verdict(drive: &Drive, lead: &[u8], sent: &[u8], came: &[u8], expected: &[u8]) -> Verdict {
    let format = drive.format;
    let [sent, stream, software] = [sent, came, expected].map(|bytes| Frames::of(format, bytes));
    let lead = Frames::of(format, lead);
    let pairs = || stream.readings.iter().zip(&software.readings);
    let missing = software.readings.len().abs_diff(stream.readings.len());
    let counters = stream.readings.iter().zip(&sent.readings);
    let wrong = counters.filter(|(a, b)| (a.counter, a.time) != (b.counter, b.time));
    let difference = came.iter().zip(expected).position(|(a, b)| a != b);
    let shorter = came.len().min(expected.len());
    let [by_stream, by_software] =
        [&stream, &software].map(|frames| navigate(drive, &[&lead.readings, &frames.readings]));
    let off = |nav: &NavState, words: usize| {
        let epoch = (lead.readings.len() + words) / drive.session.words_per_epoch();
        let truth = drive.session.reference.get(epoch);
        truth.map_or(f64::NAN, |truth| {
            nav.position.ned_from(&truth.position).xy().norm()
        })
    };
    Verdict {
        words: software.readings.len(),
        came: stream.readings.len(),
        equal: came == expected,
        first_difference: difference.or((came.len() != expected.len()).then_some(shorter)),
        different_words: pairs().filter(|(a, b)| a.words != b.words).count() + missing,
        counter_errors: wrong.count() + missing,
        bad_checksums: stream.bad_checksums,
        garbage_bytes: stream.garbage,
        stream_error_m: off(&by_stream, stream.readings.len()),
        software_error_m: off(&by_software, software.readings.len()),
        navigation_equal: bits(&by_stream) == bits(&by_software),
    }
}

/// Free inertial from the drive's known start.
fn navigate(drive: &Drive, pieces: &[&[Reading]]) -> NavState {
    let mut sins = Sins::new(drive.session.reference[0]);
    let dt = drive.session.dt;
    for reading in pieces.iter().copied().flatten() {
        sins.step(&increment(drive, &reading.words), dt);
    }
    sins.nav
}

/// A word in SI.
fn increment(drive: &Drive, words: &RawSample) -> Increment {
    let lsb = &drive.session.lsb;
    match words {
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
    let place = [nav.position.lat, nav.position.lon, nav.position.h];
    let all = place.iter().chain(nav.velocity.iter());
    all.chain(nav.q_bn.coords.iter())
        .map(|x| x.to_bits())
        .collect()
}

/// From the times of a run; `ends` are the bytes expected up to each record of the sensor. `None` when nothing came.
#[must_use]
pub fn latency(gathered: &Gathered, ends: &[usize]) -> Option<Latency> {
    let mut came = gathered.came.iter().peekable();
    let mut all: Vec<f64> = Vec::new();
    for (sent, end) in gathered.sent.iter().zip(ends) {
        while came.next_if(|(total, _)| total < end).is_some() {}
        if let Some((_, at)) = came.peek() {
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

/// The bytes of the sensor's records.
#[must_use]
pub fn sensor_bytes(records: &[super::drive::Record]) -> Vec<u8> {
    let sensor = records
        .iter()
        .filter(|record| record.input == Input::Sensor);
    sensor
        .flat_map(|record| record.bytes.iter().copied())
        .collect()
}
