//! Recorded `NovAtel` binary logs: raw increments and the navigation solution of the receiver.
//!
//! The decoder of the firmware ([`firmware::wire::novatel`]) reads the stream, so a replay tests
//! it, too. Raw increments stay the counts of the sensor. INSPVAS is both reference and fix;
//! without it there is no initial position. IMURATECORRIMUS is read but cannot become a session,
//! because the receiver has already removed gravity, Earth rate and estimated biases from it.

pub mod rewrite;

use crate::recordings::WEEK_S;
use crate::recordings::nowhere::{LeftOut, is_nowhere};
use crate::recordings::record::{Record, TimedFix};
use crate::recordings::session::{InitialAttitude, complain, referenced};
use crate::recordings::track::Track;
use firmware::sample::{Axes as Valid, Counts, Lsb, Unit};
use firmware::wire::framer::{Kind, LONGEST};
use firmware::wire::novatel::inspvas::Inspvas;
use firmware::wire::novatel::{Frame, ImuType};
use firmware::wire::{Framer, ImuFormat};
use host_core::error::Error;
use host_core::inertial::axes::Axes;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::rotation::from_euler;
use host_core::inertial::session::{EPOCH_S, Session, to_si};
use host_core::inertial::sins::NavState;
use host_core::inertial::units::DEG;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Message number of IMURATECORRIMUS, which has a short header.
const CORRECTED: u16 = 1362;
/// Length of its payload: week as u32, second as f64, then six f64.
const CORRECTED_PAYLOAD: usize = 60;
/// Standard deviations of the receiver's solution as fixes (assumed): m, then m/s. The solution is
/// smooth, so what counts is the error of its differences.
const SIGMAS: [f64; 6] = [0.1, 0.1, 0.1, 0.02, 0.02, 0.02];

/// States of the inertial solution that have position, velocity and attitude (OEM7 manual, table
/// "Inertial Solution Status"): high variance, good, free, alignment complete. The others come
/// before an alignment has ended.
const USABLE: [u32; 4] = [2, 3, 6, 7];

/// One raw sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Raw {
    /// Time of the end of the interval, s since the start of GPS time, to 0.2 us.
    pub time: f64,
    /// GPS week of the same time.
    pub week: u16,
    /// Second of that week.
    pub second_of_week: f64,
    /// Type of the IMU, in logs that name it.
    pub kind: Option<ImuType>,
    /// Angle counts, x, y, z of the sensor.
    pub gyro: [i32; 3],
    /// Velocity counts.
    pub accel: [i32; 3],
    /// Whether the log marks all six as good.
    pub good: bool,
}

/// One IMURATECORRIMUS sample: increments without gravity, Earth rate and estimated biases; x
/// right, y forward, z up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corrected {
    /// Time, s since the start of GPS time.
    pub time: f64,
    /// Angle increments x (pitch), y (roll), z (yaw), rad.
    pub dtheta: [f64; 3],
    /// Velocity increments x (lateral), y (longitudinal), z (vertical), m/s.
    pub dv: [f64; 3],
}

/// Content of a file.
#[derive(Debug, Clone, Default)]
pub struct Recording {
    /// Path as given.
    pub file: PathBuf,
    /// Good messages by number.
    pub messages: BTreeMap<u16, usize>,
    /// Messages with a wrong CRC.
    pub damaged: usize,
    /// Bytes outside messages. These include messages of more than 256 bytes, which the framer
    /// passes through unread.
    pub garbage: usize,
    /// Raw samples in the order of the file.
    pub raw: Vec<Raw>,
    /// IMURATECORRIMUS.
    pub corrected: Vec<Corrected>,
    /// INSPVAS.
    pub ins: Vec<Inspvas>,
}

