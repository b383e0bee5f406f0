//! The antenna: lever arm and latency of its fixes, as they are and as filters assume them.

use crate::inertial::earth::Local;
use crate::inertial::sins::{Increment, NavState, Sins};
use crate::simulator::truth::Truth;
use nalgebra::Vector3;

/// Times that differ by less than this share of a sample are the same.
const SAME: f64 = 1e-6;

/// Latency and lever arm as filters and the device's learner assume them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AntennaPrior {
    /// Age of a fix when it arrives, s, and its standard deviation.
    pub age_s: [f64; 2],
    /// From the IMU to the antenna: forward, right, down, m.
    pub lever_arm_m: [f64; 3],
    /// Standard deviation of the lever arm along each axis, m.
    pub lever_arm_sigma_m: f64,
}

/// Position and velocity of the antenna `sample` samples after power-on, where the IMU's state is
/// `at`. The rate is the mean of the samples that are nearest: of two at a border between samples.
#[must_use]
pub fn antenna(truth: &Truth, at: &NavState, sample: f64, arm: &Vector3<f64>) -> NavState {
    let here = Local::at(at.position.lat, at.position.h);
    let last = truth.increments.len();
    let around = (sample - 0.25).floor().max(0.0) as usize..(sample + 0.25).ceil() as usize;
    // the mean of the samples before and after; at the ends there is only one
    let around = around.start.min(last.saturating_sub(1))..around.end.min(last);
    let n = around.len() as f64;
    let turned: Vector3<f64> = truth.increments[around].iter().map(|i| i.dtheta).sum();
    let against_earth = at.q_bn.inverse_transform_vector(&here.omega_ie());
    let rate = turned / (n * truth.dt) - against_earth;
    NavState {
        position: at.position.displaced(&(at.q_bn * arm)),
        velocity: at.velocity + at.q_bn * rate.cross(arm),
        q_bn: at.q_bn,
    }
}

/// The true states of the IMU at any times, which must ascend. Between epochs they are integrated
/// from the perfect increments, starting at the epoch before.
pub(super) struct Path<'a> {
    truth: &'a Truth,
    sins: Sins,
    /// Samples that the navigator has processed since power-on.
    taken: usize,
}

impl<'a> Path<'a> {
    pub(super) fn new(truth: &'a Truth) -> Self {
        let sins = Sins::new(truth.epochs[0]);
        let taken = 0;
        Self { truth, sins, taken }
    }

    /// The state `sample` samples after power-on; the last epoch's after that.
    pub(super) fn at(&mut self, sample: f64) -> NavState {
        let Truth {
            dt,
            samples_per_epoch: n,
            ref increments,
            ref epochs,
        } = *self.truth;
        let whole = (sample + SAME).floor() as usize;
        let epoch = (whole / n).min(epochs.len() - 1);
        if self.taken < epoch * n {
            self.sins = Sins::new(epochs[epoch]);
            self.taken = epoch * n;
        }
        let end = whole.min(increments.len());
        for increment in increments.get(self.taken..end).unwrap_or_default() {
            self.sins.step(increment, dt);
        }
        self.taken = self.taken.max(end);
        if whole == epoch * n && sample - whole as f64 <= SAME {
            return epochs[epoch];
        }
        let share = sample - whole as f64;
        match increments.get(whole) {
            Some(next) if share > SAME => {
                let part = Increment {
                    dtheta: next.dtheta * share,
                    dv: next.dv * share,
                };
                let mut sins = self.sins.clone();
                sins.step(&part, share * dt);
                sins.nav
            }
            _ => self.sins.nav,
        }
    }
}
