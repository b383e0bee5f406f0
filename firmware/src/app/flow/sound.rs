//! What is done when memory is found changed by nobody: a bit has flipped.
//!
//! The compensator looks at what it corrects by ([`Compensator`](crate::compensator)). What it is
//! made from, networks and configuration, is looked at once a second.

use super::{Correction, Flow, count};
use crate::app::setup::{compensator, lsb};
use crate::compensator::of_nets;
use crate::model::Nets;
use crate::sample::RawSample;
use crate::wire::command::fault;

impl Flow<'_> {
    /// Other networks are those in use.
    pub(super) fn take_nets(&mut self, nets: Nets) {
        self.nets_sum = of_nets(&nets);
        self.config.nets = nets;
        self.prepared = None;
    }

    /// Looks at the networks. If they have changed, the compensator's copy takes their place while
    /// that is good, else no networks do, and fault WEIGHTS says so.
    #[inline(never)]
    pub fn scrub(&mut self) {
        if !self.correction.agrees() {
            // there was none, or there is none any more: the next frame makes it anew
            self.correction.clear();
            self.blackbox.part();
            self.channels.clear();
            self.mended();
        }
        if of_nets(&self.config.nets) == self.nets_sum {
            return;
        }
        let own = !self.learner_nets;
        let correction = self
            .correction
            .get()
            .filter(|c| own && c.compensator.is_sound());
        let copy = correction.map(|c| c.compensator.nets());
        match copy.filter(|nets| of_nets(nets) == self.nets_sum) {
            Some(nets) => self.config.nets = nets,
            None => {
                self.set_nets(Nets::NONE);
                self.flag(fault::WEIGHTS, true);
            }
        }
        self.mended();
    }

    /// Makes the compensator anew from configuration and networks, as it was, and ends the block
    /// whose last sample this is. Its state stays. Networks that the learner had put there are
    /// taken from the learner again.
    #[cold]
    #[inline(never)]
    pub(super) fn make_sound(&mut self, sample: &RawSample) {
        self.scrub();
        let made = self.made_anew();
        let learner_nets = core::mem::take(&mut self.learner_nets);
        match (self.correction.get_mut(), made) {
            (Some(correction), Some(made)) => {
                correction.compensator = made;
            }
            _ => self.correction.clear(),
        }
        if learner_nets {
            self.activate(false, None);
        }
        self.mended();
        let correction = self.correction.get_mut();
        let block = correction.and_then(|c| c.compensator.end_in_place(&mut c.state, sample));
        if let Some(block) = &block {
            self.end_of_block(block);
        }
    }

    #[inline(never)]
    fn made_anew(&mut self) -> Option<crate::compensator::Compensator> {
        let Correction {
            compensator: old,
            state,
        } = self.correction.get_mut()?;
        let slew = old.slew().map(|_| self.config.slew);
        let mut made = compensator(self.stream.as_ref()?, &self.config, slew)?;
        for (outlet, (source, content)) in self.channels.kinds().enumerate().skip(1) {
            if let Some(stream) = source.stream(&self.config.sensor, content)
                && let Some(lsb) = lsb(&stream, 1.0 / stream.rate)
            {
                // one that was set before has a place
                let _ = made.set_outlet(state, outlet, lsb, 1.0 / stream.rate);
            }
        }
        Some(made)
    }

    /// Memory was found changed, and was mended.
    pub fn mended(&mut self) {
        count(&mut self.counters.mended, 1);
    }

    /// Times memory was found changed.
    pub fn times_mended(&self) -> u32 {
        let state = self.correction.get().map(|c| &c.state);
        let mended = state.map_or(0, |state| state.mended);
        self.counters.mended.saturating_add(mended)
    }
}
