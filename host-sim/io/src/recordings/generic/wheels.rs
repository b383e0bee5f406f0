//! Reads the speed of the wheels.

use super::header::{SPEED, TIME, Wheels};
use super::read::OpenedHeader;
use super::{Described, File};
use crate::recordings::week::Unwrapped;
use host_core::error::Error;

/// Speeds, m/s, at rising times, s. A row without a time or a speed is left out.
pub(super) fn wheels(read: &OpenedHeader, wheels: &Wheels) -> Result<Vec<[f64; 2]>, Error> {
    let (_, second) = read.value("wheels.time", &wheels.time.unit, &TIME)?;
    let (_, mps) = read.value("wheels.speed", &wheels.speed.unit, &SPEED)?;
    let columns = [
        ("time", wheels.time.column.as_str()),
        ("speed", wheels.speed.column.as_str()),
    ];
    let described = Described {
        table: "wheels",
        separator: &wheels.separator,
        names: wheels.names,
        skip_lines: wheels.skip_lines,
    };
    let path = read.beside(&wheels.file);
    let file = File::open(read, described, &path, &columns.map(|(_, name)| name))?;
    let mut all: Vec<[f64; 2]> = Vec::new();
    let mut falls = None;
    let mut week = Unwrapped::default();
    file.rows(&columns, |row| {
        let [time, speed] = [row[0] * second, row[1] * mps];
        if time.is_finite() && speed.is_finite() {
            let time = week.on(time);
            if all.last().is_some_and(|[before, _]| time <= *before) {
                falls = falls.or(Some(time));
            }
            all.push([time, speed]);
        }
        Ok(())
    })?;
    if let Some(time) = falls {
        let problem = format!(
            "has the time {time} s after a later one in {}",
            path.display()
        );
        return Err(read.bad(
            "wheels.time",
            problem,
            "sort the rows, and take out what is double",
        ));
    }
    if all.is_empty() {
        let problem = format!("has no speed in {}", path.display());
        return Err(read.bad("wheels", problem, "leave [wheels] out"));
    }
    Ok(all)
}
