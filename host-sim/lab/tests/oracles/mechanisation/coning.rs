//! Classical coning and sculling: the drift is that of theory, for each number of samples.

use super::*;
use host_core::inertial::rotation::from_euler;
use std::f64::consts::TAU;

const HOME: Geodetic = Geodetic {
    lat: 0.84,
    lon: 0.2,
    h: 50.0,
};

/// A cone of half-angle `a` rad at `omega` rad/s about the body's x axis (Savage 1998; Bortz 1971):
/// the attitude relative to the mean one is a turn by `a` about the axis `(0, cos omega t, sin
/// omega t)`, and the body rate is `sin a d/dt(axis) - 2 sin^2(a/2) omega x`.
fn cone(a: f64, omega: f64) -> impl Fn(f64) -> (UnitQuaternion<f64>, Vector3<f64>) {
    let mean = from_euler(0.4, -0.3, 2.0);
    move |t| {
        let (s, c) = (omega * t).sin_cos();
        let q = from_rotvec(&(Vector3::new(0.0, c, s) * a));
        let rate = Vector3::new(-2.0 * (0.5 * a).sin().powi(2), -a.sin() * s, a.sin() * c) * omega;
        (mean * q, rate)
    }
}

pub(super) fn at_rest(_: f64) -> (Vector3<f64>, Vector3<f64>) {
    (Vector3::zeros(), Vector3::zeros())
}

/// Mean of `1/2 int alpha x omega` per sample, for unit amplitude and phase `l` per sample, minus
/// the result of the algorithm.
fn residual(samples: Samples, l: f64) -> f64 {
    // mean product of two increments n apart
    let product = |n: f64| 2.0 * (1.0 - l.cos()) * (n * l).sin();
    let made = match samples {
        Samples::One => 0.0,
        Samples::Two => product(1.0) / 12.0,
        Samples::Three => (17.0 / 120.0 - 1.0 / 40.0) * product(1.0) - product(2.0) / 60.0,
    };
    0.5 * (l - l.sin()) - made
}

/// Drift about the axis of the cone over `seconds`, rad/s, without the start-up.
pub(super) fn coning_drift(samples: Samples, a: f64, hz: f64, dt: f64, seconds: f64) -> f64 {
    let motion = Motion {
        attitude: Box::new(cone(a, TAU * hz)),
        velocity: Box::new(at_rest),
    };
    let drift = |seconds: f64| {
        let (nav, truth) = motion.run(samples, HOME, dt, seconds);
        attitude_error(&nav, &truth).x
    };
    (drift(seconds + 1.0) - drift(1.0)) / seconds
}

/// 1 deg at 10 Hz, samples at 100 Hz: 127 deg/h without compensation, 9.8 with two samples, 0.80
/// with three. Over two minutes.
#[test]
fn drift_in_classical_coning_is_that_of_theory() {
    let (a, hz, dt) = (1f64.to_radians(), 10.0, 0.01);
    let l = TAU * hz * dt;
    for samples in [Samples::One, Samples::Two, Samples::Three] {
        let got = coning_drift(samples, a, hz, dt, 120.0);
        // the navigator does not compensate the residual
        let want = -residual(samples, l) * a.sin().powi(2) / dt;
        let deg_h = got.to_degrees() * 3600.0;
        println!(
            "{samples:?}: {deg_h:.4} deg/h, theory {:.4}",
            want.to_degrees() * 3600.0
        );
        assert!((got / want - 1.0).abs() < 0.02, "{samples:?}: {got} {want}");
    }
    // the figures stated above, so that a missing term or a wrong sign is found independently of
    // the formula
    let deg_h = |s| coning_drift(s, a, hz, dt, 30.0).to_degrees() * 3600.0;
    assert!((deg_h(Samples::One) + 127.3).abs() < 1.0);
    assert!((deg_h(Samples::Two) + 9.8).abs() < 0.2);
}

/// Sculling: yaw `amplitude sin(omega t)` with north acceleration `b sin(omega t)`, in phase. The
/// true east velocity is zero. Gravity has no effect, because the turn is about the vertical.
fn sculling_drift(samples: Samples, amplitude: f64, b: f64, hz: f64, dt: f64, seconds: f64) -> f64 {
    let omega = TAU * hz;
    let motion = Motion {
        attitude: Box::new(move |t| {
            let (s, c) = (omega * t).sin_cos();
            (
                from_euler(0.0, 0.0, amplitude * s),
                Vector3::z() * (amplitude * omega * c),
            )
        }),
        velocity: Box::new(move |t| {
            let (s, c) = (omega * t).sin_cos();
            (Vector3::x() * (-b / omega * c), Vector3::x() * (b * s))
        }),
    };
    let drift = |seconds: f64| {
        let (nav, truth) = motion.run(samples, HOME, dt, seconds);
        (nav.velocity - truth.velocity).y
    };
    (drift(seconds + 1.0) - drift(1.0)) / seconds
}

/// 0.2 deg and 2 m/s2 at 10 Hz, samples at 100 Hz: 23 ug without compensation, 1.8 with two
/// samples, 0.14 with three.
#[test]
fn drift_in_classical_sculling_is_that_of_theory() {
    let (amplitude, b, hz, dt) = (0.2f64.to_radians(), 2.0, 10.0, 0.01);
    let l = TAU * hz * dt;
    for samples in [Samples::One, Samples::Two, Samples::Three] {
        let got = sculling_drift(samples, amplitude, b, hz, dt, 60.0);
        let want = -residual(samples, l) * amplitude * b / l;
        let ug = 1e6 / 9.806_65;
        println!("{samples:?}: {:.4} ug, theory {:.4}", got * ug, want * ug);
        assert!((got / want - 1.0).abs() < 0.02, "{samples:?}: {got} {want}");
    }
}
