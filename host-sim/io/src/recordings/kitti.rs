//! Road drives of KITTI raw, recorded with an OXTS RT3003: angular rate and specific force in
//! forward-left-up, with the solution of the RT3003 as reference.
//!
//! The CSV files come from mkutay/nn-dead-reckoning and are CC BY-NC-SA 3.0, so they stay out of
//! this repository. Positions are east, north, up in metres from the first sample, by the Mercator
//! projection of KITTI's development kit: longitude times `s R`, and `s R ln tan(45 deg +
//! latitude / 2)`, with the sphere `R` = 6378137 m and the scale `s` that is the cosine of the
//! first latitude. That scale is in the files: the integral of the velocities is 1.001 to 1.003
//! times the positions east and 0.998 to 0.999 times those north, which is the ellipsoid against
//! the sphere. They are made latitudes and longitudes again. Attitude is
//! roll, pitch (positive nose down) and yaw counter-clockwise from east. Time stamps are about 10
//! ms apart. When the recorder stalled, a few of them are 60 ms late; these are moved between their
//! neighbours, and all others are used as they are. The remaining accelerations look like noise of
//! the reference, so these drives test mechanisation and loader but say little about learning.

use crate::recordings::increments::MotionIntegral;
use crate::recordings::session::referenced;
use crate::recordings::table::Table;
use crate::recordings::track::Track;
use host_core::error::Error;
use host_core::inertial::axes::Axes;
use host_core::inertial::counts::{FINE_LSB, quantise};
use host_core::inertial::earth::Geodetic;
use host_core::inertial::rotation::from_euler;
use host_core::inertial::session::{EPOCH_S, Session};
use host_core::inertial::sins::{Increment, NavState};
use host_core::inertial::units::DEG;
use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// First line of the files.
pub const HEADER: &str = "time_s,wx_radps,wy_radps,wz_radps,fx_mps2,fy_mps2,fz_mps2,\
    east_m,north_m,up_m,ve_mps,vn_mps,vu_mps,roll_rad,pitch_rad,yaw_ccw_from_east_rad";

/// The drives: number, and how many samples to skip. Drive 0020 begins with a gap of 1.7 s.
pub const DRIVES: [(&str, usize); 4] = [("0020", 2), ("0027", 0), ("0033", 0), ("0034", 0)];

/// Nominal sample period, s.
const DT: f64 = 0.01;
/// A time stamp that departs by more than this from its neighbours is the recorder's fault, s.
const STALLED: f64 = 0.02;
/// Neighbours on either side that a time stamp is compared with.
const NEIGHBOURS: usize = 25;
/// Latitude and longitude, deg, and height, m, of Karlsruhe. The files do not give a more exact
/// position. 0.1 deg of latitude changes gravity by 9 ug.
const HOME: [f64; 3] = [49.0, 8.4, 110.0];
/// Radius of the sphere of the projection, m.
const SPHERE_M: f64 = 6_378_137.0;
/// Standard deviations of the reference as fixes (assumed): m, then m/s.
pub const SIGMAS: [f64; 6] = [0.1, 0.1, 0.2, 0.05, 0.05, 0.05];

/// Reads a drive without its first `skip` samples. Counts are of [`FINE_LSB`] value.
///
/// # Errors
/// Any fault of the file, with line and column.
pub fn session(file: &Path, skip: usize) -> Result<Session, Error> {
    let table = Table::with_header(file, HEADER)?;
    let (rate, force) = ("give rates in rad/s", "give specific force in m/s2");
    table.check_within(1..4, 35.0, rate)?;
    table.check_within(4..7, 1000.0, force)?;
    let stamps: Vec<f64> = table.rows().skip(skip).map(|r| r[0]).collect();
    let time = straightened(&stamps);
    if let Some(k) = (1..time.len()).find(|&k| !(1e-4..5.0 * DT).contains(&(time[k] - time[k - 1])))
    {
        let remedy = "give samples 10 ms apart, or skip those before a gap";
        return Err(table.complain(skip + k, 0, "not 10 ms after the sample before", remedy));
    }
    let first = time.first().copied().unwrap_or_default();
    let epochs = ((time.last().copied().unwrap_or_default() - first) / EPOCH_S) as usize;
    if epochs == 0 && skip > 0 {
        return Err(Error::Option {
            option: "--skip".into(),
            problem: format!(
                "is {skip}, which leaves less than a second of {} samples",
                table.count()
            ),
            remedy: "skip fewer".into(),
        });
    }
    if epochs == 0 {
        return Err(table.complain(
            table.count() - 1,
            0,
            "too early an end",
            "give at least one second",
        ));
    }
    let rates: Vec<Increment> = table.rows().skip(skip).map(sample).collect();
    let states: Vec<NavState> = table.rows().skip(skip).map(state).collect();
    let per_epoch = (EPOCH_S / DT).round() as usize;
    let integral = MotionIntegral::of_rates(time.clone(), rates);
    let increments = integral.increments(first, DT, epochs * per_epoch);
    let counts = quantise(increments, &FINE_LSB)
        .map_err(|k| table.complain(skip + k, 1, "out of range", rate))?;
    let track = Track::new(time, states);
    let reference: Vec<NavState> = (0..=epochs)
        .map(|k| track.at(first + k as f64 * EPOCH_S))
        .collect();
    Ok(referenced(DT, (counts, FINE_LSB), reference, SIGMAS))
}

