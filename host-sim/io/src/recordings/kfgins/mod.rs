//! The text files of KF-GINS (i2Nav, Wuhan University). Blanks or commas separate the columns, and
//! there is no line of names.
//!
//! ```text
//! IMU    second of week | dtheta x, y, z, rad | dv x, y, z, m/s | further columns are not read
//! GNSS   second of week | latitude, longitude, deg | height, m
//!        7 columns:  | standard deviations of position north, east, down, m
//!        13 columns: | velocity north, east, down, m/s | standard deviations of both
//! truth  week | second of week | latitude, longitude, deg | height, m
//!        | velocity north, east, down, m/s | roll, pitch, yaw, deg
//! ```
//!
//! Body axes are forward-right-down, the time of a sample is the end of its interval, and heights
//! are above the ellipsoid. KF-GINS documents the 7 columns. Its reader also accepts 13 and uses
//! those of them that the 7 contain. Positions are those of the antenna. KF-GINS keeps the lever
//! arm of the antenna in its own configuration, which is not read here, so the user must correct
//! for a long one beforehand. Written numbers are the shortest that read back to the same bits.
//! Seconds of week do not exceed 604 800 in KF-GINS, so a recording across the end of a week is
//! neither read nor written.

use crate::output::write_atomic;
use crate::recordings::WEEK_S;
use crate::recordings::columns::{IMU, POSITION, SIGMA, SIGMA_V, VELOCITY};
use crate::recordings::corrected::{SampleColumns, Text, shortest};
use crate::recordings::record::{Kind, NOT_MEASURED, Record, TimedFix, median_step};
use crate::recordings::session::InitialAttitude;
use crate::recordings::table::{Separator, Source, Table};
use crate::recordings::track::Track;
use host_core::error::Error;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::rotation::from_euler;
use host_core::inertial::sins::{Increment, NavState};
use host_core::inertial::units::DEG;
use host_core::list::List;
use nalgebra::{Rotation3, Vector3};
use std::fmt::Write;
use std::path::Path;

/// Reads the pair of files.
///
/// # Errors
/// Any fault of the files, with line and column.
pub fn read(
    imu: &Path,
    gnss: &Path,
    initial_attitude: Option<InitialAttitude>,
) -> Result<Record, Error> {
    let table = table(imu, &[&IMU], true)?;
    table.check_rising(0)?;
    table.check_within(1..4, 2.0, "give angle increments in rad")?;
    table.check_within(4..7, 20.0, "give velocity increments in m/s")?;
    let time: List<f64> = table.rows().map(|r| r[0]).collect();
    let step = median_step(&time);
    let rate_hz = (1.0 / step).round();
    if !(4.0..=8000.0).contains(&rate_hz) {
        return Err(table.complain(
            table.count() - 1,
            0,
            "not one of 4 to 8000 samples per second",
            "give times in s",
        ));
    }
    Ok(Record {
        file: imu.to_path_buf(),
        samples: table.rows().map(increment).collect(),
        time,
        kind: Kind::Increment,
        rate_hz: rate_hz as usize,
        fixes: fixes(gnss)?,
        initial_attitude,
        ..Record::default()
    })
}

/// Reads a file of true states.
///
/// # Errors
/// Any fault of the file, with line and column.
pub fn read_truth(file: &Path) -> Result<Track, Error> {
    let angles = ["roll_deg", "pitch_deg", "yaw_deg"];
    let names = [&["week"], &POSITION[..], &VELOCITY, &angles].concat();
    let table = table(file, &[&names], false)?;
    table.check_rising(1)?;
    table.check_within(2..3, 89.9, "give a latitude in degrees, not at a pole")?;
    table.check_within(3..4, 360.0, "give a longitude in degrees")?;
    table.check_within(4..5, 20_000.0, "give a height in m")?;
    table.check_within(8..11, 360.0, "give angles in degrees")?;
    let state = |r: &[f64]| NavState {
        position: Geodetic {
            lat: r[2] * DEG,
            lon: r[3] * DEG,
            h: r[4],
        },
        velocity: Vector3::new(r[5], r[6], r[7]),
        q_bn: from_euler(r[8] * DEG, r[9] * DEG, r[10] * DEG),
    };
    let time = table.rows().map(|r| r[1]).collect();
    Ok(Track::new(time, table.rows().map(state).collect()))
}

/// Format of a written record.
#[derive(Debug, Clone, Copy, Default)]
pub struct Form {
    /// Added to all times to make them seconds of the week, s.
    pub shift_s: f64,
    /// Whether to write 13 columns with velocities instead of 7.
    pub velocity: bool,
}

