//! The text files of KF-GINS (i2Nav, Wuhan University): IMU increments and GNSS positions, columns between blanks, no line of names.
//!
//! ```text
//! IMU   second of week | dtheta x, y, z, rad | dv x, y, z, m/s       body axes forward-right-down; time is the end of the interval
//! GNSS  second of week | latitude, longitude, deg | height, m | standard deviations north, east, down, m
//! ```
//!
//! There is no velocity in the GNSS file: the session's comes from the positions and its standard deviation says that it was not
//! measured. Counts are of [`super::words::FINE`] value. A week's end within a recording is not handled: time then runs backwards, which
//! is refused.

use super::build::{Begin, MOST_GAP_S, NOT_MEASURED, Parts, build};
use super::input::{Layout, Separator, Source, Table};
use super::track::Track;
use super::words::Running;
use crate::earth::Geodetic;
use crate::error::Error;
use crate::output::write_atomic;
use crate::session::{EPOCH_S, Session};
use crate::sins::{Increment, NavState};
use crate::units::DEG;
use nalgebra::{UnitQuaternion, Vector3};
use std::fmt::Write;
use std::path::Path;

const IMU: [&str; 7] = [
    "time_s",
    "dtheta_x_rad",
    "dtheta_y_rad",
    "dtheta_z_rad",
    "dv_x_mps",
    "dv_y_mps",
    "dv_z_mps",
];
const GNSS: [&str; 7] = [
    "time_s",
    "lat_deg",
    "lon_deg",
    "height_m",
    "sigma_north_m",
    "sigma_east_m",
    "sigma_down_m",
];

/// Reads the pair of files.
///
/// # Errors
/// Any fault of the files, with line and column.
pub fn read(imu: &Path, gnss: &Path, begin: Begin) -> Result<Session, Error> {
    let table = table(imu, &IMU)?;
    table.check_within(1..4, 2.0, "give angle increments in rad")?;
    table.check_within(4..7, 20.0, "give velocity increments in m/s")?;
    let time: Vec<f64> = table.rows().map(|r| r[0]).collect();
    let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    let step = steps.get(steps.len() / 2).copied().unwrap_or(f64::NAN);
    let rate_hz = (1.0 / step).round();
    if !(4.0..=8000.0).contains(&rate_hz) {
        return Err(table.complain(
            table.len() - 1,
            0,
            "not one of 4 to 8000 samples a second",
            "give times in s",
        ));
    }
    if let Some(k) = (1..time.len()).find(|&k| time[k] - time[k - 1] > 1.5 * step) {
        return Err(table.complain(k, 0, "after a gap", "cut the recording there"));
    }
    let words: Vec<Increment> = table.rows().map(increment).collect();
    let (fixes, sigmas) = fixes(gnss)?;
    let running = Running::of_increments(&time, &words, step);
    build(&Parts {
        file: imu.to_path_buf(),
        running,
        rate_hz: rate_hz as usize,
        fixes,
        sigmas,
        begin,
    })
}

/// Writes a session as the pair of files, from `second` of the week on, each whole or not at all. Fixes become the GNSS file.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn write(session: &Session, second: f64, imu: &Path, gnss: &Path) -> Result<(), Error> {
    let mut text = String::new();
    for (k, w) in session.increments().iter().enumerate() {
        let t = second + (k + 1) as f64 * session.dt;
        let (g, a) = (&w.dtheta, &w.dv);
        // writing to a string cannot fail
        let _ = writeln!(
            text,
            "{t:.6} {:.12e} {:.12e} {:.12e} {:.12e} {:.12e} {:.12e}",
            g.x, g.y, g.z, a.x, a.y, a.z
        );
    }
    let mut fixes = String::new();
    let [n, e, d, ..] = session.sigmas;
    for (k, fix) in session.fixes.iter().enumerate() {
        let (t, p) = (second + k as f64 * EPOCH_S, &fix.position);
        let _ = writeln!(
            fixes,
            "{t:.6} {:.12} {:.12} {:.4} {n:.3} {e:.3} {d:.3}",
            p.lat / DEG,
            p.lon / DEG,
            p.h
        );
    }
    write_atomic(imu, text.as_bytes())?;
    write_atomic(gnss, fixes.as_bytes())
}

