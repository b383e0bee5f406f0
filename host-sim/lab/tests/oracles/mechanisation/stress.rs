//! Hard cases for the mechanisation: fast coning, spin, high speed, the pole.

use super::coning::{at_rest, coning_drift};
use super::*;
use crate::ecef::{EcefReference, GravityModel, ecef, geodetic, gravity, ned_to_ecef};
use host_core::inertial::earth::OMEGA_IE;
use host_core::inertial::rotation::from_euler;
use std::f64::consts::{FRAC_PI_2, TAU};

const HOME: Geodetic = Geodetic {
    lat: 0.84,
    lon: 0.2,
    h: 50.0,
};

/// At constant sample period and angle, the drift grows with the third power of the frequency (no
/// compensation), the fifth (two samples) or the seventh (three).
#[test]
fn order_of_each_algorithm_in_classical_coning() {
    let a = 3f64.to_radians();
    for (samples, order) in [
        (Samples::One, 3.0),
        (Samples::Two, 5.0),
        (Samples::Three, 7.0),
    ] {
        // 4 and 8 Hz at 100 Hz
        let [slow, fast] = [4.0, 8.0].map(|hz| coning_drift(samples, a, hz, 0.01, 20.0).abs());
        let slope = (fast / slow).log2();
        println!("{samples:?}: {slow:.3e} {fast:.3e} rad/s, slope {slope:.3}");
        assert!((slope - order).abs() < 0.15, "{samples:?}: {slope}");
    }
}

/// A slender body on a horizontal bench, without translation: spin 400 deg/s about x, precession
/// 100 deg/s, nutation 2 deg. The specific force turns in body axes with the spin. Products of
/// increments alone do not follow it: without the third-order rotation of delta-v (`in_start_axes`
/// of the navigator) the error would be `theta^2/6` = 0.8 mg, 0.5 m/s in a minute.
#[test]
fn spinning_body_with_nutation() {
    let (spin, precession) = (400f64.to_radians(), 100f64.to_radians());
    let (sin, cos) = 2f64.to_radians().sin_cos();
    let mean = from_euler(0.0, 0.0, 0.6);
    let motion = Motion {
        attitude: Box::new(move |t| {
            let turn = |v: Vector3<f64>| from_rotvec(&v);
            let q = turn(Vector3::x() * (precession * t))
                * turn(Vector3::y() * 2f64.to_radians())
                * turn(Vector3::x() * (spin * t));
            let (s, c) = (spin * t).sin_cos();
            let rate = Vector3::new(
                spin + precession * cos,
                precession * sin * s,
                precession * sin * c,
            );
            (mean * q, rate)
        }),
        velocity: Box::new(at_rest),
    };
    for (samples, dt, speed, angle) in [
        (Samples::Two, 0.01, 3e-2, 3e-6),
        (Samples::Three, 0.01, 1.6e-3, 3.2e-7),
        (Samples::Two, 0.005, 4e-3, 4e-7),
        (Samples::Three, 0.005, 1e-4, 3e-8),
    ] {
        let (nav, truth) = motion.run(samples, HOME, dt, 60.0);
        let (v, q) = (nav.velocity.norm(), attitude_error(&nav, &truth).norm());
        println!("{samples:?} {dt}: {v:.2e} m/s, {q:.2e} rad");
        assert!(v < speed && q < angle, "{samples:?} {dt}: {v} {q}");
    }
}

/// A level track at `speed` m/s with banked turns. Its course swings by 20 deg about `course` (rad)
/// with a period of 100 s.
fn weaving(speed: f64, course: f64) -> Motion {
    let (swing, omega) = (20f64.to_radians(), TAU / 100.0);
    let bank = 0.5;
    let at = move |t: f64| {
        let (s, c) = (omega * t).sin_cos();
        // course and its derivative, roll and its derivative
        [
            course + swing * s,
            swing * omega * c,
            bank * c,
            -bank * omega * s,
        ]
    };
    Motion {
        attitude: Box::new(move |t| {
            let [chi, chi_d1, roll, roll_d1] = at(t);
            let rate = Vector3::new(roll_d1, chi_d1 * roll.sin(), chi_d1 * roll.cos());
            (from_euler(roll, 0.0, chi), rate)
        }),
        velocity: Box::new(move |t| {
            let [chi, chi_d1, ..] = at(t);
            let (s, c) = chi.sin_cos();
            let v = Vector3::new(speed * c, speed * s, 0.0);
            (v, Vector3::new(-v.y, v.x, 0.0) * chi_d1)
        }),
    }
}

/// Ten minutes. The limits are about twice the measured errors.
#[test]
fn fast_tracks() {
    for (speed, h, metres) in [(300.0, 10e3, 1e-3), (7000.0, 100e3, 0.04)] {
        for course in [0.3, 1.6] {
            let start = Geodetic {
                lat: -0.3,
                lon: 3.0,
                h,
            };
            let mut two = f64::INFINITY;
            for samples in [Samples::Two, Samples::Three] {
                let (nav, truth) = weaving(speed, course).run(samples, start, 0.01, 600.0);
                let off = nav.position.ned_from(&truth.position);
                assert!(
                    off.norm() < two + 1e-5,
                    "{speed} m/s {course}: {off:?}, {two} m with two"
                );
                two = off.norm();
                println!("{speed} m/s {course} {samples:?}: {off:.6?}");
                assert!(
                    off.norm() < metres,
                    "{speed} m/s {course} {samples:?}: {off:?}"
                );
            }
        }
    }
}

