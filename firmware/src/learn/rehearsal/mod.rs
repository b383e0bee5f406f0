//! Rehearsals: is navigation without fixes better with a hypothesis' correction than without one?
//!
//! That is what a correction is for, and it can be tried again and again while fixes come. Shadow
//! navigators start from what each hypothesis believes, go on without fixes for some time, and
//! their error at a fix then is compared with that of the shadow that corrects nothing. This asks
//! no noise model, no datasheet and no white fixes. Errors of the receiver that last shorter than a
//! coast hurt all shadows alike.
//!
//! A hypothesis has **proved** itself when the bets on it (`bets`) have won [`PROVED`] times their
//! stake at one of the [`HORIZONS_S`], and at no horizon has it been found harmful, and at
//! the longest one that has been tried it wins as well. Short coasts give speed, long ones a veto.
//! It is given up by the same bets.
//!
//! The shadows of a coast are differences to the device's navigator, which move by linear equations
//! (`coast`): a coast costs 1 % of what a navigator costs. Each horizon has two coasts, about
//! half a horizon apart. Coasts that overlap are not news to each other, so those that end in the
//! same block of time make one bet.

mod bets;
mod coast;

pub use bets::Bets;
pub use coast::{Coast, FixError, Scores};

use super::bank::{Bank, HYPOTHESES, STORED, ZERO_CORRECTION};
use super::prior::NAV;
use crate::fix::OBSERVATIONS;
use crate::nav::Transition;
use lrnn_nostd::learn::kalman::Correction;

/// Lengths of the coasts, s.
pub const HORIZONS_S: [f32; HORIZONS] = [5.0, 10.0, 30.0, 60.0, 120.0, 300.0];
const HORIZONS: usize = 6;
/// Coasts of each horizon.
const COASTS: usize = 2;
/// The second coast starts so much after the first, as a share of the horizon: about a half, with
/// room for fixes a second apart.
const APART: f32 = 0.4;
/// Capital that proves, in stakes: the odds against chance at one horizon. The horizons share their
/// luck, so it is more than a hundred: `tests/lasting.rs`.
pub const PROVED: f32 = 150.0;
/// A proved hypothesis keeps its proof above this.
const KEEPS: f32 = 20.0;
/// Below this capital of the check a hypothesis is harmful; one that has proved itself, below the
/// second.
const HARMFUL: [f32; 2] = [0.5, 0.25];
/// Coasts after which a horizon counts as tried.
const TRIED: u16 = 3;
/// Mean scores that are as good as the best one.
const ALIKE: f32 = 0.2;
/// A fix may end a coast so much sooner than its horizon, s (fixes do not come at even times), and
/// so much later: a share of it, and s.
const EARLY: f32 = 0.3;
const LATE: [f32; 2] = [0.5, 2.0];
/// Capital of earlier drives, and of a navigator that was aligned wrongly, counts no more than
/// this: what was good once must show it again. (Of nine harmful memories held in the hand, carried
/// in full, seven passed; at most ten stakes, one.)
const CARRIED: f32 = 10.0;
/// A proof that was not renewed for this time is none any more, s (assumed).
const TRUST_S: f32 = 3600.0;

/// The rehearsals of one length.
#[derive(Debug, Clone, Copy)]
struct Horizon {
    coasts: [Coast; COASTS],
    bets: Bets,
}

impl Horizon {
    const ZEROED: Horizon = Horizon {
        coasts: [Coast::NONE; COASTS],
        bets: Bets::ZEROED,
    };
    const NONE: Horizon = Horizon {
        coasts: [Coast::NONE; COASTS],
        bets: Bets::NONE,
    };

    /// A coast that may start now: one that does not run, some time after the other.
    fn free(&mut self, horizon: f32) -> Option<&mut Coast> {
        let [a, b] = &mut self.coasts;
        let waits = |coast: &Coast| coast.time < APART * horizon;
        match (a.runs, b.runs) {
            (false, runs) if !runs || !waits(b) => Some(a),
            (true, false) if !waits(a) => Some(b),
            _ => None,
        }
    }
}

/// Capital of a hypothesis that goes from drive to drive, for each horizon and each of its bets, on
/// a logarithmic scale of 0 (0.05 stakes) to 255 (10 stakes).
pub type Carried = [[u8; 2]; HORIZONS];

