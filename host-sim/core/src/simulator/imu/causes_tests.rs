//! Each error alone, compared with its own equation.

use super::tests::perfect;
use super::*;
use crate::inertial::session::Temperature;
use crate::inertial::sins::Increment;
use crate::inertial::units::{ARCSEC, DEG, DEG_PER_H, DEG_PER_SQRT_H, G0, UG};
use nalgebra::Vector3;

/// Systematic errors (rate, specific force) of consecutive samples for the inputs that `input`
/// gives at a time in s.
fn errors(
    spec: &ImuSpec,
    seconds: usize,
    input: impl Fn(f64) -> (Vector3<f64>, Vector3<f64>),
) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let mut imu = Imu::new(spec, 7, 11);
    let dt = 1.0 / f64::from(spec.rate_hz);
    (0..seconds * spec.rate_hz as usize)
        .map(|k| {
            let (w, f) = input(k as f64 * dt);
            let (_, e) = imu.measure(&Increment {
                dtheta: w * dt,
                dv: f * dt,
            });
            (e.dtheta / dt, e.dv / dt)
        })
        .collect()
}

fn at_rest(_: f64) -> (Vector3<f64>, Vector3<f64>) {
    (Vector3::zeros(), Vector3::zeros())
}

#[test]
fn causes_that_are_switched_on_leave_the_draws_of_the_others_alone() {
    let with = ImuSpec::preset("medium").unwrap();
    let mut without = with.clone();
    without.gyro.rate_random_walk_dphpsqrth = 0.0;
    without.gyro.dither.strip_residual_arcsec = 0.0;
    without.accel.vibration_rectification_ugpg2 = 0.0;
    let mut on = without.clone();
    on.gyro.dither.strip_residual_arcsec = 3.0;
    on.accel.vibration_rectification_ugpg2 = 40.0;
    on.gyro.rate_random_walk_dphpsqrth = 1e-12; // draws, and adds next to nothing
    let first = |spec: &ImuSpec| {
        errors(spec, 3, |t| {
            (Vector3::repeat(0.1), Vector3::repeat(G0 * t.sin()))
        })
    };
    for ((w, f), (w_on, f_on)) in first(&without).iter().zip(first(&on)) {
        assert!((w - w_on).norm() < 1e-9 * DEG_PER_H && (f - f_on).norm() < 100.0 * UG);
    }
}

#[test]
fn rate_random_walk_grows_with_the_root_of_time() {
    let mut spec = perfect();
    spec.rate_hz = 10;
    spec.gyro.rate_random_walk_dphpsqrth = 0.6;
    spec.accel.acceleration_random_walk_ugpsqrth = 30.0;
    let (turn_ons, seconds) = (300, 64);
    let mut sums = (0.0, 0.0);
    for turn_on in 0..turn_ons {
        let mut imu = Imu::new(&spec, 1, turn_on);
        let mut last = Increment::default();
        for _ in 0..seconds * spec.rate_hz {
            last = imu.measure(&Increment::default()).1;
        }
        sums.0 += (last.dtheta * 10.0).norm_squared();
        sums.1 += (last.dv * 10.0).norm_squared();
    }
    let root = |sum: f64| (sum / (3 * turn_ons) as f64).sqrt();
    let hours = f64::from(seconds) / 3600.0;
    assert!((root(sums.0) / (0.6 * DEG_PER_H * hours.sqrt()) - 1.0).abs() < 0.08);
    assert!((root(sums.1) / (30.0 * UG * hours.sqrt()) - 1.0).abs() < 0.08);
}

#[test]
fn lock_in_adds_its_random_walk_to_the_rest() {
    let mut spec = perfect();
    spec.gyro.pulse_arcsec = 1e-4;
    spec.gyro.angle_random_walk_dpsqrth = 0.003;
    spec.gyro.dither = DitherSpec {
        lock_in_dph: 237.4,
        ..DitherSpec::default()
    }; // 0.004 deg/sqrt(h) by the formula
    assert!((spec.gyro.total_angle_random_walk_dpsqrth() - 0.005).abs() < 1e-5);
    let mut imu = Imu::new(&spec, 1, 2);
    let n = 20_000;
    let square: f64 = (0..n)
        .map(|_| {
            imu.measure(&Increment::default())
                .0
                .dtheta
                .iter()
                .map(|&c| (f64::from(c) * 1e-4 * ARCSEC).powi(2))
                .sum::<f64>()
        })
        .sum();
    let walk = (square / f64::from(3 * n) * f64::from(spec.rate_hz)).sqrt() / DEG_PER_SQRT_H;
    assert!((walk / 0.005 - 1.0).abs() < 0.012, "{walk}"); // 60 000 squares: 0.3 % at one sigma
}

