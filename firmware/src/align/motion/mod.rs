//! Alignment in motion: attitude from samples and fixes, whatever the heading. A receiver that
//! gives positions alone is aligned by `places`, one with velocities as follows.
//!
//! Two stages follow each other. **Levelling** (`level`) finds the direction of gravity in a
//! frame that the gyros carry on. **Matching** (`filter`) navigates in a levelled frame `w` whose
//! azimuth `a` is unknown, and compares the velocities with the receiver's:
//!
//! ```text
//! v_w = R v_n,   R = [c s; -s c],   c = cos a,  s = sin a
//! ```
//!
//! The equations are linear in `c` and `s`, so that a Kalman filter finds them however large the
//! angle is (Scherzinger 1996; Rogers 1997). The filter does not know that `c^2 + s^2 = 1`. That
//! their estimates obey this is an independent test, which a wrong axis, a wrong mounting or fixes
//! of another vehicle do not pass.
//!
//! The attitude is handed over ([`Start`]) when tilt and heading are known well enough, the norm is
//! 1 within its standard deviation, and the innovations are as large as predicted, all for several
//! fixes in a row. An alignment whose innovations stay too large restarts and is counted.

mod begin;
mod filter;
mod given;
mod in_motion;
mod known;
mod level;
mod observe;
mod places;
mod start;
mod take;
mod transition;
mod watch;

pub use in_motion::InMotion;
pub use start::{Shown, Start};
pub use take::Found;

use crate::control::Way;
use crate::fix::{Fix, Heading};
use crate::nav::vector::{Q, V, rotated};
use crate::nav::{self, Navigator};
use crate::sample::Counts;
use filter::Filter;
use level::Level;
use lrnn_nostd::learn::kalman::OUTPUTS;

/// Largest standard deviation of a heading that is handed over, rad: the bank's errors are linear
/// up to it, to 2 % of the force.
pub const MAX_HEADING: f32 = 0.2;
/// The largest standard deviation of the tilt, rad.
const MAX_TILT: f32 = 0.05;
/// Fixes in a row that must pass all tests.
const PASSES: u8 = 3;
/// Fixes in a row whose norm is not 1 although all else is well: then the alignment is refused.
const NORM_FAILS: u8 = 5;
/// Largest standard deviation of the norm: the sign of the heading is then known to 5 sigma.
const MAX_NORM: f32 = 0.2;
/// Error of the norm that scale factors may cause.
const NORM_FLOOR: f32 = 0.02;
/// Largest mean normalised innovation squared of an alignment that is handed over; it is 1 when all
/// assumptions hold.
const GOOD_RESIDUAL: f32 = 2.0;
/// Above this the alignment restarts.
const BAD_RESIDUAL: f32 = 3.5;
/// Fixes before the mean says anything.
const LEAST_FIXES: u16 = 6;
/// Uncertainty of attitude at which the equations are no longer linear, rad: the alignment
/// restarts.
const LINEAR: f32 = 0.3;

/// A fix is wild that is farther than this from where the navigator is, m, up to so many in a row.
const FAR_M: f32 = 2e4;
const FARS: u8 = 3;

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
    /// Source of the heading so far; [`Way::None`] while levelling.
    pub way: Way,
    /// Standard deviation of the heading, rad; infinite while it is unknown.
    pub heading_sigma: f32,
    /// Mean normalised innovation squared of the last fixes; 1 when all assumptions hold.
    pub residual: f32,
    /// Alignments that restarted because their innovations were too large.
    pub refused: u32,
}

/// A heading that was given: where the forward axis pointed, in the navigator's frame.
#[derive(Debug, Clone, Copy)]
struct Given {
    forward: V,
    heading: Heading,
    /// Since then, s.
    age: f32,
}