/// Reads a file.
///
/// # Errors
/// [`Error::Missing`], [`Error::Unreadable`], or the file holds no message.
pub fn read(file: &Path) -> Result<Recording, Error> {
    let bytes = crate::recordings::read::read(file)?;
    let mut out = Recording {
        file: file.to_path_buf(),
        ..Recording::default()
    };
    let mut framer = Framer::new(ImuFormat::Novatel);
    for piece in bytes.chunks(LONGEST) {
        framer.push(piece);
        while let Some(event) = framer.next_event() {
            out.receive(event.kind(), event.bytes());
        }
    }
    while let Some(event) = framer.flush() {
        out.receive(event.kind(), event.bytes());
    }
    if out.messages.is_empty() {
        let problem = format!("has {} bytes and no good message", bytes.len());
        return Err(complain(
            file,
            "NovAtel log",
            problem,
            "give a binary log of an OEM receiver",
        ));
    }
    Ok(out)
}

impl Recording {
    fn receive(&mut self, kind: Kind, bytes: &[u8]) {
        match kind {
            Kind::Frame | Kind::Other => self.message(bytes),
            Kind::BadChecksum => {
                self.damaged += 1;
                self.garbage += bytes.len();
            }
            Kind::Long => {}
            Kind::Garbage | Kind::Unknown => self.garbage += bytes.len(),
        }
    }

    fn message(&mut self, bytes: &[u8]) {
        // a good message has a whole header
        let id = bytes
            .get(4..6)
            .map_or(0, |b| u16::from_le_bytes([b[0], b[1]]));
        *self.messages.entry(id).or_default() += 1;
        if let Ok(frame) = Frame::new_checked(bytes) {
            let week = match frame.log().header_len() {
                12 => bytes.get(6..8),
                _ => bytes.get(14..16),
            };
            let week = week.map_or(0, |b| u16::from_le_bytes([b[0], b[1]]));
            self.raw.push(Raw {
                time: f64::from(week) * WEEK_S + frame.second_of_week(),
                week,
                second_of_week: frame.second_of_week(),
                kind: frame.info().map(|(_, kind)| kind),
                gyro: frame.gyro(),
                accel: frame.accel(),
                good: frame.reading().valid == Valid::ALL,
            });
        } else if let Ok(ins) = Inspvas::parse(bytes) {
            self.ins.push(ins);
        } else if id == CORRECTED && bytes.len() == 12 + CORRECTED_PAYLOAD + 4 {
            self.corrected.extend(corrected(&bytes[12..]));
        }
    }

    /// INSPVAS without duplicates and without those that hold no solution, each with its time in s
    /// since the start of GPS week `week`; and what was left out.
    fn solutions(&self, week: u32) -> (Vec<(f64, &Inspvas)>, LeftOut) {
        let mut solutions: Vec<(f64, &Inspvas)> = Vec::new();
        let mut left_out = LeftOut::default();
        for ins in &self.ins {
            let time = (f64::from(ins.week) - f64::from(week)) * WEEK_S + ins.second_of_week;
            let [lat, lon, _] = ins.position;
            if !USABLE.contains(&ins.status) {
                left_out.count("the inertial solution is not aligned yet", time);
            } else if is_nowhere(lat, lon) {
                left_out.count("latitude and longitude are 0 or nan", time);
            } else if solutions.last().is_none_or(|(last, _)| time > *last) {
                solutions.push((time, ins));
            }
        }
        (solutions, left_out)
    }

    fn complain(&self, key: &str, problem: &str, remedy: &str) -> Error {
        complain(&self.file, key, problem.to_owned(), remedy)
    }
}

fn corrected(payload: &[u8]) -> Option<Corrected> {
    let number = |at: usize| {
        Some(f64::from_le_bytes(
            payload.get(at..at + 8)?.try_into().ok()?,
        ))
    };
    let three = |at: usize| Some([number(at)?, number(at + 8)?, number(at + 16)?]);
    let week = u32::from_le_bytes(payload.get(..4)?.try_into().ok()?);
    Some(Corrected {
        time: f64::from(week) * WEEK_S + number(4)?,
        dtheta: three(12)?,
        dv: three(36)?,
    })
}

fn state(ins: &Inspvas) -> NavState {
    let [lat, lon, h] = ins.position;
    let [north, east, up] = ins.velocity;
    let [roll, pitch, azimuth] = ins.attitude.map(|a| a * DEG);
    NavState {
        position: Geodetic {
            lat: lat * DEG,
            lon: lon * DEG,
            h,
        },
        velocity: Vector3::new(north, east, -up),
        q_bn: from_euler(roll, pitch, azimuth),
    }
}

