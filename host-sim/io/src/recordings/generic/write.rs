//! Writes recordings as CSV files: `imu.csv`, `gnss.csv`, and the `header.toml` that describes
//! them. Numbers read back to the same bits.

use crate::output::{CsvWriter, write_atomic};
use crate::recordings::columns::{IMU, POSITION, SIGMA, SIGMA_V, VELOCITY};
use crate::recordings::record::Record;
use crate::recordings::session::InitialAttitude;
use host_core::error::Error;
use host_core::inertial::rotation::to_euler;
use host_core::inertial::session::{EPOCH_S, Readings, Session};
use host_core::inertial::sins::Increment;
use host_core::inertial::units::DEG;
use host_unit::Unit;
use std::path::Path;

/// Name of the unit's file.
const UNIT: &str = "unit.toml";
/// First comment of that file.
pub const UNIT_BESIDE: &str = "The unit of the recording beside it";
const ATTITUDE: [&str; 3] = ["roll_deg", "pitch_deg", "heading_deg"];

/// Writes the files of a record into `dir`: increments in forward-right-down with the time of their
/// end, fixes if there are at least two, and the unit, to which the header refers.
///
/// # Errors
/// [`Error::Unwritable`]. Each file appears whole or not at all.
pub fn write(record: &Record, unit: Option<&Unit>, dir: &Path) -> Result<(), Error> {
    let row = |(t, i): (f64, Increment)| {
        let (g, a) = (&i.dtheta, &i.dv);
        vec![t, g.x, g.y, g.z, a.x, a.y, a.z]
    };
    rows(
        &dir.join("imu.csv"),
        &IMU,
        record.written_increments().map(row),
    )?;
    record.check()?;
    if record.fixes.len() > 1 {
        write_fixes(record, &dir.join("gnss.csv"))?;
    }
    if !record.wheels.is_empty() {
        let speeds = record.wheels.iter().map(|of| of.to_vec());
        rows(&dir.join("wheels.csv"), &["t_s", "speed_mps"], speeds)?;
    }
    let mut text = header(record);
    if let Some(unit) = unit {
        write_atomic(&dir.join(UNIT), unit.to_text(UNIT_BESIDE)?.as_bytes())?;
        text = format!("unit = \"{UNIT}\"\n\n{text}");
    }
    write_atomic(&dir.join("header.toml"), text.as_bytes())
}

/// Writes the fixes. A value that a fix lacks is an empty cell, as is its standard deviation.
fn write_fixes(record: &Record, file: &Path) -> Result<(), Error> {
    let velocity = has_velocities(record);
    let columns: Vec<&str> = match velocity {
        true => [&POSITION[..], &VELOCITY, &SIGMA, &SIGMA_V].concat(),
        false => [&POSITION[..], &SIGMA].concat(),
    };
    let mut csv = CsvWriter::create(file, &columns)?;
    for f in &record.fixes {
        let has = |k: usize| f.has(k..k + 1);
        let position = [f.lat_deg, f.lon_deg, f.height_m];
        let values = |from: [f64; 3], first: usize| {
            let all = from.into_iter().enumerate();
            all.map(move |(k, x)| Some(x).filter(|_| has(first + k)))
        };
        let sigmas =
            [0, 3].map(|first| [f.sigmas[first], f.sigmas[first + 1], f.sigmas[first + 2]]);
        let mut row = vec![Some(f.time)];
        row.extend(values(position, 0));
        row.extend(values(f.velocity, 3).filter(|_| velocity));
        row.extend(values(sigmas[0], 0));
        row.extend(values(sigmas[1], 3).filter(|_| velocity));
        csv.cells(row.into_iter())?;
    }
    csv.finish()
}

/// Whether any fix has a part of a velocity.
fn has_velocities(record: &Record) -> bool {
    record.fixes.iter().any(|f| (3..6).any(|k| f.has(k..k + 1)))
}

