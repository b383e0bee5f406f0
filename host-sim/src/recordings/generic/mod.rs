//! Any recording as text. A TOML header file says what the columns mean:
//!
//! ```toml
//! # The unit: what is known of the sensors. A file is relative to the header file. Optional.
//! unit = "unit.toml"
//!
//! [imu]
//! # Relative to the header file, plain or gzipped. A file on the command line replaces it.
//! file = "imu.csv"
//! # s, ms, us, ns
//! time = { column = "t", unit = "ms" }
//! # Rates: rad/s, deg/s, deg/h. Increments: rad, deg, arcsec.
//! gyro = { columns = ["gx", "gy", "gz"], unit = "deg/s" }
//! # Specific force: m/s^2, g (9.80665 m/s^2), mg. Increments: m/s.
//! accel = { columns = ["ax", "ay", "az"], unit = "g" }
//! # Forward, right, down in axes of the file. These are right-forward-up.
//! axes = "y x -z"
//! # "," by default, or "tab", or "blank" for any run of blanks.
//! # separator = ";"
//! # Without a line of names the columns are called "1", "2", ...
//! # names = false
//! # Longest step between rates that is interpolated. Three samples by default.
//! # max_gap_s = 0.05
//!
//! # Leave this table out if the vehicle is at rest.
//! [gnss]
//! # By default the file of the IMU, whose lines without a fix leave these columns empty.
//! file = "gnss.csv"
//! # On the clock of the IMU.
//! time = { column = "t", unit = "ms" }
//! # rad, deg
//! latitude = { column = "lat", unit = "deg" }
//! longitude = { column = "lon", unit = "deg" }
//! # Above the ellipsoid.
//! height = { column = "h", unit = "m" }
//! # m/s, km/h; order "ned" or "enu". May be left out.
//! velocity = { columns = ["vn", "ve", "vd"], unit = "m/s", order = "ned" }
//! # Standard deviations north, east, down, the same for all fixes ...
//! position_sigma_m = [1.0, 1.0, 1.5]
//! velocity_sigma_mps = [0.05, 0.05, 0.05]
//! # ... or columns of m and m/s.
//! # position_sigma = ["sn", "se", "sd"]
//! # velocity_sigma = ["svn", "sve", "svd"]
//!
//! [start]
//! # Self-alignment on a standstill of at least 90 s ...
//! standstill_s = 300
//! # ... or the attitude at the first fix: pitch nose up, heading clockwise from north.
//! # roll_deg = 0.0
//! # pitch_deg = 0.0
//! # heading_deg = 90.0
//! # The site, only without [gnss].
//! # latitude_deg = 34.2
//! # longitude_deg = 108.9
//! # height_m = 380.0
//! ```
//!
//! The session begins at the first fix within the time of the IMU and lasts whole seconds. Fixes at
//! whole seconds after the first are used as they are; others, at most 2.5 s apart, are
//! interpolated. Rates are integrated by the trapezoidal rule with their time stamps. An increment
//! ends at its time. Steps between increments of more than 1.5 samples are refused, because the
//! motion in them is lost. The sample rate of the session is the reciprocal of the median step, to
//! the nearest whole number. Counts have the value [`crate::inertial::counts::FINE_LSB`].

mod fixes;
mod header;
mod write;

pub use header::NamedUnit;
pub use write::{write, write_truth};

use crate::error::Error;
use crate::inertial::rotation::from_euler;
use crate::inertial::sins::Increment;
use crate::inertial::units::DEG;
use crate::recordings::record::{Kind, Record, TimedFix, median_step};
use crate::recordings::session::InitialAttitude;
use crate::recordings::table::{Layout, Source, Table};
use crate::unit::Unit;
use fixes::fixes;
use header::{ACCEL, GYRO, Read, TIME};
use std::path::{Path, PathBuf};

/// Limits of plausible samples: 2000 deg/s in rad/s, and 100 g in m/s2.
const LIMITS: [f64; 2] = [35.0, 1000.0];
/// Shortest standstill for self-alignment, s.
const LEAST_STANDSTILL_S: u32 = 90;

/// Standard deviations of a vehicle at rest, from sway (assumed): position, m, then velocity, m/s.
const AT_REST: [f64; 6] = [0.05, 0.05, 0.05, 0.01, 0.01, 0.01];