/// A session from the first raw sample after the first INSPVAS on. `mounting` turns the axes of the
/// sensor into forward-right-down of the body whose attitude INSPVAS gives. It is
/// [`Axes::RIGHT_FORWARD_UP`] for an enclosure in `NovAtel`'s vehicle axes. `kind` is needed for
/// RAWIMU and RAWIMUS, which do not name their IMU.
///
/// # Errors
/// There are no raw samples, the scale of the IMU is not known, samples are missing or marked bad,
/// or there is no INSPVAS at their time.
pub fn session(
    recording: &Recording,
    mounting: Axes,
    kind: Option<ImuType>,
) -> Result<Session, Error> {
    let (lsb, rate) = imu(recording, kind)?;
    let complain =
        |problem: &str, remedy: &str| Err(recording.complain("INSPVAS", problem, remedy));
    let dt = EPOCH_S / f64::from(rate);
    check_raw(recording, dt)?;
    let (solutions, _) = recording.solutions(0);
    let (Some((t0, _)), Some((t1, _))) = (solutions.first(), solutions.last()) else {
        let remedy = "log INSPVASB beside the raw increments";
        return complain("is not among the messages", remedy);
    };
    let first = recording.raw.partition_point(|r| r.time < *t0);
    let Some(at) = recording.raw.get(first).map(|r| r.time) else {
        let problem = "begins after the last raw sample";
        return complain(problem, "give logs of the same time");
    };
    let samples = &recording.raw[first + 1..]; // the sample before them ends at the first epoch
    let epochs = (samples.len() / usize::from(rate)).min((t1 - at + 1e-6).max(0.0) as usize);
    if epochs == 0 {
        let count = samples.len();
        let problem = format!("covers less than one second together with {count} raw samples");
        return complain(&problem, "give a longer recording");
    }
    let time = solutions.iter().map(|(t, _)| *t).collect();
    let track = Track::new(time, solutions.iter().map(|(_, ins)| state(ins)).collect());
    let reference: Vec<NavState> = (0..=epochs)
        .map(|k| track.at(at + k as f64 * EPOCH_S))
        .collect();
    let samples = samples[..epochs * usize::from(rate)].iter();
    let counts = samples.map(|raw| counts(raw, mounting)).collect();
    Ok(referenced(dt, (counts, lsb), reference, SIGMAS))
}

/// A record of the raw samples and of INSPVAS as fixes. Times are seconds of the week of the first
/// sample. Samples that the IMU marks bad are left out, so that they are a gap like missing ones.
/// The arguments are those of [`session`].
///
/// # Errors
/// As [`session`], except that samples may be missing or bad and that there may be no INSPVAS; the
/// times of the samples do not rise.
pub fn record(
    recording: &Recording,
    mounting: Axes,
    kind: Option<ImuType>,
) -> Result<Record, Error> {
    let (lsb, rate) = imu(recording, kind)?;
    let raw = good(recording)?;
    let week = raw[0].week;
    let time = |r: &Raw| (f64::from(r.week) - f64::from(week)) * WEEK_S + r.second_of_week;
    let fix = |(time, ins): &(f64, &Inspvas)| {
        let [north, east, up] = ins.velocity;
        TimedFix {
            time: *time,
            lat_deg: ins.position[0],
            lon_deg: ins.position[1],
            height_m: ins.position[2],
            velocity: [north, east, -up],
            sigmas: SIGMAS,
        }
    };
    let samples = raw.iter().map(|r| counts(r, mounting));
    let (solutions, left_out) = recording.solutions(week.into());
    let mut record = Record {
        file: recording.file.clone(),
        time: raw.iter().map(|r| time(r)).collect(),
        samples: samples.map(|counts| to_si(&counts, &lsb)).collect(),
        kind: crate::recordings::record::Kind::Increment,
        rate_hz: usize::from(rate),
        fixes: solutions.iter().map(fix).collect(),
        lever_arm_m: Some([0.0; 3]), // INSPVAS is of the IMU
        notes: left_out.notes(&format!("{}: INSPVAS", recording.file.display())),
        ..Record::default()
    };
    if !solutions.is_empty() {
        let times = solutions.iter().map(|(time, _)| *time).collect();
        let track = Track::new(times, solutions.iter().map(|(_, ins)| state(ins)).collect());
        let attitude = track.at(record.first_epoch()).q_bn;
        record.initial_attitude = Some(InitialAttitude::Known(attitude));
    }
    Ok(record)
}

