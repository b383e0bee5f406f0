//! Logs of PX4 (`ULog`): increments of `vehicle_imu` or mean rates of `sensor_combined` as samples,
//! `vehicle_gps_position` or `sensor_gps` as fixes.
//!
//! The axes of the samples are those of the body, forward-right-down. PX4 has turned the axes of
//! the sensor into them and applied its calibration. The default profile of its logger keeps
//! `sensor_combined` whole and of `vehicle_imu` only every hundredth message, so the former is read
//! where increments are missing. The time of a fix is that of its arrival, less a delay: that of
//! the autopilot's parameter `EKF2_GPS_DELAY` unless the user gives another one.

mod format;
mod row;
mod topics;

#[cfg(test)]
mod tests;

use crate::recordings::InitialAttitude;
use crate::recordings::input::{Input, Progress};
use crate::recordings::record::{Kind, Record, TimedFix};
use crate::recordings::session::complain;
use crate::recordings::stamped::{Fixes, Location, Reading, Samples, turned};
use format::{Summary, Walk};
use host_core::error::Error;
use host_core::words::counted;
use nalgebra::{Quaternion, Rotation3, UnitQuaternion};
use std::path::Path;
use topics::{Collected, Piece, SENSOR_COMBINED, Stream, VEHICLE_IMU, known};

/// Share of the time that increments must cover.
const COVERED: f64 = 0.9;
/// Largest time between the attitude of the autopilot and the first fix, s.
const NEAR_S: f64 = 0.5;
/// Delay of the fixes behind the samples in the logs, ms.
const DELAY: &str = "EKF2_GPS_DELAY";

/// Settings of the reader.
#[derive(Debug, Clone, Default)]
pub struct Choice {
    /// Instance of `vehicle_imu`.
    pub instance: Option<u8>,
    /// Time from validity to arrival of a fix, s; `None` for the autopilot's parameter.
    pub fix_delay_s: Option<f64>,
    /// Whether the attitude at the first fix is the autopilot's.
    pub attitude: bool,
    /// Longest step between samples that is interpolated, s; `None` for the usual one.
    pub max_gap_s: Option<f64>,
    /// Turns axes of the log into forward-right-down.
    pub mounting: Rotation3<f64>,
}

/// Reads a log.
///
/// # Errors
/// Any fault of the file, with topic and message; there are no usable samples.
pub fn read(file: &Path, choice: &Choice, progress: Progress<'_>) -> Result<Reading, Error> {
    let mut collected = Collected::default();
    let mut input = Input::open(file, progress)?;
    let mut wanted = |topic: &str, _| known(topic).is_some();
    let mut take = |row: &row::Row<'_>| collected.take(row);
    let summary = Walk::new(&mut wanted, &mut take).file(&mut input);
    let summary = summary.map_err(|(problem, remedy)| {
        let key = format!("ULog, byte {}", input.at);
        complain(file, &key, problem, remedy)
    })?;
    let mut notes = notes(file, &summary, &collected, input.at);
    let (stream, pieces) = choose(file, choice, &mut collected, &summary, &mut notes)?;
    let location = Location::new(file, format!("{} {}", stream.0, stream.1));
    let (fixes, utc) = fixes(file, choice, &mut collected, &summary, &mut notes)?;
    let samples = samples(&location, choice, &pieces)?;
    let origin_s = utc.zip(samples.origin_ns());
    let mut record = samples.record(file, choice.max_gap_s, &fixes)?;
    if choice.attitude {
        let origin = pieces.first().map_or(0, |p| p.end);
        record.initial_attitude = Some(attitude(&record, &collected, origin)?);
    }
    Ok(Reading {
        record,
        notes,
        origin_s: origin_s.map(|(utc, origin)| utc + origin as f64 * 1e-9),
    })
}

