//! Raw increments of a MEMS IMU and the solution of a FOG navigator on the same moving vehicle.
//! This is the situation of the paper: a good navigator teaches a poor one.
//!
//! The two files are `data/transfer_align_fog_mems.mat` of asenlinmu/psins in CSV form. Their
//! licence keeps them out of this repository. MEMS axes are right-forward-up, and the time of an
//! increment is the end of its interval. The FOG navigator gives attitude as pitch, roll, and yaw
//! counter-clockwise from north, and velocity as east-north-up. The session begins at the first FOG
//! sample, so every epoch coincides with one.

use crate::recordings::session::referenced;
use crate::recordings::table::Table;
use host_core::error::Error;
use host_core::inertial::axes::Axes;
use host_core::inertial::counts::{FINE_LSB, quantise};
use host_core::inertial::earth::Geodetic;
use host_core::inertial::rotation::from_euler;
use host_core::inertial::session::{EPOCH_S, Session};
use host_core::inertial::sins::{Increment, NavState};
use nalgebra::Vector3;
use std::path::Path;

/// First line of the file of MEMS increments.
pub const MEMS_HEADER: &str = "time_s,dtheta_right_rad,dtheta_forward_rad,dtheta_up_rad,\
    dv_right_mps,dv_forward_mps,dv_up_mps";
/// First line of the file of the FOG solution.
const FOG_HEADER: &str =
    "time_s,pitch_rad,roll_rad,yaw_ccw_rad,ve_mps,vn_mps,vu_mps,lat_rad,lon_rad,height_m";

/// Sample period, s.
const DT: f64 = 0.01;
/// FOG samples per second.
const FOG_PER_S: usize = 10;
/// Largest error of a time stamp, s.
const JITTER: f64 = 1e-3;
/// Standard deviations of the FOG solution as fixes (assumed): m, then m/s. The solution is smooth,
/// so what counts is the error of its differences, not the absolute error.
pub const SIGMAS: [f64; 6] = [0.1, 0.1, 0.1, 0.02, 0.02, 0.02];

/// Reads the two files into a session. Counts are of [`FINE_LSB`] value.
///
/// # Errors
/// Any fault of the files, with line and column.
pub fn session(mems: &Path, fog: &Path) -> Result<Session, Error> {
    let fog = Table::with_header(fog, FOG_HEADER)?;
    check_fog(&fog)?;
    let mems = Table::with_header(mems, MEMS_HEADER)?;
    check_steps(&mems, DT)?;
    mems.check_within(1..7, 2.0, "give increments of 10 ms in rad and m/s")?;
    let start = fog.row(0)[0];
    let first = mems
        .rows()
        .position(|r| r[0] > start + 0.5 * DT)
        .unwrap_or(mems.count());
    let lead = mems.row(first.min(mems.count() - 1))[0] - DT - start;
    if lead.abs() > JITTER {
        return Err(mems.complain(
            0,
            0,
            "not at the FOG's first sample",
            "give the two files of one recording",
        ));
    }
    let states: Vec<NavState> = fog.rows().step_by(FOG_PER_S).map(state).collect();
    let per_epoch = (EPOCH_S / DT).round() as usize;
    let epochs = ((mems.count() - first) / per_epoch).min(states.len() - 1);
    if epochs == 0 {
        return Err(mems.complain(
            mems.count() - 1,
            0,
            "too early an end",
            "give at least 2 s that both files cover",
        ));
    }
    let increments: Vec<Increment> = mems
        .rows()
        .skip(first)
        .take(epochs * per_epoch)
        .map(increment)
        .collect();
    let counts = quantise(&increments, &FINE_LSB).map_err(|k| {
        mems.complain(
            first + k,
            1,
            "out of range",
            "give increments of 10 ms in rad and m/s",
        )
    })?;
    let reference = states[..=epochs].to_vec();
    Ok(referenced(DT, (counts, FINE_LSB), reference, SIGMAS))
}

fn check_fog(fog: &Table) -> Result<(), Error> {
    check_steps(fog, EPOCH_S / FOG_PER_S as f64)?;
    fog.check_within(1..4, 7.0, "give angles in rad")?;
    fog.check_within(4..7, 300.0, "give velocities in m/s")?;
    fog.check_within(7..8, 1.5, "give a latitude in rad, not at a pole")?;
    fog.check_within(8..9, 7.0, "give a longitude in rad")?;
    fog.check_within(9..10, 20_000.0, "give a height in m")
}

/// Checks that time rises by `step` on every line.
fn check_steps(table: &Table, step: f64) -> Result<(), Error> {
    table.check_rising(0)?;
    for i in 1..table.count() {
        if (table.row(i)[0] - table.row(i - 1)[0] - step).abs() > JITTER {
            return Err(table.complain(i, 0, "a gap", "give a recording without gaps"));
        }
    }
    Ok(())
}

fn increment(row: &[f64]) -> Increment {
    let axes = Axes::RIGHT_FORWARD_UP;
    Increment {
        dtheta: axes.turn([row[1], row[2], row[3]]),
        dv: axes.turn([row[4], row[5], row[6]]),
    }
}