/// Counts of a sample in forward-right-down.
fn counts(raw: &Raw, mounting: Axes) -> Counts {
    Counts {
        dtheta: mounting.turn_counts(raw.gyro),
        dv: mounting.turn_counts(raw.accel),
    }
}

/// Count values and rate of the IMU of the raw samples.
fn imu(recording: &Recording, kind: Option<ImuType>) -> Result<(Lsb, u16), Error> {
    let complain = |key, problem: &str, remedy| Err(recording.complain(key, problem, remedy));
    let Some(first) = recording.raw.first() else {
        let remedy = "log RAWIMUSXB; IMURATECORRIMUS is no substitute, it lacks gravity and biases";
        return complain(
            "RAWIMUSX",
            "is not among the messages, nor another raw log",
            remedy,
        );
    };
    let Some(kind) = first.kind.or(kind) else {
        return complain(
            "IMU type",
            "is not in RAWIMU and RAWIMUS",
            "name it, or log RAWIMUSXB",
        );
    };
    let (Some(units), Some(rate)) = (kind.units(), kind.rate()) else {
        let problem = format!("is {}, whose scale or rate is not known here", kind.0);
        let remedy = "convert the recording to CSV and use the generic replay";
        return complain("IMU type", &problem, remedy);
    };
    let value = |unit: Unit| unit.increment(1.0 / f64::from(rate));
    let (Some(rad), Some(mps)) = (value(units.gyro), value(units.accel)) else {
        let problem = format!("is {}, whose values are integrated", kind.0);
        let remedy = "convert the recording to CSV and use the generic replay";
        return complain("IMU type", &problem, remedy);
    };
    Ok((Lsb { rad, mps }, rate))
}

/// The log of a [`record`], to be written again. The arguments are those of [`session`].
///
/// # Errors
/// As [`record`].
pub fn log(
    recording: &Recording,
    mounting: Axes,
    kind: Option<ImuType>,
) -> Result<rewrite::Log, Error> {
    let (lsb, _) = imu(recording, kind)?;
    Ok(rewrite::Log {
        file: recording.file.clone(),
        mounting,
        lsb,
    })
}

/// The samples that the IMU does not mark bad, at rising times; at least one.
fn good(recording: &Recording) -> Result<Vec<&Raw>, Error> {
    let complain = |problem: &str, remedy| Err(recording.complain("raw sample", problem, remedy));
    let good: Vec<&Raw> = recording.raw.iter().filter(|r| r.good).collect();
    if good.is_empty() {
        let problem = format!("1 to {} are all marked bad by the IMU", recording.raw.len());
        return complain(&problem, "give a recording of an IMU that works");
    }
    let back = good.windows(2).find(|pair| pair[1].time <= pair[0].time);
    match back {
        Some([a, b]) => {
            let [before, now] = [a, b].map(|r| r.time % WEEK_S);
            let problem = format!("at {now:.3} s follows that at {before:.3} s");
            let remedy = "log the raw increments once, not in two logs, and do not join recordings";
            complain(&problem, remedy)
        }
        _ => Ok(good),
    }
}

/// Checks that all samples are good and `dt` apart.
fn check_raw(recording: &Recording, dt: f64) -> Result<(), Error> {
    for (k, r) in recording.raw.iter().enumerate() {
        if !r.good {
            let problem = format!("{k} at {:.3} s is marked bad by the IMU", r.time % WEEK_S);
            return Err(recording.complain("raw sample", &problem, "cut the recording there"));
        }
        let step = if k > 0 {
            r.time - recording.raw[k - 1].time
        } else {
            dt
        };
        if !(0.5..1.5).contains(&(step / dt)) {
            let problem = format!(
                "{k} at {:.3} s comes {step:.4} s after the one before, not {dt}",
                r.time % WEEK_S
            );
            return Err(recording.complain("raw sample", &problem, "cut the recording there"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
