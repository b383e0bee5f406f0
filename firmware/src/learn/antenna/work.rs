//! The covariance over an interval and a fix at its end, in parts that are each short enough to be
//! computed between two samples.

use super::{Antenna, FLOOR, STATES, product, state};
use crate::fix::OBSERVATIONS;
use crate::learn::bank::Work;
use lrnn_nostd::learn::kalman::COVARIANCE_PARTS;

/// An observation further off than this, in squared standard deviations, is refused, but not more
/// often than so many times in a row: as in [`crate::learn::bank::Gates`].
const SQUARED_RATIO: f32 = 25.0;
const ESCAPE: u8 = 10;
/// The variance of an observation counts so many times here: errors of receivers last for seconds
/// (assumed). With errors that last for 5 to 60 s the estimates then stay as near as they claim.
const LASTING: f32 = 4.0;
/// What is not known of lever arm and age is the same in fix after fix, where the hypotheses take
/// it for noise. So its variance counts so many times there (assumed): they learn little from fixes
/// that depend on it.
const SAME: f32 = 10.0;

// Parts of the deferred work: of the covariance, the observations one by one, and the end.
pub(super) const COVARIANCE: usize = 0;
// Of the covariance two at a time, since six parameters make all but the last one short.
const UPDATE: usize = COVARIANCE + COVARIANCE_PARTS.div_ceil(2);
const FINISH: usize = UPDATE + OBSERVATIONS;
pub(super) const END: usize = FINISH + 1;

impl Antenna {
    /// One part of the deferred work, before that of the hypotheses, whose fix it replaces. True:
    /// there is more.
    pub fn work(&mut self, others: &mut Work) -> bool {
        match self.next {
            part @ COVARIANCE..UPDATE => {
                let block = Some(others.block()).filter(|_| self.moved);
                let mut interval = self.extended(block);
                self.wander(&mut interval);
                if part + 1 == UPDATE {
                    (self.before, self.jump, self.moved) = (self.effect, 0.0, false);
                }
                let (filter, workspace) = (&mut self.filter, &mut self.workspace);
                for k in 2 * part..COVARIANCE_PARTS.min(2 * part + 2) {
                    filter.propagate_covariance(k, &interval, workspace);
                }
            }
            part @ UPDATE..FINISH => self.update(part - UPDATE),
            FINISH => {
                if let Some(least) = self.measured.take() {
                    let [.., floor] = FLOOR;
                    let z = self.age - least;
                    let innovation = self.filter.innovation(STATES - 1, z, floor * floor);
                    self.filter.update(STATES - 1, innovation);
                }
                self.filter.finish_update();
                self.failed = !self.filter.is_healthy();
                others.replace_fix(self.without());
                self.fixed = false;
                self.report();
            }
            _ => {}
        }
        self.next += 1;
        if self.next == UPDATE && !self.fixed {
            self.next = END;
        }
        !self.is_done()
    }

    fn update(&mut self, k: usize) {
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