/// The ECEF reference has neither transport rate nor radii of curvature. So it shows whether they
/// are right in both the truth and the navigator. The height is low even at 7 km/s, because the
/// free-air series of [`Local`] is wrong by 0.7 um/s2 at 10 km, which makes most of the 0.13 m
/// there, and by 0.15 mm/s2 at 100 km.
#[test]
fn fast_tracks_as_the_ecef_reference_sees_them() {
    for (speed, h, metres) in [(300.0, 10e3, 0.2), (7000.0, 500.0, 0.03)] {
        let motion = weaving(speed, 0.8);
        let mut position = Geodetic {
            lat: -0.3,
            lon: 3.0,
            h,
        };
        let mut reference = EcefReference::new(&motion.state(0.0, position));
        let dt = 0.01;
        let mut increments = Vec::new();
        for k in 0..60_000 {
            let (increment, next) = motion.increment(f64::from(k) * dt, dt, position);
            increments.push(increment);
            position = next;
        }
        reference.run(&increments, dt);
        let off = ecef(&reference.nav().position) - ecef(&position);
        println!("{speed} m/s: reference {off:.4?}");
        assert!(off.norm() < metres, "{speed} m/s: {off:?}");
    }
}

/// Around a pole at 11 km (89.9 deg) and at 1.2 km (89.989 deg). North-east-down still works, with
/// axes that turn by up to 5 deg/s.
#[test]
fn near_the_pole() {
    for (lat, course, speed, metres) in [
        (89.9, FRAC_PI_2, 100.0, 1e-3),
        (89.9, FRAC_PI_2, 300.0, 1e-3),
        (-89.9, 1.2, 10.0, 1e-3),
        (89.989, FRAC_PI_2, 30.0, 1e-3),
        (89.989, FRAC_PI_2, 100.0, 0.03),
    ] {
        let start = Geodetic {
            lat: f64::to_radians(lat),
            lon: 0.0,
            h: 1000.0,
        };
        let motion = weaving(speed, course);
        let mut two = f64::INFINITY;
        for samples in [Samples::Two, Samples::Three] {
            let (nav, truth) = motion.run(samples, start, 0.01, 600.0);
            let off = ecef(&nav.position) - ecef(&truth.position);
            // three samples, the default, are no worse except for rounding
            assert!(
                off.norm() < two + 1e-5,
                "{lat} {speed} m/s: {off:?}, {two} m with two"
            );
            two = off.norm();
            println!("{lat} {speed} m/s {samples:?}: {:.6} m", off.norm());
            assert!(
                off.norm() < metres,
                "{lat} {speed} m/s {samples:?}: {off:?}"
            );
        }
    }
}

/// Straight over the north pole at 200 m/s in a circle about the centre of the Earth, with the pole
/// at half time. The truth is computed in ECEF by Simpson's rule. The ECEF reference follows. The
/// navigator in north-east-down raises its flag.
#[test]
fn across_the_pole() {
    let (radius, speed, dt) = (6.4e6, 200.0, 0.01);
    let turn = speed / radius;
    let n = 12_000;
    let angle = |t: f64| turn * (t - 0.5 * f64::from(n) * dt);
    // along the meridian of 0 deg to the pole, then along that of 180 deg; the body keeps its
    // attitude relative to the track
    let to_ecef = |t: f64| from_rotvec(&(Vector3::y() * -angle(t)));
    let at = |t: f64| to_ecef(t) * Vector3::z() * radius;
    let rates = |t: f64| {
        let q = to_ecef(t);
        let earth = Vector3::z() * OMEGA_IE;
        let v = q * Vector3::x() * -speed;
        let f = q * Vector3::z() * (-speed * turn) + earth.cross(&v) * 2.0
            - gravity(&at(t), GravityModel::AlongNormal);
        let omega = Vector3::y() * -turn + q.inverse() * earth;
        Increment {
            dtheta: omega,
            dv: q.inverse() * f,
        }
    };
    let increments: Vec<Increment> = (0..n)
        .map(|k| {
            let [a, b, c] = [0.0, 0.5, 1.0].map(|x| rates((f64::from(k) + x) * dt));
            Increment {
                dtheta: (a.dtheta + b.dtheta * 4.0 + c.dtheta) * (dt / 6.0),
                dv: (a.dv + b.dv * 4.0 + c.dv) * (dt / 6.0),
            }
        })
        .collect();
    let position = geodetic(&at(0.0));
    let q_ne = ned_to_ecef(position.lat, position.lon).inverse();
    let nav = NavState {
        position,
        velocity: q_ne * (to_ecef(0.0) * Vector3::x() * -speed),
        q_bn: q_ne * to_ecef(0.0),
    };
    let mut reference = EcefReference::new(&nav);
    reference.run(&increments, dt);
    let off = ecef(&reference.nav().position) - at(f64::from(n) * dt);
    println!("over the pole: {:.2e} m", off.norm());
    assert!(
        off.norm() < 1e-3 && reference.nav().position.lon.abs() > 3.1,
        "{off:?}"
    );

    let mut sins = Sins::new(nav);
    let (before, after) = increments.split_at(n as usize / 2 - 600);
    before.iter().for_each(|increment| sins.step(increment, dt));
    assert!(!sins.near_pole(), "{:?}", sins.nav.position);
    let reached = Vector3::z() * radius + Vector3::x() * (6.0 * speed);
    assert!(
        (ecef(&sins.nav.position) - reached).norm() < 0.2,
        "{:?}",
        sins.nav.position
    );
    after.iter().for_each(|increment| sins.step(increment, dt));
    assert!(sins.near_pole());
}
