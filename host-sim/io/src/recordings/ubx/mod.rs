//! Logs of u-blox receivers (UBX): NAV-PVT as fixes, and the IMU of dead-reckoning receivers from
//! ESF-RAW, or from ESF-MEAS, whose times are whole milliseconds.
//!
//! The axes of the samples are those of the receiver's sensor. Its time tags have a unit and an
//! origin of their own, which the interface descriptions do not state. They are found from the log:
//! the unit from the growth of the tags between the first and the last fix, and the origin from the
//! fix that came most promptly. Only the least delay of a fix is unknown, which the user may give.

mod clock;
mod log;

#[cfg(test)]
mod tests;

use crate::recordings::DAY_S;
use crate::recordings::input::{Input, Progress};
use crate::recordings::record::{Kind, NOT_MEASURED, TimedFix};
use crate::recordings::rtklib;
use crate::recordings::session::complain;
use crate::recordings::stamped::{Fixes, Location, Reading, Samples, turned};
use clock::{Clock, second_of_week, unwrapped};
use firmware::wire::Scan;
use firmware::wire::ubx::{Pvt, scan};
use host_core::error::Error;
use host_core::inertial::units::DEG;
use log::{Log, Measured};
use nalgebra::Rotation3;
use std::path::Path;

/// One count of a gyro, rad/s.
const GYRO: f64 = DEG / 4096.0;
/// One count of an accelerometer, m/s2.
const ACCEL: f64 = 1.0 / 1024.0;
/// The types of measurement: gyro x, y, z, accelerometer x, y, z.
const KINDS: [u8; 6] = [14, 13, 5, 16, 17, 18];

/// Settings of the reader.
#[derive(Debug, Clone, Default)]
pub struct Choice {
    /// Time from validity of a fix to the sample before it in the log, for the promptest fix, s.
    pub fix_delay_s: f64,
    /// Longest step between samples that is interpolated, s; `None` for the usual one.
    pub max_gap_s: Option<f64>,
    /// Turns axes of the receiver's sensor into forward-right-down.
    pub mounting: Rotation3<f64>,
}

/// Whether a message with a right checksum is among the bytes.
#[must_use]
pub fn is_among(bytes: &[u8]) -> bool {
    let whole = |at| matches!(scan(&bytes[at..]), Scan::Frame(_) | Scan::Other(_));
    (0..bytes.len()).any(whole)
}

/// Reads samples and fixes of a log.
///
/// # Errors
/// There are no samples, or no fixes from which their time is known; times do not rise.
pub fn read(file: &Path, choice: &Choice, progress: Progress<'_>) -> Result<Reading, Error> {
    let (log, mut notes) = open(file, progress)?;
    let (name, measured, which) = match log.raw.is_empty() {
        false => ("ESF-RAW", &log.raw, 0),
        true => ("ESF-MEAS", &log.plain, 1),
    };
    if measured.is_empty() {
        let remedy = "log UBX-ESF-RAW of a dead-reckoning receiver (u-blox M8L, M8U, F9R, F9K); \
                      for the fixes beside another IMU give --fixes FILE to its own command";
        let problem = "is not among the messages, nor ESF-MEAS".to_owned();
        return Err(complain(file, "ESF-RAW", problem, remedy));
    }
    let tags = unwrapped(measured);
    let clock = Clock::of(&log.fixes, &tags, which).ok_or_else(|| {
        let problem = "does not state the time of the samples";
        let remedy = "log NAV-PVT for at least 10 s beside the samples";
        complain(file, "NAV-PVT", problem.to_owned(), remedy)
    })?;
    let location = Location::new(file, name);
    notes.push(location.note(&clock.note(choice.fix_delay_s)));
    let mut samples = Samples::new(location, Kind::Rate);
    for (tag, values) in grouped(measured, &tags) {
        let [gx, gy, gz, ax, ay, az] = values.map(f64::from);
        let gyro = [gx, gy, gz].map(|v| v * GYRO);
        let accel = [ax, ay, az].map(|v| v * ACCEL);
        samples.push(clock.ns(tag), turned(&choice.mounting, gyro, accel), 1.0)?;
    }
    let times = second_of_week(log.fixes.iter().map(|(pvt, _)| pvt));
    let delay = (choice.fix_delay_s * 1e9).round() as i64;
    let mut fixes = Fixes::new(Location::new(file, "NAV-PVT"));
    for (k, ((pvt, _), ms)) in log.fixes.iter().zip(&times).enumerate() {
        if pvt.is_good() {
            fixes.push(k, clock.ns_of_week(*ms) - delay, fix(pvt))?;
        }
    }
    let origin_s = samples.origin_ns().and_then(|origin| {
        let dated = log
            .fixes
            .iter()
            .zip(times)
            .find(|((pvt, _), _)| pvt.is_good());
        let ((pvt, _), ms) = dated?;
        let since = (clock.ns_of_week(ms) - delay - origin) as f64 * 1e-9;
        Some(utc(pvt)? - since)
    });
    let record = samples.record(file, choice.max_gap_s, &fixes.all)?;
    Ok(Reading {
        record,
        notes,
        origin_s,
    })
}

