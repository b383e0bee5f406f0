//! A body at rest with one error: the classical responses of free-inertial navigation.

use super::*;
use host_core::inertial::earth::OMEGA_IE;
use std::f64::consts::TAU;

/// Latitude in rad at which the meridian radius of curvature is 6371 km, the radius of the table
/// below.
const LAT_6371: f64 = 0.842_03;
const DT: f64 = 0.02;
const HEIGHT: HeightLoop = HeightLoop { time_s: 10.0 };

/// Errors of position (north, east, m) and velocity (m/s) at each second. `tilt` (rad, navigation
/// axes) turns the initial attitude of the navigator. Gyro bias (rad/s) and accelerometer bias
/// (m/s2) are in body axes, here parallel to NED.
fn at_rest(
    lat: f64,
    tilt: Vector3<f64>,
    gyro: Vector3<f64>,
    accelerometer: Vector3<f64>,
    seconds: usize,
) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let home = Geodetic {
        lat,
        lon: 0.3,
        h: 0.0,
    };
    let here = Local::at(lat, 0.0);
    let increment = Increment {
        dtheta: (Vector3::new(OMEGA_IE * lat.cos(), 0.0, -OMEGA_IE * lat.sin()) + gyro) * DT,
        dv: (accelerometer - here.gravity()) * DT,
    };
    let mut sins = Sins::new(NavState {
        position: home,
        velocity: Vector3::zeros(),
        q_bn: UnitQuaternion::from_scaled_axis(tilt),
    });
    (0..seconds)
        .map(|_| {
            for _ in 0..(1.0 / DT) as usize {
                sins.step(&increment, DT);
            }
            sins.damp_height(&HEIGHT, home.h, 1.0);
            (sins.nav.position.ned_from(&home), sins.nav.velocity)
        })
        .collect()
}

#[test]
fn without_errors_it_stays_where_it_is() {
    for lat in [-1.2, 0.0, LAT_6371] {
        let zero = Vector3::zeros();
        let path = at_rest(lat, zero, zero, zero, 1320);
        assert!(path[1319].0.norm() < 1e-4, "{lat}: {:?}", path[1319]);
    }
}

/// At the equator the vertical component of Earth rate does not couple north and east, so each
/// oscillates at one frequency.
#[test]
fn a_disturbed_navigator_swings_with_the_schuler_period() {
    let here = Local::at(0.0, 0.0);
    let zero = Vector3::zeros();
    for (axis, radius) in [(0, here.m_h), (1, here.n_h)] {
        let mut bias = zero;
        bias[axis] = 1e-3;
        let v: Vec<f64> = at_rest(0.0, zero, zero, bias, 3 * 5100)
            .iter()
            .map(|(_, v)| v[axis])
            .collect();
        // rising zero crossings of velocity, in s; the sample of index k is at k + 1 s
        let crossings: Vec<f64> = (1..v.len())
            .filter(|&k| v[k - 1] < 0.0 && v[k] >= 0.0)
            .map(|k| k as f64 + v[k - 1] / (v[k - 1] - v[k]))
            .collect();
        assert!(crossings.len() >= 2, "axis {axis}: {crossings:?}");
        let period = (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64;
        let minutes = period / 60.0;
        let own = TAU * (radius / here.g).sqrt();
        println!(
            "axis {axis}: {minutes:.3} min, own radius {:.3}",
            own / 60.0
        );
        assert!(
            (minutes / 84.4 - 1.0).abs() < 5e-3,
            "axis {axis}: {minutes}"
        );
        assert!(
            (period / own - 1.0).abs() < 1e-3,
            "axis {axis}: {period} {own}"
        );
    }
}

/// Minutes, and metres from 100 ug of a level accelerometer, 0.01 deg/h of a level gyro, 10" of
/// tilt: one level axis, R = 6371 km.
const YARDSTICKS: [(usize, [f64; 3]); 5] = [
    (5, [43.6, 2.1, 21.1]),
    (10, [168.5, 16.6, 81.7]),
    (15, [357.6, 54.3, 173.4]),
    (20, [584.9, 122.5, 283.6]),
    (22, [679.7, 159.3, 329.5]),
];

/// North oscillates with the meridian radius, 6371 km at this latitude, as in the table. East
/// oscillates with the prime-vertical radius, 6390 km, which differs by 0.3 %. The tolerance of 2 %
/// allows for it and for the coupling by Earth rate, which grows as (Omega t)^2 to 0.9 % at 22 min.
#[test]
fn growth_of_errors_is_that_of_the_yardsticks() {
    let arcsec = 1f64.to_radians() / 3600.0;
    let (a, w, tilt) = (100e-6 * 9.806_65, 0.01 * arcsec, 10.0 * arcsec);
    let (x, y, zero) = (Vector3::x(), Vector3::y(), Vector3::zeros());
    // north responds to tilt and rate about east, east to those about north
    let north = [
        at_rest(LAT_6371, zero, zero, x * a, 1320),
        at_rest(LAT_6371, zero, y * w, zero, 1320),
        at_rest(LAT_6371, y * tilt, zero, zero, 1320),
    ];
    let east = [
        at_rest(LAT_6371, zero, zero, y * a, 1320),
        at_rest(LAT_6371, zero, x * w, zero, 1320),
        at_rest(LAT_6371, x * tilt, zero, zero, 1320),
    ];
    assert!((Local::at(LAT_6371, 0.0).m_h - 6.371e6).abs() < 500.0);
    for (axis, paths) in [north, east].iter().enumerate() {
        // sign: a tilt about +east lowers the north component of specific force, a tilt about
        // +north raises the east component
        let sign = if axis == 0 { -1.0 } else { 1.0 };
        for (minutes, want) in YARDSTICKS {
            for (cause, sign) in [(0, 1.0), (1, sign), (2, sign)] {
                let got = sign * paths[cause][minutes * 60 - 1].0[axis];
                let off = got / want[cause] - 1.0;
                println!(
                    "axis {axis} {minutes} min cause {cause}: {got:.2} m, {:.2} %",
                    off * 100.0
                );
                // the table is rounded to 0.05 m
                assert!(
                    (got - want[cause]).abs() < 0.02 * want[cause] + 0.05,
                    "axis {axis} {minutes} min cause {cause}: {got} instead of {}",
                    want[cause]
                );
            }
        }
    }
}
