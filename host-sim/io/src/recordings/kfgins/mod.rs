//! The text files of KF-GINS (i2Nav, Wuhan University). Blanks or commas separate the columns, and
//! there is no line of names.
//!
//! ```text
//! IMU    second of week | dtheta x, y, z, rad | dv x, y, z, m/s | further columns are not read
//! GNSS   second of week | latitude, longitude, deg | height, m
//!        7 columns:  | standard deviations of position north, east, down, m
//!        13 columns: | velocity north, east, down, m/s | standard deviations of both,
//!                    or the standard deviations of position before the velocity
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
//! read and not written.

mod fixes;

pub use fixes::Order;

use crate::output::write_atomic;
use crate::recordings::WEEK_S;
use crate::recordings::columns::{IMU, POSITION, VELOCITY};
use crate::recordings::corrected::{SampleColumns, Text, shortest};
use crate::recordings::pace::Pace;
use crate::recordings::record::{Kind, Record};
use crate::recordings::session::InitialAttitude;
use crate::recordings::table::{Layout, Separator, Source, Table};
use crate::recordings::track::Track;
use crate::recordings::week::{self, Unwrapped};
use host_core::error::Error;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::rotation::from_euler;
use host_core::inertial::sins::{Increment, NavState};
use host_core::inertial::units::DEG;
use host_core::list::List;
use host_core::words::{agrees, counted};
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
    read_in_order(imu, gnss, initial_attitude, None)
}

/// [`read()`], with the order of 13 columns of fixes instead of the one that the numbers fit.
///
/// # Errors
/// As [`read()`].
pub fn read_in_order(
    imu: &Path,
    gnss: &Path,
    initial_attitude: Option<InitialAttitude>,
    order: Option<Order>,
) -> Result<Record, Error> {
    let mut record = samples(imu)?;
    record.fixes = fixes::fixes(gnss, order, &mut record.notes)?;
    record.initial_attitude = initial_attitude;
    week::join(&mut record);
    Ok(record)
}

/// Reads the samples alone.
///
/// # Errors
/// Any fault of the file, with line and column.
pub fn samples(imu: &Path) -> Result<Record, Error> {
    let mut table = table(imu, &[&IMU], true, true)?;
    let mut notes = std::mem::take(&mut table.notes);
    table.check_within(1..4, 2.0, "give angle increments in rad")?;
    table.check_within(4..7, 20.0, "give velocity increments in m/s")?;
    let (mut week, mut time) = (Unwrapped::default(), Vec::with_capacity(table.count()));
    let (mut whole, mut raw) = (Vec::with_capacity(table.count()), f64::NEG_INFINITY);
    for (k, r) in table.rows().enumerate() {
        if r.iter().any(|x| x.is_nan()) {
            continue;
        }
        let now = week.on(r[0]);
        if time.last().is_some_and(|before| now <= *before) {
            return Err(table.time_back(k, "t_s", [raw, r[0]]));
        }
        raw = r[0];
        time.push(now);
        whole.push(increment(r));
    }
    notes.extend(week.note("samples"));
    let without = table.count() - whole.len();
    if without > 0 {
        notes.push(format!(
            "{} of {} {} no whole sample (nan) and {} as missing.",
            counted(without, "line"),
            imu.display(),
            agrees(without, "holds", "hold"),
            agrees(without, "counts", "count")
        ));
    }
    if time.len() < 2 {
        let found = "has fewer than two whole samples";
        return Err(Error::Empty {
            file: imu.to_path_buf(),
            found,
            expected: format!("lines of {}, without a header", IMU.join(",")),
        });
    }
    let time: List<f64> = time.into();
    let step = Pace::of(&time).step;
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
        samples: whole.into(),
        time,
        kind: Kind::Increment,
        rate_hz: rate_hz as usize,
        notes,
        ..Record::default()
    })
}

/// Whether a file looks like one of samples: at least seven numbers on its first line.
#[must_use]
pub fn is_imu(file: &Path) -> bool {
    Source::open(file, Separator::BlankOrComma).is_ok_and(|source| {
        // a line of names before the numbers may say that they are others
        let first = source.head().iter().find(|line| !is_comment(line));
        let number = |x: &String| x.parse::<f64>().is_ok();
        first.is_some_and(|line| line.len() >= IMU.len() && line.iter().take(IMU.len()).all(number))
    })
}

/// Reads a file of true states.
///
/// # Errors
/// Any fault of the file, with line and column.
pub fn read_truth(file: &Path) -> Result<Track, Error> {
    let angles = ["roll_deg", "pitch_deg", "yaw_deg"];
    let names = [&["week"], &POSITION[..], &VELOCITY, &angles].concat();
    let table = table(file, &[&names], false, false)?;
    let first = table.row(0)[0];
    let time: Vec<f64> = table
        .rows()
        .map(|r| (r[0] - first) * WEEK_S + r[1])
        .collect();
    if let Some(k) = time.windows(2).position(|pair| pair[1] <= pair[0]) {
        return Err(table.time_back(k + 1, "second of the week", [time[k], time[k + 1]]));
    }
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
    Ok(Track::new(time, table.rows().map(state).collect()))
}

