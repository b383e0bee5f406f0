//! One coast after the other.

use super::coast::{Coast, Seen};
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
}

impl Stream {
    /// No coast runs.
    pub const NONE: Stream = Stream { coast: Coast::NONE };

    /// A coast starts from what each hypothesis believes.
    pub fn start(&mut self, bank: &Bank) {
        self.coast.start(bank);
    }

    /// The running coast passes an interval; a fix at the end of it ends a coast of `length` s.
    /// Gives the score of each hypothesis when it has ended in time.
    pub fn passes(
        &mut self,
        passed: &Passed,
        block: &Transition,
        length: f32,
    ) -> Option<[f32; HYPOTHESES]> {
        let Stream { coast } = self;
        if !passed.at_once {
            coast.moves(block, &passed.applied);
        }
        let mut scores = None;
        if let Some(seen) = &passed.seen
            && coast.time >= length - EARLY
        {
            coast.runs = false;
            if coast.time <= length + LATE[0] * length + LATE[1] {
                scores = Some(coast.scores(seen));
            }
        }
        coast.feed_back(&passed.fed_back);
        scores
    }
}
