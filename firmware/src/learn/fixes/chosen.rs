//! Which hypothesis is in force, and which of them knows the unit best.

use super::judged::{BETTER, DRIVES};
use super::{FixLearner, SETTLES};
use crate::learn::Winner;
use crate::learn::bank::{REMEMBERING, ZERO_CORRECTION};
use crate::learn::quantise::split;
use crate::learn::unit;
use crate::model::Nets;
use lrnn_nostd::learn::kalman::OUTPUTS;

impl FixLearner<'_> {
    /// Which hypothesis is in force after a fix.
    pub(super) fn choose(&mut self) {
        let bank = &self.memory.bank;
        let chosen = if bank.doubts() {
            self.memory.rehearsal.choose(|index| bank.score(index))
        } else {
            bank.leading()
        };
        self.put_in_force(chosen);
        let bank = &self.memory.bank;
        let sigma = self.at_least(bank.bias_sigma());
        self.settled.looks(bank.estimate_of(chosen), &sigma);
        match self.best_of_unit() {
            Some(best) => {
                self.knows_best = best;
                let sigma = self.at_least(bank.bias_sigma_of(best));
                self.unit_settled.looks(&bank.constant_of(best), &sigma);
            }
            None => self.unit_settled.moves(),
        }
    }

    /// Of the hypotheses that remember the unit and have proved themselves, the one with the
    /// greatest evidence, or another one whose memory was clearly less wrong at the power-ons so
    /// far. The last one stays until another is clearly better.
    fn best_of_unit(&self) -> Option<usize> {
        let bank = &self.memory.bank;
        let worth = |h: usize| {
            let stays = if h == self.knows_best {
                self.settings.gates.better
            } else {
                0.0
            };
            bank.score(h) + stays
        };
        let each = REMEMBERING.into_iter().zip(self.judged.so_far());
        let proved = each.filter(|&(h, _)| self.memory.rehearsal.has_proved(h));
        let likely = proved
            .clone()
            .max_by(|(a, _), (b, _)| worth(*a).total_cmp(&worth(*b)))?;
        let least = proved.min_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let (best, _) = if self.base.drives >= DRIVES && least.1 < BETTER * likely.1 {
            least
        } else {
            likely
        };
        Some(best)
    }

    /// Standard deviations of what is learnt: those of the biases, and no less than a share of the
    /// datasheet's, because networks move more than biases do.
    pub(super) fn at_least(&self, mut sigma: [f32; OUTPUTS]) -> [f32; OUTPUTS] {
        let sheet = &self.settings.sheet;
        let [g, a] = [sheet.gyro_bias, sheet.accel_bias];
        for (sigma, sheet) in sigma.iter_mut().zip([g, g, g, a, a, a]) {
            *sigma = sigma.max(SETTLES * sheet);
        }
        sigma
    }

    pub(super) fn put_in_force(&mut self, chosen: usize) {
        if chosen == ZERO_CORRECTION {
            self.settled.moves();
        }
        if core::mem::replace(&mut self.running, chosen) != chosen {
            let of = if chosen == ZERO_CORRECTION {
                &mut self.tally.rollbacks
            } else {
                &mut self.tally.promotions
            };
            *of = of.saturating_add(1);
        }
    }

    /// What shall act from the next power-on, as [`crate::learn::Learner::for_next_power_on`]; all
    /// deferred work is done.
    #[inline(never)]
    pub(super) fn of_unit(&self) -> Option<Winner> {
        let best = self.best_of_unit()?;
        let bank = &self.memory.bank;
        let [gyro, accel] = bank.unit_nets_of(best);
        Some(Winner {
            nets: Nets { gyro, accel },
            states: bank.states_of(best),
            estimate: split(&bank.unit_estimate_of(best)),
            sigma: split(&self.at_least(bank.bias_sigma_of(best))),
            settled: self.unit_settled.is_settled_again(),
        })
    }

    /// Takes down what is known of the unit, if one of the hypotheses that remember it has proved
    /// itself. Gives the number of bytes.
    pub(super) fn take_down(&mut self) -> usize {
        if self.best_of_unit().is_none() {
            return 0;
        }
        let bank = &mut self.memory.bank;
        let (sheet, shapes, judged) = (&self.settings.sheet, &self.shapes, self.judged.so_far());
        self.unit
            .remember(&self.base, bank, sheet, shapes, self.covered, judged);
        unit::LEN
    }
}