fn table(file: &Path, names: &[&str]) -> Result<Table, Error> {
    let names: Vec<String> = names.iter().map(ToString::to_string).collect();
    let wanted: Vec<usize> = (0..names.len()).collect();
    let layout = Layout {
        separator: Separator::Blank,
        skip: 0,
        names: &names,
        wanted: &wanted,
        gaps: false,
    };
    let table = Table::read(&Source::open(file)?, &layout)?;
    table.check_rising(0)?;
    Ok(table)
}

fn increment(row: &[f64]) -> Increment {
    Increment {
        dtheta: Vector3::new(row[1], row[2], row[3]),
        dv: Vector3::new(row[4], row[5], row[6]),
    }
}

/// Positions, and the medians of their standard deviations.
fn fixes(file: &Path) -> Result<(Track, [f64; 6]), Error> {
    let table = table(file, &GNSS)?;
    table.check_within(1..2, 89.9, "give a latitude in degrees, not at a pole")?;
    table.check_within(2..3, 360.0, "give a longitude in degrees")?;
    table.check_within(3..4, 20_000.0, "give a height in m")?;
    let mut sigmas = [NOT_MEASURED; 6];
    for (axis, sigma) in sigmas.iter_mut().take(3).enumerate() {
        let mut all: Vec<f64> = table.rows().map(|r| r[4 + axis]).collect();
        if let Some(k) = all.iter().position(|s| *s <= 0.0) {
            return Err(table.complain(
                k,
                4 + axis,
                "no standard deviation",
                "give a number above 0, in m",
            ));
        }
        all.sort_by(f64::total_cmp);
        *sigma = all[all.len() / 2];
    }
    let time: Vec<f64> = table.rows().map(|r| r[0]).collect();
    if let Some(k) = (1..time.len()).find(|&k| time[k] - time[k - 1] > MOST_GAP_S) {
        return Err(table.complain(
            k,
            0,
            "after a gap of more than 2.5 s",
            "cut the recording there",
        ));
    }
    let state = |r: &[f64]| NavState {
        position: Geodetic {
            lat: r[1] * DEG,
            lon: r[2] * DEG,
            h: r[3],
        },
        velocity: Vector3::zeros(),
        q_bn: UnitQuaternion::identity(),
    };
    let mut track = Track::new(time, table.rows().map(state).collect());
    track.differentiate();
    Ok((track, sigmas))
}

#[cfg(test)]
mod tests {
    use super::super::input::tests::message;
    use super::*;
    use crate::gnss::GnssSpec;
    use crate::imu::ImuSpec;
    use crate::session::{SessionConfig, simulate};

    fn simulated() -> Session {
        let imu = ImuSpec::preset("medium").unwrap();
        let config = SessionConfig {
            imu: &imu,
            gnss: &GnssSpec::default(),
            start: Geodetic {
                lat: 0.6,
                lon: 1.9,
                h: 100.0,
            },
            heading: 1.0,
            standstill_s: 100.0,
            drive_s: 120.0,
            segments: None,
            vibration: 1.0,
            unit: 1,
            turn_on: 2,
            drive: 3,
        };
        simulate(&config).0
    }