fn state(row: &[f64]) -> NavState {
    let (pitch, roll, yaw) = (row[1], row[2], row[3]);
    NavState {
        position: Geodetic {
            lat: row[7],
            lon: row[8],
            h: row[9],
        },
        velocity: Vector3::new(row[5], row[4], -row[6]),
        q_bn: from_euler(roll, pitch, -yaw),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::inertial::free_inertial::from_reference;
    use host_core::inertial::units::DEG;
    use test_bench::recordings::{data_dir, file, fog_mems as recorded, message};

    #[test]
    fn free_inertial_error_is_as_documented() {
        let Some(session) = recorded() else { return };
        assert_eq!(session.epochs(), 99);
        let errors = from_reference(&session);
        let got = [10, 30, 60, 95].map(|t: usize| errors.position[t].xy().norm());
        println!("{got:.1?} m at 10, 30, 60, 95 s");
        for (got, want) in got.iter().zip([2.8, 47.0, 400.0, 1640.0]) {
            assert!((got / want - 1.0).abs() < 0.05, "{got} {want}");
        }
    }

    /// The generic loader shares little with this one. Given what the columns are, it must give the
    /// same session.
    #[test]
    fn the_generic_loader_agrees() {
        let Some(session) = recorded() else { return };
        let dir = data_dir().unwrap().canonicalize().unwrap();
        let (roll, pitch, heading) =
            host_core::inertial::rotation::to_euler(&session.reference[0].q_bn);
        let header = format!(
            r#"
            [imu]
            file = "{0}/fog-mems-mems.csv.gz"
            time = {{ column = "time_s", unit = "s" }}
            gyro = {{ columns = ["dtheta_right_rad", "dtheta_forward_rad", "dtheta_up_rad"], unit = "rad" }}
            accel = {{ columns = ["dv_right_mps", "dv_forward_mps", "dv_up_mps"], unit = "m/s" }}
            axes = "y x -z"
            [gnss]
            file = "{0}/fog-mems-fog.csv.gz"
            time = {{ column = "time_s", unit = "s" }}
            latitude = {{ column = "lat_rad", unit = "rad" }}
            longitude = {{ column = "lon_rad", unit = "rad" }}
            height = {{ column = "height_m", unit = "m" }}
            velocity = {{ columns = ["ve_mps", "vn_mps", "vu_mps"], unit = "m/s", order = "enu" }}
            [start]
            roll_deg = {1}
            pitch_deg = {2}
            heading_deg = {3}"#,
            dir.display(),
            roll / DEG,
            pitch / DEG,
            heading / DEG
        );
        let (_dir, path) = file("in.toml", header.as_bytes());
        let generic = crate::recordings::generic::read(&path, &[]).unwrap();
        let generic = generic.session().unwrap();
        assert_eq!(
            (generic.epochs(), generic.dt),
            (session.epochs(), session.dt)
        );
        let [a, b] = [&session, &generic].map(|s| from_reference(s).position[95]);
        assert!((a - b).norm() < 0.01, "{a} {b}");
    }

    /// Three seconds north at 10 m/s with a FOG that agrees, with one line of either file changed.
    fn made(mems: Option<(usize, &str)>, fog: Option<(usize, &str)>) -> Result<Session, Error> {
        let line = |k: usize, text: String, change: Option<(usize, &str)>| match change {
            Some((at, other)) if at == k => other.to_owned(),
            _ => text,
        };
        let (mut m, mut f) = (format!("{MEMS_HEADER}\n"), format!("{FOG_HEADER}\n"));
        for k in 0..301 {
            m += &(line(
                k,
                format!("{:.2},0,0,0,0,0,0.0981\n", 0.01 * k as f64),
                mems,
            ));
        }
        for k in 1..31 {
            f += &(line(
                k,
                format!("{:.1},0.01,0.02,0.3,0,10,0,0.6,1.9,170\n", 0.1 * k as f64),
                fog,
            ));
        }
        let (_m, mems) = file("in.mems", m.as_bytes());
        let (_f, fog) = file("in.fog", f.as_bytes());
        super::session(&mems, &fog)
    }

    #[test]
    fn the_session_begins_with_the_fog() {
        let s = made(Some((11, "0.11,1e-4,2e-4,3e-4,1e-3,2e-3,0.1\n")), None).unwrap();
        assert_eq!((s.epochs(), s.counts.len(), s.reference.len()), (2, 200, 3));
        // the first increment ends 10 ms after the first FOG sample
        assert_eq!(s.counts[0].dtheta, [200_000, 100_000, -300_000]);
        assert_eq!(s.counts[0].dv, [200_000, 100_000, -10_000_000]);
        let (roll, pitch, heading) = host_core::inertial::rotation::to_euler(&s.reference[0].q_bn);
        assert!((roll - 0.02).abs() + (pitch - 0.01).abs() + (heading + 0.3).abs() < 1e-12);
        assert_eq!(s.fixes[1].unwrap().velocity, Vector3::new(10.0, 0.0, 0.0));
    }

    #[test]
    fn every_fault_names_its_location() {
        let cases = [
            (
                Some((7, "0.07,0,x,0,0,0,0\n")),
                None,
                "in.mems:9: column 'dtheta_forward_rad': 'x' is not a number",
            ),
            (
                Some((7, "0.07,9,0,0,0,0,0\n")),
                None,
                "in.mems:9: column 'dtheta_right_rad': '9' is out of range",
            ),
            (
                Some((7, "")),
                None,
                "in.mems:9: column 'time_s': '0.08' is a gap",
            ),
            (
                Some((7, "0.06,0,0,0,0,0,0\n")),
                None,
                "in.mems:9: column 'time_s': time 0.06 follows 0.06",
            ),
            (
                None,
                Some((3, "")),
                "in.fog:4: column 'time_s': '0.4' is a gap",
            ),
            (
                None,
                Some((3, "0.3,0,0,0,0,10,0,1.9,0.6,170\n")),
                "in.fog:4: column 'lat_rad': '1.9' is out of range",
            ),
            (
                None,
                Some((3, "0.3,0,0,0,0,10,0,0.6,1.9\n")),
                "in.fog:4: 9 columns",
            ),
        ];
        for (mems, fog, start) in cases {
            let why = message(&made(mems, fog).unwrap_err());
            assert!(why.starts_with(start), "{why}");
        }
    }
}
