//! Work after a frame has left: gaps, repeated samples, sensors whose values do not change or that
//! restart, and the networks' and the learner's share of the sample.

use super::at_rest::FirstRest;
use super::channels::Kind;
use super::{Correction, Flow};
use crate::app::blackbox::EventKind;
use crate::compensator::Block;
use crate::control::Mode;
use crate::learn::exchange::{Order, RestartReason};
use crate::plausibility::holes::Hole;
use crate::wire::Reading;
use crate::wire::command::fault;
use crate::wire::sequence::Gap;

/// A silence of this length, microseconds, is taken for a power cycle: nothing distinguishes it
/// from a cable that was pulled, and cables carry the power.
const POWER_CYCLE_US: u64 = 1_000_000;

/// The time of a power cycle in periods of the samples, for slow sensors.
const POWER_CYCLE_PERIODS: f64 = 10.0;

/// After so many frames beside those that make blocks it is compared which come more often.
const COMPARED: u32 = 64;

impl Flow<'_> {
    /// Counts gaps and feeds the networks with the sample of the frame that has just left.
    #[inline(always)]
    pub(super) fn follow(&mut self, reading: &Reading) {
        let bad = reading.present.0 & !reading.valid.0;
        self.health.flag(fault::SENSOR, bad != 0);
        if !self.corrector.channels.leads() {
            return self.aside();
        }
        if self.corrector.channels.changed() && self.is_copy(reading) {
            return;
        }
        let stream = self.corrector.stream.as_ref();
        let gap = stream.map(|stream| stream.gap(&mut self.continuity.last, reading));
        let counters = &mut self.health.counters;
        match gap {
            Some(Gap::Duplicate) => {
                counters.duplicates.add(1);
                let stuck = self.continuity.last.is_stuck();
                return self.health.flag(fault::STUCK, stuck); // sent on, but the sample counts once
            }
            Some(Gap::Missed(frames)) => {
                counters.missed.add(frames);
                self.continuity.skip(frames);
                self.corrector.miss(frames);
            }
            Some(Gap::Jump) => counters.jumps.add(1),
            Some(Gap::None) | None => {}
        }
        self.continuity.skip(1);
        if self.corrector.uncounted {
            self.look_for_hole();
        }
        match gap {
            Some(Gap::Jump) => self.jump(),
            Some(Gap::Missed(_)) => self.gap(),
            _ if bad != 0 => self.gap(),
            _ => self.continuity.fresh = false,
        }
        if self.continuity.stuck.may_repeat(&reading.sample) || self.health.has(fault::STUCK) {
            self.check_stuck(reading, bad);
            if self.health.has(fault::STUCK) {
                return;
            }
        }
        let Some(Correction { compensator, state }) = self.corrector.correction.get_mut() else {
            return;
        };
        if self.learning.follows() {
            let number = self.continuity.sample as u32;
            (self.learning.port).hand_over(&Order::Sample(number, reading.sample));
        }
        if bad != 0 {
            return;
        }
        if let Some([x, y, z]) = reading.temperature {
            state.read_temperature((x + y + z) / 3.0);
        }
        if let Some(block) = &compensator.accumulate(state, &reading.sample) {
            self.end_of_block(block);
        } else if state.corrupted {
            self.rebuild_compensator(&reading.sample);
        }
    }

    #[inline(never)]
    pub(super) fn end_of_block(&mut self, block: &Block) {
        self.health.counters.blocks.add(1);
        let failed = block.fault.is_some();
        self.health.flag(fault::NETWORK, failed);
        self.corrector.count_failure(failed, self.is_off());
        let correction = self.corrector.correction.get();
        let zero = correction.is_some_and(|c| c.state.is_zero());
        self.corrector.block = Some(*block);
        self.learning.end_block();
        self.note_rest();
        self.health
            .flag(fault::LEARNER, self.learning.port.is_stopped());
        let equal = self.learning.answer().is_some_and(|a| a.equal_scales);
        self.health.flag(fault::TIME_BASE, equal);
        self.judge(block);
        self.promote(block);
        if self.learning.follows() {
            self.learning
                .port
                .hand_over_block(self.continuity.sample as u32, block);
        }
        if self.session.mode == Mode::Bypass && zero {
            self.corrector.correction.clear(); // faded out
        }
        self.note_correction();
    }

    /// The sensor has been silent for too long.
    pub fn silence(&mut self) {
        self.health.plausibility.holes.interrupt();
        self.gap();
        self.begin_checks();
        self.restart_learner(RestartReason::Silence);
    }

    /// The stream has a gap: damage, silence, lost bytes.
    pub fn gap(&mut self) {
        self.corrector.give_up_block();
        self.learning.port.hand_over(&Order::Gap);
    }

    /// Time or counter have jumped: how many samples are missing will not be known.
    #[cold]
    fn jump(&mut self) {
        self.gap();
        self.restart_learner(RestartReason::Silence);
    }

    /// Bytes that belong to no frame have gone by. Where the frames are counted or timed, the next
    /// one shows whether one is missing.
    pub fn unframed(&mut self, bytes: usize) {
        self.continuity.unframed = self.continuity.unframed.saturating_add(bytes as u32);
        self.corrector.channels.unselect();
        if self
            .corrector
            .stream
            .is_none_or(|stream| stream.turn().is_none())
        {
            self.gap();
        }
    }

    /// The sensor is heard again after a silence.
    pub fn heard_again(&mut self, silent_us: u64) {
        self.continuity.silent_us = Some(silent_us);
        self.corrector.channels.unselect();
    }

    /// A message that is no frame may show that the sensor has just started.
    pub fn start_message(&mut self) {
        if self.continuity.silent_us.is_some() {
            self.restarted();
        }
    }

    /// A frame of `len` bytes of another kind than the last one, or the first one after bytes of no
    /// frame or a silence. Gives whether its kind is known.
    #[cold]
    pub(super) fn another(&mut self, kind: Kind, len: usize, reading: &Reading) -> bool {
        if let Some(silent) = self.continuity.silent_us.take() {
            let stream = self.corrector.stream.as_ref();
            let silent_s = silent as f64 * 1e-6;
            let restarted = stream.is_some_and(|stream| {
                stream.has_restarted(&self.continuity.last, reading, silent_s)
            });
            let periods = stream.map_or(0.0, |stream| silent_s * stream.rate);
            if restarted || (silent >= POWER_CYCLE_US && periods >= POWER_CYCLE_PERIODS) {
                self.restarted();
            }
        }
        let unframed = core::mem::take(&mut self.continuity.unframed);
        if unframed > 0
            && let Some(turn) = self.corrector.stream.and_then(|stream| stream.turn())
            && u64::from(unframed) >= u64::from(turn) * len as u64
        {
            self.gap(); // room for a whole turn of the counter
        }
        self.corrector.channels.select(kind)
    }

    /// A frame that neither a counter nor a time numbers: the clock shows whether some are missing
    /// before it, up to a second ago.
    #[inline(never)]
    fn look_for_hole(&mut self) {
        let rate = self.corrector.rate() as f32;
        let hole = self
            .health
            .plausibility
            .holes
            .frame(self.continuity.now_us, rate);
        match hole {
            Some(Hole::Of(frames)) => {
                self.health.counters.missed.add(frames);
                self.continuity.skip(frames);
                self.corrector.miss(frames);
                self.gap();
            }
            Some(Hole::Unknown) => {
                self.health.counters.jumps.add(1);
                self.jump();
            }
            None => {}
        }
    }

    /// A frame of a kind whose samples make no blocks. When these come more often than those that
    /// do, they take their place.
    #[cold]
    fn aside(&mut self) {
        let (frames, since) = &mut self.continuity.aside;
        *frames += 1;
        if *frames < COMPARED {
            return;
        }
        // those that lead, of all frames since
        let led = self
            .health
            .counters
            .frames
            .since(*since)
            .saturating_sub(COMPARED.into());
        self.continuity.aside = (0, self.health.counters.frames);
        if led < u64::from(COMPARED / 2) {
            self.blackbox.part();
            self.corrector.channels.clear();
        }
    }

    /// Whether the sample has come before, in a frame of another kind.
    #[cold]
    fn is_copy(&mut self, reading: &Reading) -> bool {
        let stream = self.corrector.stream.as_ref();
        let copy = stream.is_some_and(|stream| stream.repeats(&self.continuity.last, reading));
        if !copy {
            self.corrector.channels.counted();
        }
        copy
    }

    /// All six values may be those of the last sample. While the sensor calls them good, they
    /// cannot be for as long as [`StuckDetector`] says. Then the sensor is stuck, and nothing is
    /// learnt.
    #[cold]
    fn check_stuck(&mut self, reading: &Reading, bad: u8) {
        let rate = self
            .corrector
            .stream
            .map_or(self.config.sensor.rate, |stream| stream.rate);
        let stuck = self
            .continuity
            .stuck
            .repeats_too_long(&reading.sample, rate)
            && bad == 0;
        self.health.flag(fault::STUCK, stuck);
        if stuck {
            self.gap();
        }
    }

    /// The sensor has restarted. Its errors differ from turn-on to turn-on, so nothing that came
    /// into force in the drive before is applied, and the learner restarts. The networks in use are
    /// those that a power-on of the board would find, and act from the first sample on. Settings
    /// that the sensor reported are no longer valid until it reports them again.
    #[cold]
    pub fn restarted(&mut self) {
        self.continuity.silent_us = None;
        if core::mem::replace(&mut self.continuity.fresh, true) {
            return; // of one start there are many signs
        }
        self.health.counters.restarts.add(1);
        let restarts = self.health.counters.restarts.saturated();
        self.blackbox.event(EventKind::Restart, restarts);
        self.continuity.sensor_restarted();
        self.forget();
        self.begin_checks();
        self.session.demote();
        self.learning.end();
        self.session.stands = None;
        self.session.first_rest = FirstRest::default();
        if let Some(nets) = self.pending.take_next() {
            self.take_nets(nets);
        }
        self.next_drive();
    }
}