#[test]
fn stripped_dither_is_bounded_in_angle() {
    let mut spec = perfect();
    spec.gyro.pulse_arcsec = 1e-3;
    spec.gyro.dither.strip_residual_arcsec = 2.0;
    spec.gyro.dither.amplitude_noise_arcsec = 0.0;
    let mut imu = Imu::new(&spec, 1, 2);
    let (mut angle, mut low, mut high, mut square) = (0, 0, 0, 0.0);
    let n = 6000;
    for _ in 0..n {
        angle += imu.measure(&Increment::default()).0.dtheta[0];
        (low, high) = (low.min(angle), high.max(angle));
        square += f64::from(angle).powi(2);
    }
    assert!(
        (-2001..-1900).contains(&low) && (1900..=2001).contains(&high),
        "{low} {high}"
    );
    assert!(((square / f64::from(n)).sqrt() / 1414.0 - 1.0).abs() < 0.02);
}

#[test]
fn thermal_bias_is_the_polynomial_of_the_block_temperature() {
    type Term = (fn(&mut ImuSpec), fn(Temperature) -> f64);
    let terms: [Term; 5] = [
        (|s| s.gyro.temperature_dphpk = 0.01, |t| t.offset),
        (
            |s| s.gyro.temperature_dphpk2 = 0.01,
            |t| t.offset * t.offset,
        ),
        (|s| s.gyro.heating_dphpkpmin = 0.01, |t| t.rate),
        (
            |s| s.gyro.heating_temperature_dphpk2pmin = 0.01,
            |t| t.rate * t.offset,
        ),
        (|s| s.gyro.gradient_dphpk = 0.01, |t| t.gradient),
    ];
    for (number, (set, shape)) in terms.into_iter().enumerate() {
        let mut spec = perfect();
        spec.rate_hz = 10;
        set(&mut spec);
        spec.accel.temperature_ugpk = 5.0;
        (spec.block.self_heating_k, spec.block.ambient_offset_k) = (20.0, 5.0);
        let mut imu = Imu::new(&spec, 1, 2);
        let mut ratios = vec![];
        for _ in 0..9000 {
            let e = imu.measure(&Increment::default()).1;
            let x = shape(imu.surroundings().temperature);
            if x.abs() > 1e-4 {
                ratios.push((
                    e.dtheta.x * 10.0 / DEG_PER_H / x,
                    e.dv.x * 10.0 / UG / imu.surroundings().temperature.offset,
                ));
            }
        }
        let (first, accel) = ratios[0];
        assert!(first != 0.0 && ratios.len() > 8000, "{number}");
        assert!(
            ratios
                .iter()
                .all(|(g, a)| (g / first - 1.0).abs() < 1e-9 && (a / accel - 1.0).abs() < 1e-9),
            "{number}"
        );
        assert!(
            first.abs()
                < if number == 2 || number == 3 {
                    0.6 * 4.0
                } else {
                    0.04
                }
                && accel.abs() < 20.0,
            "{number}: {first} {accel}"
        );
    }
}

#[test]
fn magnetic_bias_turns_with_the_field() {
    let mut spec = perfect();
    spec.gyro.magnetic_dphpgauss = 0.02;
    let bias = |field: Vector3<f64>| {
        let mut imu = Imu::new(&spec, 7, 11);
        imu.set_field(field);
        imu.measure(&Increment::default()).1.dtheta * f64::from(spec.rate_hz) / DEG_PER_H
    };
    let (x, y) = (bias(Vector3::x() * 0.5), bias(Vector3::y() * 0.5));
    assert_eq!(bias(Vector3::zeros()), Vector3::zeros());
    assert!((bias(Vector3::new(0.5, 0.5, 0.0)) - x - y).norm() < 1e-12 && x != y);
    assert!(x.norm() > 0.002 && x.norm() < 0.05, "{x}");
}