/// Notes on the file for the user.
fn notes(file: &Path, summary: &Summary, collected: &Collected, end: u64) -> Vec<String> {
    let mut notes = Vec::new();
    let mut note = |text: String| notes.push(format!("{}: {text}", file.display()));
    if summary.cut {
        note(format!(
            "ends within a message and is read up to byte {end}"
        ));
    }
    if summary.damaged > 0 {
        note(format!(
            "{} left out",
            counted(summary.damaged, "damaged byte")
        ));
    }
    if let (count @ 1.., ms) = summary.dropouts {
        note(format!(
            "the logger dropped out {}, {ms} ms in all",
            counted(count, "time")
        ));
    }
    if collected.invalid > 0 {
        note(format!(
            "{} of {SENSOR_COMBINED} without accelerometers left out",
            counted(collected.invalid, "sample")
        ));
    }
    notes
}

/// Share of the time from first to last that increments cover.
fn share(pieces: &[Piece]) -> f64 {
    let [first, .., last] = pieces else {
        return 0.0;
    };
    let covered: f64 = pieces.iter().skip(1).map(|p| p.length[0]).sum();
    covered / ((last.end - first.end) as f64 * 1e-6)
}

/// Whether increments cover the time.
fn whole(pieces: &[Piece]) -> bool {
    share(pieces) >= COVERED
}

/// How much of a topic is logged, as the rest of a sentence.
fn logged(collected: &Collected, wanted: &str, instance: Option<u8>) -> String {
    let all = collected.pieces.iter();
    let of = all.filter(|((topic, n), _)| *topic == wanted && instance.is_none_or(|i| i == *n));
    match of.map(|(_, pieces)| share(pieces)).max_by(f64::total_cmp) {
        None => "has no samples".to_owned(),
        Some(share) => format!("is logged for {:.1} % of the time", 100.0 * share),
    }
}

/// The increments to use.
///
/// # Errors
/// There are none, or none that cover the time.
fn choose(
    file: &Path,
    choice: &Choice,
    collected: &mut Collected,
    summary: &Summary,
    notes: &mut Vec<String>,
) -> Result<(Stream, Vec<Piece>), Error> {
    let is_asked = |(topic, instance): &Stream| match choice.instance {
        Some(asked) => *topic == VEHICLE_IMU && *instance == asked,
        None => true,
    };
    let all = collected.pieces.iter();
    let streams = |wanted: &str| -> Vec<Stream> {
        let all = all
            .clone()
            .filter(|((topic, _), pieces)| *topic == wanted && whole(pieces));
        all.map(|(stream, _)| *stream).filter(is_asked).collect()
    };
    let (increments, means) = (streams(VEHICLE_IMU), streams(SENSOR_COMBINED));
    if let [_, _, ..] = increments[..] {
        let instances: Vec<String> = increments.iter().map(|(_, n)| n.to_string()).collect();
        notes.push(format!(
            "{}: {VEHICLE_IMU} has the instances {}; --instance chooses another than the first",
            file.display(),
            instances.join(", ")
        ));
    }
    let stream = increments.first().or(means.first()).copied();
    if let Some((stream, pieces)) = stream.and_then(|s| collected.pieces.remove_entry(&s)) {
        return Ok((stream, pieces));
    }
    if let Some(asked) = choice.instance {
        let is_logged = collected.pieces.contains_key(&(VEHICLE_IMU, asked));
        let problem = match is_logged {
            true => format!(
                "{asked} of {VEHICLE_IMU} {}, and {:.0} % are needed",
                logged(collected, VEHICLE_IMU, Some(asked)),
                100.0 * COVERED
            ),
            false => format!("{asked} of {VEHICLE_IMU} is not in the log"),
        };
        let remedy = "leave the option out for sensor_combined, or log vehicle_imu without an \
                      interval (etc/logging/logger_topics.txt on the SD card)";
        return Err(complain(file, "--instance", problem, remedy));
    }
    let names: Vec<&str> = summary.topics.keys().map(String::as_str).collect();
    let problem = format!(
        "{}, and {VEHICLE_IMU} {}; {:.0} % are needed",
        logged(collected, SENSOR_COMBINED, None),
        logged(collected, VEHICLE_IMU, None),
        100.0 * COVERED
    );
    let remedy = format!(
        "log {SENSOR_COMBINED}, as the default SDLOG_PROFILE does; the log has {}",
        names.join(", ")
    );
    Err(complain(file, SENSOR_COMBINED, problem, &remedy))
}

