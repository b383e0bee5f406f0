//! The coloured part of a receiver's errors: ionosphere, orbits and slow multipath last for
//! minutes.
//!
//! Each axis is a first-order Gauss-Markov process of its own, which is also called an
//! Ornstein-Uhlenbeck process. "Comparison of Enhanced Noise Model Performance Based on Analysis of
//! Civilian GPS Data" (Sensors 2020, 20, 6050) finds that it describes fixes of standing
//! single-frequency receivers better than white noise does.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

/// The coloured errors. Off while all standard deviations are 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Coloured {
    /// Standard deviation of the horizontal position per axis, m.
    pub horizontal_m: f64,
    /// Standard deviation of the vertical position, m.
    pub vertical_m: f64,
    /// Standard deviation of the velocity per axis, m/s.
    pub velocity_mps: f64,
    /// Time constant of the position errors, s, > 0. The autocorrelation that D. L. Wilson
    /// measured ("GPS horizontal position accuracy", Garmin 12XL) bends after about one minute.
    pub time_s: f64,
    /// Time constant of the velocity errors, s, > 0 (assumed: much shorter).
    pub velocity_time_s: f64,
}

impl Default for Coloured {
    fn default() -> Self {
        Self {
            horizontal_m: 0.0,
            vertical_m: 0.0,
            velocity_mps: 0.0,
            time_s: 60.0,
            velocity_time_s: 5.0,
        }
    }
}

impl Coloured {
    /// Whether there are any.
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.sigmas() != [0.0; 6]
    }

    /// Standard deviations of north, east, down position (m), then velocity (m/s).
    pub(super) fn sigmas(&self) -> [f64; 6] {
        let (h, v, s) = (self.horizontal_m, self.vertical_m, self.velocity_mps);
        [h, h, v, s, s, s]
    }
}

/// The state of the coloured errors.
pub(super) struct Wander {
    sigmas: [f64; 6],
    /// Factors by which position and velocity errors decay in a step.
    decay: [f64; 2],
    now: Option<[f64; 6]>,
    rng: ChaCha8Rng,
}

impl Wander {
    pub(super) fn new(spec: &Coloured, step_s: f64, rng: ChaCha8Rng) -> Self {
        let decay = [spec.time_s, spec.velocity_time_s].map(|time| (-step_s / time).exp());
        Self {
            sigmas: spec.sigmas(),
            decay,
            now: None,
            rng,
        }
    }

    /// The errors at the next epoch; `None` while the term is off. The first are drawn from the
    /// distribution that the process has at all times.
    pub(super) fn next(&mut self) -> Option<[f64; 6]> {
        if self.sigmas == [0.0; 6] {
            return None;
        }
        let drawn = self.sigmas.map(|sigma| {
            let z: f64 = StandardNormal.sample(&mut self.rng);
            sigma * z
        });
        let next = match self.now {
            None => drawn,
            Some(before) => std::array::from_fn(|i| {
                let decay = self.decay[i / 3];
                decay * before[i] + (1.0 - decay * decay).sqrt() * drawn[i]
            }),
        };
        self.now = Some(next);
        self.now
    }
}
