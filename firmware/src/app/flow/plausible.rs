//! Compares the configuration of the sensor with the measurements. While the two disagree, the
//! device steps aside: nothing is corrected and nothing is learnt.

use super::{Correction, Flow};
use crate::compensator::Block;
use crate::learn::exchange::RestartReason;
use crate::plausibility::ASIDE;
use crate::plausibility::rate::StreamCounts;
use crate::wire::command::fault;

impl Flow<'_> {
    /// Compares the samples with the clock; called in every pass. `reads`: frames are being read.
    #[inline(always)]
    pub fn watch_rate(&mut self, now: u64, reads: bool) {
        if self.is_rate_due(now) {
            self.look_at_rate(now, reads);
        }
    }

    /// Whether the samples are to be compared with the clock.
    #[inline(always)]
    pub fn is_rate_due(&self, now: u64) -> bool {
        self.health.plausibility.rate.is_due(now)
    }

    #[cold]
    #[inline(never)]
    fn look_at_rate(&mut self, now: u64, reads: bool) {
        let seen = StreamCounts {
            samples: self.sample(),
            missed: self.health.counters.missed.low(),
            damage: self.health.damage(),
        };
        let stream = self.corrector.stream.as_ref();
        let heard = reads && self.health.faults & (fault::SILENT | fault::STUCK) == 0;
        let rate = stream.filter(|_| heard).map(|stream| stream.rate as f32);
        let wrong = self.health.plausibility.rate.look(now, rate, seen);
        let before = self.health.faults & fault::RATE != 0;
        self.health.flag(fault::RATE, wrong);
        if wrong != before {
            self.begin_checks();
            self.step_aside();
        }
    }

    /// Judges the measurements at rest. With a wrong rate, increments would be judged wrongly.
    pub(super) fn judge(&mut self, block: &Block) {
        let Some(rest) = &mut self.health.plausibility.rest else {
            return;
        };
        let Some(Correction { compensator, .. }) = self.corrector.correction.get() else {
            return;
        };
        if self.health.faults & fault::RATE != 0 {
            return;
        }
        let block_s = compensator.scale().block_s();
        if let Some(found) = rest.block(block_s, block.sources.rate, block.sources.force) {
            self.health.faults = self.health.faults & !found.judged | found.faults;
            self.step_aside();
        }
    }

    /// A good fix shows whether the vehicle is at rest.
    pub(super) fn judge_speed(&mut self, speed: f32, sigma: f32) {
        if let Some(rest) = &mut self.health.plausibility.rest {
            rest.fix(speed, sigma);
        }
    }

    /// The samples change their meaning from now on, or some are missing: the rest check restarts.
    pub(super) fn begin_checks(&mut self) {
        if let Some(rest) = &mut self.health.plausibility.rest {
            rest.restart();
        }
    }

    /// Steps aside, or restarts as after a configuration. From the beginning of an alignment on a
    /// correction goes and comes no faster than the slew limit.
    fn step_aside(&mut self) {
        let aside = self.health.faults & ASIDE != 0;
        if aside == self.health.disagrees {
            return;
        }
        self.health.disagrees = aside;
        self.session.promoted = false;
        self.corrector.forgive();
        let off = self.is_off();
        if let Some(Correction { compensator, state }) = self.corrector.correction.get_mut() {
            // networks that stay go on from their states: they are a function of the time since
            // power-on, too
            self.session.first_rest.drop_added();
            if core::mem::take(&mut self.session.learner_nets) {
                compensator.exchange(state, self.config.nets, Default::default());
            }
            compensator.give_up_block(state);
            state.off = off;
            if aside && compensator.slew().is_none() {
                compensator.force_zero(state);
            }
        }
        self.restart_learner(RestartReason::Stream);
        self.learning.end();
        self.teach();
    }
}
