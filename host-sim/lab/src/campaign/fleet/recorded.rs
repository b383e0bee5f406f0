//! Recordings of a fleet: a folder for each unit, and in it a folder for each drive, as `simulate`
//! and `convert csv` write them: `header.toml` with its files, and `temperature.csv` where there
//! are thermometers.

use super::series::{Drive, useless};
use crate::experiment::starting::{Started, Wishes, start};

use firmware::inputs::Inputs;
use host_core::error::Error;
use host_core::inertial::session::{Readings, Session};
use host_core::inertial::units::DEG;
use host_estimation::learning::teacher::Assumptions;
use host_io::recordings::{generic, read};
use host_unit::Unit;
use nalgebra::Vector3;
use std::path::{Path, PathBuf};

/// Name of the file in the folder of each drive.
const HEADER: &str = "header.toml";
/// Name of the file with the thermometers: end of a second, three axes.
const TEMPERATURE: &str = "temperature.csv";
/// Standard deviations of a given attitude, tilt and heading, rad: those of `replay`.
const ATTITUDE: [f64; 2] = [0.1 * DEG, 0.5 * DEG];

/// The folders inside a folder, in the order of their names.
///
/// # Errors
/// A folder that cannot be read.
pub fn folders(dir: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut out = Vec::new();
    for entry in std::fs::read_dir(dir).map_err(|e| Error::reading(dir, e))? {
        let path = entry.map_err(|e| Error::reading(dir, e))?.path();
        if path.is_dir() {
            out.push(path);
        }
    }
    out.sort();
    Ok(out)
}

/// The drives in a unit's folder.
///
/// # Errors
/// A folder without drives; a drive that cannot be read or gives no attitude.
pub(super) fn drives(
    (number, dir): (u32, &Path),
    unit: &Unit,
    inputs: &Inputs,
) -> Result<Vec<Drive>, Error> {
    let assumptions = Assumptions::of(unit);
    let drives = folders(dir)?;
    let headers: Vec<PathBuf> = drives.iter().map(|drive| drive.join(HEADER)).collect();
    let headers = headers.into_iter().filter(|header| header.is_file());
    let all: Result<Vec<Drive>, Error> = headers
        .map(|header| {
            let session = session(&header, unit, &assumptions)?;
            let drive = Drive::of(number, &session, &assumptions, inputs);
            drive.ok_or_else(|| useless(&header))
        })
        .collect();
    let all = all?;
    if all.is_empty() {
        return Err(Error::Option {
            option: format!("--recordings: {}", dir.display()),
            problem: format!("has no drive: no folder in it has a file '{HEADER}'"),
            remedy: "give one folder for each unit, with a folder for each drive inside, as \
                     `host-sim simulate --out UNIT/DRIVE` writes it"
                .into(),
        });
    }
    Ok(all)
}

fn session(header: &Path, unit: &Unit, assumptions: &Assumptions) -> Result<Session, Error> {
    let record = generic::read_with_truth(header, &[], None)?;
    let wishes = Wishes::of(unit, &record, ATTITUDE, None);
    let Started { session, begin, .. } = start(record.prepare()?, &wishes, assumptions, header)?;
    let beside = header.with_file_name(TEMPERATURE);
    let readings = match beside.is_file() {
        true => Some(readings(&beside, begin, session.epochs())?),
        false => session.readings.clone(),
    };
    Ok(Session {
        readings,
        ..session
    })
}

/// The last reading at the end of each second from `begin` on, of a file as `simulate` writes it.
///
/// # Errors
/// The file cannot be read or has no readings; a line has no four numbers.
pub fn readings(file: &Path, begin: f64, epochs: usize) -> Result<Vec<Readings>, Error> {
    let bytes = read::read(file)?;
    let text = String::from_utf8_lossy(&bytes);
    let mut rows = Vec::new();
    for (number, line) in text.lines().enumerate().skip(1) {
        let values: Result<Vec<f64>, _> = line.split(',').map(|x| x.trim().parse()).collect();
        match values.as_deref() {
            Ok([t, x, y, z, ..]) => rows.push((*t, Vector3::new(*x, *y, *z))),
            _ => {
                return Err(Error::Value {
                    file: file.to_path_buf(),
                    line: number + 1,
                    field: "t_s, x_degc, y_degc, z_degc".into(),
                    text: line.chars().take(40).collect(),
                    fault: "not four numbers",
                    remedy: "give a time in s and three temperatures in degrees C".into(),
                });
            }
        }
    }
    let Some((_, first)) = rows.first().copied() else {
        return Err(Error::Empty {
            file: file.to_path_buf(),
            found: "has no reading",
            expected: "lines of t_s,x_degc,y_degc,z_degc,processor_degc".into(),
        });
    };
    let of = |k: usize| {
        let end = begin + (k + 1) as f64 + 1e-6;
        let until = rows.partition_point(|(t, _)| *t <= end);
        let at = until.checked_sub(1).and_then(|last| rows.get(last));
        Readings {
            axes: at.map_or(first, |(_, axes)| *axes),
            processor: 0.0,
        }
    };
    Ok((0..epochs).map(of).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_without_drives_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let unit = dir.path().join("unit-7");
        std::fs::create_dir_all(unit.join("monday")).unwrap();
        let inputs = firmware::inputs::OWN;
        let found = drives((0, &unit), &Unit::default(), &inputs);
        let error = found.unwrap_err().to_string();
        assert!(
            error.contains("unit-7") && error.contains("header.toml"),
            "{error}"
        );
        let missing = dir.path().join("nowhere");
        let error = folders(&missing).unwrap_err().to_string();
        assert!(error.contains("nowhere"), "{error}");
    }

    #[test]
    fn readings_are_taken_at_the_end_of_their_seconds() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join(TEMPERATURE);
        let text = "t_s,x_degc,y_degc,z_degc,processor_degc\n1,20,21,22,30\n2,23,24,25,30\n";
        std::fs::write(&file, text).unwrap();
        let got = readings(&file, 0.0, 3).unwrap();
        assert_eq!(
            got.iter().map(|r| r.axes.x).collect::<Vec<_>>(),
            [20.0, 23.0, 23.0]
        );
        assert_eq!(readings(&file, 1.0, 1).unwrap()[0].axes.z, 25.0);
        std::fs::write(&file, "t_s,x_degc\n1,warm\n").unwrap();
        let error = readings(&file, 0.0, 1).unwrap_err().to_string();
        assert!(error.contains(":2:") && error.contains("1,warm"), "{error}");
    }
}