/// Reads the recording that a header file describes. `files` replace those that the header names:
/// first that of the IMU, then that of the fixes. If the header gives an attitude, the first
/// reference state of the record's session has it.
///
/// # Errors
/// Any fault of header or files, with line and column or key; more `files` than the header
/// describes.
pub fn read(header: &Path, files: &[PathBuf]) -> Result<Record, Error> {
    let read = Read::open(header, files)?;
    let initial_attitude = initial_attitude(&read)?;
    let motion = motion(&read)?;
    let fixes = match &read.header.gnss {
        Some(gnss) => fixes(&read, gnss)?,
        None => vec![site(&read)?],
    };
    Ok(Record {
        file: header.to_path_buf(),
        fixes,
        initial_attitude: Some(initial_attitude),
        ..motion
    })
}

/// The unit that a header file names, if it names one.
///
/// # Errors
/// Any fault of the header or of the unit file, with line and key.
pub fn unit(header: &Path) -> Result<Option<Unit>, Error> {
    let read = Read::open(header, &[])?;
    let named = read.header.unit.as_deref();
    named
        .map(|name| Unit::load_beside(name, header))
        .transpose()
}

/// The units that a header file names for gyros and accelerometers, and all that it could name. The
/// samples are `step` seconds apart.
///
/// # Errors
/// As [`read`].
pub fn units(header: &Path, step: f64) -> Result<[(NamedUnit, Vec<NamedUnit>); 2], Error> {
    let read = Read::open(header, &[])?;
    let imu = &read.header.imu;
    let units = |known: &[header::Unit]| {
        let value = |unit: &header::Unit| match unit.1 {
            Kind::Rate => unit.2,
            Kind::Increment => unit.2 / step,
        };
        let all = known.iter().map(|unit| (unit.0.to_owned(), value(unit)));
        all.collect::<Vec<_>>()
    };
    let named = |key: &str, name: &str, known: &[header::Unit]| {
        read.unit(key, name, known)?;
        let all = units(known);
        let told = all.iter().find(|unit| unit.0 == name).cloned();
        Ok((told.unwrap_or_default(), all))
    };
    Ok([
        named("imu.gyro", &imu.gyro.unit, &GYRO)?,
        named("imu.accel", &imu.accel.unit, &ACCEL)?,
    ])
}

fn initial_attitude(read: &Read) -> Result<InitialAttitude, Error> {
    let s = &read.header.start;
    match (s.standstill_s, s.roll_deg, s.pitch_deg, s.heading_deg) {
        (Some(t), None, None, None) if t >= LEAST_STANDSTILL_S => {
            Ok(InitialAttitude::Standstill(t as usize))
        }
        (Some(t), None, None, None) => {
            let problem = format!("is {t}, too short to align on");
            Err(read.bad(
                "start.standstill_s",
                problem,
                "give at least 90, or the attitude instead",
            ))
        }
        (None, Some(roll), Some(pitch), Some(heading)) => {
            for (key, angle) in [
                ("roll_deg", roll),
                ("pitch_deg", pitch),
                ("heading_deg", heading),
            ] {
                if !(-360.0..=360.0).contains(&angle) {
                    return Err(read.bad(
                        &format!("start.{key}"),
                        format!("is {angle}"),
                        "give -360 to 360",
                    ));
                }
            }
            Ok(InitialAttitude::Known(from_euler(
                roll * DEG,
                pitch * DEG,
                heading * DEG,
            )))
        }
        _ => {
            let problem = "gives neither a standstill nor a whole attitude".to_owned();
            Err(read.bad(
                "start",
                problem,
                "give either standstill_s, or roll_deg, pitch_deg and heading_deg",
            ))
        }
    }
}

/// The site of a vehicle at rest.
fn site(read: &Read) -> Result<TimedFix, Error> {
    let s = &read.header.start;
    let (Some(lat), Some(lon), Some(h)) = (s.latitude_deg, s.longitude_deg, s.height_m) else {
        let problem = "does not give the site of a recording without fixes".to_owned();
        return Err(read.bad(
            "start",
            problem,
            "give latitude_deg, longitude_deg and height_m, or a table [gnss]",
        ));
    };
    if !(lat.abs() < 89.9 && lon.abs() <= 360.0 && h.abs() < 20_000.0) {
        return Err(read.bad(
            "start",
            format!("has the site {lat}, {lon}, {h}"),
            "give degrees and metres, not at a pole",
        ));
    }
    Ok(TimedFix {
        time: 0.0,
        lat_deg: lat,
        lon_deg: lon,
        height_m: h,
        velocity: [0.0; 3],
        sigmas: AT_REST,
    })
}

/// A file with the names of its columns, and the table of the header file that describes it.
struct File<'a> {
    read: &'a Read,
    table: &'a str,
    source: Source,
    /// Lines before the data.
    skip: usize,
    names: Vec<String>,
}

