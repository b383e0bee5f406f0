//! How a correction is made for the frames that come, and what changes it: modes, alignments,
//! networks.

use super::channels::Kind;
use super::{Correction, Flow, Told};
use crate::app::config::Config;
use crate::app::counts::{Count, Counts};
use crate::app::phase::FAILURES;
use crate::app::setup::{lsb, renew};
use crate::compensator::{Limit, State};
use crate::control::{Alignment, Mode};
use crate::learn::exchange::{Anew, Order};
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
        let signs = self.faults & (fault::UNKNOWN_FORMAT | fault::UNITS) | self.other_sensor;
        signs != 0 || self.failures >= FAILURES
    }

    /// Samples should be corrected, but their units are not known.
    pub fn is_lost(&self) -> bool {
        let waits = self.stream.is_none() && self.channels.source().is_some_and(|s| self.awaits(s));
        let lost = self.other_sensor != 0 || self.faults & fault::UNITS != 0 && !waits;
        self.mode != Mode::Bypass && lost
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
        if self.channels.is_empty() {
            self.channels.add(kind, true);
            self.present = present;
            self.lead(stream);
        } else if !self.beside(kind, stream, present) && self.mode != Mode::Bypass {
            self.flag(fault::UNITS, true);
        }
    }

    /// Whether frames of this source wait for the sensor to tell their units.
    fn awaits(&self, source: Source) -> bool {
        self.told == Told::Unknown && source == Source::Stream(ImuFormat::Stim300)
    }

    /// One more kind of frame on the line. False: it cannot be corrected.
    fn beside(&mut self, kind: Kind, stream: Option<Stream>, present: Axes) -> bool {
        let leads = stream == self.stream && present == self.present;
        let (Some(outlet), Some(stream)) = (self.channels.add(kind, leads), stream) else {
            return false;
        };
        let Some(Correction { compensator, state }) = self.correction.get_mut() else {
            return true;
        };
        let period = 1.0 / stream.rate;
        let lsb = lsb(&stream, period);
        lsb.is_some_and(|lsb| compensator.set_outlet(state, outlet, lsb, period).is_ok())
    }

    /// A correction for the samples of this stream, which from now on make the blocks. What else
    /// follows is left to [`Flow::made`], after the frame has left.
    fn lead(&mut self, stream: Option<Stream>) {
        if stream.is_some() && stream == self.stream && self.correction.is_some() {
            return;
        }
        self.keep_count();
        self.stream = stream;
        self.uncounted = stream.is_some_and(|stream| stream.turn().is_none());
        self.plausibility.holes.interrupt();
        self.leads_anew = true;
        let wanted = self.mode != Mode::Bypass;
        (self.promoted, self.learner_nets) = (false, false);
        let agreed = self.other_sensor == 0;
        self.begin_correction(stream.filter(|_| wanted && agreed));
        self.failures = 0;
        self.flag(fault::NETWORK, false);
        self.flag(fault::UNITS, wanted && agreed && self.correction.is_none());
    }

    /// The first frame of a kind has left. If its samples make the blocks, the learner begins.
    #[inline(never)]
    pub(super) fn made(&mut self) {
        if core::mem::take(&mut self.leads_anew) {
            self.begin_checks();
            let begun = self.begun;
            self.teach();
            // one that has begun is new already
            if begun.is_some() && begun == self.begun {
                self.learner.begin_anew(Anew::Stream);
            }
        }
    }

    /// Corrections change no faster than the slew limit: from the beginning of an alignment on, and
    /// in mode learn.
    fn slow(&self) -> bool {
        self.alignment.is_some() || self.mode == Mode::Learn
    }

    /// The correction is zero or goes there.
    pub(super) fn is_off(&self) -> bool {
        self.mode == Mode::Bypass || self.observes_only()
    }

    /// Makes what the first frame of this source will ask for, as far as it is known before: a
    /// frame waits for nothing that can be made beforehand. It comes into use if the frame is of
    /// the stream and at the slew limit that it was made for.
    #[inline(never)]
    pub fn prepare(&mut self, source: Source) {
        self.prepared = None;
        if self.mode == Mode::Bypass || self.awaits(source) {
            return;
        }
        let slew = self.slow().then_some(self.config.slew);
        // what a frame contains seldom matters
        let Some(stream) = source.stream(&self.config.sensor, 0) else {
            return;
        };
        if let Some(correction) = self.correction.place() {
            let made = correction.renew(&stream, (&self.config, self.nets_sum), slew);
            self.prepared = made.map(|()| (stream, slew));
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
        let slew = self.slow().then_some(self.config.slew);
        let off = self.observes_only();
        let in_force = self.correction.get().map(|c| c.state.estimate());
        let fresh = self.fresh;
        let Some(stream) = stream else {
            return self.correction.clear();
        };
        let prepared = self.prepared.take() == Some((stream, slew)) && self.correction.is_none();
        let correction = self.correction.put();
        if !prepared
            && correction
                .renew(&stream, (&self.config, self.nets_sum), slew)
                .is_none()
        {
            return self.correction.clear();
        }
        let Correction { compensator, state } = correction;
        let held = slew.is_some() && !fresh;
        state.off = off;
        match in_force {
            Some(in_force) if held => compensator.force(state, &in_force),
            _ if off || held => {}
            _ => compensator.force(state, &compensator.initial_output()),
        }
    }

    /// Forgets the stream's units and rate: the next frame decides anew.
    pub fn forget(&mut self) {
        self.blackbox.part();
        self.keep_count();
        self.channels.clear();
        self.stream = None;
        self.correction.clear();
        self.last = Last::default();
        self.flag(fault::UNITS, false);
    }

    /// The sensor has told its configuration.
    pub fn configured(&mut self, stim: stim300::config::Config) {
        let known = self.told != Told::Unknown && self.config.sensor.stim300.config == stim;
        self.config.sensor.stim300.config = stim;
        self.told = Told::BySensor;
        if !known {
            self.blackbox.part();
            self.channels.clear();
            self.flag(fault::UNITS, false); // the next frame shows it
            self.prepare(Source::Stream(ImuFormat::Stim300));
        }
    }

    /// The sensor's configuration may change: nothing is corrected until the sensor tells it.
    pub fn untold(&mut self) {
        self.told = Told::Unknown;
        self.forget();
    }

    /// What is known of the units that the sensor tells.
    #[inline(always)]
    pub fn told(&self) -> Told {
        self.told
    }

    /// Another mode; the caller has checked that it is allowed.
    pub fn set_mode(&mut self, mode: Mode) {
        let fade = self.slow() || mode == Mode::Learn;
        self.mode = mode;
        self.promoted = false;
        let off = self.is_off();
        let zero = |state: &State| mode == Mode::Bypass && state.estimate() == [[0.0; 3]; 2];
        match self.correction.get_mut() {
            Some(Correction { compensator, state }) if fade && !zero(state) => {
                state.off = off;
                compensator.set_slew(Some(self.config.slew));
                if core::mem::take(&mut self.learner_nets) {
                    compensator.exchange(state, self.config.nets, Default::default());
                }
            }
            _ => {
                self.blackbox.part();
                self.keep_count();
                self.correction.clear();
                self.channels.clear();
            }
        }
        self.failures = 0;
        if self.learner.is_stopped() {
            self.begun = None; // it may begin again
        }
        self.teach();
    }

    /// No sample has come for a second, which counts like a power cycle. A correction that was
    /// fading out in bypass has no sample left to fade in.
    pub fn rest(&mut self) {
        if self.mode == Mode::Bypass && self.correction.is_some() {
            self.blackbox.part();
            self.keep_count();
            self.correction.clear();
            self.channels.clear();
        }
    }

    /// The navigation computer's alignment. At its beginning a correction may jump to where it
    /// goes; from then on it changes only slowly.
    pub fn align(&mut self, alignment: Alignment) {
        if self.alignment.replace(alignment) == Some(alignment) {
            return; // asked again, since the answer was lost
        }
        self.learner.hand_over(&Order::Align(alignment));
        if alignment == Alignment::Started {
            self.arrive();
        }
        if let Some(correction) = self.correction.get_mut() {
            correction.compensator.set_slew(Some(self.config.slew));
        }
    }

    /// A correction that moves arrives at once.
    fn arrive(&mut self) {
        if self.mode == Mode::Learn && !self.acts_from_power_on() {
            return self.activate(true);
        }
        if let Some(Correction { compensator, state }) = self.correction.get_mut() {
            let output = match &self.block {
                _ if state.off => [[0.0; 3]; 2],
                Some(block) => block.network_output,
                None => compensator.initial_output(),
            };
            compensator.force(state, &output);
        }
    }

    /// A block's networks have failed, or not. When they have failed for too long, the correction
    /// goes to zero, and then everything passes through. It comes back if they step before.
    pub(super) fn count_failure(&mut self, failed: bool) {
        let before = self.failures >= FAILURES;
        self.failures = if failed {
            self.failures.saturating_add(1)
        } else {
            0
        };
        let now = self.failures >= FAILURES;
        let off = now || self.is_off();
        if let (true, Some(Correction { state, .. })) = (now != before, self.correction.get_mut()) {
            state.off = off;
        }
    }

    /// Whether the networks have failed for too long, and the correction has gone.
    pub fn has_failed(&self) -> bool {
        let gone =
            |c: &Correction| c.compensator.slew().is_none() || c.state.estimate() == [[0.0; 3]; 2];
        self.failures >= FAILURES && self.correction.get().is_none_or(gone)
    }

    /// Other networks from the next sample on. The block in progress is given up, and the estimate
    /// is held until they have stepped.
    #[inline(never)]
    pub fn set_nets(&mut self, nets: Nets) {
        self.take_nets(nets);
        self.note_nets();
        self.keep.forget_next();
        self.flag(fault::WEIGHTS, false);
        self.failures = 0;
        self.begun = None;
        self.block = None;
        (self.promoted, self.learner_nets) = (false, false);
        let off = self.is_off();
        if let Some(Correction { compensator, state }) = self.correction.get_mut() {
            compensator.give_up_block(state);
            compensator.exchange(state, nets, Default::default());
            state.off = off;
        }
        self.teach();
    }

    /// All counters, with those of the correction's state.
    pub fn counted(&self) -> Counts {
        let mut counters = self.counters;
        if let Some(Correction { state, .. }) = self.correction.get() {
            counters.given_up.add(state.given_up);
            counters.mended.add(state.mended);
        }
        counters
    }

    /// Blocks in which a correction was clipped.
    pub fn clipped(&self) -> Count {
        let mut clipped = self.clipped;
        let state = self.correction.get().map(|c| &c.state);
        clipped.add(state.map_or(0, |state| state.clipped));
        clipped
    }

    /// As if so many samples had come and corrections been clipped.
    pub fn begin_at(&mut self, counted: u64) {
        self.sample = counted.wrapping_sub(1);
        self.clipped = Count::of(counted);
        self.aside.1 = self.counters.frames;
    }

    /// Keeps a state's counters before it is dropped.
    fn keep_count(&mut self) {
        (self.counters, self.clipped) = (self.counted(), self.clipped());
        if let Some(correction) = self.correction.get_mut() {
            correction.state.given_up = 0;
            correction.state.mended = 0;
            correction.state.clipped = 0;
        }
    }
}

impl Correction {
    /// As before the first sample of this stream, by networks with this check. `None`: its samples
    /// cannot be corrected.
    fn renew(&mut self, stream: &Stream, nets: (&Config, u32), slew: Option<Limit>) -> Option<()> {
        self.state.clear();
        renew(&mut self.compensator, stream, nets, slew)
    }
}
