//! What has come and is not taken yet, and the stages in which it is taken.
//!
//! Samples, ends of blocks and fixes wait here in the order in which they came.
//! [`FixLearner::work`] takes them one by one, in stages of which each is short enough for one pass
//! of the main loop:
//!
//! ```text
//! sample      gathered - piece and second of the standstill - navigator's piece - a fix's turn
//! missing     deferred work - variances - the navigator goes on, a piece at a time
//! block, fix  deferred work - its result - piece - transition - means - antenna, rehearsals
//!             block: feedback, the networks' inputs      fix: innovation
//! ```
//!
//! The order is the same whenever the stages are computed, and so are the bits.

use super::FixLearner;
use crate::compensator::Block;
use crate::fix::{Fix, OBSERVATIONS};
use crate::inputs::Sources;
use crate::learn::bank::{HYPOTHESES, Half};
use crate::learn::prior::{NAV, Shapes};
use crate::sample::Counts;
use heapless::Deque;

/// So many wait at most: more than 6 ms at 2000 Hz, the time of some 500 000 instructions. What
/// finds no room has the oldest taken at once.
const ROOM: usize = 16;

const REACHES: usize = Shapes::<f32>::REACHES;

/// What has come.
#[derive(Debug, Clone, Copy)]
pub(super) enum Event {
    /// Its number and its counts.
    Sample(u32, Counts),
    Gap,
    Silence,
    /// In [`Events::block`].
    Block,
    /// In [`Events::fix`].
    Fix,
}

/// A fix that is compared with the navigator: its age, s, and variances.
#[derive(Debug, Clone, Copy)]
pub(super) struct Compared {
    pub fix: Fix,
    pub age: f32,
    pub variance: [f32; OBSERVATIONS],
}

/// A fix while nothing navigates: its age, s, and the velocity's standard deviation of a vehicle
/// that stands, m/s, if it does.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fresh {
    pub fix: Fix,
    pub age: f32,
    pub stands: Option<f32>,
}

/// What is made of a fix.
#[derive(Debug, Clone, Copy)]
pub(super) enum Looked {
    Unused,
    Compare(Compared),
    Start(Fresh),
}

/// What comes next of a fix from which the navigator may start: the alignment at standstill is
/// solved or finished, else the alignment in motion takes it.
#[derive(Debug, Clone, Copy)]
pub(super) enum Part {
    Look,
    Sweep,
    End,
    Carry,
    Judge,
    Start,
    Motion,
}

/// What all deferred work must be done for.
#[derive(Debug, Clone, Copy)]
pub(super) enum Then {
    /// Samples are missing before this one.
    Bridge(u32, Counts),
    Silence,
    /// In [`Events::block`].
    Block,
    /// The fix and the number of the sample before it.
    Fix(u32, Fix),
}

/// Why an interval ends.
#[derive(Debug, Clone, Copy)]
pub(super) enum End {
    Block,
    Fix(Compared),
}

/// What comes next of what is being taken.
#[derive(Debug, Clone, Copy, Default)]
pub(super) enum Stage {
    /// The next event.
    #[default]
    Idle,
    /// A part of the beginning: the shapes, the hypotheses, the antenna, what is known.
    Begin(usize),
    /// Deferred work must be done first.
    Settle(Then),
    /// Its result is known.
    Settled(Then),
    /// The navigator goes on for so many missing samples, and then takes one.
    Coast(u32, Counts, u32, Counts),
    /// The sample's piece of the standstill is over, and that of the navigator, or not.
    Standstill(bool),
    Piece,
    /// The interval's last piece, its transition, means, and what else moves with it.
    Interval(End),
    Transition(End),
    Means(End),
    Others(End),
    Correct,
    /// By this error.
    Corrected([f32; NAV]),
    Inputs,
    Compare(Compared),
    /// The navigator may start from this fix.
    Start(Part, Fresh),
}

/// See the module.
#[derive(Debug)]
pub(super) struct Events {
    waiting: Deque<Event, ROOM>,
    block: Option<Sources>,
    fix: Option<(u32, Fix)>,
    pub stage: Stage,
}

impl Events {
    pub const NONE: Events = Events {
        waiting: Deque::new(),
        block: None,
        fix: None,
        stage: Stage::Idle,
    };

