//! Makes the correction for the frames that come, and handles what changes it: modes, alignments,
//! networks.

use super::channels::Kind;
use super::{Correction, Flow, Units};
use crate::app::counts::Counts;
use crate::app::setup::lsb;
use crate::compensator::State;
use crate::control::{Alignment, Mode};
use crate::learn::exchange::{Order, RestartReason};
use crate::model::Nets;
use crate::sample::Axes;
use crate::wire::command::fault;
use crate::wire::sequence::Last;
use crate::wire::{ImuFormat, Source, Stream, stim300};

impl Flow<'_> {
    /// Whether frames may have led to another state: what [`Flow::is_lost`] and
    /// [`Flow::has_failed`] begin with, or a format that is not known.
    #[inline(always)]
    pub fn may_change_state(&self) -> bool {
        let signs =
            self.health.faults & (fault::UNKNOWN_FORMAT | fault::UNITS) | self.health.other_sensor;
        signs != 0 || self.corrector.fails()
    }

    /// Samples should be corrected, but their units are not known.
    pub fn is_lost(&self) -> bool {
        let waits = self.corrector.stream.is_none()
            && self
                .corrector
                .channels
                .source()
                .is_some_and(|s| self.awaits(s));
        let lost =
            self.health.other_sensor != 0 || self.health.faults & fault::UNITS != 0 && !waits;
        self.session.mode != Mode::Bypass && lost
    }

    /// A correction for frames of this kind, when one is wanted.
    #[inline(never)]
    pub(super) fn make(&mut self, kind: Kind, present: Axes) {
        self.blackbox.part();
        let (source, content) = kind;
        let stream = if self.awaits(source) {
            None
        } else {
            source.stream(&self.config.sensor, content)
        };
        self.make_for(kind, present, stream);
    }

    /// A correction for frames of this kind, whose samples are of this stream.
    pub(super) fn make_for(&mut self, kind: Kind, present: Axes, stream: Option<Stream>) {
        if self.corrector.channels.is_empty() {
            self.corrector.channels.add(kind, true);
            self.corrector.present = present;
            self.lead(stream);
        } else if !self.beside(kind, stream, present) && self.session.mode != Mode::Bypass {
            self.health.flag(fault::UNITS, true);
        }
    }

    /// Whether frames of this source wait for the sensor to report their units.
    fn awaits(&self, source: Source) -> bool {
        self.continuity.units == Units::Unknown && source == Source::Stream(ImuFormat::Stim300)
    }

    /// One more kind of frame on the line. False: it cannot be corrected.
    fn beside(&mut self, kind: Kind, stream: Option<Stream>, present: Axes) -> bool {
        let leads = stream == self.corrector.stream && present == self.corrector.present;
        let (output, Some(stream)) = (self.corrector.channels.add(kind, leads), stream) else {
            return false;
        };
        let Some(output) = output else {
            // increments over a time that comes seldom pass as they are
            return self.corrector.stream.map(|leading| leading.units) == Some(stream.units);
        };
        let Some(Correction { compensator, state }) = self.corrector.correction.get_mut() else {
            return true;
        };
        let period = 1.0 / stream.rate;
        let lsb = lsb(&stream, period);
        lsb.is_some_and(|lsb| {
            compensator
                .set_output_stream(state, output, lsb, period)
                .is_ok()
        })
    }

    /// A correction for the samples of this stream, which from now on make the blocks. What else
    /// follows is left to [`Flow::made`], after the frame has left.
    fn lead(&mut self, stream: Option<Stream>) {
        if stream.is_some()
            && stream == self.corrector.stream
            && self.corrector.correction.is_some()
        {
            return;
        }
        self.corrector.retain_counts(&mut self.health.counters);
        self.corrector.stream = stream;
        self.corrector.uncounted = stream.is_some_and(|stream| stream.turn().is_none());
        self.health.plausibility.holes.interrupt();
        self.corrector.leader_changed = true;
        let wanted = self.session.mode != Mode::Bypass;
        self.session.demote();
        let agreed = self.health.other_sensor == 0;
        self.begin_correction(stream.filter(|_| wanted && agreed));
        self.corrector.forgive();
        self.health.flag(fault::NETWORK, false);
        self.health.flag(
            fault::UNITS,
            wanted && agreed && self.corrector.correction.is_none(),
        );
    }

    /// The first frame of a kind has left. If its samples make the blocks, the learner begins.
    #[inline(never)]
    pub(super) fn made(&mut self) {
        if core::mem::take(&mut self.corrector.leader_changed) {
            self.begin_checks();
            let begun = self.learning.begun();
            self.teach();
            // one that has begun is new already
            if begun.is_some() && begun == self.learning.begun() {
                self.restart_learner(RestartReason::Stream);
            }
        }
    }

    /// The correction is zero or goes there.
    pub(super) fn is_off(&self) -> bool {
        self.session.mode == Mode::Bypass || self.observes_only()
    }

    /// Makes what the first frame of this source will ask for, as far as it is known before: a
    /// frame waits for nothing that can be made beforehand. It comes into use if the frame is of
    /// the stream and at the slew limit that it was made for.
    #[inline(never)]
    pub fn prepare(&mut self, source: Source) {
        self.corrector.prepared = None;
        if self.session.mode == Mode::Bypass || self.awaits(source) {
            return;
        }
        let slew = self.session.is_slow().then_some(self.config.slew);
        // what a frame contains seldom matters
        let Some(stream) = source.stream(&self.config.sensor, 0) else {
            return;
        };
        if let Some(correction) = self.corrector.correction.place() {
            let made = correction.renew(&stream, (&self.config, self.corrector.nets_sum), slew);
            self.corrector.prepared = made.map(|()| (stream, slew));
        }
    }

    /// A new correction for samples of this stream, or none. By itself, so that what it needs on
    /// the stack is gone before the learner begins.
    ///
    /// From the sensor's power-on on it is in force at once. Later, where corrections change slowly
    /// only, it begins with what was in force, which is in SI units and so the same for every
    /// stream.
    #[inline(never)]
    fn begin_correction(&mut self, stream: Option<Stream>) {
        let slew = self.session.is_slow().then_some(self.config.slew);
        let off = self.observes_only();
        let in_force = self.corrector.correction.get();
        let in_force = in_force.map(|c| (c.state.estimate(), *c.state.maps()));
        let fresh = self.continuity.fresh;
        let Some(stream) = stream else {
            return self.corrector.correction.clear();
        };
        let prepared = self.corrector.prepared.take() == Some((stream, slew))
            && self.corrector.correction.is_none();
        let correction = self.corrector.correction.put();
        if !prepared
            && correction
                .renew(&stream, (&self.config, self.corrector.nets_sum), slew)
                .is_none()
        {
            return self.corrector.correction.clear();
        }
        let Correction { compensator, state } = correction;
        let held = slew.is_some() && !fresh;
        state.off = off;
        match in_force {
            Some((estimate, maps)) if held => compensator.force_with(state, &estimate, &maps),
            _ if off || held => {}
            _ => compensator.force(state, &compensator.initial_output()),
        }
    }

    /// Forgets the stream's units and rate: the next frame sets them again.
    pub fn forget(&mut self) {
        self.blackbox.part();
        self.corrector.retain_counts(&mut self.health.counters);
        self.corrector.channels.clear();
        self.corrector.stream = None;
        self.corrector.correction.clear();
        self.continuity.last = Last::default();
        self.health.flag(fault::UNITS, false);
    }

    /// The sensor has reported its configuration.
    pub fn configured(&mut self, stim: stim300::config::Config) {
        let known =
            self.continuity.units != Units::Unknown && self.config.sensor.stim300.config == stim;
        self.config.sensor.stim300.config = stim;
        self.continuity.units = Units::Reported;
        if !known {
            self.blackbox.part();
            self.corrector.channels.clear();
            self.health.flag(fault::UNITS, false); // the next frame shows it
            self.prepare(Source::Stream(ImuFormat::Stim300));
        }
    }

    /// The sensor's configuration may change: nothing is corrected until the sensor reports it.
    pub fn forget_units(&mut self) {
        self.continuity.units = Units::Unknown;
        self.forget();
    }

    /// Another mode; the caller has checked that it is allowed.
    pub fn set_mode(&mut self, mode: Mode) {
        let fade = self.session.is_slow() || mode == Mode::Learn;
        self.session.mode = mode;
        self.session.promoted = false;
        let off = self.is_off();
        let zero = |state: &State| mode == Mode::Bypass && state.is_zero();
        match self.corrector.correction.get_mut() {
            Some(Correction { compensator, state }) if fade && !zero(state) => {
                state.off = off;
                compensator.set_slew(Some(self.config.slew));
                self.session.first_rest.drop_added();
                if core::mem::take(&mut self.session.learner_nets) {
                    compensator.exchange(state, self.config.nets, Default::default());
                }
            }
            _ => {
                self.blackbox.part();
                self.corrector.retain_counts(&mut self.health.counters);
                self.corrector.look_again();
            }
        }
        self.corrector.forgive();
        if self.learning.port.is_stopped() {
            self.learning.end(); // it may begin again
        }
        self.teach();
    }

    /// No sample has come for a second, which counts like a power cycle. A correction that was
    /// fading out in bypass has no sample left to fade in.
    pub fn rest(&mut self) {
        if self.session.mode == Mode::Bypass && self.corrector.correction.is_some() {
            self.blackbox.part();
            self.corrector.retain_counts(&mut self.health.counters);
            self.corrector.look_again();
        }
    }

    /// The navigation computer's alignment. At its beginning a correction may jump to where it
    /// goes; from then on it changes only slowly.
    pub fn align(&mut self, alignment: Alignment) {
        if self.session.alignment.replace(alignment) == Some(alignment) {
            return; // asked again, since the answer was lost
        }
        self.learning.port.hand_over(&Order::Align(alignment));
        if alignment == Alignment::Started {
            self.arrive();
        }
        self.corrector.slow_down(self.config.slew);
    }

    /// A correction that moves arrives at once.
    fn arrive(&mut self) {
        if self.session.mode == Mode::Learn
            && !self.session.acts_from_power_on(self.config.activation)
        {
            return self.activate(true);
        }
        if let Some(Correction { compensator, state }) = self.corrector.correction.get_mut() {
            match &self.corrector.block {
                _ if state.off => compensator.force_zero(state),
                Some(block) => compensator.force(state, &block.network_output),
                None => compensator.force(state, &compensator.initial_output()),
            }
        }
    }

    /// Other networks from the next sample on. The block in progress is given up, and the estimate
    /// is held until they have stepped.
    #[inline(never)]
    pub fn set_nets(&mut self, nets: Nets) {
        self.take_nets(nets);
        self.note_nets();
        self.pending.forget_next();
        self.health.flag(fault::WEIGHTS, false);
        self.corrector.forgive();
        self.learning.end();
        self.corrector.block = None;
        self.session.demote();
        let off = self.is_off();
        if let Some(Correction { compensator, state }) = self.corrector.correction.get_mut() {
            compensator.give_up_block(state);
            compensator.exchange(state, nets, Default::default());
            state.off = off;
        }
        self.teach();
    }

    /// All counters, with those of the correction's state.
    pub fn counted(&self) -> Counts {
        self.corrector.counted(self.health.counters)
    }

    /// Sets the numbers of samples and of clipped corrections.
    pub fn begin_at(&mut self, counted: u64) {
        self.continuity.sample = counted.wrapping_sub(1);
        self.corrector.has_clipped(counted);
        self.continuity.aside.1 = self.health.counters.frames;
    }
}
