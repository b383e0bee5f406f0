//! Reads the samples.

use super::header::{ACCEL, GYRO, TIME};
use super::read::OpenedHeader;
use super::{Described, File};
use crate::recordings::corrected::{SampleColumns, Text};
use crate::recordings::pace::Pace;
use crate::recordings::record::{Kind, Record};
use crate::recordings::week::Unwrapped;
use host_core::error::Error;
use host_core::inertial::sins::Increment;
use host_core::list::Writer;
use host_core::words::{agrees, counted};

/// Limits of plausible samples: 2000 deg/s in rad/s, and 100 g in m/s2.
const LIMITS: [f64; 2] = [35.0, 1000.0];

/// Reads the samples. The record has no fixes yet.
pub(super) fn motion(read: &OpenedHeader) -> Result<Record, Error> {
    let imu = &read.header.imu;
    let axes = read.turn()?;
    if let Some(gap) = imu.max_gap_s.filter(|g| !(g.is_finite() && *g > 0.0)) {
        return Err(read.bad("imu.max_gap_s", format!("is {gap}"), "give seconds above 0"));
    }
    let (_, second) = read.value("imu.time", &imu.time.unit, &TIME)?;
    let (kind, gyro) = read.value("imu.gyro", &imu.gyro.unit, &GYRO)?;
    let (kind_a, accel) = read.value("imu.accel", &imu.accel.unit, &ACCEL)?;
    if kind != kind_a {
        let problem = format!(
            "is in {} while the gyros are in {}",
            imu.accel.unit, imu.gyro.unit
        );
        let remedy = "give rates for both or increments for both";
        return Err(read.bad("imu.accel", problem, remedy));
    }
    let file = imu_file(read)?;
    let wanted = columns(read);
    let mut taken = CheckedValues::default();
    let mut table = file.rows(&wanted, |row| {
        let Ok([t, gx, gy, gz, ax, ay, az]) = <[f64; 7]>::try_from(row) else {
            return Ok(()); // as many are wanted
        };
        let Some(time) = taken.note(t, t * second, &row[1..]) else {
            return Ok(()); // no sample
        };
        taken.time.push(time)?;
        taken.samples.push(Increment {
            dtheta: axes.turn([gx, gy, gz]) * gyro,
            dv: axes.turn([ax, ay, az]) * accel,
        })
    })?;
    if let Some((row, times)) = taken.back {
        return Err(table.time_back(row, &imu.time.column, times));
    }
    let mut notes = std::mem::take(&mut table.notes);
    notes.extend(taken.week.note("samples"));
    if taken.without > 0 {
        notes.push(format!(
            "{} of {} {} no whole sample (empty or nan) and {} as missing.",
            counted(taken.without, "line"),
            file.source.file.display(),
            agrees(taken.without, "holds", "hold"),
            agrees(taken.without, "counts", "count")
        ));
    }
    let time = taken.time.finish()?;
    if time.len() < 2 {
        let problem = format!("has {} whole samples", time.len());
        let remedy = "give a file with a number in each column of the samples";
        return Err(read.bad("imu.file", problem, remedy));
    }
    let step = Pace::of(&time).step;
    let rate_hz = (1.0 / step).round();
    if !(4.0..=8000.0).contains(&rate_hz) {
        let problem = format!("has a median step of {step} s");
        return Err(read.bad("imu.time", problem, &time_remedy(step, &imu.time.unit)));
    }
    let limits = limits((kind, step), (gyro, accel));
    check(&file, &wanted, taken.largest, limits)?;
    Ok(Record {
        file: read.file.clone(),
        time,
        samples: taken.samples.finish()?,
        kind,
        rate_hz: rate_hz as usize,
        max_gap_s: imu.max_gap_s,
        notes,
        ..Record::default()
    })
}

/// The file of the samples.
fn imu_file(read: &OpenedHeader) -> Result<File<'_>, Error> {
    let imu = &read.header.imu;
    let names: Vec<&str> = columns(read).iter().map(|(_, name)| *name).collect();
    let described = Described {
        table: "imu",
        separator: &imu.separator,
        names: imu.names,
        skip_lines: imu.skip_lines,
    };
    File::open(read, described, &read.imu_file()?, &names)
}

/// Key and name of the columns of a sample.
fn columns(read: &OpenedHeader) -> Vec<(&str, &str)> {
    let imu = &read.header.imu;
    let mut wanted = vec![("time", imu.time.column.as_str())];
    wanted.extend(imu.gyro.columns.iter().map(|c| ("gyro", c.as_str())));
    wanted.extend(imu.accel.columns.iter().map(|c| ("accel", c.as_str())));
    wanted
}

