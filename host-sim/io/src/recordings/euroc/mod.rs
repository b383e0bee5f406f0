//! Folders in the form of the EuRoC MAV dataset (ETH Zurich, ASL): an IMU, and a ground truth of
//! position, velocity and attitude in a room.
//!
//! ```text
//! mav0/imu0/data.csv                          ns | rates x, y, z, rad/s | forces x, y, z, m/s2
//! mav0/imu0/sensor.yaml                       T_BS: from axes of the sensor to those of the body
//! mav0/state_groundtruth_estimate0/data.csv   ns | position x, y, z, m | attitude w, x, y, z
//!                                             | velocity x, y, z, m/s | more columns are not read
//! mav0/state_groundtruth_estimate0/sensor.yaml
//! ```
//!
//! There is no satellite in a room, so the ground truth is thinned to fixes. Its axes have z up and
//! any heading; here x counts as north and y as west, at an origin that the user may give. The
//! rotation of the Earth then points in a wrong direction, which matters only for gyros much better
//! than those of these datasets. The body of the EuRoC MAV has x up, y right and z forward.

use crate::recordings::InitialAttitude;
use crate::recordings::corrected::{SampleColumns, Text};
use crate::recordings::record::{Kind, NOT_MEASURED, Record, TimedFix};
use crate::recordings::session::complain;
use crate::recordings::stamped::{Fixes, Location, Reading, Samples, turned};
use crate::recordings::table::{Cell, Layout, Separator, Source, Table};
use crate::recordings::track::Track;
use host_core::error::Error;
use host_core::inertial::axes::Axes;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::sins::NavState;
use host_core::inertial::units::DEG;
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use std::fmt;
use std::path::{Path, PathBuf};

/// Axes of the body of the EuRoC MAV: forward, right and down are z, y and -x.
pub const BODY: &str = "z y -x";
/// Rotation of the axes of the room, north-west-up, into north-east-down.
const NORTH_WEST_UP: [f64; 3] = [1.0, -1.0, -1.0];

/// Settings of the reader.
#[derive(Debug, Clone)]
pub struct Choice {
    /// Geodetic position of the room's origin.
    pub origin: Geodetic,
    /// Time between two fixes, s.
    pub interval_s: f64,
    /// Standard deviations of the fixes: position, m, velocity, m/s.
    pub sigmas: [f64; 2],
    /// Longest step between samples that is interpolated, s; `None` for the usual one.
    pub max_gap_s: Option<f64>,
    /// Turns axes of the body into forward-right-down.
    pub mounting: Rotation3<f64>,
}

/// Reads a folder: the one with `mav0`, or `mav0` itself.
///
/// # Errors
/// Any fault of the files, with line and column.
pub fn read(folder: &Path, choice: &Choice) -> Result<Reading, Error> {
    if folder.is_file() {
        let path = folder.to_path_buf();
        return Err(Error::NoFolder { path });
    }
    let mav = mav(folder);
    let (imu, truth) = (mav.join("imu0"), mav.join("state_groundtruth_estimate0"));
    let to_body = choice.mounting * sensor(&imu.join("sensor.yaml"))?;
    let file = imu.join("data.csv");
    let (samples, mut notes) = samples(&file, &to_body)?;
    let origin = samples.origin_ns().unwrap_or_default();
    let (states, measured) = states(&truth, choice, &mut notes)?;
    let thinned = thinned(&states, measured, &truth, choice)?;
    let mut record = samples.record(&file, choice.max_gap_s, &thinned)?;
    record.notes.append(&mut notes);
    let since = |ns: i64| (ns - origin) as f64 / 1e9;
    let time = states.iter().map(|(ns, _)| since(*ns)).collect();
    let track = Track::new(time, states.iter().map(|(_, state)| *state).collect());
    let first = track.at(record.first_epoch());
    record.initial_attitude = Some(InitialAttitude::Known(first.q_bn));
    record.truth = Some(track);
    record.lever_arm_m = Some([0.0; 3]); // the ground truth is of the body
    let note = format!(
        "{}: the ground truth serves as fixes, with x as north and y as west",
        folder.display()
    );
    Ok(Reading {
        record,
        notes: vec![note],
        origin_s: Some(origin as f64 / 1e9),
    })
}

/// Reads the samples alone. `mounting` as in [`Choice`].
///
/// # Errors
/// As [`read`].
pub fn at_rest(folder: &Path, mounting: Rotation3<f64>) -> Result<Record, Error> {
    let imu = mav(folder).join("imu0");
    let file = imu.join("data.csv");
    let (samples, mut notes) = samples(&file, &(mounting * sensor(&imu.join("sensor.yaml"))?))?;
    let mut record = samples.record(&file, None, &[])?;
    record.notes.append(&mut notes);
    Ok(record)
}