#[test]
fn nonlinearity_is_cubic_and_given_at_its_rate() {
    let mut spec = perfect();
    (spec.gyro.nonlinearity_ppm, spec.gyro.nonlinearity_rate_dps) = (10.0, 100.0);
    let at = |dps: f64| {
        errors(&spec, 1, |_| (Vector3::x() * dps * DEG, Vector3::zeros()))[0]
            .0
            .x
    };
    let ppm = at(100.0) / (100.0 * DEG) * 1e6;
    assert!(ppm != 0.0 && ppm.abs() < 40.0, "{ppm}");
    assert!(
        (at(50.0) / at(100.0) - 0.125).abs() < 1e-9 && (at(-100.0) / at(100.0) + 1.0).abs() < 1e-9
    );
    spec.gyro.nonlinearity_rate_dps = 200.0;
    let half = errors(&spec, 1, |_| (Vector3::x() * 200.0 * DEG, Vector3::zeros()))[0]
        .0
        .x;
    assert!((half / (200.0 * DEG) * 1e6 / ppm - 1.0).abs() < 1e-9);
}

#[test]
fn cross_coupling_needs_both_axes() {
    let mut spec = perfect();
    spec.accel.cross_coupling_ugpg2 = 20.0;
    let at = |f: Vector3<f64>| errors(&spec, 1, |_| (Vector3::zeros(), f * G0))[0].1 / UG;
    assert_eq!(at(Vector3::x()), Vector3::zeros());
    let both = at(Vector3::new(1.0, 1.0, 0.0));
    assert!(both.x != 0.0 && both.y == 0.0 && both.z == 0.0);
    assert!((at(Vector3::new(1.0, -2.0, 0.0)).x / both.x + 2.0).abs() < 1e-9);
}

#[test]
fn vibration_is_rectified_by_its_mean_square_and_a_steady_force_is_not() {
    let mut spec = perfect();
    (
        spec.accel.vibration_rectification_ugpg2,
        spec.accel.vibration_above_ratio,
    ) = (40.0, 2.0);
    let shaken = |g: f64| {
        let wave = |t: f64| {
            (
                Vector3::zeros(),
                Vector3::repeat(G0 * (1.0 + g * (50.0 * std::f64::consts::TAU * t + 0.3).sin())),
            )
        };
        let e = errors(&spec, 3, wave);
        assert_eq!(e[0].1, Vector3::zeros());
        e[e.len() - 1].1.x / UG
    };
    assert!(shaken(0.0).abs() < 1e-6);
    let one = shaken(1.0); // mean square 1/2 g^2 in the increments, 1 g^2 above
    assert!(one.abs() > 1.0 && one.abs() < 160.0, "{one}");
    assert!((shaken(2.0) / one - 4.0).abs() < 1e-9);
}

#[test]
fn the_size_effect_is_centripetal_and_tangential() {
    let mut spec = perfect();
    spec.accel.size_effect_mm = 20.0;
    let steady = |dps: Vector3<f64>| errors(&spec, 1, |_| (dps * DEG, Vector3::zeros()))[50].1;
    let f = steady(Vector3::new(0.0, 0.0, 60.0));
    // the accelerometer x at r measures -w^2 r_x, and z nothing
    let r_x = -f.x / (60.0 * DEG).powi(2);
    assert!(r_x.abs() > 1e-3 && r_x.abs() < 0.08 && f.z == 0.0, "{r_x}");
    assert!((steady(Vector3::new(0.0, 0.0, 120.0)).x / f.x - 4.0).abs() < 1e-9);
    // a rate that grows as a t about z adds a x r = a (-r_y, r_x, 0); the x accelerometer shows its
    // own r_y
    let growing = |a: f64| errors(&spec, 1, |t| (Vector3::z() * a * t, Vector3::zeros()))[1].1;
    assert!((growing(2.0).x / growing(1.0).x - 2.0).abs() < 0.01);
    let r_y = -growing(1.0).x;
    assert!(
        r_y.abs() > 1e-3 && r_y.abs() < 0.08 && (r_y - r_x).abs() > 1e-4,
        "{r_y}"
    );
}

