//! When the vehicle is at rest, and the means of the samples meanwhile.
//!
//! Rest must not be recognised by units that may be wrong. Four things do without them:
//!
//! * **The receiver.** Good fixes decide. While they show motion nothing is judged. When all fixes
//!   of 30 s show none, gravity is judged even if the vehicle swings.
//! * **The direction of gravity.** What is turned by 12 degrees from its mean, or pushed by a
//!   tenth of gravity, does not rest, whatever the fixes show: a sensor in the hand.
//! * **Steadiness.** The specific force of every block stays within 0.15 % of the first block's,
//!   with the noise of the datasheet as a share of 1 g beside it. Only then the rates are judged.
//! * **The kind of vehicle.** Without fixes, a land vehicle that is steady for 60 s stands. The
//!   smoothest road still moves the 1 s means by 0.3 % of gravity (ISO 8608, class A, at 25 m/s). A
//!   train that is as steady passes too, but on a straight line it also sees gravity and the Earth
//!   only. Ships and aircraft can be steady in a turn, so for them only fixes show rest.

use super::{Expected, Means, norm};
use crate::configuration::VehicleKind;
use crate::units::G;
use crate::wire::command::fault;
use libm::sqrtf;

/// Rest that is enough when fixes show it, s.
pub const WITH_FIXES_S: f32 = 30.0;
/// Rest that is enough without fixes, s.
pub const WITHOUT_FIXES_S: f32 = 60.0;
/// Time after which a fix says nothing about the blocks that end, s.
const FIX_LASTS_S: f32 = 2.5;
/// A vehicle that is faster by the receiver moves, m/s.
const MOVES_MPS: f32 = 0.3;
/// Largest standard deviation of a velocity that is used, m/s.
const GOOD_MPS: f32 = 0.5;
/// Steadiness of the specific force, as a share.
pub(super) const STEADY: f32 = 1.5e-3;
/// Noise of the difference of two blocks that is allowed, in standard deviations of one block.
const NOISE: f32 = 8.5;

/// A vehicle that is turned or pushed by more than this from its mean does not rest: cosine of 12
/// degrees, and a share of the specific force.
const TURNED: f32 = 0.978;
const PUSHED: f32 = 0.1;

/// Result of a time at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judged {
    /// Faults: bits of [`super::AT_REST`].
    pub faults: u32,
    /// Checks that could be made: likewise.
    pub judged: u32,
    /// The means.
    pub means: Means,
    /// Blocks.
    pub blocks: u16,
}

/// Gathers the means of the blocks at rest and judges them.
#[derive(Debug)]
pub struct RestCheck {
    expected: Expected,
    blocks: u16,
    seconds: f32,
    /// Rate and force of the first block. Sums are of differences from them.
    first: [[f32; 3]; 2],
    sums: [[f32; 3]; 2],
    /// Squares of the rates.
    squares: [f32; 3],
    /// A fix covers every block.
    covered: bool,
    /// The force was not steady.
    swings: bool,
    /// Whether the last good fix shows motion, and its age, s.
    fix: Option<(bool, f32)>,
}

impl RestCheck {
    /// No measurement yet.
    #[must_use]
    pub const fn new(expected: Expected) -> RestCheck {
        RestCheck {
            expected,
            blocks: 0,
            seconds: 0.0,
            first: [[0.0; 3]; 2],
            sums: [[0.0; 3]; 2],
            squares: [0.0; 3],
            covered: true,
            swings: false,
            fix: None,
        }
    }

    /// Forgets the means: the sensor was silent, or means something else from now on.
    pub fn restart(&mut self) {
        *self = RestCheck {
            fix: self.fix,
            ..RestCheck::new(self.expected)
        };
    }

    /// A fix: speed in space and its standard deviation, m/s.
    pub fn fix(&mut self, speed: f32, sigma: f32) {
        if sigma <= GOOD_MPS {
            self.fix = Some((speed > MOVES_MPS, 0.0));
        }
    }

