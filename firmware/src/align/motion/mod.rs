//! Alignment in motion: attitude from samples and fixes, whatever the heading and the mounting.
//!
//! The last fixes and what the sensors gained between them are retained (`window.rs`). Several
//! guesses of the heading, all around, are each improved by passes over all of it (`pass.rs`), in
//! which the sensors' biases, a lever arm and a delay are found too. So no error of a start is left
//! in linear equations. The guess under which the fixes are the most likely is believed if every
//! other one has come to the same attitude, or is far less likely (`in_motion/judge.rs`).
//!
//! A receiver gives positions, velocities, or both. A velocity from two close positions is as noisy
//! as they are, and its noise is that of its neighbours with the other sign. So positions are
//! compared as positions (`pass/observe.rs`). On land the course shows the heading, forwards or
//! backwards, where the vehicle's forward axis is known.
//!
//! The biases may be ten times as large as the unit file says, or a tenth: the fixes find them.
//! What a receiver of positions alone says of its noise is corrected by what the fixes show.
//!
//! When the positions jump, those before it are forgotten.
//!
//! A pass is long. So it advances by one interval at a time between the samples: how far it is
//! depends on their number alone.

mod in_motion;
mod pass;
mod regression;
mod window;

pub use in_motion::InMotion;
pub use regression::BiasObservations;

use crate::control::HeadingSource;
use crate::nav;
use lrnn_nostd::learn::kalman::{OUTPUTS, Transition};

/// Number of the navigator's errors: attitude, velocity, position.
const ERRORS: usize = 9;
/// Largest standard deviation of a heading that is handed over, rad: the bank's errors are linear
/// up to it, to 2 % of the force.
pub const MAX_HEADING: f32 = 0.2;
/// The largest standard deviation of the tilt, rad.
const MAX_TILT: f32 = 0.05;
/// Rounds in a row that must pass all tests.
const PASSES: u8 = 3;
/// Largest mean normalised innovation squared of an alignment that is handed over; it is 1 when all
/// assumptions hold.
const GOOD_RESIDUAL: f32 = 2.0;
/// Above this the alignment restarts.
const BAD_RESIDUAL: f32 = 3.5;
/// Errors of the times of the fixes, s (assumed).
const TIMING_S: f32 = 0.03;
/// A fix is wild that is farther than this from the first one, m.
const FAR_M: f32 = 2e4;

/// Configuration of an alignment in motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// The navigator's configuration: counts, sample period, noise, lever arm.
    pub navigator: nav::Config,
    /// Standard deviations of the biases, rad/s and m/s2.
    pub bias: [f32; 2],
    /// Random walks of the biases, rad/s and m/s2 per sqrt(s).
    pub walk: [f32; 2],
    /// Errors in proportion to the motion (scale factors and misalignments together), as ratios:
    /// gyros, accelerometers.
    pub scale: [f32; 2],
    /// The vehicle's forward axis in the sensor's axes, unit vector; zero where the mounting is
    /// unknown. Then neither a course nor a heading of the vehicle says anything of the sensor's.
    pub forward: [f32; 3],
    /// Standard deviation of the navigator's lever arm along each axis, m.
    pub lever_arm_sigma: f32,
    /// The vehicle moves along its forward axis, forwards or backwards: on land.
    pub rolls: bool,
    /// A standstill is one: the vehicle does not float.
    pub stands: bool,
}

/// Progress of an alignment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Progress {
    /// Source of the heading so far; [`HeadingSource::None`] before there are guesses.
    pub way: HeadingSource,
    /// Standard deviation of the heading, rad; infinite while it is unknown.
    pub heading_sigma: f32,
    /// Mean normalised innovation squared of the last fixes; 1 when all assumptions hold.
    pub residual: f32,
    /// Alignments that restarted because their innovations were too large.
    pub refused: u32,
}

/// A state to start from. Its errors are in the scratch memory of [`InMotion::fix`], in the order
/// attitude (rad), velocity (m/s), position (m), each north, east, down.
///
/// They are `gamma` times the sensors' errors that are left when `applied` has been subtracted,
/// plus others of covariance `q`. So they are given the sensors' errors, whatever is assumed about
/// these. `phi` is the covariance of both, as far as the alignment knows the sensors' errors.
#[derive(Debug, Clone, Copy)]
pub struct AlignedState {
    /// State at the end of the last sample.
    pub state: nav::State,
    /// The alignment's estimate of the sensors' errors, rad/s and m/s2.
    pub applied: [f32; OUTPUTS],
    /// Observations of them by the fixes.
    pub observed: BiasObservations,
    /// Source of the heading.
    pub way: HeadingSource,
    /// Standard deviation of the heading, rad.
    pub heading_sigma: f32,
    /// Mean normalised innovation squared of the last fixes.
    pub residual: f32,
    /// How long the alignment took, s.
    pub time_s: f64,
}

impl AlignedState {
    /// Standard deviations of the errors, that of the sensors included.
    #[must_use]
    pub fn sigmas(scratch: &Transition<ERRORS>) -> [f32; ERRORS] {
        core::array::from_fn(|i| libm::sqrtf(scratch.phi[i][i].max(0.0)))
    }
}

#[cfg(test)]
pub(crate) mod tests;
