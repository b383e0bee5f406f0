//! Learning, beside the flow of the samples: on networks of its own, which come into use only as
//! the mode allows it or by command.
//!
//! A [`Learner`] receives what there is to learn from: samples, blocks (the networks' input), the
//! navigation computer's references, the receiver's fixes. It is plain sequential code with a
//! priority of its own, which the frame path interrupts ([`exchange`]). The board provides its
//! memory: a board without that has no mode `learn`.

pub mod age;
mod antenna;
pub mod bank;
mod combined;
pub mod exchange;
mod fixes;
mod learnt_weights;
pub mod prior;
mod quantise;
pub mod rehearsal;
mod settings;
pub mod unit;
mod window;

pub use antenna::{Antenna, AntennaEstimate};
pub use combined::CombinedLearner;
pub use fixes::{FixLearner, Memory as FixMemory, REFUSED, ROOM, Started};
pub use settings::Settings;
pub(crate) use settings::usual;
pub use window::{BLOCKS, GATE, WindowLearner};

use crate::compensator::Block;
use crate::control::{Alignment, HeadingSource, Reason, Window};
use crate::fix::{Fix, Heading};
use crate::model::Nets;
use crate::nav;
use crate::sample::{RawSample, StreamScale};
use crate::wheels::WheelSpeed;
use bank::HYPOTHESES;
use lrnn_nostd::State;
use rehearsal::Standing;

/// Version of the learner from fixes. It is raised when the same input gives other bits, and stands
/// in every page of measured results (a test compares them).
pub const VERSION: u32 = 3;

/// Report of a learner.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Report {
    /// First and last sample of the window that awaits a reference.
    pub window: Option<(u32, u32)>,
    /// The learner's estimate for the last block: rate error in rad/s, specific-force error in
    /// m/s2.
    pub estimate: [[f32; 3]; 2],
    /// References used.
    pub used: u32,
    /// References with an axis that was refused as an outlier.
    pub doubted: u32,
    /// Fixes used.
    pub fixes: u32,
    /// Number of these with a component that was refused as an outlier.
    pub refused: u32,
    /// Fixes not used because they arrived too late: see [`age::MAX_AGE_S`].
    pub late: u32,
    /// The hypothesis in force, 0 for "the sensors are right": see [`rehearsal`].
    pub winner: u8,
    /// Number of promotions of a hypothesis other than 0.
    pub promotions: u32,
    /// Number of times that it was given up for 0.
    pub rollbacks: u32,
    /// The learner's navigator is aligned and is compared with fixes.
    pub navigates: bool,
    /// Time for which the vehicle has been stationary, s.
    pub still_s: u32,
    /// Lever arm and delay of the receiver's fixes.
    pub antenna: AntennaEstimate,
    /// Source of the navigator's heading; while it does not navigate, source of the heading of the
    /// alignment in motion so far.
    pub way: HeadingSource,
    /// Standard deviation of the heading by the hypothesis in force, rad; while it does not
    /// navigate, that of the alignment in motion. Infinite while the heading is unknown.
    pub heading_sigma: f32,
    /// Mean normalised innovation squared of the alignment in motion, present or last: 1 when the
    /// fixes are as exact as the alignment assumes, 0 without one.
    pub residual: f32,
    /// Alignments in motion that were refused because they contradicted the fixes.
    pub refused_alignments: u32,
    /// Rests from which the gyros were learnt.
    pub rests: u32,
    /// Time of the rest in progress, s; 0 without one.
    pub rest_s: u32,
    /// The gyros' scale errors are so alike that the time base must be wrong:
    /// [`bank::Bank::has_equal_scales`]. No map is learnt until the learner restarts.
    pub equal_scales: bool,
    /// By the rehearsals of this drive, the networks that [`Learner::begin`] was given, and that
    /// correct the samples of this drive, navigate worse than none. Until the learner restarts.
    pub stored_harms: bool,
    /// What this drive has stored, memory and networks, is to be replaced by what was known before:
    /// it was taught by a navigator that has lost its way.
    pub withdraws: bool,
}

/// The promoted hypothesis: networks that may correct the samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Winner {
    /// Networks, biases folded in.
    pub nets: Nets,
    /// States of the networks after the last block.
    pub states: [State; 2],
    /// Output of the networks for the present block: rad/s, m/s2.
    pub estimate: [[f32; 3]; 2],
}

/// Errors of the gyros by the rest in progress and by the memory before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resting {
    /// Errors of the gyros, rad/s.
    pub gyro: [f32; 3],
    /// How much of them noise, sway and the Earth's rotation may be, rad/s.
    pub doubt: f32,
}

