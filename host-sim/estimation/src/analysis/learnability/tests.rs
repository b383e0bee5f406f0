use super::*;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::ekf::{Parameter, Regressor};
use host_core::simulator::truth::Segment;
use nalgebra::{DMatrix, DVector};

fn imu() -> ImuSpec {
    constants_only(&ImuSpec::preset("medium").unwrap())
}

fn at_rest<'a>(imu: &'a ImuSpec, gnss: &'a GnssSpec, segments: &'a [Segment]) -> SessionConfig<'a> {
    SessionConfig {
        imu,
        gnss,
        start: Geodetic {
            lat: 0.5,
            lon: 1.0,
            h: 0.0,
        },
        heading: 0.0,
        standstill_s: 0.0,
        drive_s: 0.0,
        segments: Some(segments),
        vibration: 0.0,
        unit: 0,
        turn_on: 0,
        drive: 1,
    }
}

fn bias(triad: Triad, axis: usize, sigma: f64) -> ErrorModel {
    ErrorModel {
        parameters: vec![Parameter::constant(triad, axis, Regressor::One, sigma)],
        ..ErrorModel::default()
    }
}

/// Standard deviation, m/s2, of a constant acceleration on one axis from positions of `sigma` m at
/// `rate_hz` over `time_s`, with unknown start and speed. It holds for many fixes.
fn acceleration_sigma(sigma: f64, rate_hz: f64, time_s: f64) -> f64 {
    sigma * (720.0 / (rate_hz * time_s)).sqrt() / (time_s * time_s)
}

/// The known figures are 491 ug over 60 s and 8.8 ug over 300 s, from fixes of 5 m at 1
/// Hz. They are computed by formula, by least squares of the fixes, and by the bound of a vehicle
/// at rest with unknown position, speed and bias of one accelerometer.
#[test]
fn fixes_alone_give_the_known_acceleration() {
    let mut imu = imu();
    imu.accel.velocity_random_walk_ugpsqrthz = 0.0;
    imu.gyro.angle_random_walk_dpsqrth = 0.0;
    imu.gyro.dither.lock_in_dph = 0.0;
    (imu.gyro.pulse_arcsec, imu.accel.pulse_ugs) = (1e-6, 1e-6);
    let gnss = GnssSpec {
        horizontal_m: 5.0,
        vertical_m: 5.0,
        velocity_mps: 1e6,
        ..GnssSpec::default()
    };
    for (time, documented) in [(60, 491.0), (300, 8.8)] {
        let formula = acceleration_sigma(5.0, 1.0, f64::from(time)) / UG;
        assert!((formula / documented - 1.0).abs() < 0.005, "{formula}");
        let a = DMatrix::from_fn(time as usize + 1, 3, |k, j| {
            [1.0, k as f64, 0.5 * (k * k) as f64][j]
        });
        let least_squares = 5.0 * (a.transpose() * a).try_inverse().unwrap()[(2, 2)].sqrt() / UG;
        let segments = [Segment::hold(f64::from(time))];
        let config = at_rest(&imu, &gnss, &segments);
        let (truth, _) = host_core::simulator::session::drive(&config);
        let start = InitialSigma {
            tilt: 0.0,
            heading: 0.0,
            velocity: 1e3,
            position: 1e6,
        };
        // the bound has no fix at time 0, one fix less than the sums above
        let b = DMatrix::from_fn(time as usize, 3, |k, j| {
            let t = (k + 1) as f64;
            [1.0, t, 0.5 * t * t][j]
        });
        let want = 5.0 * (b.transpose() * b).try_inverse().unwrap()[(2, 2)].sqrt() / UG;
        let got = bound(
            &config,
            &truth,
            &bias(Triad::Accel, 0, 10.0),
            &start,
            &[time as usize],
        )[0][0]
            / UG;
        println!("{time} s: {formula:.2} {least_squares:.2} {want:.2} {got:.2} ug");
        assert!((least_squares / formula - 1.0).abs() < 0.05);
        // the Schuler period of 84 min bends a parabola of 300 s by 1 %
        assert!((got / want - 1.0).abs() < 0.02, "{time}: {got} {want}");
    }
}

