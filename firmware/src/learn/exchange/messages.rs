//! What goes between the frame path and the learner.

use super::super::{Learner, Report, Resting, Settings, Solution, Trials, Winner};
use crate::compensator::Block;
use crate::control::{Alignment, Reason, Window};
use crate::fix::{Fix, Heading};
use crate::model::Nets;
use crate::sample::{RawSample, StreamScale};
use crate::wheels::WheelSpeed;
use lrnn_nostd::State;

/// Orders of the frame path.
#[derive(Debug, Clone, Copy)]
#[expect(
    clippy::large_enum_variant,
    reason = "samples have a queue of their own"
)]
pub enum Order {
    /// An uncorrected sample and its number: [`Learner::sample`].
    Sample(u32, RawSample),
    /// [`Learner::gap`].
    Gap,
    /// The learner restarts. [`View`] follows.
    Restart(RestartReason),
    /// [`Learner::block`], with its own number and that of its last sample. [`Answer`] and [`View`]
    /// follow.
    Block(u32, u32, Block),
    /// [`Learner::fix`].
    Fix(u32, Fix),
    /// [`Learner::wheel_speed`].
    WheelSpeed(u32, WheelSpeed),
    /// [`Learner::align`].
    Align(Alignment),
    /// [`Learner::heading`], with its number. [`Reply::Verdict`] and [`View`] follow.
    Heading(u8, Heading),
    /// [`Learner::reference`], with its number. [`Reply::Verdict`] and [`View`] follow.
    Reference(u8, Window),
    /// [`Learner::remember`]. [`Reply::Remembered`] follows.
    Remember,
}

/// Why the learner restarts.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::large_enum_variant, reason = "there is no heap")]
pub enum RestartReason {
    /// The configuration is another one: [`Learner::configure`]. Of another unit, its memory is no
    /// longer valid: [`Learner::recall`] before.
    Configured {
        /// The settings.
        settings: Settings,
        /// It is of the same unit.
        same_unit: bool,
    },
    /// [`Learner::begin`].
    Begin(Nets, StreamScale),
    /// [`Learner::restart`].
    Stream,
    /// [`Learner::silence`].
    Silence,
    /// [`Learner::next_drive`].
    Drive,
}

/// The learner's results after a block, for the correction and the store.
#[derive(Debug, Clone, Copy)]
pub struct Answer {
    /// The block's number.
    pub number: u32,
    /// [`Learner::winner`].
    pub winner: Option<Winner>,
    /// [`Learner::for_next_power_on`].
    pub next: Option<Winner>,
    /// [`Learner::rest`].
    pub rest: Option<Resting>,
    /// [`Learner::learnt`].
    pub learnt: (Nets, [State; 2]),
    /// [`Report::still_s`].
    pub still_s: u32,
    /// [`Report::navigates`].
    pub navigates: bool,
    /// [`Report::equal_scales`].
    pub equal_scales: bool,
    /// [`Report::stored_harms`].
    pub stored_harms: bool,
    /// [`Report::withdraws`].
    pub withdraws: bool,
}

/// The learner's state, for reports.
#[derive(Debug, Clone, Copy, Default)]
pub struct View {
    /// [`Learner::report`].
    pub report: Report,
    /// [`Learner::solution`].
    pub solution: Option<Solution>,
    /// [`Learner::trials`].
    pub trials: Option<Trials>,
}

impl View {
    pub(super) fn of(learner: &dyn Learner) -> View {
        View {
            report: learner.report(),
            solution: learner.solution(),
            trials: learner.trials(),
        }
    }
}

impl Answer {
    pub(super) fn of(learner: &mut dyn Learner, number: u32) -> Answer {
        let report = learner.report();
        Answer {
            number,
            winner: learner.winner(),
            next: learner.for_next_power_on(),
            rest: learner.rest(),
            learnt: learner.learnt(),
            still_s: report.still_s,
            navigates: report.navigates,
            equal_scales: report.equal_scales,
            stored_harms: report.stored_harms,
            withdraws: report.withdraws,
        }
    }
}

/// Reply to an order other than a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reply {
    /// Why the heading or the reference of this number was not used.
    Verdict(u8, Result<(), Reason>),
    /// Number of bytes that were recorded; 0: nothing is to be stored.
    Remembered(usize),
}