/// State of the learner's navigator, for reports.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// State of the navigator.
    pub state: nav::State,
    /// Sensor errors by the hypothesis that it follows: rad/s, m/s2.
    pub estimate: [[f32; 3]; 2],
    /// Standard deviations of the estimates.
    pub sigma: [[f32; 3]; 2],
}

/// State of the hypotheses, for reports.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trials {
    /// Index of the hypothesis with the most evidence.
    pub leading: usize,
    /// Rehearsals that have ended, at each horizon.
    pub ended: [u16; 6],
    /// Each hypothesis.
    pub each: [Trial; HYPOTHESES],
}

/// State of a hypothesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trial {
    /// Whether the hypothesis takes part.
    pub enabled: bool,
    /// Whether the hypothesis has proved itself.
    pub proved: bool,
    /// Evidence of the hypothesis: see [`bank::Bank::evidence`].
    pub evidence: f64,
    /// Result of its rehearsals.
    pub standing: Standing,
}

/// Bytes of what a learner remembers over power-off, at most.
pub const MEMORY_LEN: usize = 2792;

/// A way to learn. Results depend on the order of the calls alone, so that the same input gives the
/// same bits on every machine. A call may take as long as it needs.
pub trait Learner: Send {
    /// Configures it for a unit. Everything learnt before is forgotten: it waits for
    /// [`Learner::begin`].
    fn configure(&mut self, _settings: &Settings) {}

    /// Restarts from a copy of `nets`.
    fn begin(&mut self, nets: &Nets, stream: StreamScale);

    /// The stream restarts: the networks' states are those of power-on; what was learnt stays.
    fn restart(&mut self);

    /// An uncorrected sample and its number, after its frame has left.
    fn sample(&mut self, _number: u32, _sample: &RawSample) {}

    /// The block that ends with sample `last`; no sample of it is missing.
    fn block(&mut self, last: u32, block: &Block);

    /// Samples are missing: a window or block in progress is given up.
    fn gap(&mut self);

    /// The sensor is silent: how many samples are missing will not be known.
    fn silence(&mut self) {
        self.gap();
    }

    /// The navigation computer aligns itself: the vehicle stands.
    fn align(&mut self, _: Alignment) {}

    /// A heading that somebody knows, of the vehicle's forward axis now.
    ///
    /// # Errors
    /// Why it cannot be used.
    fn heading(&mut self, _: Heading) -> Result<(), Reason> {
        Err(Reason::NotAvailable)
    }

    /// The navigation computer's reference.
    ///
    /// # Errors
    /// Why it cannot be used. A reference given twice is used once.
    fn reference(&mut self, _window: &Window) -> Result<(), Reason> {
        Err(Reason::NotAvailable)
    }

    /// A fix of the receiver, which arrived after sample `number`.
    fn fix(&mut self, _number: u32, _fix: &Fix) {}

    /// Speed by the wheels, which arrived after sample `number`.
    fn wheel_speed(&mut self, _number: u32, _speed: &WheelSpeed) {}

    /// The networks that have proved themselves and may correct the samples; `None`: no correction
    /// may.
    fn winner(&mut self) -> Option<Winner> {
        None
    }

    /// The networks that shall act from the next power-on: as [`Learner::winner`], but without what
    /// is new at every turn-on.
    fn for_next_power_on(&mut self) -> Option<Winner> {
        self.winner()
    }

    /// What the rest in progress has shown; `None`: the vehicle moves, or nothing is known yet.
    fn rest(&self) -> Option<Resting> {
        None
    }

    /// Takes down what is known of the unit, for [`Learner::write_memory`]; at most [`MEMORY_LEN`]
    /// bytes. The next [`Learner::begin`] begins from it. 0: there is nothing to be stored, and
    /// what was known stays.
    fn remember(&mut self) -> usize {
        0
    }

    /// The sensor was powered on: another drive begins, in which what is known of the unit is the
    /// prior, however often [`Learner::begin`] is called. [`Learner::recall`] begins one as well.
    fn next_drive(&mut self) {
        self.remember();
        self.restart();
    }

    /// Copies what was taken down last from byte `start` on into `piece`; bytes beyond its end stay
    /// as they are.
    fn write_memory(&self, _start: usize, _piece: &mut [u8]) {}

    /// Gives the memory of the unit at the last power-off, before [`Learner::begin`]. Bytes of
    /// another layout are ignored. Empty: there is none.
    fn recall(&mut self, _memory: &[u8]) {}

    /// The learnt networks, and the networks' states now.
    fn learnt(&mut self) -> (Nets, [State; 2]);

    /// Counters and state, for reading only.
    fn report(&self) -> Report;

    /// State of its navigator; `None` while it does not navigate.
    fn solution(&self) -> Option<Solution> {
        None
    }

    /// State of its hypotheses; `None` where it has none.
    fn trials(&self) -> Option<Trials> {
        None
    }
}