/// What to do about a step that no IMU has: the units with a step that one has.
fn time_remedy(step: f64, named: &str) -> String {
    let known = |name: &str| TIME.iter().find(|unit| unit.0 == name).map(|unit| unit.2);
    let fits = |unit: &&super::header::Unit| {
        let step = step * unit.2 / known(named).unwrap_or(1.0);
        (1.0 / 2000.0..=0.1).contains(&step)
    };
    let names: Vec<String> = TIME
        .iter()
        .filter(fits)
        .map(|u| format!("'{}'", u.0))
        .collect();
    match names.is_empty() {
        true => "check the unit; 4 to 8000 samples a second can be used".into(),
        false => format!(
            "check the unit: {} would fit; 4 to 8000 samples a second can be used",
            names.join(" or ")
        ),
    }
}

/// Values that the checks need, of the rows read so far.
#[derive(Default)]
struct CheckedValues {
    time: Writer<f64>,
    samples: Writer<Increment>,
    /// The last time, in the unit of the file.
    last: Option<f64>,
    /// Rows so far.
    rows: usize,
    /// Rows that lack a value.
    without: usize,
    week: Unwrapped,
    /// The last time, s.
    second: f64,
    /// The first row whose time does not rise, with the one before it.
    back: Option<(usize, [f64; 2])>,
    /// Largest size of a value of the gyros, and of one of the accelerometers.
    largest: [f64; 2],
}

impl CheckedValues {
    /// Records a row for the checks. Returns the time of its sample, s, or `None` where it lacks a
    /// value.
    fn note(&mut self, time: f64, second: f64, values: &[f64]) -> Option<f64> {
        let row = self.rows;
        self.rows += 1;
        if time.is_nan() || values.iter().any(|x| x.is_nan()) {
            self.without += 1;
            return None;
        }
        let second = self.week.on(second);
        let before = self.last.replace(time).filter(|_| second <= self.second);
        self.second = second;
        self.back = self.back.or_else(|| Some((row, [before?, time])));
        for (largest, values) in self.largest.iter_mut().zip(values.chunks(3)) {
            *largest = values.iter().fold(*largest, |most, x| most.max(x.abs()));
        }
        Some(second)
    }
}

/// Position of the samples in their file.
pub(super) fn original(read: &OpenedHeader) -> Result<Text, Error> {
    let imu = &read.header.imu;
    let (_, gyro) = read.value("imu.gyro", &imu.gyro.unit, &GYRO)?;
    let (_, accel) = read.value("imu.accel", &imu.accel.unit, &ACCEL)?;
    let file = imu_file(read)?;
    let column = |key: &str, name: &String| file.position(&(key, name.as_str()));
    let columns = |key: &str, [x, y, z]: &[String; 3]| {
        Ok::<_, Error>([column(key, x)?, column(key, y)?, column(key, z)?])
    };
    let columns = SampleColumns {
        time: column("time", &imu.time.column)?,
        columns: [
            columns("gyro", &imu.gyro.columns)?,
            columns("accel", &imu.accel.columns)?,
        ],
        units: [gyro, accel],
        turn: read.turn()?.rotation(),
    };
    let separator = read.separator("imu.separator", &imu.separator)?;
    Ok(Text::new(
        file.source.file.clone(),
        separator,
        file.skip,
        columns,
    ))
}

/// Largest plausible values of gyros and accelerometers, in the units of the file.
fn limits((kind, step): (Kind, f64), (gyro, accel): (f64, f64)) -> [f64; 2] {
    let per_sample = match kind {
        Kind::Rate => 1.0,
        Kind::Increment => step,
    };
    [
        LIMITS[0] * per_sample / gyro,
        LIMITS[1] * per_sample / accel,
    ]
}

/// Checks that the largest values are plausible. If not, the file is read again to locate the first
/// value beyond its limit, first of the gyros.
fn check(
    file: &File<'_>,
    wanted: &[(&str, &str)],
    largest: [f64; 2],
    limits: [f64; 2],
) -> Result<(), Error> {
    let remedies = [
        "check the unit of the gyros; the limit is 35 rad/s",
        "check the unit of the accelerometers; the limit is 1000 m/s2",
    ];
    let Some(triad) = [0, 1].into_iter().find(|k| largest[*k] > limits[*k]) else {
        return Ok(());
    };
    let (first, limit, remedy) = (1 + 3 * triad, limits[triad], remedies[triad]);
    let (mut found, mut row) = (None, 0);
    let table = file.rows(wanted, |values| {
        let here = (first..first + 3).find(|k| values[*k].abs() > limit);
        found = found.or_else(|| here.map(|k| (row, k, values[k])));
        row += 1;
        Ok(())
    })?;
    Err(match found {
        Some((row, k, value)) => {
            table.complain_of(row, wanted[k].1, &value, "out of range", remedy)
        }
        None => {
            let problem = "changes while it is read".to_owned();
            file.read
                .bad("imu.file", problem, "read it when it is whole")
        }
    })
}