/// Format of a written record.
#[derive(Debug, Clone, Copy, Default)]
pub struct Form {
    /// Added to all times to make them seconds of the week, s.
    pub shift_s: f64,
    /// Whether to write 13 columns, with velocities before the standard deviations, instead of 7.
    pub velocity: bool,
}

/// Writes a record as the pair of files, each of which appears whole or not at all. Returns the
/// number of fixes written: the text has no empty cells, so that a fix without height, or without a
/// velocity that was asked for, is left out.
///
/// # Errors
/// Times are not seconds of the week; no fix has the velocity that was asked for;
/// [`Error::Unwritable`].
pub fn write(record: &Record, form: Form, imu: &Path, gnss: &Path) -> Result<usize, Error> {
    let refused = |option: &str, problem: String, remedy: &str| Error::Option {
        option: option.into(),
        problem,
        remedy: remedy.into(),
    };
    if form.velocity && !record.fixes.iter().any(|f| f.has(3..6)) {
        let problem = "the recording has no velocities".into();
        return Err(refused("--velocity", problem, "leave it out"));
    }
    let (time, increments): (Vec<_>, Vec<_>) = record.written_increments().unzip();
    record.check()?;
    let second = |t: f64| t + form.shift_s;
    let all = time.iter().chain(record.fixes.iter().map(|f| &f.time));
    check_seconds(all, form.shift_s, "--shift")?;
    let text = lines_of(&time, &increments, form.shift_s);
    let mut fixes = String::new();
    let values = 0..if form.velocity { 6 } else { 3 };
    let whole = record.fixes.iter().filter(|f| f.has(values.clone()));
    let mut count = 0;
    for f in whole {
        let mut row = vec![f.lat_deg, f.lon_deg, f.height_m];
        row.extend(
            Some(f.velocity)
                .filter(|_| form.velocity)
                .into_iter()
                .flatten(),
        );
        row.extend(&f.sigmas[values.clone()]);
        line(&mut fixes, second(f.time), &row);
        count += 1;
    }
    write_atomic(imu, text.as_bytes())?;
    write_atomic(gnss, fixes.as_bytes())?;
    Ok(count)
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
    Ok(lines_of(&time, &increments, shift_s))
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
        time: 0,
        columns: [[1, 2, 3], [4, 5, 6]],
        units: [1.0; 2],
        turn: Rotation3::identity(),
    };
    Text::new(imu.to_path_buf(), Separator::BlankOrComma, 0, columns)
}

/// The lines of samples.
fn lines_of(time: &[f64], increments: &[Increment], shift_s: f64) -> String {
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

/// Reads a file whose columns are one of the lists `known`, with any further columns if `more`. If
/// it is `lenient`, a cell of `nan` is NaN, and a first or last line that is cut is left out.
fn table(file: &Path, known: &[&[&str]], more: bool, lenient: bool) -> Result<Table, Error> {
    let source = Source::open(file, Separator::BlankOrComma)?;
    let head = source.head();
    let skip = begins(head, known[0].len());
    // the first line may be cut
    let counts = || head[skip..].iter().take(2).map(Vec::len);
    let names = counts().find_map(|count| known.iter().find(|names| names.len() == count));
    let names = names.unwrap_or(&known[0]);
    let found = counts().max().unwrap_or(0);
    let mut all: Vec<String> = names.iter().map(ToString::to_string).collect();
    if more {
        all.extend((all.len()..found).map(|k| (k + 1).to_string()));
    }
    let wanted: Vec<usize> = (0..names.len()).collect();
    let layout = Layout {
        skip,
        names: &all,
        wanted: &wanted,
        gap: lenient.then_some(f64::NAN),
        loose: usize::MAX,
        cut: lenient,
    };
    let mut table = Table::read(&source, &layout)?;
    if head[..skip].iter().any(|line| !is_comment(line)) {
        let file = file.display();
        let note = format!("{file}: the lines before line {} are left out", skip + 1);
        table.notes.push(note);
    }
    Ok(table)
}

/// Number of lines before the data: comments, and lines of which fewer than half of the first
/// `least` values are numbers. Where there is no other line, the comments.
fn begins(head: &[Vec<String>], least: usize) -> usize {
    let number = |text: &&String| text.parse::<f64>().is_ok();
    let data = |line: &Vec<String>| {
        let numbers = line.iter().take(least).filter(number).count();
        line.len() > 2 && 2 * numbers >= line.len().min(least)
    };
    let first = head.iter().position(data);
    let first = first.or_else(|| head.iter().position(|line| !is_comment(line)));
    first.unwrap_or(0)
}

/// Whether a line is empty or begins with the mark of a comment.
fn is_comment(line: &[String]) -> bool {
    let first = line.first();
    first.is_none_or(|first| first.starts_with(['#', '%']))
}

fn increment(row: &[f64]) -> Increment {
    Increment {
        dtheta: Vector3::new(row[1], row[2], row[3]),
        dv: Vector3::new(row[4], row[5], row[6]),
    }
}

#[cfg(test)]
mod tests;
