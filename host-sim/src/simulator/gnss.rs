//! Errors of GNSS fixes: white noise, and what else a real receiver does. All but the white noise is
//! off by default, and each term has random numbers of its own: a term that is switched on changes
//! nothing in the others.

mod coloured;
mod spells;
#[cfg(test)]
mod tests;

pub use coloured::Coloured;
pub use spells::{Gaps, Multipath};

use crate::inertial::gnss::Fix;
use crate::inertial::sins::NavState;
use coloured::Wander;
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};
use spells::{Bursts, Spells};

/// Stream of the random numbers of the coloured errors. The white noise has stream 0.
const COLOURED_STREAM: u64 = 1;
/// Stream of the gaps.
const GAPS_STREAM: u64 = 2;
/// Streams of the times and of the shifts of multipath.
const MULTIPATH_STREAMS: [u64; 2] = [3, 4];

/// Errors of the receiver: standard deviations per axis, and what it tells of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GnssSpec {
    /// White part of the horizontal position, m, > 0.
    pub horizontal_m: f64,
    /// White part of the vertical position, m, > 0.
    pub vertical_m: f64,
    /// White part of the velocity, m/s, > 0.
    pub velocity_mps: f64,
    /// What the receiver tells of its accuracy, divided by the truth, 0.01 to 100. What a receiver
    /// tells is an estimate of its own (u-blox M8 protocol specification, UBX-NAV-PVT, fields hAcc,
    /// vAcc and sAcc), and nothing makes it true.
    pub told_factor: f64,
    /// Errors that last.
    pub coloured: Coloured,
    /// Times without fixes.
    pub gaps: Gaps,
    /// Bursts of multipath. They are no part of what the receiver tells.
    pub multipath: Multipath,
}

impl Default for GnssSpec {
    /// A single-frequency receiver in the open: 1 m, 1.5 m, 0.05 m/s.
    fn default() -> Self {
        Self {
            horizontal_m: 1.0,
            vertical_m: 1.5,
            velocity_mps: 0.05,
            told_factor: 1.0,
            coloured: Coloured::default(),
            gaps: Gaps::default(),
            multipath: Multipath::default(),
        }
    }
}

impl GnssSpec {
    /// Standard deviations of the white noise of north, east, down position (m), then velocity
    /// (m/s).
    #[must_use]
    pub fn sigmas(&self) -> [f64; 6] {
        let (h, v, s) = (self.horizontal_m, self.vertical_m, self.velocity_mps);
        [h, h, v, s, s, s]
    }

    /// Standard deviations that the receiver tells: those of white and coloured errors together,
    /// times [`told_factor`](Self::told_factor).
    #[must_use]
    pub fn told(&self) -> [f64; 6] {
        let (white, coloured) = (self.sigmas(), self.coloured.sigmas());
        std::array::from_fn(|i| self.told_factor * white[i].hypot(coloured[i]))
    }

    /// A fix of the true state with white noise only.
    #[must_use]
    pub fn fix(&self, truth: &NavState, rng: &mut ChaCha8Rng) -> Fix {
        let noise = self.sigmas().map(|s| {
            let z: f64 = StandardNormal.sample(rng);
            s * z
        });
        let position = truth
            .position
            .displaced(&Vector3::new(noise[0], noise[1], noise[2]));
        let velocity = truth.velocity + Vector3::new(noise[3], noise[4], noise[5]);
        Fix::new(position, velocity, self.told())
    }

    /// The fixes of these true states, which are `step_s` apart, with all errors.
    #[must_use]
    pub fn fixes(&self, truth: &[NavState], step_s: f64, rng: &mut ChaCha8Rng) -> Vec<Option<Fix>> {
        let mut wander = Wander::new(&self.coloured, step_s, stream(rng, COLOURED_STREAM));
        let mut gaps = Spells::gaps(&self.gaps, step_s, stream(rng, GAPS_STREAM));
        let streams = MULTIPATH_STREAMS.map(|number| stream(rng, number));
        let mut bursts = Bursts::new(&self.multipath, step_s, streams);
        let fix = |at: &NavState| {
            let mut fix = self.fix(at, rng);
            for error in [wander.next(), bursts.next()].iter().flatten() {
                add(&mut fix, error);
            }
            (!gaps.next_is_bad()).then_some(fix)
        };
        truth.iter().map(fix).collect()
    }
}

/// Random numbers that are independent of those of `rng`, which stays as it is.
fn stream(rng: &ChaCha8Rng, stream: u64) -> ChaCha8Rng {
    let mut own = rng.clone();
    own.set_stream(stream);
    own
}

/// Adds an error to position (m) and velocity (m/s).
fn add(fix: &mut Fix, error: &[f64; 6]) {
    let [n, e, d, velocity @ ..] = *error;
    fix.position = fix.position.displaced(&Vector3::new(n, e, d));
    fix.velocity += Vector3::from(velocity);
}
