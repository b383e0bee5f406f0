//! One coast: navigation without fixes, once with each hypothesis' correction.

use super::bets::MOST;
use super::{EARLY, LATE};
use crate::fix::OBSERVATIONS;
use crate::learn::bank::{Bank, EXTENDING, HYPOTHESES, ZERO_CORRECTION};
use crate::learn::prior::NAV;
use crate::nav::Transition;
use lrnn_nostd::learn::kalman::Correction;

/// A navigator without fixes, as its difference to the device's own: shadow minus navigator, in the
/// order of [`NAV`]. That is enough, because differences move by the linear equations of the
/// navigator's errors.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shadow {
    pub off: [f32; NAV],
    /// Correction that it subtracts from the samples. It does not change.
    pub correction: Correction,
}

impl Shadow {
    const NONE: Shadow = Shadow {
        off: [0.0; NAV],
        correction: Correction::NONE,
    };
}

/// Errors of the navigator by a fix: estimate minus fix of two horizontal components, and the
/// standard deviation of the fix.
#[derive(Debug, Clone, Copy)]
pub struct FixError {
    /// Index of the first component in [`NAV`]: north of the position or of the velocity.
    pub first: usize,
    /// m or m/s.
    pub off: [f32; 2],
    /// m or m/s.
    pub sigma: f32,
}

impl FixError {
    /// From estimate minus fix and its variance. The position counts; where it is not measured, the
    /// velocity.
    pub fn of(z: &[f32; OBSERVATIONS], variance: &[f32; OBSERVATIONS]) -> Option<FixError> {
        let [n, e, _, vn, ve, _] = *z;
        let [of_n, of_e, _, of_vn, of_ve, _] = *variance;
        let (position, velocity) = (of_n.max(of_e), of_vn.max(of_ve));
        let (first, off, variance) = if position.is_finite() {
            (6, [n, e], position)
        } else if velocity.is_finite() {
            (3, [vn, ve], velocity)
        } else {
            return None;
        };
        Some(FixError {
            first,
            off,
            sigma: libm::sqrtf(variance.max(0.0)),
        })
    }
}

/// Navigation without fixes, once with each hypothesis' correction.
#[derive(Debug, Clone, Copy)]
pub struct Coast {
    pub(super) shadows: [Shadow; HYPOTHESES],
    /// Time since its start, s.
    pub(super) time: f32,
    pub(super) runs: bool,
    /// The likelier of both kinds of biases at its start.
    biases: usize,
}

impl Coast {
    /// None runs.
    pub const NONE: Coast = Coast {
        shadows: [Shadow::NONE; HYPOTHESES],
        time: 0.0,
        runs: false,
        biases: ZERO_CORRECTION,
    };

    /// Every shadow starts where its hypothesis believes the vehicle to be, with what it believes
    /// of the sensors.
    pub fn start(&mut self, bank: &Bank) {
        for (index, shadow) in self.shadows.iter_mut().enumerate() {
            shadow.off = bank.error_state_of(index).map(|error| -error);
            shadow.correction = bank.correction_of(index);
        }
        (self.time, self.runs, self.biases) = (0.0, true, bank.biases());
    }

    /// The navigator has passed an interval with the correction `applied`.
    pub fn moves(&mut self, block: &Transition, applied: &Correction) {
        self.time += block.time;
        for shadow in &mut self.shadows {
            block.moves(&mut shadow.off, &shadow.correction, applied);
        }
    }

    /// A fix ends a coast of `length` s. Gives the scores of each hypothesis when it has ended in
    /// time.
    pub fn ends(&mut self, error: &FixError, length: f32) -> Option<Scores> {
        if !self.runs || self.time < length - EARLY {
            return None;
        }
        self.runs = false;
        (self.time <= length + LATE[0] * length + LATE[1]).then(|| self.scores(error))
    }

    /// The navigator has been corrected by `error`; the shadows have not.
    pub fn feed_back(&mut self, error: &[f32; NAV]) {
        for shadow in &mut self.shadows {
            for (off, error) in shadow.off.iter_mut().zip(error) {
                *off += error;
            }
        }
    }

    /// The scores of each hypothesis at this fix.
    pub(super) fn scores(&self, error: &FixError) -> Scores {
        let floor = error.sigma * error.sigma;
        let squares = self.shadows.each_ref().map(|shadow| {
            let off = shadow.off.iter().skip(error.first).zip(error.off);
            off.fold(floor, |sum, (off, error)| {
                sum + (off + error) * (off + error)
            })
        });
        let of = |h: usize| squares.get(h).copied().unwrap_or(f32::NAN);
        let (without, biases) = (of(ZERO_CORRECTION), of(self.biases));
        let extending = core::array::from_fn(|h| {
            let extends = EXTENDING >> h & 1 == 1;
            score(if extends { biases } else { without }, of(h))
        });
        Scores {
            gains: squares.map(|with| score(without, with)),
            extending,
        }
    }
}

/// How much smaller the horizontal errors of the hypotheses are than another one's, as the natural
/// logarithm of the ratio, from -3 to 3. An error below the fix's standard deviation
/// counts as that one. What is not finite is the worst.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scores {
    /// Against the error without correction.
    pub gains: [f32; HYPOTHESES],
    /// Of those that extend the biases, against these ([`EXTENDING`]).
    pub extending: [f32; HYPOTHESES],
}

/// Score by the squares of the errors without and with a correction.
fn score(without: f32, with: f32) -> f32 {
    let score = 0.5 * libm::logf(without / with);
    if score >= -MOST {
        score.min(MOST)
    } else {
        -MOST
    }
}