#[test]
fn delay_holds_back_the_accelerometers_alone() {
    let mut spec = perfect();
    spec.accel.delay_s = 0.0035; // not a whole number of increments
    let ramp = errors(&spec, 1, |t| (Vector3::x() * t, Vector3::x() * t));
    let (gyro, accel) = ramp[100];
    assert_eq!(gyro, Vector3::zeros());
    assert!((accel.x + 0.0035).abs() < 1e-12, "{}", accel.x);
    let steady = errors(&spec, 1, |_| (Vector3::zeros(), Vector3::z() * -G0));
    assert!(
        steady.iter().all(|(_, f)| f.norm() < 1e-12),
        "standing still it shows nothing, from the first increment on"
    );
}

#[test]
fn a_perfect_imu_has_no_error() {
    let spec = perfect();
    assert!(
        errors(&spec, 2, at_rest)
            .iter()
            .all(|(w, f)| w.norm() == 0.0 && f.norm() == 0.0)
    );
}

#[test]
#[ignore = "prints the time of a 22-minute drive at 200 Hz; run it with --release"]
fn speed() {
    for (what, spec) in [
        ("medium", ImuSpec::preset("medium").unwrap()),
        ("perfect", perfect()),
        ("medium in a rich world", rich()),
    ] {
        let input = Increment {
            dtheta: Vector3::repeat(1e-3),
            dv: Vector3::new(0.0, 0.01, -G0 * 0.005),
        };
        let mut imu = Imu::new(&spec, 1, 2);
        let start = std::time::Instant::now();
        let sum: i64 = (0..264_000)
            .map(|_| i64::from(imu.measure(&input).0.dtheta[0]))
            .sum();
        println!(
            "{what}: {:.1} ms ({sum})",
            start.elapsed().as_secs_f64() * 1e3
        );
    }
}

/// The preset `medium` with everything that follows the environment.
fn rich() -> ImuSpec {
    let mut spec = ImuSpec::preset("medium").unwrap();
    spec.nodes = Some(NodesSpec {
        rate_wpdps: 0.01,
        heater_w: 20.0,
        heater_set_k: 30.0,
        heater_band_k: 1.0,
        ..NodesSpec::typical()
    });
    spec.gyro.bias_instability_dph = 0.01;
    spec.accel.bias_instability_ug = 10.0;
    let gyro = &mut spec.gyro.environment;
    gyro.hysteresis_dph = 0.05;
    gyro.scale_temperature_ppmpk = 2.0;
    gyro.stretched_warm_up_dph = 0.1;
    gyro.mode_hop_dph = 0.02;
    gyro.mode_deflection_dph = 0.02;
    gyro.g_square_dphpg2 = 0.01;
    let accel = &mut spec.accel.environment;
    accel.hysteresis_ug = 50.0;
    accel.scale_temperature_ppmpk = 5.0;
    accel.stretched_warm_up_ug = 50.0;
    spec
}

/// The matrix from specific force to the bias of the gyros: linear, with the given size, and the
/// same at every turn-on.
#[test]
fn g_sensitivity_is_a_matrix_of_the_unit() {
    let mut spec = perfect();
    spec.gyro.g_sensitivity_dphpg = 2.0;
    let bias = |force: Vector3<f64>| errors(&spec, 1, |_| (Vector3::zeros(), force))[0].0;
    let along = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| bias(axis * G0));
    let both = bias(Vector3::new(2.0, -1.0, 0.5) * G0);
    let sum = along[0] * 2.0 - along[1] + along[2] * 0.5;
    assert!((both - sum).norm() < 1e-9 * DEG_PER_H);
    let squares = (0..400).map(|unit| {
        let mut imu = Imu::new(&spec, unit, 3);
        let dt = 1.0 / f64::from(spec.rate_hz);
        let (_, e) = imu.measure(&Increment {
            dtheta: Vector3::zeros(),
            dv: Vector3::z() * (G0 * dt),
        });
        (e.dtheta / dt).norm_squared()
    });
    let sigma = (squares.sum::<f64>() / 1200.0).sqrt() / DEG_PER_H;
    assert!((sigma / 2.0 - 1.0).abs() < 0.08, "{sigma}"); // 1200 squares: 2 % at one sigma
}