    #[test]
    fn a_session_written_and_read_is_the_same_motion() {
        let dir = tempfile::tempdir().unwrap();
        let (imu, gnss) = (dir.path().join("imu.txt"), dir.path().join("gnss.txt"));
        let session = simulated();
        write(&session, 345_600.0, &imu, &gnss).unwrap();
        let back = read(&imu, &gnss, Begin::Standstill(100)).unwrap();
        assert_eq!((back.epochs(), back.standstill), (session.epochs(), 100));
        assert_eq!(back.sigmas, [1.0, 1.0, 1.5, 1e3, 1e3, 1e3]);
        let sum = |s: &Session, n: usize| {
            s.increments()[..n]
                .iter()
                .fold([Vector3::zeros(); 2], |a, w| [a[0] + w.dtheta, a[1] + w.dv])
        };
        for n in [1, 12_345, back.counts.len()] {
            let ([g, a], [g_back, a_back]) = (sum(&session, n), sum(&back, n));
            // half a fine count, and time stamps of 345 600 s that carry 3e-11 s of rounding
            assert!(
                (g - g_back).norm() < 2e-9 && (a - a_back).norm() < 2e-8,
                "{n}"
            );
        }
        for (f, b) in session.fixes.iter().zip(&back.fixes) {
            assert!(f.position.ned_from(&b.position).norm() < 1e-3);
        }
        let moved = (session.fixes[200].velocity - back.fixes[200].velocity).norm();
        assert!(moved < 6.0, "{moved}"); // positions of 1 m over 2 s
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2);
    }

    fn complaint(imu: &str, gnss: &str) -> String {
        let dir = tempfile::tempdir().unwrap();
        let (i, g) = (dir.path().join("in.imu"), dir.path().join("in.gnss"));
        std::fs::write(&i, imu).unwrap();
        std::fs::write(&g, gnss).unwrap();
        message(&read(&i, &g, Begin::Attitude(UnitQuaternion::identity())).unwrap_err())
    }

    #[test]
    fn every_fault_names_its_place() {
        let imu = |k: usize| format!("{:.2} 0 0 0 0 0 -0.0981\n", 100.0 + 0.01 * k as f64);
        let gnss = |k: usize| format!("{} 45 7 80 1 1 2\n", 100 + k);
        let (imus, fixes): (String, String) =
            ((0..300).map(imu).collect(), (0..4).map(gnss).collect());
        let cases = [
            (
                imus.replace("100.05 0 0", "100.05 0 z"),
                fixes.clone(),
                "in.imu:6: column 'dtheta_y_rad': 'z' is not a number",
            ),
            (
                imus.replace("100.05 0 0", "100.05 9 0"),
                fixes.clone(),
                "in.imu:6: column 'dtheta_x_rad': '9' is out of range",
            ),
            (
                imus.replace("100.05 0 0", "100.05 0"),
                fixes.clone(),
                "in.imu:6: 6 columns where the header names 7",
            ),
            (
                imus.replace("100.05 0 0", "100.04 0 0"),
                fixes.clone(),
                "in.imu:6: column 'time_s': time 100.04 follows",
            ),
            (
                imus.replace(&imu(5), ""),
                fixes.clone(),
                "in.imu:6: column 'time_s': '100.06' is after a gap",
            ),
            (
                imu(0),
                fixes.clone(),
                "in.imu:1: column 'time_s': '100' is not one of 4 to 8000",
            ),
            (String::new(), fixes.clone(), "in.imu: is empty"),
            (
                imus.clone(),
                fixes.replace("102 45", "102 95"),
                "in.gnss:3: column 'lat_deg': '95' is out of range",
            ),
            (
                imus.clone(),
                fixes.replace("1 1 2", "1 0 2"),
                "in.gnss:1: column 'sigma_east_m': '0' is no standard deviation",
            ),
            (
                imus.clone(),
                fixes.replace("103 ", "109 "),
                "in.gnss:4: column 'time_s': '109' is after a gap",
            ),
            (
                imus.clone(),
                fixes.replace("10", "20"),
                "in.imu: 'time' has no whole second",
            ),
        ];
        for (i, g, start) in cases {
            let why = complaint(&i, &g);
            assert!(why.starts_with(start), "{why}");
        }
    }
}
