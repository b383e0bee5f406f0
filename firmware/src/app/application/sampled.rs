//! Samples and fixes without their bytes, for simulations and recordings on the desktop: all that
//! decides is the application's own, from the sample to what is stored.

use super::App;
use crate::app::phase::Phase;
use crate::fix::Fix;
use crate::link::{Clock, NoLine};
use crate::sample::RawSample;
use crate::wire::command::fault;
use crate::wire::{Reading, Stream};

impl App<'_> {
    /// A sample of this stream, instead of the bytes of its frame; gives the corrected sample. As
    /// with [`App::burst`], [`App::poll`] follows for the clock and all that is not a frame.
    pub fn sample(&mut self, reading: &Reading, stream: &Stream, clock: &impl Clock) -> RawSample {
        let now = clock.now_us();
        self.heard(now);
        match self.machine.phase() {
            Phase::Start | Phase::Detect => {
                self.link.frameless_us = now;
                self.flow.health.flag(fault::UNKNOWN_FORMAT, false);
                self.machine.transition_to_run(self.flow.session.mode);
            }
            Phase::Fault(_) => return reading.sample,
            Phase::Run(_) => {}
        }
        self.flow.continuity.now_us = now;
        self.link.sampled_us = now;
        let corrected = self.flow.sampled(reading, stream);
        self.after_frames(&mut NoLine);
        corrected
    }

    /// A good fix, instead of the receiver's bytes. [`Fix::waited`] and [`Fix::age`] are the
    /// caller's; its heading is that of the first antenna to the second.
    pub fn fix_of(&mut self, fix: Fix) {
        self.flow.health.counters.fixes.add(1);
        self.take_fix(fix);
    }
}