/// The increments as samples.
fn samples(location: &Location, choice: &Choice, pieces: &[Piece]) -> Result<Samples, Error> {
    let mut samples = Samples::new(location.clone(), Kind::Increment);
    for (k, piece) in pieces.iter().enumerate() {
        let [gyro, accel] = piece.length;
        if !(gyro > 0.0 && accel > 0.0) {
            let problem = format!("covers {gyro} and {accel} s");
            return Err(location.complain(k, problem, "cut the log there"));
        }
        let sample = turned(&choice.mounting, piece.dtheta, piece.dv);
        samples.push(piece.end.saturating_mul(1000), sample, gyro.min(accel))?;
    }
    Ok(samples)
}

/// Fixes with their times, ns.
type TimedFixes = Vec<(i64, TimedFix)>;

/// The fixes, and UTC at the start of the autopilot, s since 1970, if the receiver knew it.
fn fixes(
    file: &Path,
    choice: &Choice,
    collected: &mut Collected,
    summary: &Summary,
    notes: &mut Vec<String>,
) -> Result<(TimedFixes, Option<f64>), Error> {
    let Some(((topic, instance), all)) = collected.receiver() else {
        return Ok(Default::default());
    };
    let logged = summary.parameters.get(DELAY).map(|ms| ms * 1e-3);
    let delay_s = choice.fix_delay_s.or(logged).unwrap_or(0.0);
    let mut fixes = Fixes::new(Location::new(file, format!("{topic} {instance}")));
    let sampled = choice.fix_delay_s.is_none() && all.iter().all(|of| of.sampled.is_some());
    if sampled {
        let text = "fixes have their own time of validity (timestamp_sample)";
        notes.push(fixes.note(text));
    } else if choice.fix_delay_s.is_none() {
        notes.push(fixes.note(&match logged {
            Some(s) => format!(
                "fixes count as {s:.3} s old, as {DELAY} says; --fix-delay-s gives another delay"
            ),
            None => "fixes count as valid when they arrived; --fix-delay-s gives a delay".into(),
        }));
    }
    let delay = (delay_s * 1e9).round() as i64;
    let without = collected.without_fix.get(&(topic, instance));
    if let Some(count) = without {
        let text = format!(
            "{} without a fix (fix_type below 3)",
            counted(count, "message")
        );
        notes.push(fixes.note(&text));
    }
    let mut starts = Vec::new();
    for (k, of) in all.iter().enumerate() {
        let arrived = of.arrived.saturating_mul(1000).saturating_sub(delay);
        let valid = of.sampled.filter(|_| sampled);
        let ns = valid.map_or(arrived, |us| us.saturating_mul(1000));
        fixes.push(k, ns, of.fix)?;
        starts.extend(of.utc.map(|us| us as f64 * 1e-6 - ns as f64 * 1e-9));
    }
    notes.extend(fixes.left_out());
    starts.sort_by(f64::total_cmp);
    Ok((fixes.all, starts.get(starts.len() / 2).copied()))
}

/// The autopilot's attitude at the first fix.
fn attitude(record: &Record, collected: &Collected, origin: i64) -> Result<InitialAttitude, Error> {
    let first = record.first_epoch();
    let away = |us: i64| ((us - origin) as f64 * 1e-6 - first).abs();
    let nearest = collected
        .attitudes
        .iter()
        .min_by(|a, b| away(a.0).total_cmp(&away(b.0)));
    let found = nearest.filter(|(us, q)| {
        let norm: f64 = q.iter().map(|x| x * x).sum();
        away(*us) < NEAR_S && (norm - 1.0).abs() < 0.01
    });
    let Some((_, [w, x, y, z])) = found else {
        let problem = "finds no attitude of the autopilot (vehicle_attitude) at the first fix";
        let remedy = "give --attitude or --standstill-s";
        return Err(complain(
            &record.file,
            "--attitude-from-log",
            problem.into(),
            remedy,
        ));
    };
    let q = UnitQuaternion::new_normalize(Quaternion::new(*w, *x, *y, *z));
    Ok(InitialAttitude::Known(q))
}