/// Reads a log, with notes for the user.
fn open(file: &Path, progress: Progress<'_>) -> Result<(Log, Vec<String>), Error> {
    let mut input = Input::open(file, progress)?;
    let log = Log::read(&mut input);
    let log = log.map_err(|e| input.fault(file, e))?;
    if log.messages == 0 {
        let problem = format!("has {} bytes and no UBX message", input.at);
        let remedy = "give a log of UBX messages; u-center records them as .ubx";
        return Err(complain(file, "UBX", problem, remedy));
    }
    let mut notes = Vec::new();
    let mut note = |text: String| notes.push(format!("{}: {text}", file.display()));
    if log.damaged > 0 {
        note(format!("{} damaged messages are left out", log.damaged));
    }
    if log.cut {
        note("ends within a message and is read up to it".into());
    }
    Ok((log, notes))
}

/// A fix from NAV-PVT, decoded as by the device.
fn fix(pvt: &Pvt) -> TimedFix {
    let fix = pvt.to_fix(0);
    let sigma = |s: f32| match s {
        s if s.is_finite() => f64::from(s),
        _ => NOT_MEASURED,
    };
    TimedFix {
        time: 0.0, // stored beside the fix, in ns
        lat_deg: f64::from(pvt.latitude) * 1e-7,
        lon_deg: f64::from(pvt.longitude) * 1e-7,
        height_m: fix.position.height,
        velocity: fix.velocity,
        sigmas: fix.sigmas.map(sigma),
    }
}

/// UTC of a fix, s since 1970; `None` where the receiver does not know it.
fn utc(pvt: &Pvt) -> Option<f64> {
    let [month, day, hour, minute, second] = pvt.month_to_second.map(f64::from);
    let days = rtklib::days([f64::from(pvt.year), month, day]).filter(|_| pvt.valid & 7 == 7)?;
    let of_day = (hour * 60.0 + minute) * 60.0 + second + f64::from(pvt.nanosecond) * 1e-9;
    Some(days * DAY_S + of_day)
}

/// The measurements of all six axes at the same tag. A tag without one of them is left out.
fn grouped(measured: &[Measured], tags: &[i64]) -> Vec<(i64, [i32; 6])> {
    let mut out = Vec::new();
    let mut now: (Option<i64>, [Option<i32>; 6]) = (None, [None; 6]);
    let whole = |(tag, values): (Option<i64>, [Option<i32>; 6])| {
        let [Some(a), Some(b), Some(c), Some(d), Some(e), Some(f)] = values else {
            return None;
        };
        Some((tag?, [a, b, c, d, e, f]))
    };
    for (m, tag) in measured.iter().zip(tags) {
        if now.0 != Some(*tag) {
            out.extend(whole(now));
            now = (Some(*tag), [None; 6]);
        }
        if let Some(axis) = KINDS.iter().position(|kind| *kind == m.kind) {
            now.1[axis] = Some(m.value);
        }
    }
    out.extend(whole(now));
    out
}
