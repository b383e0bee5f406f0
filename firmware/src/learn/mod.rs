//! Learning, beside the flow of the words: on a copy of the networks, which takes the place of those in use only by command.
//!
//! A [`Learner`] is handed what there is to learn from: blocks (what the networks step on), words, the navigation computer's
//! references, the receiver's fixes. What takes long it puts off to [`Learner::work`], which the application calls between
//! frames, a piece at a time. Its memory is the board's: a board without one has no mode `learn`.

pub mod age;
pub mod bank;
mod combined;
mod fixes;
mod learnt_weights;
pub mod prior;
mod quantise;
mod settings;
mod window;

pub use combined::CombinedLearner;
pub use fixes::{FixLearner, Memory as FixMemory, ROOM};
pub use settings::Settings;
pub use window::{BLOCKS, GATE, WindowLearner};

use crate::compensator::Block;
use crate::control::{Alignment, Reason, Window};
use crate::fix::Fix;
use crate::model::Nets;
use crate::sample::{RawSample, StreamScale};
use lrnn_nostd::State;

/// What a learner can tell.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Report {
    /// First and last sample of the window that a reference may be given for.
    pub window: Option<(u32, u32)>,
    /// What the copy said of the last block: rate error in rad/s, error of specific force in m/s2.
    pub estimate: [[f32; 3]; 2],
    /// References used.
    pub used: u32,
    /// References of which at least one axis was too far off to be believed.
    pub doubted: u32,
    /// Fixes used.
    pub fixes: u32,
    /// Of these, with a component that was not believed.
    pub refused: u32,
    /// Fixes not used because they arrived too late: see [`age::MAX_AGE_S`].
    pub late: u32,
    /// The hypothesis that stands, 0 for "the sensors are right": see [`bank::Bank::running`].
    pub winner: u8,
    /// Times another hypothesis than that one came to stand.
    pub promotions: u32,
    /// Times it was given up for that one.
    pub rollbacks: u32,
    /// Aligned, and compared with fixes.
    pub navigates: bool,
    /// Time that the vehicle has stood, s.
    pub still_s: u32,
}

/// What a learner stands by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Winner {
    /// Networks, biases folded in.
    pub nets: Nets,
    /// Their states after the last block.
    pub states: [State; 2],
    /// What they say for the present block: rad/s, m/s2.
    pub estimate: [[f32; 3]; 2],
}

/// A way to learn. Nothing here may depend on when it is called between two words, so that the same input gives the same bits
/// on every machine.
pub trait Learner {
    /// Begins anew, from a copy of `nets`.
    fn begin(&mut self, nets: &Nets, stream: StreamScale);

    /// The stream begins anew: the networks' states as at power-on; what was learnt stays.
    fn restart(&mut self);

    /// An uncorrected word with its sample number, after its frame has left.
    fn sample(&mut self, _number: u32, _words: &RawSample) {}

    /// The block that ends with sample `last` and has no hole.
    fn block(&mut self, last: u32, block: &Block);

    /// Samples are missing: nothing goes on across.
    fn gap(&mut self);

    /// The sensor is silent: how many are missing will not be known.
    fn silence(&mut self) {
        self.gap();
    }

    /// The navigation computer aligns itself: the vehicle stands.
    fn align(&mut self, _: Alignment) {}

    /// The navigation computer's reference.
    ///
    /// # Errors
    /// Why it cannot be used; given twice it is used once.
    fn reference(&mut self, _window: &Window) -> Result<(), Reason> {
        Err(Reason::NotAvailable)
    }

    /// The receiver's fix, which arrived after sample `number`.
    fn fix(&mut self, _number: u32, _fix: &Fix) {}

    /// A piece of what was put off, some ten thousand instructions at most. True: there is more.
    fn work(&mut self) -> bool {
        false
    }

    /// What has proved itself and may correct the words by itself; `None`: nothing may. What was put off is done first.
    fn winner(&mut self) -> Option<Winner> {
        None
    }

    /// What was learnt, and the networks' states now; what was put off is done first.
    fn learnt(&mut self) -> (Nets, [State; 2]);

    /// For those who look on.
    fn report(&self) -> Report;
}
