//! The covariance recursion along the true drive.

use super::{QUANTITIES, sensor};
use crate::inertial::earth::Local;
use crate::inertial::ekf::{Aided, ErrorModel, Held, InitialSigma, Inputs, NAV, Noise};
use crate::inertial::gnss::Fix;
use crate::inertial::session::{EPOCH_S, Session};
use crate::inertial::units::{DEG_PER_SQRT_H, UG_PER_SQRT_HZ};
use crate::learning::teacher::aid;
use crate::simulator::imu::Imu;
use crate::simulator::session::SessionConfig;
use crate::simulator::truth::Truth;
use nalgebra::{DMatrix, DVector, Vector3};

/// Noise of words and fixes with quantisation in it.
#[derive(Debug, Clone, Copy)]
pub struct Noises {
    /// White noise of the sensors.
    pub words: Noise,
    /// Fixes: m, then m/s.
    pub fixes: [f64; 6],
}

/// White noise, and quantisation as what it amounts to. Pulses of size q are the rounding of a running sum, whose error is white with
/// sigma = q / sqrt(12) and is not summed up: that of the velocity stands beside the velocity of a fix; that of the angle tilts gravity by
/// as much for a word of length dt, which adds a velocity random walk of g sigma sqrt(dt).
#[must_use]
pub fn noises(config: &SessionConfig<'_>) -> Noises {
    let imu = config.imu;
    let lsb = Imu::lsb(imu);
    let [angle, velocity] = [lsb.rad, lsb.mps].map(|q| q / 12.0_f64.sqrt());
    let g = Local::at(config.start.lat, config.start.h).g;
    let tilting = g * angle / f64::from(imu.rate_hz).sqrt();
    let mut fixes = config.gnss.sigmas();
    fixes[3..].iter_mut().for_each(|s| *s = s.hypot(velocity));
    Noises {
        words: Noise {
            gyro: imu.gyro.total_angle_random_walk_dpsqrth() * DEG_PER_SQRT_H,
            accel: (imu.accel.velocity_random_walk_ugpsqrthz * UG_PER_SQRT_HZ).hypot(tilting),
        },
        fixes,
    }
}

/// Standard deviations of all quantities at each of `epochs` (rising). The vehicle is known to stand during the standstill.
#[must_use]
pub fn bound(
    config: &SessionConfig<'_>,
    truth: &Truth,
    model: &ErrorModel,
    start: &InitialSigma,
    epochs: &[usize],
) -> Vec<Vec<f64>> {
    let noises = noises(config);
    let exact = Session {
        dt: truth.dt,
        lsb: Imu::lsb(config.imu),
        counts: Vec::new(),
        standstill: (config.standstill_s / EPOCH_S) as usize,
        reference: truth.epochs.clone(),
        fixes: truth
            .epochs
            .iter()
            .map(|s| Fix {
                position: s.position,
                velocity: s.velocity,
            })
            .collect(),
        sigmas: noises.fixes,
        systematic: None,
        surroundings: None,
        gather: 1,
    };
    let mut filter = Aided::new(truth.epochs[0], start, model.clone(), noises.words);
    let mut out = Vec::new();
    let mut means = Means::new(model.len());
    for k in 0..epochs.last().copied().unwrap_or_default() {
        aid(&mut filter, &exact, &truth.increments, k);
        means.add(model, truth, k);
        if epochs.contains(&(k + 1)) {
            out.push(deviations(&filter, &means.jacobian()));
        }
    }
    out
}

/// Standard deviations of the constants, then of the six mean errors `j theta`.
fn deviations(filter: &Aided, j: &DMatrix<f64>) -> Vec<f64> {
    let n = j.ncols();
    let p = filter.p.view((NAV, NAV), (n, n));
    let of_means = (j * p * j.transpose()).diagonal();
    let all = p
        .diagonal()
        .iter()
        .chain(of_means.iter())
        .map(|v| v.sqrt())
        .collect::<Vec<_>>();
    debug_assert_eq!(all.len() + 24, QUANTITIES + n);
    all
}

/// Mean of the derivatives of the six errors by the parameters.
pub(super) struct Means {
    sum: DMatrix<f64>,
    epochs: f64,
}

impl Means {
    pub(super) fn new(n: usize) -> Self {
        Self {
            sum: DMatrix::zeros(6, n),
            epochs: 0.0,
        }
    }

    pub(super) fn add(&mut self, model: &ErrorModel, truth: &Truth, epoch: usize) {
        let [rate, force] = inputs(truth, epoch);
        let now = Inputs {
            rate,
            force,
            rate_change: Vector3::zeros(), // no constant has to do with them
            force_change: Vector3::zeros(),
            time: epoch as f64,
        };
        let mut one = DVector::zeros(model.len());
        for (i, p) in model.parameters.iter().enumerate() {
            // linear in the parameters: the errors of one alone are its derivatives
            one[i] = 1.0;
            let error = model.error(&one, &now, &mut Held::default())[p.triad.index()][p.axis];
            self.sum[(sensor(p.triad, p.axis), i)] += error;
            one[i] = 0.0;
        }
        self.epochs += 1.0;
    }

    pub(super) fn jacobian(&self) -> DMatrix<f64> {
        &self.sum / self.epochs.max(1.0)
    }
}

/// True mean rate and specific force of an epoch.
pub(super) fn inputs(truth: &Truth, epoch: usize) -> [Vector3<f64>; 2] {
    let n = truth.samples_per_epoch;
    let words = &truth.increments[epoch * n..(epoch + 1) * n];
    let rate: Vector3<f64> = words.iter().map(|w| w.dtheta).sum();
    let force: Vector3<f64> = words.iter().map(|w| w.dv).sum();
    [rate / EPOCH_S, force / EPOCH_S]
}

/// Closed form for one axis and nothing but positions: the standard deviation (m/s2) of a constant acceleration from positions of
/// `sigma` m at `rate_hz` over `time_s`, start and speed unknown; sigma sqrt(720 / (rate time)) / time^2 for many fixes.
#[must_use]
pub fn acceleration_sigma(sigma: f64, rate_hz: f64, time_s: f64) -> f64 {
    sigma * (720.0 / (rate_hz * time_s)).sqrt() / (time_s * time_s)
}
