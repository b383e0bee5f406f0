//! How often the intervals hold the truth, over simulated units with all errors of their sheets.

use super::*;
use crate::learning::device::Device;
use crate::learning::teacher::{aid, aligned};
use host_core::inertial::earth::Geodetic;
use host_core::inertial::ekf::{InitialSigma, displaced};
use host_core::inertial::sins::{Increment, NavState};
use host_core::inertial::units::{DEG, DEG_PER_H, G0};
use host_core::simulator::gnss::GnssSpec;
use host_core::simulator::imu::{Group, ImuSpec};
use host_core::simulator::session::{Drive, SessionConfig, measure};
use host_core::simulator::truth::VehicleName;
use host_unit::Unit;
use host_unit::scenario::Scenario;
use nalgebra::{DVector, SVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use statrs::distribution::{Binomial, ChiSquared, ContinuousCDF, DiscreteCDF};

const Z_95: f64 = 1.96;
/// Probability with which a band is left, on each side: a few hundred are looked at.
const TAIL: f64 = 1e-6;
const DRIVE_S: f64 = 300.0;
const START: InitialSigma = InitialSigma {
    tilt: 0.3 * DEG,
    heading: DEG,
    velocity: 0.1,
    position: 1.0,
};

/// Units whose 95 % interval holds the true bias, axis by axis: by the filter's own covariance, and
/// by the larger of that and the considered one; and the sum of the normalised squares of the
/// errors by the considered one.
struct Coverage {
    claimed: [u64; BIASES],
    printed: [u64; BIASES],
    squares: f64,
}

/// Whose biases and claims are looked at.
#[derive(Clone, Copy, PartialEq)]
enum By {
    /// The desktop's filter with six biases.
    Filter,
    /// The device after a standstill, as a page prints it.
    Device,
}

impl By {
    fn standstill_s(self) -> f64 {
        match self {
            By::Filter => 10.0,
            By::Device => 120.0,
        }
    }
}

fn config<'a>(imu: &'a ImuSpec, gnss: &'a GnssSpec, by: By, unit: u64) -> SessionConfig<'a> {
    SessionConfig {
        gnss,
        start: Geodetic {
            lat: 0.8,
            lon: 0.2,
            h: 100.0,
        },
        ..SessionConfig::new(
            imu,
            [by.standstill_s(), DRIVE_S],
            [unit, unit + 1_000_000, 5],
        )
    }
}

fn held(by: By, preset: &str, vehicle: VehicleName, units: u64) -> Coverage {
    let of_preset = Unit::preset(preset).unwrap();
    let (simulated, mut a) = (of_preset.simulated(), Assumptions::of(&of_preset));
    let g = simulated.gyro.g_sensitivity_dphpg;
    let g = g.max(0.01 * simulated.expected_bias()[0]);
    a.g_sensitivity = a.g_sensitivity.max(g * DEG_PER_H / G0);
    let mut spec = simulated.scaled(|group| match group {
        Group::Noise | Group::Condition | Group::Constant | Group::Wander => 1.0,
        _ => 0.0,
    });
    (spec.rate_hz, spec.gyro.g_sensitivity_dphpg) = (50, g);
    let mut biases = spec.clone();
    biases.gyro.g_sensitivity_dphpg = 0.0;
    (biases.gyro.scale_ppm, biases.gyro.misalignment_arcsec) = (0.0, 0.0);
    (biases.accel.scale_ppm, biases.accel.misalignment_arcsec) = (0.0, 0.0);
    let gnss = GnssSpec::default();
    let mut scenario = Scenario::default();
    scenario.vehicle_name = vehicle;
    let drive = Drive::of(&scenario.vehicle(), &config(&spec, &gnss, by, 0));
    let measured = |imu: &ImuSpec, unit, rng: &mut ChaCha8Rng| {
        let fixes = gnss.fixes(&drive.truth.epochs, 1.0, rng);
        let mut session = measure(&config(imu, &gnss, by, unit), imu, &drive.truth, &fixes);
        if by == By::Filter {
            session.standstill = 0;
        }
        session
    };
    let each = (0..units).into_par_iter().map(|unit| {
        let mut rng = ChaCha8Rng::seed_from_u64(unit);
        let session = measured(&spec, unit, &mut rng);
        let truth = measured(&biases, unit, &mut rng).systematic.unwrap();
        let truth = truth.last().unwrap();
        let increments = session.increments();
        let (estimate, claimed, covariance) = match by {
            By::Filter => by_filter(&session, &increments, &a, &drive.truth.epochs[0], &mut rng),
            By::Device => by_device(&session, &increments, &a, &of_preset),
        };
        let of = truth.dtheta.iter().chain(&truth.dv).copied();
        let truth = SVector::<f64, BIASES>::from_iterator(of);
        let error = SVector::<f64, BIASES>::from_fn(|k, _| estimate[k] - truth[k]);
        let squares = error.dot(&(covariance.try_inverse().unwrap() * error));
        let holds = |sigma: f64, k: usize| u64::from(error[k].abs() < Z_95 * sigma);
        let printed = |k: usize| claimed[k].max(covariance[(k, k)].sqrt());
        let own: [u64; BIASES] = std::array::from_fn(|k| holds(claimed[k], k));
        (own, std::array::from_fn(|k| holds(printed(k), k)), squares)
    });
    let add = |a: [u64; BIASES], b: [u64; BIASES]| std::array::from_fn(|k| a[k] + b[k]);
    let sum = each.reduce(
        || ([0; BIASES], [0; BIASES], 0.0),
        |a, b| (add(a.0, b.0), add(a.1, b.1), a.2 + b.2),
    );
    Coverage {
        claimed: sum.0,
        printed: sum.1,
        squares: sum.2,
    }
}

/// Estimated biases, their claimed standard deviations, and the considered covariance.
type Estimated = ([f64; BIASES], [f64; BIASES], Covariance);

fn by_filter(
    session: &Session,
    increments: &[Increment],
    a: &Assumptions,
    truth: &NavState,
    rng: &mut ChaCha8Rng,
) -> Estimated {
    let sigmas = [START.tilt, START.tilt, START.heading];
    let sigmas = [sigmas, [START.velocity; 3], [START.position; 3]].concat();
    let error = sigmas.iter().map(|sigma| {
        let z: f64 = StandardNormal.sample(rng);
        sigma * z
    });
    let nav = displaced(truth, &DVector::from_iterator(NAV, error));
    let begun = |model| Aided::new(nav, &START, model, a.noise);
    let prior = a.walking(a.datasheet_walk()).prior;
    let mut filter = begun(ErrorModel::biases(&prior));
    let epochs = 0..session.epochs();
    epochs.clone().for_each(|k| {
        aid(&mut filter, session, &increments, k);
    });
    let all = considered(session, &increments, a, begun, epochs);
    (
        std::array::from_fn(|k| filter.theta[k]),
        std::array::from_fn(|k| filter.p[(NAV + k, NAV + k)].sqrt()),
        *all.last().unwrap(),
    )
}

fn by_device(
    session: &Session,
    increments: &[Increment],
    a: &Assumptions,
    unit: &Unit,
) -> Estimated {
    let aligned = aligned(session, &increments).unwrap();
    let filter = |model| aligned.filter(model, a);
    let epochs = aligned.first..session.epochs();
    let all = considered(session, &increments, a, filter, epochs);
    let drive = Device::of_unit(unit)
        .unwrap()
        .drive_session(session, session.epochs());
    let last = drive.diary.entries.last().unwrap();
    (
        last.estimate.map(f64::from),
        last.sigma.map(f64::from),
        *all.last().unwrap(),
    )
}

/// The intervals of all pairs of a preset and a vehicle. The claims alone fail this test.
fn all_hold(by: By, presets: &[&str], vehicles: &[(&str, VehicleName)], units: u64) {
    let of_units = Binomial::new(0.95, units).unwrap();
    let least = of_units.inverse_cdf(TAIL);
    let chi = ChiSquared::new((BIASES as u64 * units) as f64).unwrap();
    let band = [chi.inverse_cdf(TAIL), chi.inverse_cdf(1.0 - TAIL)];
    let (mut wrong, mut missed) = (Vec::new(), 0);
    for preset in presets {
        for (name, vehicle) in vehicles {
            let held = held(by, preset, *vehicle, units);
            let per = held.squares / (BIASES as u64 * units) as f64;
            println!(
                "{preset}, {name}: of {units} at least {least}: claimed {:?}, printed {:?}, NEES {per:.2}",
                held.claimed, held.printed
            );
            missed += held.claimed.iter().filter(|held| **held < least).count();
            if held.printed.iter().any(|held| *held < least) || held.squares > band[1] {
                wrong.push(format!(
                    "{preset}, {name}: {:?}, NEES {per:.2}",
                    held.printed
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(missed > 0, "the filter's own covariance would do");
}

#[test]
fn printed_intervals_hold_the_biases() {
    let vehicles = [
        ("road", VehicleName::Road),
        ("hand-held", VehicleName::HandHeld),
    ];
    all_hold(By::Filter, &["medium", "mems"], &vehicles, 60);
}

/// The device's own estimates, of its likeliest candidate.
#[test]
#[ignore = "a minute: cargo test --release -p host-lab -- --ignored intervals_of_the_device"]
fn printed_intervals_of_the_device_hold() {
    all_hold(
        By::Device,
        &["medium", "mems"],
        &[("road", VehicleName::Road)],
        200,
    );
}

/// All presets that the simulator draws units of, and all vehicles.
#[test]
#[ignore = "minutes: cargo test --release -p host-lab -- --ignored printed_intervals"]
fn printed_intervals_hold_the_biases_of_all_presets_and_vehicles() {
    let presets = ["mems", "fog", "medium", "tactical", "nav"];
    all_hold(By::Filter, &presets, &VehicleName::NAMES, 200);
}
