use host_core::inertial::earth::Geodetic;
use host_core::inertial::ekf::{
    Aided, ErrorModel, InitialSigma, NAV, Noise, Prior, Record, smooth,
};
use host_core::inertial::sins::{Increment, NavState};
use host_core::inertial::units::{DEG_PER_H, UG};
use host_core::simulator::gnss::GnssSpec;
use host_core::simulator::truth::{DriveConfig, Truth, random_drive};
use nalgebra::{DMatrix, DVector, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Runs the filter with GNSS over a drive with constant biases in the increments.
fn run(seed: u64) -> (Aided, Vec<Record>, Truth, [Vector3<f64>; 2]) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let segments = random_drive(900.0, &mut rng);
    let start = Geodetic {
        lat: 0.55,
        lon: 1.9,
        h: 100.0,
    };
    let truth = Truth::new(
        &DriveConfig {
            segments: &segments,
            start,
            heading: 0.4,
            dt: 0.01,
            vibration: 1.0,
        },
        &mut rng,
    );
    let bias = [
        Vector3::new(0.2, -0.3, 0.1) * DEG_PER_H,
        Vector3::new(200.0, -300.0, 150.0) * UG,
    ];
    let prior = Prior {
        gyro_bias: 0.3 * DEG_PER_H,
        accel_bias: 300.0 * UG,
        walk_per_hour: 0.02,
        scale: [0.0; 2],
        misalignment: [0.0; 2],
    };
    let sigma = InitialSigma {
        tilt: 1e-4,
        heading: 1e-3,
        velocity: 0.05,
        position: 1.0,
    };
    let noise = Noise {
        gyro: 1e-6,
        accel: 1e-4,
    };
    let mut filter = Aided::new(truth.epochs[0], &sigma, ErrorModel::biases(&prior), noise);
    let gnss = GnssSpec::default();
    let mut records = Vec::new();
    for (k, increments) in truth
        .increments
        .chunks_exact(truth.samples_per_epoch)
        .enumerate()
    {
        for w in increments {
            let measured = Increment {
                dtheta: w.dtheta + bias[0] * truth.dt,
                dv: w.dv + bias[1] * truth.dt,
            };
            filter.step(&measured, truth.dt);
        }
        let fix = gnss.fix(&truth.epochs[k + 1], &mut rng);
        records.push(filter.fix(Some(&fix)));
    }
    (filter, records, truth, bias)
}

#[test]
fn biases_are_found_within_their_own_uncertainty() {
    let (filter, _, truth, bias) = run(11);
    for i in 0..6 {
        let error = filter.theta[i] - bias[i / 3][i % 3];
        let sigma = filter.p[(NAV + i, NAV + i)].sqrt();
        assert!(
            error.abs() < 3.5 * sigma,
            "parameter {i}: {error:e} sigma {sigma:e}"
        );
    }
    // the uncertainty has become small for the vertical accelerometer and the level gyros
    assert!(filter.p[(NAV + 5, NAV + 5)].sqrt() < 30.0 * UG);
    assert!(filter.p[(NAV, NAV)].sqrt() < 1e-3 && filter.p[(NAV + 1, NAV + 1)] > 0.0);
    let end = filter
        .sins
        .nav
        .position
        .ned_from(&truth.epochs.last().unwrap().position);
    assert!(end.norm() < 3.0, "{end:?}");
}

#[test]
fn smoothing_improves_position_and_keeps_the_biases() {
    let (_, records, truth, bias) = run(12);
    let smoothed = smooth(&records.clone().into());
    assert_eq!(smoothed.len(), records.len());
    let rms = |nav: &dyn Fn(usize) -> NavState| {
        let n = records.len();
        let sum: f64 = (50..n - 50)
            .map(|k| {
                nav(k)
                    .position
                    .ned_from(&truth.epochs[k].position)
                    .norm_squared()
            })
            .sum();
        (sum / (n - 100) as f64).sqrt()
    };
    let filtered = rms(&|k| records[k].nav);
    let smooth_rms = rms(&|k| smoothed[k].nav);
    assert!(
        smooth_rms < 0.7 * filtered,
        "smoothed {smooth_rms} m, filtered {filtered} m"
    );
    // the smoothed biases of the start use what the filter learns only later
    for i in 0..6 {
        let error = |theta: &DVector<f64>| (theta[i] - bias[i / 3][i % 3]).abs();
        assert!(
            error(&smoothed[5].theta) < 4.0 * smoothed[5].sigma[i],
            "parameter {i}"
        );
    }
}

#[test]
fn covariance_stays_symmetric_and_positive() {
    let (filter, _, _, _) = run(13);
    let p = &filter.p;
    assert!((p - p.transpose()).amax() <= 1e-12 * p.amax());
    let d = p.diagonal().map(|v| 1.0 / v.sqrt());
    let unit = DMatrix::from_fn(p.nrows(), p.ncols(), |i, j| p[(i, j)] * d[i] * d[j]);
    assert!(unit.symmetric_eigenvalues().min() > 0.0);
}
