//! Gains of the bets on each hypothesis at one horizon.
//!
//! A **block** is a stretch of time, and all coasts that end in it. At its end a capital is
//! multiplied once, by
//!
//! ```text
//! 1 + BET (m - worth) / (worth - least)       m: mean of the block's scores, none below `least`
//! ```
//!
//! If the conditional mean of m is at most `worth`, given all blocks before, then the capital's
//! expectation does not grow. It then exceeds a hundred times the stake with a probability of at
//! most one in a hundred, at any time (Ville's inequality; Waudby-Smith and Ramdas 2024,
//! "Estimating means of bounded random variables by betting"). There is one factor a block, since
//! a product of factors of the same time would need independent ones. No distribution of the
//! noise is assumed.
//!
//! What is assumed is that a hypothesis which is not better does not win on average over a block
//! *whatever happened before*. Errors of the navigator or the receiver that last longer than a
//! block break this: then the next block is as lucky as the last one. So there are two bets, half
//! of the stake on each ([`BETS`]), which deal with lasting errors in two ways. The first one has
//! blocks of a minute. The second one has blocks as long as the horizon, but wins only where the
//! error becomes 4.5 times smaller, which lasting errors do not imitate for long.
//! `tests/lasting.rs` measures what is proved falsely while errors last up to 100 s.

use super::coast::Scores;
use super::{CARRIED, EARLY};
use crate::learn::bank::HYPOTHESES;

/// One of the two bets.
struct Bet {
    /// Scores are cut to these.
    cut: [f32; 2],
    /// Required worth of a correction: the mean score above which the bet wins.
    worth: f32,
    /// Length of a block, s; no less than the horizon.
    block_s: f32,
}

/// A worth of 0.2 is an error that is 18 % smaller, 1.5 one that is 4.5 times smaller. The cuts
/// of the second bet prove fastest of those tried that prove falsely in less than 2 %
/// (`tests/lasting.rs`). A first one with blocks of 45 s and a worth of 0.25 proves gains of 65 %
/// sooner and of 30 % later, which is what a laser gyro's corrections gain.
const BETS: [Bet; 2] = [
    Bet {
        cut: [-1.0, 1.0],
        worth: 0.2,
        block_s: 60.0,
    },
    Bet {
        cut: [-2.0, MOST],
        worth: 1.5,
        block_s: 0.0,
    },
];
/// The largest score that counts: an error that is 20 times smaller.
pub(super) const MOST: f32 = 3.0;
/// Share of the capital that is at stake when proving.
const BET: f32 = 0.95;
/// Share that is at stake at each coast when checking for harm.
const CHECK_BET: f32 = 0.3;
/// The capital stays between these. Below the least one, the bets restart, so that an early failure
/// does not count for ever; the largest one bounds how long an early success does.
const PROOF: [f32; 2] = [0.05, 1e4];
const CHECK: [f32; 2] = [0.05, 2.0];
/// Number of scores that the mean covers.
const MEMORY: f32 = 20.0;

/// Gains of the bets on one hypothesis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wealth {
    /// Capital of each of [`BETS`].
    pub(super) capital: [f32; 2],
    /// Sums of the scores of their blocks.
    pub(super) sums: [f32; 2],
    /// Capital of bets that it does no harm beside those that it extends.
    pub check: f32,
    /// Mean of the last scores, each in -1 ..= 1.
    pub mean: f32,
}

impl Wealth {
    const ZEROED: Wealth = Wealth {
        capital: [0.0; 2],
        sums: [0.0; 2],
        check: 0.0,
        mean: 0.0,
    };
    /// A stake each.
    const NONE: Wealth = Wealth {
        capital: [1.0; 2],
        sums: [0.0; 2],
        check: 1.0,
        mean: 0.0,
    };

    /// Capital of the bets that it is worth its use.
    pub fn proof(&self) -> f32 {
        let [slight, large] = self.capital;
        0.5 * (slight + large)
    }

    /// The part of it that is on slight gains.
    pub fn slight(&self) -> f32 {
        let [slight, _] = self.capital;
        slight
    }