/// [`Carried`] of a hypothesis without history: one stake.
pub const UNTRIED: Carried = [[144; 2]; HORIZONS];

/// How near a proof is, 0 to 100: the logarithm of the `capital` in stakes as a share of that of
/// [`PROVED`], rounded down. 100 is only what has `proved` itself.
#[must_use]
pub fn of_100(capital: f32, proved: bool) -> u8 {
    let share = 100.0 * libm::logf(capital.max(1.0)) / libm::logf(PROVED);
    match (proved, share) {
        (true, _) => 100,
        // a capital that is no number is none
        (false, share) if share > 0.0 => share.min(99.0) as u8,
        _ => 0,
    }
}

/// State of a hypothesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// Greatest capital of the proof over the horizons.
    pub proof: f32,
    /// Least capital of the check.
    pub check: f32,
    /// Capital of the bet on slight gains at the longest horizon that was tried.
    pub longest: f32,
    /// Mean score there.
    pub score: f32,
}

impl Standing {
    /// Whether the hypothesis has been found harmful at some horizon.
    #[must_use]
    pub fn harms(&self) -> bool {
        self.check < HARMFUL[1]
    }
}

/// The coasts in progress, and the hypotheses that they have proved.
#[derive(Debug, Clone)]
pub struct Rehearsal {
    horizons: [Horizon; HORIZONS],
    proved: [bool; HYPOTHESES],
    /// Time since a coast has ended, s.
    since_s: f32,
}

impl Rehearsal {
    /// All zeros. Call [`Rehearsal::begin`] before use.
    pub const ZEROED: Rehearsal = Rehearsal {
        horizons: [Horizon::ZEROED; HORIZONS],
        proved: [false; HYPOTHESES],
        since_s: 0.0,
    };

    /// Restarts in place.
    pub fn begin(&mut self) {
        self.horizons.fill(Horizon::NONE);
        self.drop_coasts();
        self.proved = [false; HYPOTHESES];
        self.since_s = 0.0;
    }

    fn coasts(&mut self) -> impl Iterator<Item = &mut Coast> {
        self.horizons.iter_mut().flat_map(|of| &mut of.coasts)
    }

    fn drop_coasts(&mut self) {
        self.coasts().for_each(|coast| coast.runs = false);
    }

    /// The navigator was lost, or restarts: the coasts in progress end without a result. What was
    /// won up to there stays.
    pub fn interrupted(&mut self) {
        self.drop_coasts();
    }

    /// What the navigator has shown is in doubt: what has been proved must be proved again, from a
    /// smaller capital.
    pub fn doubt(&mut self) {
        self.drop_coasts();
        for horizon in &mut self.horizons {
            horizon.bets.limit(CARRIED);
        }
        self.proved = [false; HYPOTHESES];
    }

    /// The capital of a hypothesis for the next drive.
    pub fn carried(&self, hypothesis: usize) -> Carried {
        self.horizons
            .each_ref()
            .map(|horizon| horizon.bets.carried(hypothesis))
    }

    /// After [`Rehearsal::begin`]: a hypothesis begins with the capital of earlier drives.
    pub fn carry(&mut self, hypothesis: usize, carried: &Carried) {
        for (horizon, carried) in self.horizons.iter_mut().zip(carried) {
            horizon.bets.carry(hypothesis, *carried);
        }
    }

    /// The navigator has passed an interval with the correction `applied`.
    pub fn interval(&mut self, block: &Transition, applied: &Correction) {
        self.since_s += block.time;
        for horizon in &mut self.horizons {
            horizon.bets.passes(block.time);
        }
        for coast in self.coasts().filter(|coast| coast.runs) {
            coast.moves(block, applied);
        }
    }

    /// A fix at the end of the interval: estimate minus fix, and its variance. It ends the coasts
    /// that are long enough.
    pub fn fix(&mut self, z: &[f32; OBSERVATIONS], variance: &[f32; OBSERVATIONS]) {
        let Some(seen) = FixError::of(z, variance) else {
            return;
        };
        for (Horizon { coasts, bets }, length) in self.horizons.iter_mut().zip(HORIZONS_S) {
            for coast in coasts {
                if let Some(scores) = coast.ends(&seen, length) {
                    bets.takes(&scores, length);
                    self.since_s = 0.0;
                }
            }
        }
    }