/// Time stamps, of which those that the recorder displaced are moved by their neighbours: each
/// stamp lags an even grid, and the median lag of the neighbours is taken.
fn straightened(stamps: &[f64]) -> Vec<f64> {
    let lag: Vec<f64> = (0..stamps.len())
        .map(|k| stamps[k] - k as f64 * DT)
        .collect();
    let median_lag = |k: usize| {
        let mut near =
            lag[k.saturating_sub(NEIGHBOURS)..(k + NEIGHBOURS + 1).min(lag.len())].to_vec();
        near.sort_by(f64::total_cmp);
        near[near.len() / 2]
    };
    let straightened = |k: usize| {
        let even = k as f64 * DT + median_lag(k);
        if (stamps[k] - even).abs() > STALLED {
            even
        } else {
            stamps[k]
        }
    };
    (0..stamps.len()).map(straightened).collect()
}

fn sample(row: &[f64]) -> Increment {
    let axes = Axes::FORWARD_LEFT_UP;
    Increment {
        dtheta: axes.turn([row[1], row[2], row[3]]),
        dv: axes.turn([row[4], row[5], row[6]]),
    }
}

fn state(row: &[f64]) -> NavState {
    NavState {
        position: geodetic(row[7], row[8], row[9]),
        velocity: Vector3::new(row[11], row[10], -row[12]),
        q_bn: from_euler(row[13], -row[14], FRAC_PI_2 - row[15]),
    }
}

