//! One coast after the other, and the bets on what they show.

use super::coast::{Coast, Seen};
use super::wealth::Wealth;
use super::{EARLY, LATE};
use crate::learn::bank::{Bank, HYPOTHESES};
use crate::learn::prior::NAV;
use crate::nav::Transition;
use lrnn_nostd::learn::kalman::OUTPUTS;

/// What the navigator has passed, beside the transition.
#[derive(Debug, Clone, Copy)]
pub struct Passed {
    /// The estimate that it subtracted, rad/s and m/s2.
    pub applied: [f32; OUTPUTS],
    /// By how much it has been corrected after the interval.
    pub fed_back: [f32; NAV],
    /// What a fix at the end says.
    pub seen: Option<Seen>,
    /// The interval has no length: there is a fix at the end of the last one.
    pub at_once: bool,
}

/// See the module.
#[derive(Debug, Clone, Copy)]
pub struct Stream {
    pub(super) coast: Coast,
    pub(super) wealth: [Wealth; HYPOTHESES],
}

impl Stream {
    /// Nothing has been tried.
    pub const ZEROED: Stream = Stream {
        coast: Coast::NONE,
        wealth: [Wealth::ZEROED; HYPOTHESES],
    };
    /// Nothing has been tried.
    pub const NONE: Stream = Stream {
        coast: Coast::NONE,
        wealth: [Wealth::NONE; HYPOTHESES],
    };

    /// A coast starts from what each hypothesis believes.
    pub fn start(&mut self, bank: &Bank) {
        self.coast.start(bank);
    }

    /// The running coast passes an interval; a fix at the end of it ends a coast of `length` s.
    /// True: it has ended and been counted.
    pub fn passes(&mut self, passed: &Passed, block: &Transition, length: f32) -> bool {
        let Stream { coast, wealth } = self;
        if !passed.at_once {
            coast.moves(block, &passed.applied);
        }
        let mut counted = false;
        if let Some(seen) = &passed.seen
            && coast.time >= length - EARLY
        {
            coast.runs = false;
            if coast.time <= length + LATE[0] * length + LATE[1] {
                let scores = coast.scores(seen);
                for (wealth, score) in wealth.iter_mut().zip(scores) {
                    wealth.takes(&score, coast.count);
                }
                coast.count = coast.count.saturating_add(1);
                counted = true;
            }
        }
        coast.feed_back(&passed.fed_back);
        counted
    }

    /// Coasts that were counted.
    #[must_use]
    pub fn count(&self) -> u16 {
        self.coast.count
    }
}