    /// One more score against nothing, and against what is extended; `count` of them before.
    fn takes(&mut self, score: f32, extending: f32, count: u16) {
        for (sum, bet) in self.sums.iter_mut().zip(&BETS) {
            let [least, most] = bet.cut;
            *sum += score.clamp(least, most);
        }
        let score = score.clamp(-1.0, 1.0);
        let checked = 1.0 + CHECK_BET * extending.clamp(-1.0, 1.0);
        self.check = clamped(self.check * checked, CHECK);
        self.mean += (score - self.mean) / (f32::from(count) + 1.0).min(MEMORY);
    }

    /// A block of one of the bets, `which` of them, has ended with `coasts` in it.
    fn ends(&mut self, which: usize, bet: &Bet, coasts: u16) {
        let Some((capital, sum)) = self.capital.get_mut(which).zip(self.sums.get_mut(which)) else {
            return;
        };
        let mean = core::mem::take(sum) / f32::from(coasts);
        let [least, _] = bet.cut;
        let won = 1.0 + BET * (mean - bet.worth) / (bet.worth - least);
        *capital = clamped(*capital * won, PROOF);
    }
}

/// A block in progress.
#[derive(Debug, Clone, Copy)]
struct Block {
    /// Time since it began, s.
    time: f32,
    /// Coasts that have ended in it.
    coasts: u16,
}

impl Block {
    const NONE: Block = Block {
        time: 0.0,
        coasts: 0,
    };
}

/// The bets of all hypotheses at one horizon.
#[derive(Debug, Clone, Copy)]
pub struct Bets {
    pub(super) wealth: [Wealth; HYPOTHESES],
    blocks: [Block; 2],
    /// Coasts that have ended.
    pub(super) count: u16,
}

impl Bets {
    /// All zeros.
    pub const ZEROED: Bets = Bets {
        wealth: [Wealth::ZEROED; HYPOTHESES],
        blocks: [Block::NONE; 2],
        count: 0,
    };
    /// No coast has ended.
    pub const NONE: Bets = Bets {
        wealth: [Wealth::NONE; HYPOTHESES],
        ..Bets::ZEROED
    };

    /// Lets this time of navigation pass, s.
    pub fn passes(&mut self, time: f32) {
        for block in &mut self.blocks {
            block.time += time;
        }
    }

    /// A coast of `horizon` s has ended with these scores of the hypotheses.
    pub fn takes(&mut self, scores: &Scores, horizon: f32) {
        let each = scores.gains.iter().zip(&scores.extending);
        for (wealth, (gain, extending)) in self.wealth.iter_mut().zip(each) {
            wealth.takes(*gain, *extending, self.count);
        }
        self.count = self.count.saturating_add(1);
        for (which, (block, bet)) in self.blocks.iter_mut().zip(&BETS).enumerate() {
            block.coasts = block.coasts.saturating_add(1);
            if block.time >= bet.block_s.max(horizon) - EARLY {
                for wealth in &mut self.wealth {
                    wealth.ends(which, bet, block.coasts);
                }
                *block = Block::NONE;
            }
        }
    }

    /// Earlier successes count no more than this.
    pub(super) fn limit(&mut self, proof: f32) {
        let capitals = self.wealth.iter_mut().flat_map(|of| &mut of.capital);
        capitals.for_each(|capital| *capital = capital.min(proof));
    }

    /// The capitals of a hypothesis as [`super::Carried`], rounded down.
    pub(super) fn carried(&self, hypothesis: usize) -> [u8; 2] {
        let capital = self
            .wealth
            .get(hypothesis)
            .map_or([1.0; 2], |of| of.capital);
        capital.map(|capital| (libm::logf(capital / PROOF[0]) / STEP) as u8) // `as` saturates
    }

    /// A hypothesis begins with these capitals.
    pub(super) fn carry(&mut self, hypothesis: usize, carried: [u8; 2]) {
        if let Some(wealth) = self.wealth.get_mut(hypothesis) {
            wealth.capital = carried.map(|step| PROOF[0] * libm::expf(f32::from(step) * STEP));
        }
    }
}

/// Logarithm of the ratio of one step of [`super::Carried`]: 255 steps from the least capital to
/// [`CARRIED`].
const STEP: f32 = 0.020_777_715;
const _: () = assert!(CARRIED / PROOF[0] == 200.0); // ln 200 = 255 STEP

/// The capital between two limits; the least one if it is not finite.
fn clamped(capital: f32, [least, most]: [f32; 2]) -> f32 {
    if capital >= least {
        capital.min(most)
    } else {
        least
    }
}