/// A gyro at rest, whose tilt is known at the start and measured at the end, has the bound
/// ARW / sqrt(T).
#[test]
fn a_static_gyro_bias_is_bound_by_the_random_walk() {
    let mut imu = imu();
    imu.accel.velocity_random_walk_ugpsqrthz = 1e-3;
    imu.gyro.dither.lock_in_dph = 0.0;
    imu.gyro.angle_random_walk_dpsqrth = 0.01;
    (imu.gyro.pulse_arcsec, imu.accel.pulse_ugs) = (1e-6, 1e-6);
    let gnss = GnssSpec {
        horizontal_m: 1e-3,
        vertical_m: 1e-3,
        velocity_mps: 1e-5,
        ..GnssSpec::default()
    };
    let start = InitialSigma {
        tilt: 1e-9,
        heading: 1e-9,
        velocity: 1e-6,
        position: 1e-3,
    };
    let segments = [Segment::hold(400.0)];
    let config = at_rest(&imu, &gnss, &segments);
    let (truth, _) = host_core::simulator::session::drive(&config);
    for axis in [0, 1] {
        let model = bias(Triad::Gyro, axis, 1.0);
        let got = bound(&config, &truth, &model, &start, &[100, 400]);
        for (got, time) in got.iter().zip([100.0_f64, 400.0]) {
            let want = 0.01 * host_core::inertial::units::DEG_PER_SQRT_H / time.sqrt();
            assert!(
                (got[0] / want - 1.0).abs() < 0.02,
                "{axis} {time}: {} {want}",
                got[0]
            );
        }
    }
}

/// Longer learning on the same road or better fixes never make the bound larger, and it stays below
/// the prior.
#[test]
fn more_knowledge_never_widens_the_bound() {
    let imu = imu();
    let run = |metres: f64| {
        let gnss = GnssSpec {
            horizontal_m: metres,
            vertical_m: metres,
            velocity_mps: 0.1 * metres,
            ..GnssSpec::default()
        };
        let config = SessionConfig {
            standstill_s: 60.0,
            drive_s: 240.0,
            segments: None,
            ..at_rest(&imu, &gnss, &[])
        };
        let (truth, _) = host_core::simulator::session::drive(&config);
        bound(&config, &truth, &model(&imu), &AT_POWER_ON, &[60, 150, 300])
    };
    let (coarse, fine) = (run(2.0), run(0.2));
    let prior: Vec<f64> = model(&imu).parameters.iter().map(|p| p.sigma).collect();
    for q in 0..CONSTANTS {
        let least = 1.0 + 1e-9;
        assert!(coarse[0][q] <= prior[q] * least, "{q}");
        assert!(coarse[1][q] <= coarse[0][q] * least && coarse[2][q] <= coarse[1][q] * least);
        assert!(fine[2][q] <= coarse[2][q] * least);
    }
    // only the fixes show the vertical, so fixes ten times as good must show
    assert!(fine[2][29] < 0.7 * coarse[2][29]);
}

/// A filter with the right model and correct initial uncertainty reaches the bound: squared errors
/// over their variances are chi-square.
#[test]
fn an_efficient_estimator_attains_the_bound() {
    let question = Question {
        imu: ImuSpec::preset("medium").unwrap(),
        gnss: GnssSpec::default(),
        minutes: 5,
        units: 12,
        seed: 3,
    };
    let a = answer(&question, &|| ());
    assert_eq!(a.units, 12);
    let ekf24 = &a.reached[SCHEMES.iter().position(|s| s.0 == "ekf24").unwrap()];
    let end = a.times_s.len() - 1;
    let ratios = DVector::from_fn(CONSTANTS, |q, _| (ekf24[end][q] / a.bound[end][q]).powi(2));
    println!(
        "squared ratios {:.2} to {:.2}, mean {:.2}",
        ratios.min(),
        ratios.max(),
        ratios.mean()
    );
    // 12 units of 24 correlated constants: the standard deviation of the mean is 0.08 to 0.4, that
    // of one ratio 0.41
    assert!((0.6..1.5).contains(&ratios.mean()), "{ratios}");
    assert!(ratios.max() < 3.0, "{ratios}");
    // no scheme beats the bound of the mean errors, except by chance
    for (name, reached) in SCHEMES.iter().zip(&a.reached) {
        let pairs = reached[end].iter().zip(&a.bound[end]).enumerate();
        for (q, (reached, bound)) in pairs.skip(CONSTANTS) {
            assert!(*reached > 0.5 * bound, "{}: {q}", name.0);
        }
    }
}

#[test]
fn quantities_have_names_in_the_order_of_the_model() {
    let names: Vec<String> = (0..QUANTITIES).map(|i| quantity(i).0).collect();
    assert_eq!(names[0], "gyro bias x");
    assert_eq!(names[5], "accelerometer bias z");
    assert_eq!(
        (names[6].as_str(), names[7].as_str()),
        ("gyro scale x", "gyro misalignment xy")
    );
    assert_eq!(
        (names[23].as_str(), quantity(23).1),
        ("accelerometer scale z", "ppm")
    );
    assert_eq!(names[29], "accelerometer mean error z");
    for (i, p) in model(&imu()).parameters.iter().enumerate() {
        let kind = ["gyro", "accelerometer"][p.triad.index()];
        assert!(
            names[i].starts_with(kind) && names[i].contains(["x", "y", "z"][p.axis]),
            "{i}"
        );
    }
    assert_eq!(times(30), [60, 120, 300, 600, 1200, 1800]);
}
