//! Reports of the learner's state while it learns.

use super::FixLearner;
use crate::learn::quantise::split;
use crate::learn::{Solution, Trial, Trials};
use lrnn_nostd::learn::kalman::OUTPUTS;

/// The standard deviation that is reported is no less than this share of the datasheet's bias
/// (assumed).
const LEAST: f32 = 0.1;

impl FixLearner<'_> {
    #[inline(never)]
    pub(super) fn solved(&self) -> Option<Solution> {
        let navigator = self.navigation.course.navigator()?;
        let bank = &self.memory.bank;
        Some(Solution {
            state: navigator.state(),
            estimate: split(bank.navigating_estimate()),
            sigma: split(&self.at_least(bank.bias_sigma())),
        })
    }

    /// Standard deviations of what is learnt: those of the biases, and no less than a share of the
    /// datasheet's, because networks move more than biases do.
    fn at_least(&self, mut sigma: [f32; OUTPUTS]) -> [f32; OUTPUTS] {
        let sheet = &self.settings.sheet;
        let [g, a] = [sheet.gyro_bias, sheet.accel_bias];
        for (sigma, sheet) in sigma.iter_mut().zip([g, g, g, a, a, a]) {
            *sigma = sigma.max(LEAST * sheet);
        }
        sigma
    }

    #[inline(never)]
    pub(super) fn tried(&self) -> Trials {
        let (bank, rehearsal) = (&self.memory.bank, &self.memory.rehearsal);
        Trials {
            leading: bank.leading(),
            ended: rehearsal.counts(),
            each: core::array::from_fn(|index| Trial {
                enabled: bank.takes_part(index),
                proved: rehearsal.has_proved(index),
                evidence: bank.evidence(index),
                standing: rehearsal.standing(index),
            }),
        }
    }
}
