//! What bets on a hypothesis have won.
//!
//! After each coast a capital is multiplied by `1 + bet * score`, where the score is at least -1.
//! If the expected score is not above zero, whatever was seen before, then the capital's
//! expectation does not grow. It then exceeds a hundred times the stake with a probability of at
//! most one in a hundred, at any time (Ville's inequality; Waudby-Smith and Ramdas 2024,
//! "Estimating means of bounded random variables by betting"). Nothing is assumed of noise,
//! independence or distribution.

use super::coast::Score;

/// A hypothesis must make the error smaller by this much, as a natural logarithm: an eighth is 12
/// %. It is what a correction must be worth, and covers that errors of the fixes at both ends of a
/// coast may be alike.
const WORTH: f32 = 0.125;
/// Share of the capital that is at stake when proving and when checking.
const PROOF_BET: f32 = 0.95;
const CHECK_BET: f32 = 0.6;
/// The capital is kept between these. Below the least one, the bets begin anew, so that a past
/// failure does not count for ever; the largest one bounds how long a past success does.
const PROOF: [f32; 2] = [0.05, 1e4];
const CHECK: [f32; 2] = [0.05, 2.0];
/// Scores whose mean is kept.
const MEMORY: f32 = 10.0;

/// The bets on one hypothesis at one horizon.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wealth {
    /// Capital of bets that it is worth its use, one half of it on the whole error.
    proof: f32,
    /// The other half, on the error's parts north and east, one after the other. Where a correction
    /// gains much in both, this is twice as fast.
    parts: f32,
    /// Capital of bets that it does no harm.
    pub check: f32,
    /// Mean of the last scores.
    pub mean: f32,
}

impl Wealth {
    pub const ZEROED: Wealth = Wealth {
        proof: 0.0,
        parts: 0.0,
        check: 0.0,
        mean: 0.0,
    };
    /// A stake each.
    pub const NONE: Wealth = Wealth {
        proof: 1.0,
        parts: 1.0,
        check: 1.0,
        mean: 0.0,
    };

    /// One more score; `count` of them before.
    pub fn takes(&mut self, score: &Score, count: u16) {
        let Score { whole, parts } = score;
        self.proof = kept(self.proof * won(*whole), PROOF);
        let [north, east] = parts.map(won);
        self.parts = kept(self.parts * north * east, PROOF);
        self.check = kept(self.check * (1.0 + CHECK_BET * whole), CHECK);
        self.mean += (whole - self.mean) / (f32::from(count) + 1.0).min(MEMORY);
    }

    /// Capital of the bets that it is worth its use.
    pub fn proof(&self) -> f32 {
        0.5 * (self.proof + self.parts)
    }

    /// Past successes count no more than this.
    pub fn limit(&mut self, proof: f32) {
        self.proof = self.proof.min(proof);
        self.parts = self.parts.min(proof);
    }
}

/// What a bet makes of its stake.
fn won(score: f32) -> f32 {
    1.0 + PROOF_BET * (score - WORTH) / (1.0 + WORTH)
}

/// Kept between two limits; what is not finite is the least.
fn kept(capital: f32, [least, most]: [f32; 2]) -> f32 {
    if capital >= least {
        capital.min(most)
    } else {
        least
    }
}