/// Position of a point given in Mercator metres east and north of home.
fn geodetic(east: f64, north: f64, up: f64) -> Geodetic {
    let (lat, lon) = (HOME[0] * DEG, HOME[1] * DEG);
    let scale = SPHERE_M * lat.cos();
    let mercator = (0.5 * (FRAC_PI_2 + lat)).tan().ln() + north / scale;
    Geodetic {
        lat: 2.0 * mercator.exp().atan() - FRAC_PI_2,
        lon: lon + east / scale,
        h: HOME[2] + up,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::inertial::free_inertial::from_reference;
    use test_bench::recordings::{file, message};

    /// A drive of `n` samples to the east at 10 m/s, with one line changed. A metre of the file is
    /// 1.0019 m on the ellipsoid.
    fn drive(n: usize, change: Option<(usize, &str)>) -> String {
        let mut text = format!("{HEADER}\n");
        for k in 0..n {
            let t = k as f64 * DT;
            let row = format!(
                "{t:.4},0,0,0,0,0,9.81,{:.3},0,0,10,0,0,0,0,0",
                10.0 / 1.0019 * t
            );
            text += change.filter(|c| c.0 == k).map_or(row.as_str(), |c| c.1);
            text.push('\n');
        }
        text
    }

    #[test]
    fn axes_and_attitude_are_turned_to_forward_right_down() {
        let row = [
            0.0, 0.1, 0.2, 0.3, 1.0, 2.0, 3.0, 5.0, 7.0, 9.0, 0.5, 0.7, 0.9, 0.01, 0.02, 0.3,
        ];
        let s = sample(&row);
        assert_eq!(s.dtheta, Vector3::new(0.1, -0.2, -0.3));
        assert_eq!(s.dv, Vector3::new(1.0, -2.0, -3.0));
        let nav = state(&row);
        assert_eq!(nav.velocity, Vector3::new(0.7, 0.5, -0.9));
        // forward axis of the body: yaw from east, pitch nose down
        let forward = nav.q_bn * Vector3::x();
        let (sy, cy) = 0.3f64.sin_cos();
        let (sp, cp) = 0.02f64.sin_cos();
        assert!(
            (forward - Vector3::new(sy * cp, cy * cp, sp)).norm() < 1e-12,
            "{forward}"
        );
    }

    /// The inverse projection gives back the metres of the file.
    #[test]
    fn positions_project_to_the_metres_of_the_file() {
        let project = |p: &Geodetic| {
            let scale = (HOME[0] * DEG).cos();
            let y = ((90.0 + p.lat / DEG) * std::f64::consts::PI / 360.0)
                .tan()
                .ln();
            [scale * SPHERE_M * p.lon, scale * SPHERE_M * y]
        };
        let home = project(&geodetic(0.0, 0.0, 0.0));
        for [east, north] in [[0.0, 0.0], [1500.0, -700.0], [-30.0, 2000.0]] {
            let [x, y] = project(&geodetic(east, north, 5.0));
            assert!((x - home[0] - east).abs() < 1e-5, "{x}");
            assert!((y - home[1] - north).abs() < 1e-5, "{y}");
        }
        // 1 km east is longer on the ellipsoid, 1 km north shorter
        let moved = geodetic(1000.0, 1000.0, 0.0).ned_from(&geodetic(0.0, 0.0, 0.0));
        assert!(
            (moved.y - 1001.9).abs() < 0.3 && (moved.x - 999.1).abs() < 0.3,
            "{moved}"
        );
    }

    /// The velocities of the file integrate to the positions better than the file's own metres.
    #[test]
    fn positions_are_what_the_velocities_say() {
        use test_bench::recordings::recorded;
        for (drive, skip) in DRIVES {
            let Some(path) = recorded(&format!("kitti-2011_09_30_drive_{drive}.csv.gz")) else {
                return;
            };
            let states = session(&path, skip).unwrap().reference;
            let mut sums = [[0.0; 2]; 2];
            for pair in states.windows(5) {
                // Simpson's rule over four seconds
                let v = |k: usize| pair[k].velocity;
                let by = (v(0) + v(1) * 4.0 + v(2) * 2.0 + v(3) * 4.0 + v(4)) / 3.0;
                let moved = pair[4].position.ned_from(&pair[0].position);
                for axis in 0..2 {
                    sums[axis][0] += moved[axis] * by[axis];
                    sums[axis][1] += by[axis] * by[axis];
                }
            }
            let scale = sums.map(|[product, square]| product / square - 1.0);
            println!("{drive}: {scale:.5?}");
            assert!(scale.iter().all(|s| s.abs() < 1.2e-3), "{drive}: {scale:?}");
        }
    }

    #[test]
    fn late_stamps_are_moved_back_and_gaps_refused() {
        let late = "1.0600,0,0,0,0,0,9.81,10,0,0,10,0,0,0,0,0";
        let (_dir, path) = file("in.csv", drive(301, Some((100, late))).as_bytes());
        let got = session(&path, 0).unwrap();
        assert_eq!(
            (got.epochs(), got.counts.len(), got.reference.len()),
            (3, 300, 4)
        );
        // 3 s of free inertial on a level road: only Coriolis and the rounded gravity remain
        assert!(from_reference(&got).position[3].xy().norm() < 0.05);
        let text = drive(301, None);
        let gap: String = text
            .lines()
            .enumerate()
            .filter(|(k, _)| !(150..160).contains(k))
            .map(|(_, l)| format!("{l}\n"))
            .collect();
        let (_dir, path) = file("in.csv", gap.as_bytes());
        let why = message(&session(&path, 0).unwrap_err());
        assert!(
            why.starts_with(
                "in.csv:151: column 'time_s': '1.59' is not 10 ms after the sample before"
            ),
            "{why}"
        );
        let (_dir, path) = file("in.csv", drive(50, None).as_bytes());
        assert!(message(&session(&path, 0).unwrap_err()).contains("too early an end"));
        assert!(
            message(&session(&path, 60).unwrap_err())
                .contains("is 60, which leaves less than a second")
        );
        let (_dir, path) = file(
            "in.csv",
            drive(301, Some((7, "0.07,99,0,0,0,0,9.81,0,0,0,0,0,0,0,0,0"))).as_bytes(),
        );
        let why = message(&session(&path, 0).unwrap_err());
        assert_eq!(
            why,
            "in.csv:9: column 'wx_radps': '99' is out of range; remedy: give rates in rad/s"
        );
    }
}