/// An alignment by velocities.
#[derive(Debug, Clone)]
struct Matching {
    config: Config,
    /// The vehicle moves along its forward axis: as configured. That the axis is where it should
    /// be may be wrong, so that every other attempt does without.
    rolls: bool,
    /// `None` before the first fix.
    navigator: Option<Navigator>,
    level: Level,
    /// `None` while levelling.
    filter: Option<Filter>,
    /// The sensors' errors that are known already, rad/s and m/s2.
    known: [f32; OUTPUTS],
    given: Option<Given>,
    /// Attitude and receiver's velocity at the last fix.
    last: (Q, V),
    /// Since the beginning, s.
    time: f64,
    passes: u8,
    norm_fails: u8,
    /// Fixes in a row that were too far away.
    far: u8,
    refused: u32,
}

impl Matching {
    /// Waits for the first fix. `known`: errors of the sensors that have been learnt before, rad/s
    /// and m/s2.
    pub fn new(config: Config, known: [f32; OUTPUTS]) -> Self {
        Self {
            config,
            rolls: config.rolls,
            navigator: None,
            level: Level::default(),
            filter: None,
            known,
            given: None,
            last: ([1.0, 0.0, 0.0, 0.0], [0.0; 3]),
            time: 0.0,
            passes: 0,
            norm_fails: 0,
            far: 0,
            refused: 0,
        }
    }

    /// Takes one uncorrected sample.
    #[inline]
    pub fn sample(&mut self, counts: &Counts) {
        if let Some(navigator) = &mut self.navigator {
            navigator.sample(counts);
        }
    }

    /// The samples are interrupted: restarts. The count of refused alignments stays.
    pub fn gap(&mut self) {
        // in place, and not by `new`, which would be built on the stack first
        (self.navigator, self.filter, self.given) = (None, None, None);
        self.level = Level::default();
        self.last = ([1.0, 0.0, 0.0, 0.0], [0.0; 3]);
        self.time = 0.0;
        (self.passes, self.norm_fails, self.far) = (0, 0, 0);
    }

    /// A heading that somebody knows, valid now.
    pub fn heading(&mut self, heading: Heading) {
        let Some(navigator) = &self.navigator else {
            return;
        };
        self.given = Some(Given {
            forward: rotated(navigator.state().q_bn, self.config.forward.map(f64::from)),
            heading,
            age: 0.0,
        });
    }

    /// Whether the alignment has begun: a given heading then stays in use.
    pub fn has_begun(&self) -> bool {
        self.navigator.is_some()
    }

    /// Progress of the alignment.
    pub fn progress(&self) -> Progress {
        let refused = self.refused;
        match &self.filter {
            None => Progress {
                heading_sigma: f32::INFINITY,
                refused,
                ..Progress::default()
            },
            Some(filter) => Progress {
                way: filter.way(),
                heading_sigma: filter.heading_sigma(),
                residual: filter.residual(),
                refused,
            },
        }
    }

    /// Levelling begins with this fix, in the frame that the navigator has.
    fn begin_level(&mut self, fix: &Fix) {
        let Some(navigator) = &mut self.navigator else {
            return;
        };
        let [x, y, z] = navigator.state().velocity.map(|v| v as f32);
        navigator.feed_back(&[0.0, 0.0, 0.0, x, y, z, 0.0, 0.0, 0.0]);
        let [a, b, c, d, e, f] = self.known;
        navigator.set_estimate([a, b, c], [d, e, f]);
        (self.level, self.filter) = (Level::begin(fix), None);
        (self.passes, self.norm_fails) = (0, 0);
    }

    /// The alignment contradicts the fixes: it restarts, with other data, and believes the course
    /// if it has not done so.
    fn refuse(&mut self, fix: &Fix) {
        self.config.rolls = self.rolls && !self.config.rolls;
        self.refused = self.refused.saturating_add(1);
        self.begin_level(fix);
    }
}

/// A fix without numbers that mean nothing.
fn measured(fix: &Fix) -> Fix {
    let mut fix = *fix;
    if !fix.has(2..3) {
        fix.position.height = 0.0;
    }
    if !fix.has(5..6) {
        fix.velocity[2] = 0.0;
    }
    fix
}

/// Gravity's reaction points up.
const UP: V = [0.0, 0.0, -1.0];

#[cfg(test)]
pub(crate) mod tests;
