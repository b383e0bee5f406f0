//! Noise of GNSS fixes: white noise on position and velocity.

use crate::inertial::gnss::Fix;
use crate::inertial::sins::NavState;
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

/// Noise of the receiver: standard deviations per axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GnssSpec {
    /// Horizontal position, m, > 0.
    pub horizontal_m: f64,
    /// Vertical position, m, > 0.
    pub vertical_m: f64,
    /// Velocity, m/s, > 0.
    pub velocity_mps: f64,
}

impl Default for GnssSpec {
    /// A single-frequency receiver in the open: 1 m, 1.5 m, 0.05 m/s.
    fn default() -> Self {
        Self {
            horizontal_m: 1.0,
            vertical_m: 1.5,
            velocity_mps: 0.05,
        }
    }
}

impl GnssSpec {
    /// Standard deviations of north, east, down position (m), then velocity (m/s).
    #[must_use]
    pub fn sigmas(&self) -> [f64; 6] {
        let (h, v, s) = (self.horizontal_m, self.vertical_m, self.velocity_mps);
        [h, h, v, s, s, s]
    }

    /// A fix of the true state.
    #[must_use]
    pub fn fix(&self, truth: &NavState, rng: &mut ChaCha8Rng) -> Fix {
        let sigmas = self.sigmas();
        let noise = sigmas.map(|s| {
            let z: f64 = StandardNormal.sample(rng);
            s * z
        });
        let position = truth
            .position
            .displaced(&Vector3::new(noise[0], noise[1], noise[2]));
        let velocity = truth.velocity + Vector3::new(noise[3], noise[4], noise[5]);
        Fix::new(position, velocity, sigmas)
    }
}