/// Writes a record as the pair of files. Each appears whole or not at all.
///
/// # Errors
/// Times are not seconds of the week; the record lacks velocities that were asked for;
/// [`Error::Unwritable`].
pub fn write(record: &Record, form: Form, imu: &Path, gnss: &Path) -> Result<(), Error> {
    let refused = |option: &str, problem: String, remedy: &str| Error::Option {
        option: option.into(),
        problem,
        remedy: remedy.into(),
    };
    if form.velocity && !record.has_velocity() {
        let problem = "the recording has no velocities".into();
        return Err(refused("--velocity", problem, "leave it out"));
    }
    let (time, increments): (Vec<_>, Vec<_>) = record.written_increments().unzip();
    record.check()?;
    let second = |t: f64| t + form.shift_s;
    let all = time.iter().chain(record.fixes.iter().map(|f| &f.time));
    check_seconds(all, form.shift_s, "--shift")?;
    let text = samples(&time, &increments, form.shift_s);
    let mut fixes = String::new();
    for f in record.fixes.iter().filter(|f| f.has(0..3)) {
        let mut row = vec![f.lat_deg, f.lon_deg, f.height_m];
        let sigmas = if form.velocity { 6 } else { 3 };
        row.extend(
            Some(f.velocity)
                .filter(|_| form.velocity)
                .into_iter()
                .flatten(),
        );
        row.extend(&f.sigmas[..sigmas]);
        line(&mut fixes, second(f.time), &row);
    }
    write_atomic(imu, text.as_bytes())?;
    write_atomic(gnss, fixes.as_bytes())
}

/// The samples of a record as the text of the file of the IMU. `shift_s` is added to all times;
/// `option` is the user's option for it.
///
/// # Errors
/// Times are not seconds of the week.
pub fn imu_text(record: &Record, shift_s: f64, option: &str) -> Result<String, Error> {
    let (time, increments): (Vec<_>, Vec<_>) = record.written_increments().unzip();
    record.check()?;
    check_seconds(time.iter(), shift_s, option)?;
    Ok(samples(&time, &increments, shift_s))
}

/// Checks that all times are seconds of the week.
fn check_seconds<'t>(
    mut times: impl Iterator<Item = &'t f64>,
    shift_s: f64,
    option: &str,
) -> Result<(), Error> {
    match times.find(|t| !(0.0..=WEEK_S).contains(&(*t + shift_s))) {
        None => Ok(()),
        Some(t) => Err(Error::Option {
            option: option.into(),
            problem: format!("{} s is not a second of the week", t + shift_s),
            remedy: "give the seconds that make the times of the recording seconds of the week"
                .into(),
        }),
    }
}

/// Position of the samples in a file.
#[must_use]
pub fn original(imu: &Path) -> Text {
    let columns = SampleColumns {
        columns: [[1, 2, 3], [4, 5, 6]],
        units: [1.0; 2],
        turn: Rotation3::identity(),
    };
    Text::new(imu.to_path_buf(), Separator::BlankOrComma, 0, columns)
}

/// The lines of samples.
fn samples(time: &[f64], increments: &[Increment], shift_s: f64) -> String {
    let mut text = String::new();
    for (t, i) in time.iter().zip(increments) {
        let row = [i.dtheta.x, i.dtheta.y, i.dtheta.z, i.dv.x, i.dv.y, i.dv.z];
        line(&mut text, t + shift_s, &row);
    }
    text
}

/// Adds a line with a time and numbers, in the fewest digits that read back to the same bits. Small
/// numbers have an exponent.
fn line(text: &mut String, time: f64, row: &[f64]) {
    // writing to a string does not fail
    let _ = write!(text, "{time}");
    for x in row {
        text.push(' ');
        text.push_str(&shortest(*x));
    }
    text.push('\n');
}

/// Reads a file whose columns are one of the lists `known`, with any further columns if `more`.
fn table(file: &Path, known: &[&[&str]], more: bool) -> Result<Table, Error> {
    let source = Source::open(file, Separator::BlankOrComma)?;
    let found = source.first_line().len();
    let names = known.iter().find(|names| names.len() == found);
    let names = names.unwrap_or(&known[0]);
    let mut all: Vec<String> = names.iter().map(ToString::to_string).collect();
    if more {
        all.extend((all.len()..found).map(|k| (k + 1).to_string()));
    }
    Table::first_columns(&source, 0, &all, names.len())
}

fn increment(row: &[f64]) -> Increment {
    Increment {
        dtheta: Vector3::new(row[1], row[2], row[3]),
        dv: Vector3::new(row[4], row[5], row[6]),
    }
}

fn fixes(file: &Path) -> Result<Vec<TimedFix>, Error> {
    let plain = [&POSITION[..], &SIGMA].concat();
    let full = [&POSITION[..], &VELOCITY, &SIGMA, &SIGMA_V].concat();
    let table = table(file, &[&plain, &full], false)?;
    table.check_rising(0)?;
    table.check_within(1..2, 89.9, "give a latitude in degrees, not at a pole")?;
    table.check_within(2..3, 360.0, "give a longitude in degrees")?;
    table.check_within(3..4, 20_000.0, "give a height in m")?;
    let mut out: Vec<TimedFix> = Vec::with_capacity(table.count());
    for (k, r) in table.rows().enumerate() {
        let with_velocity = r.len() == full.len();
        let first = if with_velocity { 7 } else { 4 };
        if let Some(c) = (first..r.len()).find(|&c| r[c] <= 0.0) {
            let remedy = "give a number above 0";
            return Err(table.complain(k, c, "not a standard deviation", remedy));
        }
        let mut sigmas = [NOT_MEASURED; 6];
        sigmas[..r.len() - first].copy_from_slice(&r[first..]);
        out.push(TimedFix {
            time: r[0],
            lat_deg: r[1],
            lon_deg: r[2],
            height_m: r[3],
            velocity: if with_velocity {
                [r[4], r[5], r[6]]
            } else {
                [0.0; 3]
            },
            sigmas,
        });
    }
    Ok(out)
}

#[cfg(test)]
mod tests;
