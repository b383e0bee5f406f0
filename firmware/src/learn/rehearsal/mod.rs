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
mod stream;

pub use bets::Bets;
pub use coast::Seen;
pub use stream::{Passed, Stream};

use super::bank::{Bank, HYPOTHESES, ZERO_CORRECTION};
use super::prior::NAV;
use crate::fix::OBSERVATIONS;
use crate::nav::Transition;
use lrnn_nostd::learn::kalman::OUTPUTS;

/// How long the coasts last, s.
pub const HORIZONS_S: [f32; HORIZONS] = [5.0, 10.0, 30.0, 60.0, 120.0, 300.0];
const HORIZONS: usize = 6;
/// Coasts of each horizon.
const STREAMS: usize = 2;
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
/// After a new start of the navigator, past proofs count no more than this.
const ANEW: f32 = 10.0;
/// A proof that was not renewed for this time is none any more, s (assumed).
const TRUST_S: f32 = 3600.0;

/// The rehearsals of one length.
#[derive(Debug, Clone, Copy)]
struct Horizon {
    streams: [Stream; STREAMS],
    bets: Bets,
}

impl Horizon {
    const ZEROED: Horizon = Horizon {
        streams: [Stream::NONE; STREAMS],
        bets: Bets::ZEROED,
    };
    const NONE: Horizon = Horizon {
        streams: [Stream::NONE; STREAMS],
        bets: Bets::NONE,
    };

    /// Which coast may start now: one that does not run, some time after the other.
    fn free(&mut self, horizon: f32) -> Option<&mut Stream> {
        let [a, b] = &mut self.streams;
        let waits = |stream: &Stream| stream.coast.time < APART * horizon;
        match (a.coast.runs, b.coast.runs) {
            (false, runs) if !runs || !waits(b) => Some(a),
            (true, false) if !waits(a) => Some(b),
            _ => None,
        }
    }
}

/// How a hypothesis stands.
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

/// See the module.
#[derive(Debug, Clone)]
pub struct Rehearsal {
    horizons: [Horizon; HORIZONS],
    /// The interval that the running coasts are to pass.
    passed: Passed,
    /// The coast that is to pass it next; from this number on they are done.
    next: usize,
    /// Coasts that ran when the interval ended, one bit each.
    moving: u16,
    proved: [bool; HYPOTHESES],
    /// Time since a coast has ended, s.
    since_s: f32,
}

const COASTS: usize = HORIZONS * STREAMS;

impl Rehearsal {
    /// All zeros. Call [`Rehearsal::begin`] before use.
    pub const ZEROED: Rehearsal = Rehearsal {
        horizons: [Horizon::ZEROED; HORIZONS],
        passed: Passed {
            applied: [0.0; OUTPUTS],
            fed_back: [0.0; NAV],
            seen: None,
            at_once: false,
        },
        next: 0,
        moving: 0,
        proved: [false; HYPOTHESES],
        since_s: 0.0,
    };

    /// Begins anew, in place.
    pub fn begin(&mut self) {
        self.horizons.fill(Horizon::NONE);
        self.drop_coasts();
        self.proved = [false; HYPOTHESES];
        (self.moving, self.since_s) = (0, 0.0);
    }

    fn streams(&mut self) -> impl Iterator<Item = &mut Stream> {
        self.horizons.iter_mut().flat_map(|of| &mut of.streams)
    }

    fn drop_coasts(&mut self) {
        for stream in self.streams() {
            stream.coast.runs = false;
        }
        self.passed.seen = None;
        self.next = COASTS;
    }

    /// The navigator was lost, or starts anew: the coasts in progress end without a result, and
    /// what has been proved must be proved again, from a smaller capital.
    pub fn interrupted(&mut self) {
        self.drop_coasts();
        for horizon in &mut self.horizons {
            horizon.bets.limit(ANEW);
        }
        self.proved = [false; HYPOTHESES];
    }

    /// The navigator has passed an interval with the estimate `applied` subtracted. The coasts
    /// follow in [`Self::work`].
    pub fn interval(&mut self, time: f32, applied: &[f32; OUTPUTS]) {
        self.since_s += time;
        for horizon in &mut self.horizons {
            horizon.bets.passes(time);
        }
        self.passed.applied = *applied;
        self.passed.seen = None;
        self.goes_on(false);
    }

    fn goes_on(&mut self, at_once: bool) {
        self.passed.at_once = at_once;
        self.passed.fed_back = [0.0; NAV];
        self.next = 0;
        let streams = self.streams().enumerate();
        self.moving = streams.fold(0, |bits, (k, of)| bits | u16::from(of.coast.runs) << k);
    }

    /// A fix at the end of the interval: estimate minus fix, and its variance. The position counts;
    /// where it is not measured, the velocity.
    pub fn fix(&mut self, z: &[f32; OBSERVATIONS], variance: &[f32; OBSERVATIONS]) {
        let [n, e, _, vn, ve, _] = *z;
        let [of_n, of_e, _, of_vn, of_ve, _] = *variance;
        let (position, velocity) = (of_n.max(of_e), of_vn.max(of_ve));
        self.passed.seen = if position.is_finite() {
            Some((6, [n, e], position))
        } else if velocity.is_finite() {
            Some((3, [vn, ve], velocity))
        } else {
            None
        }
        .map(|(first, off, variance)| Seen {
            first,
            off,
            sigma: libm::sqrtf(variance.max(0.0)),
        });
        if self.is_done() {
            self.goes_on(true);
        }
    }

    /// The navigator has been corrected by `error` after the interval.
    pub fn feed_back(&mut self, error: &[f32; NAV]) {
        if self.is_done() {
            self.streams().for_each(|of| of.coast.feed_back(error));
        } else {
            self.passed.fed_back = *error;
        }
    }

    /// The hypotheses have learnt from a fix: coasts may start.
    pub fn start(&mut self, bank: &Bank) {
        for (horizon, length) in self.horizons.iter_mut().zip(HORIZONS_S) {
            if let Some(stream) = horizon.free(length) {
                stream.start(bank);
            }
        }
    }

    /// Whether all coasts have passed the interval.
    pub fn is_done(&self) -> bool {
        self.next >= COASTS
    }

    /// One coast passes the interval, some thousand instructions. True: there is more.
    pub fn work(&mut self, block: &Transition) -> bool {
        if self.is_done() {
            return false;
        }
        let (k, stream) = (self.next / STREAMS, self.next % STREAMS);
        let moves = self.moving >> self.next & 1 == 1;
        self.next += 1;
        let length = HORIZONS_S.get(k).copied().unwrap_or(f32::INFINITY);
        let horizon = self.horizons.get_mut(k).filter(|_| moves);
        if let Some(Horizon { streams, bets }) = horizon
            && let Some(stream) = streams.get_mut(stream)
            && let Some(scores) = stream.passes(&self.passed, block, length)
        {
            bets.takes(&scores, length);
            self.since_s = 0.0;
        }
        !self.is_done()
    }

    /// How a hypothesis stands.
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

    /// Whether a hypothesis has been found harmful at some horizon.
    pub fn harms(&self, hypothesis: usize) -> bool {
        self.standing(hypothesis).check < HARMFUL[1]
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
