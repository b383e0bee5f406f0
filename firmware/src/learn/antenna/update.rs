//! The covariance over an interval and a fix at its end.

use super::{Antenna, FLOOR, STATES, product, state};
use crate::fix::OBSERVATIONS;
use crate::learn::prior::NAV;
use lrnn_nostd::learn::kalman::Transition;

/// An observation further off than this, in squared standard deviations, is refused, but not more
/// often than so many times in a row: as in [`crate::learn::bank::Gates`].
const SQUARED_RATIO: f32 = 25.0;
const ESCAPE: u8 = 10;
/// The variance of an observation counts so many times here: errors of receivers last for seconds
/// (assumed). With errors that last for 5 to 60 s the estimates then stay as near as they claim.
const LASTING: f32 = 4.0;
/// The unknown part of lever arm and age is the same in fix after fix, where the hypotheses take it
/// for noise. So its variance counts this many times there (assumed): they learn little from fixes
/// that depend on it.
const SAME: f32 = 10.0;

impl Antenna {
    /// The covariance over the last interval, `block`, if one has passed since the last call, and
    /// the fix at its end, if there is one. Gives that fix as it would be without the antenna's
    /// errors, for the hypotheses, and its variance with what is not known of them.
    pub fn update(
        &mut self,
        block: &Transition<NAV>,
    ) -> Option<([f32; OBSERVATIONS], [f32; OBSERVATIONS])> {
        if !(self.moved || self.fixed) {
            return None;
        }
        let mut interval = self.extended(Some(block).filter(|_| self.moved));
        self.wander(&mut interval);
        (self.before, self.jump, self.moved) = (self.effect, 0.0, false);
        (self.filter).propagate_covariance(&interval, &mut self.workspace);
        if !core::mem::take(&mut self.fixed) {
            return None;
        }
        (0..OBSERVATIONS).for_each(|k| self.observe(k));
        if let Some(least) = self.measured.take() {
            let [.., floor] = FLOOR;
            let z = self.age - least;
            let innovation = self.filter.innovation(STATES - 1, z, floor * floor);
            self.filter.update(STATES - 1, innovation);
        }
        self.filter.finish_update();
        self.failed = !self.filter.is_healthy();
        let without = self.without();
        self.report();
        Some(without)
    }

    fn observe(&mut self, k: usize) {
        let (z, variance) = self.fix;
        let (Some(&z), Some(&variance)) = (z.get(k), variance.get(k)) else {
            return;
        };
        let Some(refused) = self.refused.get_mut(k).filter(|_| variance.is_finite()) else {
            return;
        };
        let innovation = self.filter.innovation(state(k), z, LASTING * variance);
        let near = innovation.squared_ratio() <= SQUARED_RATIO;
        if refused.accepts(z.is_finite(), !near, self.counts, ESCAPE) {
            self.filter.update(state(k), innovation);
        }
    }

    /// The fix as it would be without the antenna's errors, and its variance with what is not known
    /// of them.
    fn without(&self) -> ([f32; OBSERVATIONS], [f32; OBSERVATIONS]) {
        let (mut z, mut variance) = self.fix;
        if self.failed {
            return (z, variance);
        }
        let (d, spread) = (self.error(), self.spread());
        for (k, (z, variance)) in z.iter_mut().zip(&mut variance).enumerate() {
            *z -= self.effect.get(k).map_or(0.0, |row| product(row, &d));
            *variance += SAME * spread.get(k).copied().unwrap_or(0.0);
        }
        (z, variance)
    }
}
