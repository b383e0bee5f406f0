//! Reports of the learner's state while it learns.

use super::FixLearner;
use crate::learn::quantise::split;
use crate::learn::{Solution, Trial, Trials};

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
