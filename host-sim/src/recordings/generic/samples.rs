//! Reads the samples.

use super::File;
use super::header::{ACCEL, GYRO, Imu, TIME};
use super::read::Read;
use crate::error::Error;
use crate::inertial::sins::Increment;
use crate::recordings::corrected::{Place, Text};
use crate::recordings::record::{Kind, Record, median_step};
use crate::recordings::table::Table;

/// Limits of plausible samples: 2000 deg/s in rad/s, and 100 g in m/s2.
const LIMITS: [f64; 2] = [35.0, 1000.0];

/// Reads the samples. The record has no fixes yet.
pub(super) fn motion(read: &Read) -> Result<Record, Error> {
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
    let mut values: Vec<[f64; 6]> = Vec::new();
    let mut table = file.times(&wanted, |row| values.extend(<[f64; 6]>::try_from(row)))?;
    table.check_rising(0)?;
    let mut time = table.take_values();
    time.iter_mut().for_each(|t| *t *= second);
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
    check((&table, imu), &values, (kind, step), (gyro, accel))?;
    let sample = |[gx, gy, gz, ax, ay, az]: [f64; 6]| Increment {
        dtheta: axes.turn([gx, gy, gz]) * gyro,
        dv: axes.turn([ax, ay, az]) * accel,
    };
    // the values become samples where they are
    let samples: Vec<Increment> = values.into_iter().map(sample).collect();
    Ok(Record {
        file: read.file.clone(),
        time,
        samples,
        kind,
        rate_hz: rate_hz as usize,
        max_gap_s: imu.max_gap_s,
        ..Record::default()
    })
}

/// Where the samples stand in their file.
pub(super) fn original(read: &Read) -> Result<Text, Error> {
    let imu = &read.header.imu;
    let (_, gyro) = read.value("imu.gyro", &imu.gyro.unit, &GYRO)?;
    let (_, accel) = read.value("imu.accel", &imu.accel.unit, &ACCEL)?;
    let file = File::open(read, "imu", &read.imu_file()?, &imu.separator, imu.names)?;
    let column = |key: &str, name: &String| file.place(&(key, name.as_str()));
    let columns = |key: &str, [x, y, z]: &[String; 3]| {
        Ok::<_, Error>([column(key, x)?, column(key, y)?, column(key, z)?])
    };
    let place = Place {
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
        place,
    ))
}

/// Checks that values are plausible. The table names their places.
fn check(
    (table, imu): (&Table, &Imu),
    values: &[[f64; 6]],
    (kind, step): (Kind, f64),
    (gyro, accel): (f64, f64),
) -> Result<(), Error> {
    let per_sample = match kind {
        Kind::Rate => 1.0,
        Kind::Increment => step,
    };
    for (first, columns, limit, remedy) in [
        (
            0,
            &imu.gyro.columns,
            LIMITS[0] * per_sample / gyro,
            "check the unit of the gyros; the limit is 35 rad/s",
        ),
        (
            3,
            &imu.accel.columns,
            LIMITS[1] * per_sample / accel,
            "check the unit of the accelerometers; the limit is 1000 m/s2",
        ),
    ] {
        for (i, row) in values.iter().enumerate() {
            for (column, value) in columns.iter().zip(&row[first..]) {
                if value.abs() > limit {
                    let fault = "out of range";
                    return Err(table.complain_of(i, column, value, fault, remedy));
                }
            }
        }
    }
    Ok(())
}
