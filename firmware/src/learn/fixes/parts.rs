//! Parts of a learner from fixes, each with its own reset.

use super::course::Course;
use super::gaps::Recent;
use super::judged::Judged;
use super::observe::{Mean, StopPosition};
use super::pending::PendingFix;
use super::proportional::Proportional;
use super::rests::Rests;
use super::start::{Probation, Started};
use super::wheels::Wheels;
use super::{NOWHERE, ZERO_CORRECTION};
use crate::align::Align;
use crate::learn::age::FixAge;
use crate::learn::quantise::Scale;
use crate::learn::unit::{Head, Unit};
use crate::model::Nets;
use crate::sample::{Counts, StreamScale};
use lrnn_nostd::learn::kalman::Maps;

/// The stream of samples.
#[derive(Debug, Default)]
pub(super) struct Samples {
    /// `None` until the learner has begun.
    pub stream: Option<StreamScale>,
    /// Scale of the counts; from the first sample on.
    pub scale: Option<Scale>,
    /// Number of the first sample.
    pub first: u32,
    /// The last sample and its number.
    pub last: Option<(u32, Counts)>,
}

/// The navigator and how it starts.
#[derive(Debug)]
pub(super) struct Navigation {
    pub course: Course,
    pub align: Option<Align>,
    /// The last start of the navigator.
    pub started: Option<Started>,
    /// Probation of a navigator that was aligned in motion.
    pub probation: Probation,
    /// The heading is too little known for what the vehicle does.
    pub astray: bool,
}

impl Navigation {
    pub fn new() -> Navigation {
        Navigation {
            course: Course::Waits,
            align: None,
            started: None,
            probation: Probation::default(),
            astray: false,
        }
    }

    /// Each by itself: the stack does not hold a navigator for it.
    pub fn reset(&mut self) {
        self.course = Course::Waits;
        self.align = None;
        self.started = None;
        self.probation = Probation::default();
        self.astray = false;
    }
}

/// Motion of the vehicle.
#[derive(Debug, Default)]
pub(super) struct Motion {
    /// Recent motion.
    pub recent: Recent,
    /// Turns and gains of velocity.
    pub proportional: Proportional,
    /// Position at rest, if the receiver measures no velocity.
    pub rest: Option<StopPosition>,
    /// Motion by a receiver that measures it, while the sensors are at rest.
    pub mean: Mean,
    /// What the rest in progress has taught.
    pub rests: Rests,
    /// What is known of the wheels.
    pub wheels: Wheels,
}

/// Times of the fixes.
#[derive(Debug, Default)]
pub(super) struct FixTimes {
    /// Time of validity of the last fix used.
    pub last_fix_ms: Option<u32>,
    /// Time of validity of the last fix whose refusals count.
    pub counted_ms: Option<u32>,
    pub age: FixAge,
    /// A fix that waits, so that little comes together.
    pub pending: PendingFix,
}

/// Indices of the hypothesis in force and of the one that knows the unit best, and what corrects
/// this drive.
#[derive(Debug)]
pub(super) struct Choice {
    /// The hypothesis in force after the last fix.
    pub running: usize,
    pub knows_best: usize,
    /// Maps that correct this drive.
    pub stored_maps: Maps<f32>,
}

impl Choice {
    pub fn new() -> Choice {
        Choice {
            running: ZERO_CORRECTION,
            knows_best: ZERO_CORRECTION,
            stored_maps: Nets::NONE.maps,
        }
    }
}

/// Memory of the unit.
#[derive(Debug)]
pub(super) struct Remembered {
    /// Memory when the drive began, which the learner begins from.
    pub before: Unit,
    /// Its counters and scatter when the learner began.
    pub base: Head,
    /// The memory to be stored.
    pub unit: Unit,
    /// `unit` has something of this drive.
    pub taken_down: bool,
    /// What this drive has stored is to be replaced by `before`.
    pub withdraws: bool,
    /// A navigator that was given up had found the networks in use harmful.
    pub harmful: bool,
    pub judged: Judged,
    /// Of this drive: seconds beside fixes, and the lowest and highest temperature in them.
    pub covered: (f32, [f32; 2]),
}

impl Remembered {
    pub const NOTHING: Remembered = Remembered {
        before: Unit::NEW,
        base: Head::NEW,
        unit: Unit::NEW,
        taken_down: false,
        withdraws: false,
        harmful: false,
        judged: Judged::NONE,
        covered: NOWHERE,
    };
}
