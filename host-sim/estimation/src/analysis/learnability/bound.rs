//! The bound: the covariance of the filter along the true drive.

use super::{QUANTITIES, sensor};
use crate::learning::teacher::aid;
use host_core::inertial::earth::Local;
use host_core::inertial::ekf::{Aided, ErrorModel, InitialSigma, Inputs, NAV, Noise, SlowErrors};
use host_core::inertial::gnss::Fix;
use host_core::inertial::session::{EPOCH_S, Session};
use host_core::inertial::sins::NavState;
use host_core::inertial::units::{DEG_PER_SQRT_H, UG_PER_SQRT_HZ};
use host_core::simulator::imu::Imu;
use host_core::simulator::session::SessionConfig;
use host_core::simulator::truth::Truth;
use nalgebra::{DMatrix, DVector, Vector3};

/// Noise of samples and fixes, with quantisation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noises {
    /// White noise of the sensors.
    pub(super) samples: Noise,
    /// Standard deviations of fixes: m, then m/s.
    pub(super) fixes: [f64; 6],
}

/// White noise, with the effect of quantisation. Pulses of size q round a running sum, so their
/// error is white with sigma = q / sqrt(12) and does not accumulate. That of the velocity adds to
/// the velocity error of a fix. That of the angle tilts gravity by as much for a sample of length
/// dt, which adds a velocity random walk of g sigma sqrt(dt).
pub(super) fn noises(config: &SessionConfig<'_>) -> Noises {
    let imu = config.imu;
    let lsb = Imu::lsb(imu);
    let [angle, velocity] = [lsb.rad, lsb.mps].map(|q| q / 12.0_f64.sqrt());
    let g = Local::at(config.start.lat, config.start.h).g;
    let tilting = g * angle / f64::from(imu.rate_hz).sqrt();
    let mut fixes = config.gnss.sigmas();
    fixes[3..].iter_mut().for_each(|s| *s = s.hypot(velocity));
    Noises {
        samples: Noise {
            gyro: imu.gyro.total_angle_random_walk_dpsqrth() * DEG_PER_SQRT_H,
            accel: (imu.accel.velocity_random_walk_ugpsqrthz * UG_PER_SQRT_HZ).hypot(tilting),
        },
        fixes,
    }
}

/// Standard deviations of all quantities at each of the rising `epochs`. The filter knows that the
/// vehicle stands during the standstill.
pub(super) fn bound(
    config: &SessionConfig<'_>,
    truth: &Truth,
    model: &ErrorModel,
    start: &InitialSigma,
    epochs: &[usize],
) -> Vec<Vec<f64>> {
    let noises = noises(config);
    let fix = |s: &NavState| Some(Fix::new(s.position, s.velocity, noises.fixes));
    let fixes = truth.epochs.iter().map(fix).collect();
    let samples = (Vec::new(), Imu::lsb(config.imu));
    let exact = Session {
        standstill: (config.standstill_s / EPOCH_S) as usize,
        ..Session::new(truth.dt, samples, truth.epochs.clone(), fixes)
    };
    let mut filter = Aided::new(truth.epochs[0], start, model.clone(), noises.samples);
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

/// Mean derivatives of the six sensor errors with respect to the parameters.
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
            rate_change: Vector3::zeros(), // the constants do not depend on changes
            force_change: Vector3::zeros(),
            time: epoch as f64,
        };
        let mut one = DVector::zeros(model.len());
        for (i, p) in model.parameters.iter().enumerate() {
            // errors are linear in the parameters, so those of one parameter are its derivatives
            one[i] = 1.0;
            let error =
                model.error(&one, &now, &mut SlowErrors::default())[p.triad.index()][p.axis];
            self.sum[(sensor(p.triad, p.axis), i)] += error;
            one[i] = 0.0;
        }
        self.epochs += 1.0;
    }

    pub(super) fn jacobian(&self) -> DMatrix<f64> {
        &self.sum / self.epochs.max(1.0)
    }
}

/// True mean angular rate and specific force of an epoch.
pub(super) fn inputs(truth: &Truth, epoch: usize) -> [Vector3<f64>; 2] {
    let n = truth.samples_per_epoch;
    let increments = &truth.increments[epoch * n..(epoch + 1) * n];
    let rate: Vector3<f64> = increments.iter().map(|w| w.dtheta).sum();
    let force: Vector3<f64> = increments.iter().map(|w| w.dv).sum();
    [rate / EPOCH_S, force / EPOCH_S]
}
