//! Reports on the learner: its estimates, and the results of its rehearsals.

use serde::{Deserialize, Serialize};

/// The answer to [`Request::GetSolution`](super::Request::GetSolution): the learner's navigator and
/// what it subtracts. Between a fix and the end of its work the values may be of both sides of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Solution {
    /// Latitude and longitude, rad.
    pub place: [f64; 2],
    /// Height, m.
    pub height: f32,
    /// Velocity over ground, north, east, down, m/s.
    pub velocity: [f32; 3],
    /// Body axes to north-east-down: unit quaternion, scalar first.
    pub attitude: [f32; 4],
    /// Sensor errors by the hypothesis that the navigator follows: rad/s, m/s2.
    pub estimate: [[f32; 3]; 2],
    /// Standard deviations of the estimates.
    pub sigma: [[f32; 3]; 2],
}

/// The answer to [`Request::GetProgress`](super::Request::GetProgress): how far the learner is on
/// its way to a correction, in few bytes. Each field is one step of the way.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Progress {
    /// The learner is aligned and compares itself with fixes.
    pub navigates: bool,
    /// Fixes learnt from.
    pub used_fixes: u32,
    /// The hypothesis that is nearest to its proof: its number in `crate::learn::bank::NAMES`. 0:
    /// none takes part yet.
    pub nearest: u8,
    /// Greatest capital of its bets, in stakes, as in [`Trials::proof`].
    pub proof: f32,
    /// It has proved itself.
    pub proved: bool,
    /// Networks that proved themselves in this drive are in the store, for the next power-on.
    pub stored: bool,
    /// A correction other than zero is in force.
    pub in_force: bool,
}

/// The answer to [`Request::GetTrials`](super::Request::GetTrials): how each hypothesis stands, in
/// the order of `crate::learn::bank::NAMES`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Trials {
    /// The hypothesis with the most evidence.
    pub leading: u8,
    /// Hypotheses that take part, a bit each.
    pub enabled: u8,
    /// Hypotheses that have proved themselves, a bit each.
    pub proved: u8,
    /// Rehearsals that have ended, at each of `crate::learn::rehearsal::HORIZONS_S`.
    pub ended: [u16; 6],
    /// Log-likelihood relative to the zero correction's.
    pub evidence: [f32; 8],
    /// Greatest capital of the bets that it is worth its use, in stakes:
    /// `crate::learn::rehearsal::of_100` makes of it how near the proof is.
    pub proof: [f32; 8],
    /// Least capital of the bets that it does no harm, in stakes.
    pub check: [f32; 8],
}
