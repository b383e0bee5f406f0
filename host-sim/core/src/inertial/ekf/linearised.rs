//! The linearised navigation equations alone, for learners that keep their own covariance.

use super::dynamics::Interval;
use super::{ErrorModel, NAV, Noise, Prior};
use crate::inertial::sins::{Increment, NavState};
use nalgebra::SMatrix;

/// The linearised navigation equations over one block.
#[derive(Debug, Clone)]
pub struct Block {
    /// Derivative of the navigation errors at the end by those at the start.
    pub phi: SMatrix<f64, NAV, NAV>,
    /// Derivative of the navigation errors at the end by errors of the estimated gyro (rad/s) and
    /// accelerometer errors (m/s2) that are constant over the block.
    pub gamma: SMatrix<f64, NAV, 6>,
    /// Covariance from white noise.
    pub q: SMatrix<f64, NAV, NAV>,
    /// Length, s.
    pub time: f64,
}

/// Accumulates a [`Block`] increment by increment.
#[derive(Debug, Clone)]
pub struct Linearised {
    interval: Interval,
    biases: ErrorModel,
    noise: Noise,
}

impl Linearised {
    /// Starts for sensors with this white noise.
    #[must_use]
    pub fn new(prior: &Prior, noise: Noise) -> Self {
        let biases = ErrorModel::biases(prior);
        Self {
            interval: Interval::new(biases.len()),
            biases,
            noise,
        }
    }

    /// Accumulates one corrected increment. `nav` is the state after it.
    pub fn accumulate(&mut self, nav: &NavState, increment: &Increment, dt: f64) {
        self.interval
            .accumulate(nav, increment, dt, &self.biases, self.noise);
    }

    /// Ends the block at `nav` and returns it. A new block begins.
    pub fn take(&mut self, nav: &NavState) -> Block {
        self.interval.finish(nav, &self.biases, self.noise);
        let block = Block {
            phi: self.interval.phi,
            gamma: self.interval.psi.fixed_columns::<6>(0).into_owned(),
            q: self.interval.q,
            time: self.interval.time,
        };
        self.interval.reset();
        block
    }
}