/// The samples of a file, and notes on it.
fn samples(file: &Path, to_body: &Rotation3<f64>) -> Result<(Samples, Vec<String>), Error> {
    let mut table = table(file, 7)?;
    let mut samples = Samples::new(Location::new(file, "data line"), Kind::Rate);
    for row in table.rows() {
        let [ns, gx, gy, gz, ax, ay, az, ..] = row else {
            continue; // each row has at least as many
        };
        let gyro = [gx, gy, gz].map(|x| x.value);
        let accel = [ax, ay, az].map(|x| x.value);
        let gyro = if ns.value.is_nan() {
            [f64::NAN; 3]
        } else {
            gyro
        };
        samples.push(ns.whole, turned(to_body, gyro, accel), 1.0)?;
    }
    Ok((samples, std::mem::take(&mut table.notes)))
}

/// The folder of the sensors.
fn mav(folder: &Path) -> PathBuf {
    let inner = folder.join("mav0");
    if inner.is_dir() {
        inner
    } else {
        folder.to_path_buf()
    }
}

/// Position of the samples in their file, to write it again. `mounting` as in [`Choice`].
///
/// # Errors
/// As [`read`].
pub fn original(folder: &Path, mounting: Rotation3<f64>) -> Result<Text, Error> {
    let imu = mav(folder).join("imu0");
    let file = imu.join("data.csv");
    let first = Source::open(&file, Separator::COMMA)?.first_line();
    let columns = SampleColumns {
        time: 0,
        columns: [[1, 2, 3], [4, 5, 6]],
        units: [1.0; 2],
        turn: mounting * sensor(&imu.join("sensor.yaml"))?,
    };
    let skip = usize::from(has_names(&first));
    Ok(Text::new(file, Separator::COMMA, skip, columns))
}

/// Whether a first line holds the names of the columns.
fn has_names(first: &[String]) -> bool {
    let time = first.first().map(|text| text.parse::<f64>());
    time.is_none_or(|time| time.is_err())
}

/// The true states with their times, ns, and whether they have a velocity.
fn states(
    folder: &Path,
    choice: &Choice,
    notes: &mut Vec<String>,
) -> Result<(Vec<(i64, NavState)>, bool), Error> {
    let file = folder.join("data.csv");
    let mut table = table(&file, 8)?;
    notes.append(&mut table.notes);
    // Attitudes are those of a sensor on the body, whose axes may differ from the body's.
    let from_body = sensor(&folder.join("sensor.yaml"))?.inverse() * choice.mounting.inverse();
    let from_body = UnitQuaternion::from_rotation_matrix(&from_body);
    let room = Rotation3::from_matrix_unchecked(Matrix3::from_diagonal(&NORTH_WEST_UP.into()));
    let ned = UnitQuaternion::from_rotation_matrix(&room);
    let mut states: Vec<(i64, NavState)> = Vec::with_capacity(table.count());
    let mut has_velocity = true;
    for (k, row) in table.rows().enumerate() {
        if row.iter().take(11).any(|x| x.value.is_nan()) {
            continue; // the tracking of the room had lost the body
        }
        let ns = row[0].whole;
        if states.last().is_some_and(|(before, _)| *before >= ns) {
            return Err(table.complain(k, 0, "not after the line before", "sort the lines"));
        }
        let three = |at: usize| Vector3::new(row[at].value, row[at + 1].value, row[at + 2].value);
        let far = (1..4).find(|&c| row[c].value.abs() > 1e4);
        if let Some(c) = far {
            return Err(table.complain(k, c, "out of range", "give metres in a room"));
        }
        let q = Quaternion::new(row[4].value, row[5].value, row[6].value, row[7].value);
        if (q.norm() - 1.0).abs() > 0.01 {
            return Err(table.complain(k, 4, "not part of a unit quaternion", "give w, x, y, z"));
        }
        has_velocity &= row.len() >= 11;
        let velocity = if has_velocity {
            three(8)
        } else {
            Vector3::zeros()
        };
        states.push((
            ns,
            NavState {
                position: choice.origin.displaced(&(ned * three(1))),
                velocity: ned * velocity,
                q_bn: ned * UnitQuaternion::new_normalize(q) * from_body,
            },
        ));
    }
    Ok((states, has_velocity))
}

