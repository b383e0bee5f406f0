//! The navigation's linearisation by itself, for learners that keep their own covariance.

use super::dynamics::Interval;
use super::{ErrorModel, NAV, Noise, Prior};
use crate::inertial::sins::{Increment, NavState};
use nalgebra::SMatrix;

/// Effect of what happened over a block on the navigation's errors.
#[derive(Debug, Clone)]
pub struct Block {
    /// dx(end)/dx(start).
    pub phi: SMatrix<f64, NAV, NAV>,
    /// dx(end) by errors of the estimates of gyro (rad/s) and accelerometer errors (m/s2) that hold through the block.
    pub gamma: SMatrix<f64, NAV, 6>,
    /// Covariance from white noise.
    pub q: SMatrix<f64, NAV, NAV>,
    /// Length, s.
    pub time: f64,
}

/// Gathers a [`Block`] word by word.
#[derive(Debug, Clone)]
pub struct Linearised {
    interval: Interval,
    biases: ErrorModel,
    noise: Noise,
}

impl Linearised {
    /// Sensors with this white noise.
    #[must_use]
    pub fn new(prior: &Prior, noise: Noise) -> Self {
        let biases = ErrorModel::biases(prior);
        Self {
            interval: Interval::new(biases.len()),
            biases,
            noise,
        }
    }

    /// Takes one corrected word; `nav` is the state after it.
    pub fn word(&mut self, nav: &NavState, word: &Increment, dt: f64) {
        self.interval.word(nav, word, dt, &self.biases, self.noise);
    }

    /// The block that ends now, at `nav`; a new one begins.
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