    /// Takes the mean rate (rad/s) and specific force (m/s2) of a block of `block_s` seconds. At
    /// the end of a time at rest it gives what was found.
    pub fn block(&mut self, block_s: f32, rate: [f32; 3], force: [f32; 3]) -> Option<Judged> {
        let rests = match &mut self.fix {
            Some((moves, age)) if *age <= FIX_LASTS_S => {
                *age += block_s;
                Some(!*moves)
            }
            _ => None,
        };
        let finite = rate.iter().chain(&force).all(|value| value.is_finite());
        let needs_fixes = self.expected.vehicle != VehicleKind::Land;
        if !finite || rests == Some(false) || (rests.is_none() && needs_fixes) {
            self.restart();
            return None;
        }
        if self.blocks > 0 && self.is_moved(force) {
            self.restart();
        }
        if self.blocks > 0 && !self.is_steady(block_s, force) {
            self.swings = true;
        }
        self.covered &= rests.is_some();
        if self.swings && !self.covered {
            self.restart();
            self.covered = rests.is_some();
        }
        self.add(block_s, rate, force);
        let enough = if self.covered {
            WITH_FIXES_S
        } else {
            WITHOUT_FIXES_S
        };
        // sums of f32 seconds: half a block less is as good
        if self.seconds + 0.5 * block_s < enough {
            return None;
        }
        let judged = if self.swings {
            fault::GRAVITY | fault::AXES
        } else {
            super::AT_REST
        };
        let (means, blocks) = (self.means(), self.blocks);
        self.restart();
        Some(Judged {
            faults: means.judge(&self.expected) & judged,
            judged,
            means,
            blocks,
        })
    }

    /// The specific force is not that of a sensor that has rested so far.
    fn is_moved(&self, force: [f32; 3]) -> bool {
        let mean = self.mean(1);
        let (was, now) = (norm(mean), norm(force));
        let along: f32 = force.iter().zip(&mean).map(|(a, b)| a * b).sum();
        along < TURNED * was * now || (now - was).abs() > PUSHED * was
    }

    fn is_steady(&self, block_s: f32, force: [f32; 3]) -> bool {
        let noise = self.expected.accel.white_noise / (G as f32 * sqrtf(block_s));
        let most = norm(self.first[1]) * (STEADY + NOISE * noise);
        let pairs = force.iter().zip(&self.first[1]);
        pairs.fold(true, |all, (now, first)| {
            all & ((now - first).abs() <= most)
        })
    }

    fn add(&mut self, block_s: f32, rate: [f32; 3], force: [f32; 3]) {
        if self.blocks == 0 {
            self.first = [rate, force];
        }
        self.blocks = self.blocks.saturating_add(1);
        self.seconds += block_s;
        for axis in 0..3 {
            let [rates, forces] = &mut self.sums;
            let rate = rate[axis] - self.first[0][axis];
            rates[axis] += rate;
            forces[axis] += force[axis] - self.first[1][axis];
            self.squares[axis] += rate * rate;
        }
    }

    /// Mean rate (0) or specific force (1) of the blocks.
    fn mean(&self, of: usize) -> [f32; 3] {
        let share = 1.0 / f32::from(self.blocks.max(1));
        let [Some(first), Some(sum)] = [self.first.get(of), self.sums.get(of)] else {
            return [0.0; 3];
        };
        core::array::from_fn(|axis| first[axis] + sum[axis] * share)
    }

    fn means(&self) -> Means {
        let share = 1.0 / f32::from(self.blocks.max(1));
        let scatter = |axis: usize| {
            let mean = self.sums[0][axis] * share;
            sqrtf((self.squares[axis] * share - mean * mean).max(0.0) * share)
        };
        Means {
            seconds: self.seconds,
            rate: self.mean(0),
            scatter: core::array::from_fn(scatter),
            force: self.mean(1),
        }
    }
}
