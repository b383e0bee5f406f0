use super::*;
use crate::inertial::sins::Increment;
use crate::inertial::units::{DEG_PER_H, DEG_PER_SQRT_H, G0, UG};
use nalgebra::Vector3;

/// A spec without errors except quantisation.
pub(super) fn perfect() -> ImuSpec {
    let medium = ImuSpec::preset("medium").unwrap();
    let mut spec = medium.error_model(ErrorModelName::Noise);
    spec.gyro.angle_random_walk_dpsqrth = 0.0;
    spec.gyro.dither = DitherSpec::default();
    spec.accel.velocity_random_walk_ugpsqrthz = 0.0;
    spec
}

fn sum_of(
    spec: &ImuSpec,
    unit: u64,
    turn_on: u64,
    input: &Increment,
    seconds: usize,
) -> ([i64; 6], Increment) {
    let mut imu = Imu::new(spec, unit, turn_on);
    let mut sum = [0i64; 6];
    let mut error = Increment::default();
    for _ in 0..seconds * spec.rate_hz as usize {
        let (c, e) = imu.measure(input);
        for (s, x) in sum.iter_mut().zip(c.dtheta.iter().chain(&c.dv)) {
            *s += i64::from(*x);
        }
        error.dtheta += e.dtheta;
        error.dv += e.dv;
    }
    (sum, error)
}

#[test]
fn quantisation_carries_its_remainder() {
    let spec = perfect();
    let lsb = Imu::lsb(&spec);
    let dt = 1.0 / f64::from(spec.rate_hz);
    // a rate far below one pulse per sample
    let input = Increment {
        dtheta: Vector3::new(0.013, -0.4, 7.7) * lsb.rad,
        dv: Vector3::new(0.0, 0.003, -G0 * dt / lsb.mps) * lsb.mps,
    };
    let (sum, error) = sum_of(&spec, 1, 2, &input, 60);
    assert_eq!(error, Increment::default());
    let n = f64::from(spec.rate_hz) * 60.0;
    for i in 0..3 {
        assert!(
            (sum[i] as f64 - input.dtheta[i] / lsb.rad * n).abs() <= 0.51,
            "gyro {i}"
        );
        assert!(
            (sum[i + 3] as f64 - input.dv[i] / lsb.mps * n).abs() <= 0.51,
            "accel {i}"
        );
    }
}

#[test]
fn bias_of_the_unit_repeats_and_turn_on_bias_does_not() {
    let mut spec = perfect();
    spec.gyro.bias_unit_dph = 0.1;
    let rest = Increment::default();
    let bias = |spec: &ImuSpec, unit, turn_on| {
        sum_of(spec, unit, turn_on, &rest, 10).1.dtheta / 10.0 / DEG_PER_H
    };
    assert_eq!(bias(&spec, 1, 1), bias(&spec, 1, 2));
    assert_ne!(bias(&spec, 1, 1), bias(&spec, 2, 1));
    spec.gyro.bias_unit_dph = 0.0;
    spec.gyro.bias_turn_on_dph = 0.1;
    assert_ne!(bias(&spec, 1, 1), bias(&spec, 1, 2));
    // standard deviation over turn-ons as configured: 3 x 400 draws, so within 6 % at 3 sigma
    let n = 400;
    let mean_square = (0..n)
        .map(|k| bias(&spec, 1, k).norm_squared() / 3.0)
        .sum::<f64>()
        / n as f64;
    assert!(
        (mean_square.sqrt() / 0.1 - 1.0).abs() < 0.06,
        "{}",
        mean_square.sqrt()
    );
}

#[test]
fn angle_random_walk_grows_with_the_root_of_time() {
    let mut spec = perfect();
    spec.rate_hz = 20;
    spec.gyro.angle_random_walk_dpsqrth = 0.1;
    let lsb = Imu::lsb(&spec);
    let rest = Increment::default();
    for seconds in [4, 64] {
        let n = 300;
        let mean_square: f64 = (0..n)
            .map(|k| {
                sum_of(&spec, 1, k, &rest, seconds).0[..3]
                    .iter()
                    .map(|s| (*s as f64 * lsb.rad).powi(2))
                    .sum::<f64>()
                    / 3.0
            })
            .sum::<f64>()
            / n as f64;
        let want = 0.1 * DEG_PER_SQRT_H * (seconds as f64).sqrt();
        assert!(
            (mean_square.sqrt() / want - 1.0).abs() < 0.08,
            "{seconds} s: {}",
            mean_square.sqrt() / want
        );
    }
}

#[test]
fn scale_asymmetry_and_k2_follow_the_input() {
    let mut spec = perfect();
    spec.accel.k2_ugpg2 = 50.0;
    let error = |spec: &ImuSpec, f: f64| {
        let dt = 1.0 / f64::from(spec.rate_hz);
        sum_of(
            spec,
            3,
            1,
            &Increment {
                dv: Vector3::new(f, 0.0, 0.0) * dt,
                ..Default::default()
            },
            1,
        )
        .1
        .dv
        .x
    };
    assert!((error(&spec, 2.0 * G0) / error(&spec, G0) - 4.0).abs() < 1e-9);
    assert!((error(&spec, -G0) / error(&spec, G0) - 1.0).abs() < 1e-9);
    assert!(error(&spec, G0).abs() < 250.0 * UG && error(&spec, G0) != 0.0);
    spec.accel.k2_ugpg2 = 0.0;
    spec.accel.scale_ppm = 100.0;
    assert!((error(&spec, -G0) / error(&spec, G0) + 1.0).abs() < 1e-9);
    spec.accel.scale_ppm = 0.0;
    spec.accel.scale_asymmetry_ppm = 100.0;
    assert!((error(&spec, -G0) / error(&spec, G0) - 1.0).abs() < 1e-9);
}

#[test]
fn warm_up_decays_with_its_time_constant() {
    let mut spec = perfect();
    spec.gyro.warm_up_dph = 0.2;
    let mut imu = Imu::new(&spec, 5, 5);
    let n = spec.rate_hz as usize * 901;
    let errors: Vec<f64> = (0..n)
        .map(|_| imu.measure(&Increment::default()).1.dtheta.x)
        .collect();
    assert!((errors[n - 1] / errors[0] - (-1.0f64).exp()).abs() < 1e-9);
}