impl<'a> File<'a> {
    fn open(
        read: &'a Read,
        table: &'a str,
        file: &Path,
        separator: &str,
        names: bool,
    ) -> Result<Self, Error> {
        let separator = read.separator(&format!("{table}.separator"), separator)?;
        let source = Source::open(file, separator)?;
        let first = source.header("names of the columns")?;
        let (skip, names) = match names {
            true => (1, first),
            false => (0, (1..=first.len()).map(|k| k.to_string()).collect()),
        };
        Ok(Self {
            read,
            table,
            source,
            skip,
            names,
        })
    }

    /// Reads the columns `wanted`, each given as key of the header file and name of the column.
    fn table(&self, wanted: &[(&str, &str)], gap: Option<f64>) -> Result<Table, Error> {
        let names = &self.names;
        let place = |(key, name): &(&str, &str)| {
            names.iter().position(|n| n == name).ok_or_else(|| {
                let problem = format!(
                    "names column '{name}', which {} does not have",
                    self.source.file.display()
                );
                self.read.bad(
                    &format!("{}.{key}", self.table),
                    problem,
                    &format!("use one of {}", names.join(", ")),
                )
            })
        };
        let wanted: Vec<usize> = wanted.iter().map(place).collect::<Result<_, _>>()?;
        let layout = Layout {
            skip: self.skip,
            names,
            wanted: &wanted,
            gap,
        };
        Table::read(&self.source, &layout)
    }
}

/// Reads the samples. The record has no fixes yet.
fn motion(read: &Read) -> Result<Record, Error> {
    let imu = &read.header.imu;
    let axes = read.axes()?;
    if let Some(gap) = imu.max_gap_s.filter(|g| !(g.is_finite() && *g > 0.0)) {
        return Err(read.bad("imu.max_gap_s", format!("is {gap}"), "give seconds above 0"));
    }
    let (_, second) = read.unit("imu.time", &imu.time.unit, &TIME)?;
    let (kind, gyro) = read.unit("imu.gyro", &imu.gyro.unit, &GYRO)?;
    let (kind_a, accel) = read.unit("imu.accel", &imu.accel.unit, &ACCEL)?;
    if kind != kind_a {
        let problem = format!(
            "is in {} while the gyros are in {}",
            imu.accel.unit, imu.gyro.unit
        );
        return Err(read.bad(
            "imu.accel",
            problem,
            "give rates for both or increments for both",
        ));
    }
    let file = File::open(read, "imu", &read.imu_file()?, &imu.separator, imu.names)?;
    let mut wanted = vec![("time", imu.time.column.as_str())];
    wanted.extend(imu.gyro.columns.iter().map(|c| ("gyro", c.as_str())));
    wanted.extend(imu.accel.columns.iter().map(|c| ("accel", c.as_str())));
    let table = file.table(&wanted, None)?;
    table.check_rising(0)?;
    let time: Vec<f64> = table.rows().map(|r| r[0] * second).collect();
    let step = median_step(&time);
    let rate_hz = (1.0 / step).round();
    if !(4.0..=8000.0).contains(&rate_hz) {
        let problem = format!("has a median step of {step} s");
        return Err(read.bad(
            "imu.time",
            problem,
            "check the unit; 4 to 8000 samples a second can be used",
        ));
    }
    check(&table, &time, (kind, step), (gyro, accel), imu.max_gap_s)?;
    let sample = |r: &[f64]| Increment {
        dtheta: axes.turn([r[1], r[2], r[3]]) * gyro,
        dv: axes.turn([r[4], r[5], r[6]]) * accel,
    };
    let samples: Vec<Increment> = table.rows().map(sample).collect();
    Ok(Record {
        file: read.file.clone(),
        time,
        samples,
        kind,
        rate_hz: rate_hz as usize,
        ..Record::default()
    })
}

/// Checks that values are plausible and that there are no gaps.
fn check(
    table: &Table,
    time: &[f64],
    (kind, step): (Kind, f64),
    (gyro, accel): (f64, f64),
    max_gap_s: Option<f64>,
) -> Result<(), Error> {
    let (per_sample, longest) = match kind {
        Kind::Rate => (1.0, max_gap_s.unwrap_or(3.0 * step)),
        Kind::Increment => (step, 1.5 * step),
    };
    let remedy = "check the unit of the gyros; the limit is 35 rad/s";
    table.check_within(1..4, LIMITS[0] * per_sample / gyro, remedy)?;
    let remedy = "check the unit of the accelerometers; the limit is 1000 m/s2";
    table.check_within(4..7, LIMITS[1] * per_sample / accel, remedy)?;
    match (1..time.len()).find(|&k| time[k] - time[k - 1] > longest) {
        Some(k) => {
            let remedy = "cut the recording there, or for rates raise imu.max_gap_s";
            Err(table.complain(k, 0, "after a gap", remedy))
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
