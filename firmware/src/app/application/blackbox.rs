//! The black box at the application: what is noted in each pass, and going on from a page.

use super::App;
use crate::app::blackbox::{AppState, BlackBox, Key, Memory};
use crate::app::flow::FOLLOWS;
use crate::app::phase::{Cause, Phase};
use crate::control::recording::Order;

impl<'m> App<'m> {
    /// Records in this memory, before the first pass. What it holds from before a reset stays until
    /// it is released.
    pub fn record_in(&mut self, memory: &'m mut Memory) {
        self.flow.blackbox.begin(memory);
    }

    /// Makes the black box hold its recording.
    pub fn hold_recording(&mut self) {
        let _ = self.flow.blackbox.order(Order::Hold); // without memory there is nothing to hold
    }

    /// Bytes of the recording from `start` on, and their number, while it holds.
    pub fn read_recording(&self, start: usize, piece: &mut [u8]) -> Option<usize> {
        self.flow.blackbox.read(start, piece)
    }

    /// The black box.
    pub fn blackbox(&self) -> &BlackBox<'m> {
        &self.flow.blackbox
    }

    /// Notes what has changed.
    #[inline(always)]
    pub(super) fn note_state(&mut self) -> AppState {
        let stage = stage(self.machine.phase());
        let noted = self.flow.noted(stage as u8);
        if self.flow.blackbox.differs(&noted) {
            let estimate = self.flow.corrector.estimate();
            self.flow.blackbox.note(noted, &estimate);
        }
        stage
    }

    /// Notes the end of a pass.
    #[inline(always)]
    pub(super) fn note_pass(&mut self, now: u64) {
        let stage = self.note_state();
        if self.flow.blackbox.has_frame() && self.link.framer.pending() == 0 {
            let key = self.flow.key(now, stage, self.link.framer.format());
            self.flow.blackbox.begin_page(&key);
        }
    }
}

/// For a replay of a black box.
impl App<'_> {
    /// Goes on from a key, when the first frame of its page has passed. False: the application is
    /// not in the state that the key gives, so it is another configuration's.
    pub fn resume(&mut self, key: &Key) -> bool {
        self.flow.blackbox.only_hashes();
        self.flow.blackbox.set_hash(key.hash);
        let runs = matches!(self.machine.phase(), Phase::Run(_));
        if runs {
            self.machine.transition_to_run(key.mode);
        }
        self.flow.resume(key) && runs == (key.stage == AppState::Run)
    }

    /// The correction is this from now on.
    pub fn impose(&mut self, estimate: &[[f32; 3]; 2]) {
        self.flow.impose(estimate);
    }

    /// Takes over the fault bits that do not follow from the stream alone, and returns the others:
    /// those of the configuration, and those in force here.
    pub fn impose_faults(&mut self, configuration: u32) -> [u32; 2] {
        self.flow.health.impose(configuration, !FOLLOWS);
        [configuration & FOLLOWS, self.flow.health.faults & FOLLOWS]
    }
}

fn stage(phase: Phase) -> AppState {
    match phase {
        Phase::Start => AppState::Start,
        Phase::Detect => AppState::Detect,
        Phase::Run(_) => AppState::Run,
        Phase::Fault(Cause::Units) => AppState::FaultUnits,
        Phase::Fault(Cause::Network) => AppState::FaultNetwork,
    }
}