/// Writes the reference states of a session, one per second.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn write_truth(session: &Session, file: &Path) -> Result<(), Error> {
    let row = |(k, s): (usize, &host_core::inertial::sins::NavState)| {
        let (p, v) = (&s.position, &s.velocity);
        let (roll, pitch, heading) = to_euler(&s.q_bn);
        let mut row = vec![k as f64 * EPOCH_S, p.lat / DEG, p.lon / DEG, p.h];
        row.extend([v.x, v.y, v.z, roll / DEG, pitch / DEG, heading / DEG]);
        row
    };
    let columns = [&POSITION[..], &VELOCITY, &ATTITUDE].concat();
    rows(
        file,
        &columns,
        session.reference.iter().enumerate().map(row),
    )
}

/// Writes the thermometer readings of a session, degrees Celsius, one row per second. The time is
/// the end of the second.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn write_readings(session: &Session, file: &Path) -> Result<(), Error> {
    let readings = session.readings.as_deref().unwrap_or_default();
    let row = |(k, of): (usize, &Readings)| {
        let time = (k + 1) as f64 * EPOCH_S;
        vec![time, of.axes.x, of.axes.y, of.axes.z, of.processor]
    };
    let columns = ["t_s", "x_degc", "y_degc", "z_degc", "processor_degc"];
    rows(file, &columns, readings.iter().enumerate().map(row))
}

fn rows(file: &Path, columns: &[&str], rows: impl Iterator<Item = Vec<f64>>) -> Result<(), Error> {
    let mut csv = CsvWriter::create(file, columns)?;
    for row in rows {
        csv.row(&row)?;
    }
    csv.finish()
}

