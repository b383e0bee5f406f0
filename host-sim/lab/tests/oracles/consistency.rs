//! Consistency of the filters. Normalised squares over Monte-Carlo runs must lie inside their
//! two-sided 99.9 % chi-square bounds (Bar-Shalom, Li and Kirubarajan 2001, sec. 5.4): of the
//! navigation error (NEES) at three epochs, and of the innovations (NIS) over two stretches. Unit,
//! turn-on, heading, road, fixes and first velocity are drawn from what the filter assumes. Each
//! classical filter has an IMU with the errors of its model. The oracle has the groups of errors of
//! the simulator.

use host_core::inertial::earth::Geodetic;
use host_core::inertial::ekf::{Aided, ErrorModel, NAV};
use host_core::inertial::session::Session;
use host_core::inertial::sins::{Increment, NavState};
use host_core::simulator::gnss::GnssSpec;
use host_core::simulator::imu::{ErrorModelName, ImuSpec};
use host_core::simulator::session::{SessionConfig, simulate};
use host_estimation::learning::teacher::{Aligned, Assumptions, aligned};
use host_lab::campaign::oracle;
use nalgebra::{DMatrix, DVector, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

const RUNS: u64 = 30;
const STANDSTILL_S: usize = 300;
const DRIVE_S: usize = 900;
/// Epochs of the NEES, and limits of the stretches of the NIS: end of the alignment, while driving,
/// end of aiding.
const EPOCHS: [usize; 3] = [100, 700, STANDSTILL_S + DRIVE_S];

/// Results of one run: NEES at [`EPOCHS`], and the sums of the NIS over the stretches between them.
#[derive(Debug, Clone, Copy, Default)]
struct Squares {
    nees: [f64; 3],
    nis: [f64; 2],
}

fn session(imu: &ImuSpec, run: u64) -> Session {
    let mut rng = ChaCha8Rng::seed_from_u64(900 + run);
    let config = SessionConfig {
        imu,
        gnss: &GnssSpec::default(),
        start: Geodetic {
            lat: 0.6,
            lon: 2.0,
            h: 60.0,
        },
        heading: rng.random_range(0.0..std::f64::consts::TAU),
        standstill_s: STANDSTILL_S as f64,
        drive_s: DRIVE_S as f64,
        segments: None,
        vibration: 1.0,
        unit: rng.random(),
        turn_on: rng.random(),
        drive: rng.random(),
    };
    simulate(&config).0
}

/// Squared error of the nine navigation states, normalised by their covariance.
fn nees(filter: &Aided, truth: &NavState) -> f64 {
    let nav = &filter.sins.nav;
    let phi = (truth.q_bn * nav.q_bn.inverse()).scaled_axis();
    let dv = nav.velocity - truth.velocity;
    let dr = nav.position.ned_from(&truth.position);
    let e = DVector::from_iterator(NAV, phi.iter().chain(&dv).chain(&dr).copied());
    let p = filter.p.view((0, 0), (NAV, NAV));
    let unit = e.zip_map(&p.diagonal(), |e, v| e / v.sqrt());
    let correlation = DMatrix::from_fn(NAV, NAV, |i, j| p[(i, j)] / (p[(i, i)] * p[(j, j)]).sqrt());
    unit.dot(&correlation.cholesky().unwrap().solve(&unit))
}

/// An IMU, and the filter that knows its errors.
struct Subject {
    name: &'static str,
    imu: ImuSpec,
    model: fn(&ImuSpec, &Session) -> ErrorModel,
    /// Standard deviation of a ramp of each gyro (rad/s per hour) and accelerometer (m/s2 per
    /// hour). No error of the simulator is a ramp.
    ramps: [f64; 2],
    /// Noise of the filter relative to the true noise.
    noise: f64,
}

/// Adds a ramp drawn from `sigmas` to every axis.
fn add_ramps(increments: &mut [Increment], dt: f64, sigmas: [f64; 2], rng: &mut ChaCha8Rng) {
    let mut draw = |sigma: f64| {
        Vector3::from_fn(|_, _| {
            let z: f64 = StandardNormal.sample(rng);
            z * sigma
        })
    };
    let (gyro, accel) = (draw(sigmas[0]), draw(sigmas[1]));
    for (k, increment) in increments.iter_mut().enumerate() {
        let hours = (k as f64 + 0.5) * dt / 3600.0;
        increment.dtheta += gyro * (hours * dt);
        increment.dv += accel * (hours * dt);
    }
}

fn run(subject: &Subject, number: u64) -> Squares {
    let session = Session {
        gather: 10,
        ..session(&subject.imu, number)
    };
    let mut rng = ChaCha8Rng::seed_from_u64(number);
    let mut increments = session.increments();
    add_ramps(&mut increments, session.step_s(), subject.ramps, &mut rng);
    let mut assumptions = Assumptions::of_simulated(&subject.imu);
    assumptions.noise.gyro *= subject.noise;
    assumptions.noise.accel *= subject.noise;
    let mut aligned = aligned(&session, &increments).unwrap();
    let filter =
        |aligned: &Aligned| aligned.filter((subject.model)(&subject.imu, &session), &assumptions);
    // the velocity is drawn, because the simulated vehicle moves less at standstill than the filter
    // assumes
    let p = filter(&aligned).p;
    for i in 3..6 {
        let z: f64 = StandardNormal.sample(&mut rng);
        aligned.nav.velocity[i - 3] =
            session.reference[aligned.first].velocity[i - 3] + z * p[(i, i)].sqrt();
    }
    let mut filter = filter(&aligned);
    let mut out = Squares::default();
    let n = session.steps_per_epoch();
    assert_eq!(aligned.first, EPOCHS[0]);
    for k in EPOCHS[0]..=EPOCHS[2] {
        if let Some(i) = EPOCHS.iter().position(|e| *e == k) {
            out.nees[i] = nees(&filter, &session.reference[k]);
        }
        if k < EPOCHS[2] {
            for increment in &increments[k * n..(k + 1) * n] {
                filter.step(increment, session.step_s());
            }
            let record = filter.fix(session.fixes[k + 1].as_ref());
            out.nis[usize::from(k >= EPOCHS[1])] += record.nis;
        }
    }
    out
}

/// Each sum over the runs, per degree of freedom, and whether it lies within its bounds.
fn judged(subject: &Subject) -> Vec<(&'static str, f64, bool)> {
    let runs: Vec<Squares> = (0..RUNS).into_par_iter().map(|k| run(subject, k)).collect();
    let names = [
        "NEES after alignment",
        "NEES while driving",
        "NEES at the end",
        "NIS of the first half",
        "NIS of the second half",
    ];
    let stretch = |i: usize| 6 * (EPOCHS[i + 1] - EPOCHS[i]);
    let freedom = [NAV, NAV, NAV, stretch(0), stretch(1)];
    (0..names.len())
        .map(|i| {
            let sum: f64 = runs
                .iter()
                .map(|r| if i < 3 { r.nees[i] } else { r.nis[i - 3] })
                .sum();
            let freedom = freedom[i] as f64 * RUNS as f64;
            let chi = ChiSquared::new(freedom).unwrap();
            let (low, high) = (chi.inverse_cdf(0.0005), chi.inverse_cdf(0.9995));
            let within = (low..=high).contains(&sum);
            println!(
                "{}: {} {:.4} ({:.4} .. {:.4})",
                subject.name,
                names[i],
                sum / freedom,
                low / freedom,
                high / freedom
            );
            (names[i], sum / freedom, within)
        })
        .collect()
}

fn consistent(subject: &Subject) {
    for (name, value, within) in judged(subject) {
        assert!(
            within,
            "{}: {name} is {value} per degree of freedom",
            subject.name
        );
    }
}

/// All errors of a group, and the filter with parameters for each of them.
fn oracle_of(group: ErrorModelName) -> Subject {
    let mut imu = ImuSpec::preset("medium").unwrap().error_model(group);
    imu.rate_hz = 100;
    Subject {
        name: "oracle",
        imu,
        model: oracle,
        ramps: [0.0; 2],
        noise: 1.0,
    }
}

/// White noise, and biases that are drawn and walk as the classical filters assume.
fn walking(name: &'static str, model: fn(&ImuSpec, &Session) -> ErrorModel) -> Subject {
    let mut subject = oracle_of(ErrorModelName::Noise);
    let preset = ImuSpec::preset("medium").unwrap();
    let (gyro, accel) = (preset.gyro.bias_unit_dph, preset.accel.bias_unit_ug);
    let imu = &mut subject.imu;
    (imu.gyro.bias_unit_dph, imu.accel.bias_unit_ug) = (gyro, accel);
    let walk = Assumptions::of_simulated(imu).prior.walk_per_hour;
    imu.gyro.rate_random_walk_dphpsqrth = walk * gyro;
    imu.accel.acceleration_random_walk_ugpsqrth = walk * accel;
    Subject {
        name,
        model,
        ..subject
    }
}

#[test]
fn ekf6_is_consistent_on_walking_biases() {
    consistent(&walking("ekf6", |imu, _| {
        ErrorModel::biases(&Assumptions::of_simulated(imu).prior)
    }));
}

#[test]
fn ekf12_is_consistent_with_scale_factors_too() {
    let mut subject = walking("ekf12", |imu, _| {
        ErrorModel::with_scale(&Assumptions::of_simulated(imu).prior)
    });
    (subject.imu.gyro.scale_ppm, subject.imu.accel.scale_ppm) = (300.0, 300.0);
    consistent(&subject);
}

#[test]
fn ekf24_is_consistent_with_matrices_too() {
    let mut subject = walking("ekf24", |imu, _| {
        ErrorModel::with_matrices(&Assumptions::of_simulated(imu).prior)
    });
    let (gyro, accel) = (&mut subject.imu.gyro, &mut subject.imu.accel);
    (gyro.scale_ppm, accel.scale_ppm) = (300.0, 300.0);
    (gyro.misalignment_arcsec, accel.misalignment_arcsec) = (60.0, 60.0);
    consistent(&subject);
}

#[test]
fn ekf_ramp_is_consistent_with_ramps_too() {
    let mut subject = walking("ekf-ramp", |imu, _| {
        ErrorModel::with_ramps(&Assumptions::of_simulated(imu).prior)
    });
    let prior = Assumptions::of_simulated(&subject.imu).prior;
    subject.ramps = [prior.gyro_bias, prior.accel_bias];
    consistent(&subject);
}

#[test]
fn consistent_on_noise_without_a_model() {
    consistent(&oracle_of(ErrorModelName::Noise));
}

#[test]
fn consistent_on_linear_errors() {
    consistent(&oracle_of(ErrorModelName::Linear));
}

#[test]
fn consistent_on_thermal_errors() {
    consistent(&oracle_of(ErrorModelName::Thermal));
}

#[test]
fn consistent_on_all_errors() {
    consistent(&oracle_of(ErrorModelName::All));
}

#[test]
fn a_filter_that_halves_its_noise_is_found_out() {
    let squares = judged(&Subject {
        noise: 0.5,
        ..oracle_of(ErrorModelName::Noise)
    });
    for (name, value, within) in &squares[..3] {
        assert!(!within && *value > 1.5, "{name} is {value}");
    }
}