    /// Nothing waits, and nothing is being taken.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty() && matches!(self.stage, Stage::Idle)
    }

    /// All is taken but for a piece of the navigator that is over, on which nothing depends yet.
    pub fn is_known(&self) -> bool {
        self.waiting.is_empty() && matches!(self.stage, Stage::Idle | Stage::Piece)
    }
}

impl FixLearner<'_> {
    /// Something has come.
    #[inline]
    pub(super) fn comes(&mut self, event: Event) {
        while self.events.waiting.is_full() {
            self.advance();
        }
        let _ = self.events.waiting.push_back(event); // there is room
    }

    /// The end of a block.
    pub(super) fn block_comes(&mut self, block: &Block) {
        while self.events.block.is_some() {
            self.advance();
        }
        self.events.block = Some(block.sources);
        self.comes(Event::Block);
    }

    pub(super) fn fix_comes(&mut self, number: u32, fix: &Fix) {
        while self.events.fix.is_some() {
            self.advance();
        }
        self.events.fix = Some((number, *fix));
        self.comes(Event::Fix);
    }

    /// Takes all that has come, at once.
    pub(super) fn take_all(&mut self) {
        while self.advance() {}
    }

    /// The same but for the navigator's last piece: what the hypotheses and the detector of a
    /// standstill know does not depend on it.
    pub(super) fn take_known(&mut self) {
        while !self.events.is_known() {
            self.advance();
        }
    }

    /// One stage of what has come. False: nothing has.
    pub(super) fn advance(&mut self) -> bool {
        match self.events.stage {
            Stage::Idle => return self.take_next(),
            Stage::Begin(hypothesis) => self.begin_part(hypothesis),
            Stage::Settle(then) => {
                if !self.align_part() && !self.part() {
                    self.events.stage = Stage::Settled(then);
                    if !self.fixing {
                        self.settled(then); // there is no result
                    } else {
                        self.conclude();
                    }
                }
            }
            Stage::Settled(then) => self.settled(then),
            Stage::Coast(missing, of, number, counts) => {
                let navigator = self.course.navigator_mut();
                match navigator.map_or(0, |navigator| navigator.coast(&of, missing)) {
                    0 => self.take_sample(number, &counts),
                    left => self.events.stage = Stage::Coast(left, of, number, counts),
                }
            }
            Stage::Standstill(piece) => {
                if !self.align.as_mut().is_some_and(|align| align.part()) {
                    self.events.stage = Stage::Piece;
                    if !piece {
                        self.turn_of_fix();
                    }
                }
            }
            Stage::Piece => {
                self.course.end_piece();
                self.turn_of_fix();
            }
            stage => self.interval_stage(stage),
        }
        true
    }

    /// Takes the oldest event. False: there is none.
    fn take_next(&mut self) -> bool {
        let first = match self.events.waiting.front() {
            Some(Event::Sample(..)) => self.waiting.is_full(), // which makes room for it
            Some(Event::Fix) => self.is_aligning(),            // whether the navigator starts
            _ => false,
        };
        if first {
            return self.align_part();
        }
        let Some(event) = self.events.waiting.pop_front() else {
            return false;
        };
        match event {
            Event::Sample(number, counts) if self.missing(number) > 0 => {
                self.events.stage = Stage::Settle(Then::Bridge(number, counts));
            }
            Event::Sample(number, counts) => self.take_sample(number, &counts),
            Event::Gap => self.held.gap(),
            Event::Silence => self.events.stage = Stage::Settle(Then::Silence),
            Event::Block => {
                self.held.block();
                self.events.stage = Stage::Settle(Then::Block);
            }
            Event::Fix => {
                if let Some((number, fix)) = self.events.fix.take() {
                    let waits = self.course.navigates().then_some(self.stream).flatten();
                    if !waits.is_some_and(|stream| self.held.takes(number, &fix, &stream)) {
                        self.events.stage = Stage::Settle(Then::Fix(number, fix));
                    }
                }
            }
        }
        true
    }

    /// No work is left.
    fn settled(&mut self, then: Then) {
        self.events.stage = Stage::Idle;
        match then {
            Then::Bridge(number, counts) => {
                let of = self.last.map_or(counts, |(_, counts)| counts);
                let missing = self.bridge(self.missing(number));
                self.events.stage = Stage::Coast(missing, of, number, counts);
            }
            Then::Silence => self.falls_silent(),
            Then::Block => self.events.stage = Stage::Interval(End::Block),
            Then::Fix(number, fix) => {
                self.events.stage = match self.look_at(number, &fix) {
                    Looked::Unused => Stage::Idle,
                    Looked::Compare(compared) => Stage::Interval(End::Fix(compared)),
                    Looked::Start(fresh) => Stage::Start(Part::Look, fresh),
                };
            }
        }
    }

    /// Takes a sample; none is missing before it.
    pub(super) fn take_sample(&mut self, number: u32, counts: &Counts) {
        let still = self.gather(number, counts);
        let piece = if self.is_aligning() {
            self.waiting.push(counts); // there is room
            false
        } else {
            self.course.gather(counts)
        };
        if still {
            self.events.stage = Stage::Standstill(piece);
        } else if piece {
            self.events.stage = Stage::Piece;
        } else {
            self.turn_of_fix();
        }
    }

    /// A sample is taken: a fix that waits may have its turn.
    fn turn_of_fix(&mut self) {
        self.events.stage = match self.held.sample() {
            Some((number, fix)) => Stage::Settle(Then::Fix(number, fix)),
            None => Stage::Idle,
        };
    }

    /// A stage of the end of an interval, or of what follows a fix.
    #[inline(never)]
    fn interval_stage(&mut self, stage: Stage) {
        self.events.stage = match stage {
            Stage::Interval(end) if self.interval_is_over() => Stage::Transition(end),
            Stage::Interval(end) => not_navigating(end),
            Stage::Transition(end) => {
                if self.take_transition() {
                    Stage::Means(end)
                } else {
                    navigating(end)
                }
            }
            Stage::Means(end) => {
                self.move_means();
                Stage::Others(end)
            }
            Stage::Others(end) => {
                self.move_others();
                navigating(end)
            }
            Stage::Correct => {
                let error = self.correct();
                error.map_or(Stage::Inputs, Stage::Corrected)
            }
            Stage::Corrected(error) => {
                self.corrected(&error);
                Stage::Inputs
            }
            Stage::Inputs => {
                if let Some(sources) = self.events.block.take() {
                    self.take_inputs(&sources);
                }
                Stage::Idle
            }
            Stage::Compare(compared) => {
                self.compare(&compared);
                Stage::Idle
            }
            Stage::Start(part, fresh) => match self.start_at(part, &fresh) {
                Some(part) => Stage::Start(part, fresh),
                None => Stage::Idle,
            },
            _ => Stage::Idle,
        };
    }

    /// What was known of the stream before, rehearsals, the stored networks, shapes, hypotheses one
    /// by one, antenna, what is known of the unit.
    fn begin_part(&mut self, part: usize) {
        self.events.stage = Stage::Begin(part + 1);
        const SHAPES: usize = 4;
        const FIRST: usize = SHAPES + REACHES;
        const LAST: usize = FIRST + 3 * HYPOTHESES;
        match part {
            0 => self.begin_bank(),
            1 => self.memory.rehearsal.begin(),
            2 => self.begin_stored(),
            3 => self.begin_shapes(),
            SHAPES..FIRST => self.shapes.reach(part - SHAPES),
            FIRST..LAST => {
                let part = part - FIRST;
                let halves = [Some(Half::Networks), Some(Half::Prior)];
                let half = halves.get(part % 3).copied().flatten();
                self.begin_hypothesis(part / 3, half);
            }
            LAST => self.begin_antenna(),
            _ => {
                self.begin_known();
                self.events.stage = Stage::Idle;
            }
        }
    }
}

/// What follows an interval.
fn navigating(end: End) -> Stage {
    match end {
        End::Block => Stage::Correct,
        End::Fix(compared) => Stage::Compare(compared),
    }
}

/// What follows where there is no navigator.
fn not_navigating(end: End) -> Stage {
    match end {
        End::Block => Stage::Inputs,
        End::Fix(_) => Stage::Idle,
    }
}