    /// The navigator has been corrected by `error` after the interval.
    pub fn feed_back(&mut self, error: &[f32; NAV]) {
        self.coasts().for_each(|coast| coast.feed_back(error));
    }

    /// The hypotheses have learnt from a fix: coasts may start.
    pub fn start(&mut self, bank: &Bank) {
        for (horizon, length) in self.horizons.iter_mut().zip(HORIZONS_S) {
            if let Some(coast) = horizon.free(length) {
                coast.start(bank);
            }
        }
    }

    /// State of a hypothesis.
    pub fn standing(&self, hypothesis: usize) -> Standing {
        let mut standing = Standing {
            proof: 0.0,
            check: f32::INFINITY,
            longest: 0.0,
            score: 0.0,
        };
        for bets in self.horizons.iter().map(|horizon| &horizon.bets) {
            let Some(wealth) = bets.wealth.get(hypothesis) else {
                continue;
            };
            standing.proof = standing.proof.max(wealth.proof());
            standing.check = standing.check.min(wealth.check);
            if bets.count >= TRIED {
                (standing.longest, standing.score) = (wealth.slight(), wealth.mean);
            }
        }
        standing
    }

    /// The hypothesis that may correct: of those that have proved themselves and are about as good
    /// as the best of them, the one with the greatest evidence. `evidence` is minus infinity for
    /// those that may not.
    pub fn choose(&mut self, evidence: impl Fn(usize) -> f64) -> usize {
        let stale = self.since_s > TRUST_S;
        let mut best = f32::NEG_INFINITY;
        for (hypothesis, proved) in self.standings() {
            let Standing {
                proof,
                check,
                longest,
                score,
            } = self.standing(hypothesis);
            let new = proof >= PROVED && check >= HARMFUL[0] && longest >= 1.0;
            let keeps = proved && proof >= KEEPS && check >= HARMFUL[1];
            let may = hypothesis != ZERO_CORRECTION && !stale;
            let may = may && (new || keeps) && evidence(hypothesis).is_finite();
            if let Some(proved) = self.proved.get_mut(hypothesis) {
                *proved = may;
            }
            if may && score > best {
                best = score;
            }
        }
        let mut chosen = (ZERO_CORRECTION, f64::NEG_INFINITY);
        for (hypothesis, proved) in self.standings() {
            let good = self.standing(hypothesis).score >= best - ALIKE;
            let evidence = evidence(hypothesis);
            if proved && good && evidence > chosen.1 {
                chosen = (hypothesis, evidence);
            }
        }
        chosen.0
    }

    /// Whether a hypothesis has proved itself, by the last choice.
    pub fn has_proved(&self, hypothesis: usize) -> bool {
        self.proved.get(hypothesis).copied().unwrap_or(false)
    }

    /// Whether what acted from power-on, or is on trial as [`STORED`], is refuted: it is when it
    /// took part and does harm, and stays so, if it `was` before, until it has proved itself.
    pub fn refutes(&self, took_part: bool, was: bool) -> bool {
        took_part && self.harms(STORED) || was && !self.has_proved(STORED)
    }

    /// Whether a hypothesis has been found harmful at some horizon.
    pub fn harms(&self, hypothesis: usize) -> bool {
        self.standing(hypothesis).harms()
    }

    /// A coast of each horizon has ended with these scores, a horizon after the last one.
    #[cfg(test)]
    pub fn bet(&mut self, gains: &[f32; HYPOTHESES]) {
        let scores = &Scores {
            gains: *gains,
            extending: *gains,
        };
        for (horizon, length) in self.horizons.iter_mut().zip(HORIZONS_S) {
            horizon.bets.passes(length);
            horizon.bets.takes(scores, length);
        }
    }

    /// Numbers of the hypotheses, and whether each has proved itself.
    fn standings(&self) -> impl Iterator<Item = (usize, bool)> + use<> {
        self.proved.into_iter().enumerate()
    }

    /// Coasts that have ended, at each horizon.
    pub fn counts(&self) -> [u16; HORIZONS] {
        self.horizons.each_ref().map(|horizon| horizon.bets.count)
    }
}

#[cfg(test)]
mod tests;
