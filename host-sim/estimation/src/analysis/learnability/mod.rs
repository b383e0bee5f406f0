//! The best possible estimates of bias, scale factor and misalignment: their Cramer-Rao bound, and
//! the errors that the learning schemes reach.
//!
//! The bound is the covariance of a filter that knows everything except the state and the 24
//! constants. Run along the true drive it does not depend on the data, and with linear dynamics and
//! normal errors no estimator has a smaller mean square error (van Trees; Tichavsky et al. 1998).
//! The simulated units have these constants and white noise, but no drift, warm-up or nonlinearity.

mod bound;
mod lines;
mod reached;

use bound::bound;
pub use lines::{Line, Reached};
pub use reached::{SCHEMES, Scheme};
use reached::{Unit, unit};

use crate::learning::teacher::Assumptions;
use host_core::inertial::ekf::{ErrorModel, InitialSigma, Triad};
use host_core::inertial::units::{ARCSEC, DEG, DEG_PER_H, PPM, UG};
use host_core::simulator::gnss::GnssSpec;
use host_core::simulator::imu::{Group, ImuSpec};
use host_core::simulator::session::SessionConfig;
use host_unit::scenario::Scenario;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Number of constants of the six sensors: each has a bias and a row of three.
const CONSTANTS: usize = 24;
/// Number of constants and of mean errors of the six sensors over the learning time.
const QUANTITIES: usize = CONSTANTS + 6;
/// Standstill before the drive, s.
const STANDSTILL_S: u32 = 300;
/// Samples per second.
const RATE_HZ: u32 = 100;

/// Uncertainty of the state at power-on, before the samples improve it.
const AT_POWER_ON: InitialSigma = InitialSigma {
    tilt: DEG,
    heading: 5.0 * DEG,
    velocity: 0.01,
    position: 1.0,
};

/// The question: the IMU, the receiver, and the time of driving.
#[derive(Debug, Clone)]
pub struct Question {
    /// IMU.
    pub imu: ImuSpec,
    /// Receiver, of which bound and schemes know the white noise only. It must have no other
    /// errors: neither coloured ones nor gaps, multipath, latency or lever arm.
    pub gnss: GnssSpec,
    /// Longest time of driving, min.
    pub minutes: u32,
    /// Number of simulated units.
    pub units: u32,
    /// Seed of road and units.
    pub seed: u64,
}

/// The answer, in SI.
#[derive(Debug, Clone)]
pub struct Answer {
    /// Seconds of driving.
    pub times_s: Vec<u32>,
    /// Standard deviation of each quantity before learning.
    pub prior: Vec<f64>,
    /// Bound of each quantity at each time: `bound[time][quantity]`.
    pub bound: Vec<Vec<f64>>,
    /// Root mean square error over the units: `reached[scheme][time][quantity]`. NaN where a scheme
    /// does not estimate the quantity.
    pub reached: Vec<Vec<Vec<f64>>>,
    /// Number of units that were aligned.
    pub units: u32,
}

/// The IMU with constant bias, scale factor, misalignment and white noise only.
fn constants_only(imu: &ImuSpec) -> ImuSpec {
    let mut imu = imu.scaled(|group| match group {
        Group::Noise | Group::Condition | Group::Constant => 1.0,
        _ => 0.0,
    });
    imu.rate_hz = RATE_HZ;
    imu
}

/// The 24 constants with the standard deviations of the datasheet: the biases of the six sensors,
/// then their rows of three.
fn model(imu: &ImuSpec) -> ErrorModel {
    let mut model = ErrorModel::with_matrices(&Assumptions::of_simulated(imu).prior);
    model.parameters.iter_mut().for_each(|p| p.walk = 0.0);
    model
}

/// Name of a quantity, its unit, and the value of the unit in SI.
#[must_use]
pub fn quantity(i: usize) -> (String, &'static str, f64) {
    let axis = ["x", "y", "z"];
    let names = ["gyro", "accelerometer"];
    let unit = |k: usize| [("deg/h", DEG_PER_H), ("ug", UG)][k];
    let (what, k, a) = match i {
        0..6 => ("bias".to_owned(), i / 3, i % 3),
        6..CONSTANTS => {
            let (k, a, j) = ((i - 6) / 9, (i - 6) % 9 / 3, (i - 6) % 3);
            if a == j {
                return (format!("{} scale {}", names[k], axis[a]), "ppm", PPM);
            }
            let name = format!("{} misalignment {}{}", names[k], axis[a], axis[j]);
            return (name, "arcsec", ARCSEC);
        }
        _ => ("mean error".to_owned(), (i - CONSTANTS) / 3, i % 3),
    };
    let (unit, si) = unit(k);
    (format!("{} {what} {}", names[k], axis[a]), unit, si)
}

/// Learning times, seconds of driving: 1, 2, 5, 10, 20, 50, ... min, and `minutes`.
fn times(minutes: u32) -> Vec<u32> {
    let decades = [1, 2, 5, 10, 20, 50, 100, 200, 500];
    let mut out: Vec<u32> = decades.into_iter().filter(|t| *t < minutes).collect();
    out.push(minutes);
    out.into_iter().map(|t| 60 * t).collect()
}

/// Computes the bound along a drive and the errors that schemes reach with simulated units on it.
/// Calls `progress` after each unit.
#[must_use]
pub fn answer(question: &Question, progress: &(dyn Fn() + Sync)) -> Answer {
    let imu = constants_only(&question.imu);
    let times_s = times(question.minutes);
    let mut rng = ChaCha8Rng::seed_from_u64(question.seed);
    let home = Scenario::default();
    let config = SessionConfig {
        imu: &imu,
        gnss: &question.gnss,
        start: home.start(),
        heading: home.heading_deg.to_radians(),
        standstill_s: f64::from(STANDSTILL_S),
        drive_s: f64::from(60 * question.minutes),
        segments: None,
        vibration: home.vibration,
        unit: 0,
        turn_on: 0,
        drive: rng.random(),
    };
    let epochs: Vec<usize> = times_s
        .iter()
        .map(|t| (STANDSTILL_S + t) as usize)
        .collect();
    let model = model(&imu);
    let (truth, fixes) = host_core::simulator::session::drive(&config);
    let bound = bound(&config, &truth, &model, &AT_POWER_ON, &epochs);
    let seeds: Vec<[u64; 3]> = (0..question.units)
        .map(|_| [rng.random(), rng.random(), rng.random()])
        .collect();
    let units: Vec<Unit> = seeds
        .par_iter()
        .filter_map(|seeds| {
            let done = unit(&config, *seeds, (&truth, &fixes), &model, &epochs);
            progress();
            done
        })
        .collect();
    let mut prior: Vec<f64> = model.parameters.iter().map(|p| p.sigma).collect();
    prior.extend([f64::NAN; 6]);
    Answer {
        reached: reached::root_mean_square(&units, epochs.len()),
        units: units.len() as u32,
        times_s,
        prior,
        bound,
    }
}

/// Index of a sensor: gyros are 0 to 2, accelerometers 3 to 5.
fn sensor(triad: Triad, axis: usize) -> usize {
    3 * triad.index() + axis
}

#[cfg(test)]
mod tests;
