//! Which hypothesis is in force, and which of them knows the unit best.

use super::judged::{BETTER, DRIVES};
use super::{FixLearner, Memory, Tally};
use crate::learn::Winner;
use crate::learn::bank::{MAP, STORED, ZERO_CORRECTION};
use crate::learn::quantise::split;
use crate::learn::unit;
use crate::model::Nets;

/// A drive teaches something for the next ones from so much navigation beside so many fixes on,
/// s (assumed).
const LEAST_S: f32 = 10.0;
const LEAST_FIXES: u32 = 10;
/// A drive teaches nothing for the next ones when more than one fix in so many was refused: one
/// with a wrong fix in six that were believed doubles their error.
pub const REFUSED: u32 = 8;
/// A drive teaches nothing while no fix has come for so long, s.
const NO_FIX_S: f32 = 10.0;

impl FixLearner<'_> {
    /// Selects the hypothesis in force after a fix.
    pub(super) fn choose(&mut self) {
        let bank = &self.memory.bank;
        let chosen = if bank.doubts() {
            self.memory.rehearsal.choose(|index| bank.score(index))
        } else {
            bank.leading()
        };
        self.put_in_force(chosen);
        if let Some(best) = self.best_of_unit() {
            self.choice.knows_best = best;
        }
    }

    /// The hypothesis that acts from the next power-on, of those that remember the unit and have
    /// proved themselves.
    fn best_of_unit(&self) -> Option<usize> {
        let bank = &self.memory.bank;
        let [biases, driven, curved] = self.remembered.judged.so_far();
        let wrong = [biases, driven, curved, biases];
        let each = bank.remembering().into_iter().zip(wrong);
        let proved = each.filter(|&(h, _)| self.memory.rehearsal.has_proved(h));
        let candidates = proved.map(|(hypothesis, wrong)| Candidate {
            hypothesis,
            evidence: bank.score(hypothesis),
            wrong,
        });
        let judged = self.remembered.base.drives >= DRIVES;
        best(
            candidates,
            self.choice.knows_best,
            self.settings.gates.better,
            judged,
        )
    }

    pub(super) fn put_in_force(&mut self, chosen: usize) {
        if core::mem::replace(&mut self.choice.running, chosen) != chosen {
            let of = if chosen == ZERO_CORRECTION {
                &mut self.tally.rollbacks
            } else {
                &mut self.tally.promotions
            };
            *of = of.saturating_add(1);
        }
    }

    /// Networks that shall act from the next power-on, as
    /// [`crate::learn::Learner::for_next_power_on`].
    #[inline(never)]
    pub(super) fn of_unit(&self) -> Option<Winner> {
        let Memory {
            bank, rehearsal, ..
        } = &*self.memory;
        let refuted = rehearsal.refutes(bank.takes_part(STORED), self.remembered.base.refuted);
        let best = self.best_of_unit().filter(|_| self.teaches() && !refuted)?;
        let [gyro, accel] = bank.unit_nets_of(best);
        let maps = bank.maps_of(best);
        Some(Winner {
            nets: Nets { gyro, accel, maps },
            states: bank.states_of(best),
            estimate: split(&bank.unit_estimate_of(best)),
        })
    }

    /// Whether the drive may teach something for the next ones: it has shown something, fixes come,
    /// and they do not contradict it.
    fn teaches(&self) -> bool {
        let (seconds, _) = self.remembered.covered;
        let Tally { used, refused, .. } = self.tally;
        let in_doubt =
            self.navigation.probation.doubts() || self.motion.rests.since_fix_s() > NO_FIX_S;
        seconds >= LEAST_S && used >= LEAST_FIXES && refused <= used / REFUSED && !in_doubt
    }

    /// Whether this drive has found the networks harmful that it began with.
    pub(super) fn stored_harms(&self) -> bool {
        let Memory {
            bank, rehearsal, ..
        } = &*self.memory;
        self.remembered.harmful || bank.takes_part(STORED) && rehearsal.harms(STORED)
    }

    /// Whether the map takes part no longer: see [`crate::learn::bank::Bank::has_equal_scales`].
    pub(super) fn has_equal_scales(&self) -> bool {
        self.settings.gates.enabled >> MAP & 1 == 1 && !self.memory.bank.takes_part(MAP)
    }

    /// Takes down what is known of the unit, if the drive teaches anything. Gives the number of
    /// bytes.
    pub(super) fn take_down(&mut self) -> usize {
        if core::mem::take(&mut self.remembered.withdraws) {
            return unit::LEN; // as before the drive
        }
        if !self.teaches() {
            return 0;
        }
        self.remembered.taken_down = true;
        if self.has_equal_scales()
            && let Some(stream) = self.samples.stream
        {
            self.begin_hypotheses(1 << MAP, &stream); // what it has learnt is not the unit's
        }
        let bank = &mut self.memory.bank;
        let (sheet, shapes, judged) = (
            &self.settings.sheet,
            &self.shapes,
            self.remembered.judged.so_far(),
        );
        self.remembered.unit.remember(
            &self.remembered.base,
            (bank, &self.memory.rehearsal),
            sheet,
            shapes,
            self.remembered.covered,
            judged,
        );
        unit::LEN
    }
}

/// A hypothesis that remembers the unit.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    hypothesis: usize,
    /// Log-likelihood of the hypothesis.
    evidence: f64,
    /// How wrong its memory was at the power-ons so far: [`Judged::so_far`](super::judged::Judged).
    wrong: f32,
}

/// The one with the greatest evidence; `last`, which was the best one before, stays until another
/// has `better` more. Where earlier drives have `judged` their memories, another one takes its
/// place if its memory was clearly less wrong.
fn best(
    candidates: impl Iterator<Item = Candidate> + Clone,
    last: usize,
    better: f64,
    judged: bool,
) -> Option<usize> {
    let worth = |of: &Candidate| of.evidence + if of.hypothesis == last { better } else { 0.0 };
    let least = candidates
        .clone()
        .min_by(|a, b| a.wrong.total_cmp(&b.wrong))?;
    let likely = candidates.max_by(|a, b| worth(a).total_cmp(&worth(b)))?;
    let takes_over = judged && least.wrong < BETTER * likely.wrong;
    Some(if takes_over { least } else { likely }.hypothesis)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(candidates: &[(usize, f64, f32)], last: usize, judged: bool) -> Option<usize> {
        let each = candidates
            .iter()
            .map(|&(hypothesis, evidence, wrong)| Candidate {
                hypothesis,
                evidence,
                wrong,
            });
        best(each, last, 1.0, judged)
    }

    /// Evidence decides, and another memory takes over only where it is clearly better.
    #[test]
    fn another_memory_takes_over_when_it_is_better() {
        assert_eq!(chosen(&[], 0, true), None);
        let by_evidence = |a, b, last| chosen(&[(1, a, 1.0), (2, b, 1.0)], last, false);
        assert_eq!(by_evidence(5.0, 5.9, 1), Some(1), "not by more than 1");
        assert_eq!(by_evidence(5.0, 6.1, 1), Some(2));
        assert_eq!(by_evidence(5.0, 5.9, 2), Some(2));
        let by_memory = |wrong, judged| chosen(&[(1, 9.0, 1.0), (2, 5.0, wrong)], 1, judged);
        assert_eq!(by_memory(0.86, true), Some(1), "less is chance");
        assert_eq!(by_memory(0.84, true), Some(2));
        assert_eq!(by_memory(0.84, false), Some(1), "too few drives");
        let unjudged = [(1, 9.0, 0.0), (2, 5.0, 0.0)];
        assert_eq!(chosen(&unjudged, 1, true), Some(1));
    }
}