/// The header file for what [`write()`] writes.
fn header(record: &Record) -> String {
    let names = |n: &[&str]| format!("[\"{}\"]", n.join("\", \""));
    let mut text = format!(
        r#"[imu]
file = "imu.csv"
time = {{ column = "t_s", unit = "s" }}
gyro = {{ columns = {}, unit = "rad" }}
accel = {{ columns = {}, unit = "m/s" }}
axes = "x y z"
"#,
        names(&IMU[1..4]),
        names(&IMU[4..])
    );
    if record.fixes.len() > 1 {
        text += r#"
[gnss]
file = "gnss.csv"
time = { column = "t_s", unit = "s" }
latitude = { column = "lat_deg", unit = "deg" }
longitude = { column = "lon_deg", unit = "deg" }
height = { column = "height_m", unit = "m" }
"#;
        if let Some(arm) = record.lever_arm_m {
            text += &format!("lever_arm_m = {arm:?}\n");
        }
        if record.estimates_offset {
            text += "time_offset_s = \"estimate\"\n";
        }
        text += &format!("position_sigma = {}\n", names(&SIGMA));
        if has_velocities(record) {
            let (velocity, sigma) = (names(&VELOCITY), names(&SIGMA_V));
            text += &format!(
                r#"velocity = {{ columns = {velocity}, unit = "m/s", order = "ned" }}
velocity_sigma = {sigma}
"#
            );
        }
    }
    if !record.wheels.is_empty() {
        text += r#"
[wheels]
file = "wheels.csv"
time = { column = "t_s", unit = "s" }
speed = { column = "speed_mps", unit = "m/s" }
"#;
    }
    text += "\n[start]\n";
    text += &match (record.initial_attitude, record.rough_heading) {
        (Some(InitialAttitude::Standstill(s)), _) => format!("standstill_s = {s}\n"),
        (Some(InitialAttitude::Known(q)), _) => {
            let (roll, pitch, heading) = to_euler(&q);
            let [roll, pitch, heading] = [roll, pitch, heading].map(|a| a / DEG);
            format!("roll_deg = {roll}\npitch_deg = {pitch}\nheading_deg = {heading}\n")
        }
        (None, Some(rough)) => {
            let [heading, sigma] = rough.map(|a| a / DEG);
            format!("heading_deg = {heading}\nheading_sigma_deg = {sigma}\n")
        }
        (None, None) => "# the attitude is found in motion; else standstill_s, or roll_deg, \
                         pitch_deg and heading_deg at the first fix\n"
            .to_owned(),
    };
    if let [site] = record.fixes[..] {
        text += &format!(
            "latitude_deg = {}\nlongitude_deg = {}\nheight_m = {}\n",
            site.lat_deg, site.lon_deg, site.height_m
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::read;
    use super::*;
    use crate::recordings::kfgins;
    use crate::recordings::record::{Kind, NOT_MEASURED, TimedFix};
    use host_core::inertial::sins::Increment;
    use nalgebra::Vector3;

    fn record(velocity: bool) -> Record {
        let fix = |k: usize| TimedFix {
            time: 1000.3 + k as f64,
            lat_deg: 45.123_456_789_012_3 + 1e-5 * k as f64,
            lon_deg: -7.0 / 3.0,
            height_m: 100.1,
            velocity: [1.0 / 3.0, k as f64, -0.1],
            sigmas: if velocity {
                [1.1, 2.0, 3.0, 0.1, 0.2, 0.3]
            } else {
                [1.1, 2.0, 3.0, NOT_MEASURED, NOT_MEASURED, NOT_MEASURED]
            },
        };
        let increment = |k: usize| Increment {
            dtheta: Vector3::new(1e-7 / 3.0, -1e-3 * (k as f64).sin(), 0.0),
            dv: Vector3::new(0.1 / 7.0, k as f64 * 1e-5, -0.0981),
        };
        Record {
            file: "made".into(),
            time: (1..=500).map(|k| 1000.0 + 0.01 * f64::from(k)).collect(),
            samples: (1..=500).map(increment).collect(),
            kind: Kind::Increment,
            rate_hz: 100,
            fixes: (0..4).map(fix).collect(),
            initial_attitude: Some(InitialAttitude::Standstill(100)),
            ..Record::default()
        }
    }

    /// From CSV to KF-GINS and back: no bit changes.
    #[test]
    fn conversions_both_ways_are_exact() {
        for velocity in [true, false] {
            let dir = tempfile::tempdir().unwrap();
            let path = |name: &str| dir.path().join(name);
            let first = record(velocity);
            write(&first, None, dir.path()).unwrap();
            let csv = read(&path("header.toml"), &[]).unwrap();
            let form = kfgins::Form {
                shift_s: 0.0,
                velocity,
            };
            kfgins::write(&csv, form, &path("i.txt"), &path("g.txt")).unwrap();
            let text = kfgins::read(&path("i.txt"), &path("g.txt"), csv.initial_attitude).unwrap();
            std::fs::create_dir(path("again")).unwrap();
            write(&text, None, &path("again")).unwrap();
            for name in ["imu.csv", "gnss.csv", "header.toml"] {
                let [a, b] =
                    [path(name), path("again").join(name)].map(|p| std::fs::read(p).unwrap());
                assert!(a == b, "{name}");
            }
            assert_eq!(text.fixes.len(), first.fixes.len());
            assert!(text.fixes[3].lat_deg == first.fixes[3].lat_deg);
        }
    }

    /// A fix may lack any of its values; what it has comes back, and nothing else.
    #[test]
    fn a_value_that_a_fix_lacks_is_an_empty_cell() {
        let dir = tempfile::tempdir().unwrap();
        let mut first = record(true);
        first.fixes = (0..8)
            .map(|k| TimedFix {
                time: 1000.3 + f64::from(k),
                ..first.fixes[0]
            })
            .collect();
        for k in 0..6 {
            first.fixes[k + 1].sigmas[k] = NOT_MEASURED;
        }
        first.fixes[1].sigmas[1] = NOT_MEASURED; // latitude and longitude go together
        first.fixes[2].sigmas[0] = NOT_MEASURED;
        first.fixes[7].sigmas[3..].fill(NOT_MEASURED);
        write(&first, None, dir.path()).unwrap();
        let back = read(&dir.path().join("header.toml"), &[]).unwrap();
        assert_eq!(back.fixes.len(), 8);
        for (back, first) in back.fixes.iter().zip(&first.fixes) {
            assert_eq!(back.sigmas, first.sigmas);
            let values = |f: &TimedFix| {
                let [n, e, d] = f.velocity;
                let all = [f.lat_deg, f.lon_deg, f.height_m, n, e, d];
                std::array::from_fn::<_, 6, _>(|k| if f.has(k..k + 1) { all[k] } else { 0.0 })
            };
            assert_eq!(values(back), values(first));
        }
        let text = std::fs::read_to_string(dir.path().join("gnss.csv")).unwrap();
        assert!(
            text.lines()
                .nth(8)
                .unwrap()
                .contains(",100.1,,,,1.1,2.0,3.0,,,"),
            "{text}"
        );
        // KF-GINS has no empty cells: whole fixes are written, and counted
        let path = |name: &str| dir.path().join(name);
        for (velocity, count) in [(false, 5), (true, 1)] {
            let form = kfgins::Form {
                shift_s: 0.0,
                velocity,
            };
            let written = kfgins::write(&first, form, &path("i.txt"), &path("g.txt")).unwrap();
            let lines = std::fs::read_to_string(path("g.txt"))
                .unwrap()
                .lines()
                .count();
            assert_eq!((written, lines), (count, count));
        }
    }

    #[test]
    fn the_header_refers_to_the_unit_beside_it() {
        let dir = tempfile::tempdir().unwrap();
        let header = dir.path().join("header.toml");
        write(&record(true), None, dir.path()).unwrap();
        assert_eq!(super::super::unit(&header).unwrap(), None);
        let unit = Unit::preset("tactical").unwrap();
        write(&record(true), Some(&unit), dir.path()).unwrap();
        assert_eq!(super::super::unit(&header).unwrap(), Some(unit));
        read(&header, &[]).unwrap();
        let spoilt = dir.path().join(UNIT);
        let text = std::fs::read_to_string(&spoilt).unwrap();
        std::fs::write(&spoilt, text.replace("[accel]", "[axel]")).unwrap();
        let error = super::super::unit(&header).unwrap_err().to_string();
        assert!(
            error.contains("unit.toml:") && error.contains("'axel'"),
            "{error}"
        );
    }

    #[test]
    fn the_header_states_lever_arm_offset_and_rough_heading() {
        let dir = tempfile::tempdir().unwrap();
        let header = dir.path().join("header.toml");
        let degree = std::f64::consts::PI / 180.0;
        for (arm, estimates) in [
            (None, true),
            (Some([0.0; 3]), false),
            (Some([2.0, -1.0, -1.5]), true),
        ] {
            let first = Record {
                lever_arm_m: arm,
                estimates_offset: estimates,
                initial_attitude: None,
                rough_heading: Some([40.0 * degree, 5.0 * degree]),
                ..record(true)
            };
            write(&first, None, dir.path()).unwrap();
            let back = read(&header, &[]).unwrap();
            assert_eq!((back.lever_arm_m, back.estimates_offset), (arm, estimates));
            let [heading, sigma] = back.rough_heading.unwrap();
            assert!(
                (heading - 40.0 * degree).abs() < 1e-12 && (sigma - 5.0 * degree).abs() < 1e-12
            );
        }
    }

    #[test]
    fn a_vehicle_at_rest_has_a_site_and_no_file_of_fixes() {
        let dir = tempfile::tempdir().unwrap();
        let mut r = record(true);
        r.fixes.truncate(1);
        write(&r, None, dir.path()).unwrap();
        let back = read(&dir.path().join("header.toml"), &[]).unwrap();
        assert_eq!(
            (back.fixes.len(), back.fixes[0].lat_deg),
            (1, r.fixes[0].lat_deg)
        );
        assert!(!dir.path().join("gnss.csv").exists());
    }
}
