//! Two learners side by side: from references and from fixes.

use super::{Learner, Report, Resting, Settings, Solution, Trials, Winner};
use crate::compensator::Block;
use crate::control::{Alignment, Reason, Window};
use crate::fix::{Fix, Heading};
use crate::model::Nets;
use crate::sample::{RawSample, StreamScale};
use crate::wheels::WheelSpeed;
use lrnn_nostd::State;

/// References go to the one, fixes to the other. [`Learner::learnt`] gives the networks learnt from
/// fixes when they have proved themselves, else those learnt from references.
#[derive(Debug)]
pub struct CombinedLearner<'m, R, F> {
    /// The learner from references.
    pub references: &'m mut R,
    /// The learner from fixes.
    pub fixes: F,
}

impl<R: Learner, F: Learner> Learner for CombinedLearner<'_, R, F> {
    fn configure(&mut self, settings: &Settings) {
        self.references.configure(settings);
        self.fixes.configure(settings);
    }

    fn begin(&mut self, nets: &Nets, stream: StreamScale) {
        self.references.begin(nets, stream);
        self.fixes.begin(nets, stream);
    }

    fn restart(&mut self) {
        self.references.restart();
        self.fixes.restart();
    }

    fn sample(&mut self, number: u32, sample: &RawSample) {
        self.references.sample(number, sample);
        self.fixes.sample(number, sample);
    }

    fn block(&mut self, last: u32, block: &Block) {
        self.references.block(last, block);
        self.fixes.block(last, block);
    }

    fn gap(&mut self) {
        self.references.gap();
        self.fixes.gap();
    }

    fn silence(&mut self) {
        self.references.silence();
        self.fixes.silence();
    }

    fn align(&mut self, alignment: Alignment) {
        self.references.align(alignment);
        self.fixes.align(alignment);
    }

    fn heading(&mut self, heading: Heading) -> Result<(), Reason> {
        self.fixes.heading(heading)
    }

    fn reference(&mut self, window: &Window) -> Result<(), Reason> {
        self.references.reference(window)
    }

    fn fix(&mut self, number: u32, fix: &Fix) {
        self.fixes.fix(number, fix);
    }

    fn wheel_speed(&mut self, number: u32, speed: &WheelSpeed) {
        self.fixes.wheel_speed(number, speed);
    }

    fn winner(&mut self) -> Option<Winner> {
        self.fixes.winner()
    }

    fn for_next_power_on(&mut self) -> Option<Winner> {
        self.fixes.for_next_power_on()
    }

    fn rest(&self) -> Option<Resting> {
        self.fixes.rest()
    }

    fn remember(&mut self) -> usize {
        self.fixes.remember()
    }

    fn next_drive(&mut self) {
        self.references.next_drive();
        self.fixes.next_drive();
    }

    fn write_memory(&self, start: usize, piece: &mut [u8]) {
        self.fixes.write_memory(start, piece);
    }

    fn recall(&mut self, memory: &[u8]) {
        self.fixes.recall(memory);
    }

    fn learnt(&mut self) -> (Nets, [State; 2]) {
        match self.fixes.winner() {
            Some(winner) => (winner.nets, winner.states),
            None => self.references.learnt(),
        }
    }

    fn solution(&self) -> Option<Solution> {
        self.fixes.solution()
    }

    fn trials(&self) -> Option<Trials> {
        self.fixes.trials()
    }

    fn report(&self) -> Report {
        let (references, fixes) = (self.references.report(), self.fixes.report());
        let estimate = if fixes.winner == 0 {
            references.estimate
        } else {
            fixes.estimate
        };
        Report {
            window: references.window,
            estimate,
            used: references.used,
            doubted: references.doubted,
            ..fixes
        }
    }
}
