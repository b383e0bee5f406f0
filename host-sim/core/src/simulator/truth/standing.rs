//! A vehicle that never moves: gusts of wind and people rock it on its suspension.

use super::attitude::Turned;
use super::dual::Dual;
use super::vibration::{IDLE, Shaker};
use super::waves::Waves;
use super::{Instant, Motion};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// A vehicle that stands all the time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Standing {
    /// Rocking of roll and pitch, deg, 1 sigma, 0 to 1; half of it in heading.
    pub rock_deg: f64,
    /// Velocity of the sway in each direction, m/s, 1 sigma, 0 to 0.05.
    pub sway_mps: f64,
}

impl Default for Standing {
    /// A parked car in some wind (assumed): 0.02 deg and 2 mm/s.
    fn default() -> Self {
        Self {
            rock_deg: 0.02,
            sway_mps: 0.002,
        }
    }
}

/// The motion of a [`Standing`] vehicle.
pub(super) struct Parked {
    duration: f64,
    heading: f64,
    gusts: Waves,
    shaker: Shaker,
}

impl Parked {
    /// Stands for `duration` s.
    pub(super) fn new(
        standing: &Standing,
        duration: f64,
        [heading, vibration]: [f64; 2],
        dt: f64,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        Self {
            duration,
            heading,
            gusts: Waves::of_air(standing.sway_mps, standing.rock_deg.to_radians(), rng),
            // engine and people, as in a car on the road that stands
            shaker: Shaker::new(rng, IDLE * vibration, dt),
        }
    }
}

impl Motion for Parked {
    fn duration(&self) -> f64 {
        self.duration
    }

    fn begin(&mut self, t: f64, second: bool) {
        self.shaker.begin(t, second);
    }

    fn at(&self, t: f64, node: usize) -> Instant {
        let [north, east, down, roll, pitch, yaw] = self.gusts.at(t);
        let shake = self.shaker.at(node);
        let angle = |i: usize| Dual::new(shake.angle[i], shake.rate[i]);
        let heave = Dual::new(shake.heave[0], shake.heave[1]);
        let attitude = Turned::level()
            .yaw(Dual::from(self.heading) + yaw + angle(2))
            .pitch(pitch + angle(1))
            .roll(roll + angle(0));
        Instant::of([north, east, down + heave], &attitude)
    }
}