/// States that are at least the interval apart, as fixes.
fn thinned(
    states: &[(i64, NavState)],
    has_velocity: bool,
    folder: &Path,
    choice: &Choice,
) -> Result<Vec<(i64, TimedFix)>, Error> {
    let mut fixes = Fixes::new(Location::new(&folder.join("data.csv"), "data line"));
    let interval = (choice.interval_s * 1e9).round() as i64;
    let [p, v] = choice.sigmas;
    let v = if has_velocity { v } else { NOT_MEASURED };
    let mut next = i64::MIN;
    for (k, (ns, state)) in states.iter().enumerate() {
        if *ns < next {
            continue;
        }
        // Times that jitter do not make the interval longer.
        next = if next == i64::MIN { *ns } else { next } + interval;
        next = next.max(*ns + interval / 2);
        let fix = TimedFix {
            time: 0.0, // stored beside the fix, in ns
            lat_deg: state.position.lat / DEG,
            lon_deg: state.position.lon / DEG,
            height_m: state.position.h,
            velocity: state.velocity.into(),
            sigmas: [p, p, p, v, v, v],
        };
        fixes.push(k, *ns, fix)?;
    }
    Ok(fixes.all)
}

/// A number that is exact whether it is a time stamp in ns or not.
#[derive(Debug, Clone, Copy)]
struct Wide {
    whole: i64,
    value: f64,
}

impl Wide {
    /// No number.
    const NONE: Self = Self {
        whole: 0,
        value: f64::NAN,
    };
}

impl fmt::Display for Wide {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.value)
    }
}

impl Cell for Wide {
    const REMEDY: &str = "give whole ns and decimal numbers, as EuRoC does";

    fn parse(text: &str) -> Result<Self, &'static str> {
        let value = f64::parse(text)?;
        let whole = text.parse().unwrap_or(value as i64);
        Ok(Self { whole, value })
    }
}

/// A table of at least so many columns, after a line of names that begins with `#` or letters.
fn table(file: &Path, least: usize) -> Result<Table<Wide>, Error> {
    let source = Source::open(file, Separator::COMMA)?;
    let first = source.header("#timestamp [ns],...")?;
    let has_names = has_names(&first);
    if first.len() < least {
        let problem = format!("has {} columns", first.len());
        let remedy = format!("give at least {least}, as EuRoC does");
        return Err(complain(file, "line 1", problem, &remedy));
    }
    let names: Vec<String> = match has_names {
        true => first,
        false => (1..=first.len()).map(|k| k.to_string()).collect(),
    };
    let wanted: Vec<usize> = (0..names.len()).collect();
    let layout = Layout {
        skip: usize::from(has_names),
        names: &names,
        wanted: &wanted,
        gap: Some(Wide::NONE),
        loose: usize::MAX,
        cut: true,
    };
    Table::read(&source, &layout)
}

/// The rotation of `T_BS` in a `sensor.yaml`, from axes of the sensor to those of the body; none if
/// there is no such file.
fn sensor(file: &Path) -> Result<Rotation3<f64>, Error> {
    let text = match std::fs::read_to_string(file) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Rotation3::identity()),
        text => text.map_err(|e| Error::reading(file, e))?,
    };
    let Some((_, after)) = text.split_once("T_BS:") else {
        return Ok(Rotation3::identity());
    };
    let list = after
        .split_once('[')
        .and_then(|(_, list)| Some(list.split_once(']')?.0));
    let numbers = list.unwrap_or_default().split(',');
    let numbers: Vec<f64> = numbers.filter_map(|x| x.trim().parse().ok()).collect();
    let bad = |problem: &str| {
        let remedy = "give a rigid transformation of 4 x 4 numbers in rows, as EuRoC does";
        Err(complain(file, "T_BS", problem.to_owned(), remedy))
    };
    let [a, b, c, _, d, e, f, _, g, h, i, ..] = numbers[..] else {
        return bad("has no list 'data' of 16 numbers");
    };
    let matrix = Matrix3::new(a, b, c, d, e, f, g, h, i);
    let off = (matrix * matrix.transpose() - Matrix3::identity())
        .abs()
        .max();
    if !(off < 1e-3 && matrix.determinant() > 0.0) {
        return bad("is not a rotation");
    }
    let exact = (off < 1e-12).then(|| Rotation3::from_matrix_unchecked(matrix));
    Ok(exact.unwrap_or_else(|| Rotation3::from_matrix(&matrix)))
}

/// The axes of [`BODY`].
#[must_use]
pub fn body() -> Axes {
    Axes::parse(BODY).unwrap_or(Axes::FORWARD_RIGHT_DOWN)
}

#[cfg(test)]
mod tests;
