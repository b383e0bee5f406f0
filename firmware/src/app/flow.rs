//! One frame through the device: read, correct, send. All other work follows when the frame has
//! left.

mod learning;

use super::config::Config;
use super::load::Load;
use super::phase::FAILURES;
use super::setup::compensator;
use crate::compensator::{Block, Compensator, State};
use crate::control::{Alignment, Mode};
use crate::learn::Learner;
use crate::link::Line;
use crate::model::Nets;
use crate::sample::{Axes, RawSample, StreamScale};
use crate::wire::command::{Counters, fault};
use crate::wire::sequence::{Gap, Last};
use crate::wire::{Change, Checked, Reading, Source, Stream, stim300};
use learning::BoardLearner;

/// The correction of a stream's frames.
#[derive(Debug)]
struct Correction {
    compensator: Compensator,
    state: State,
}

/// Everything between the sensor's framer and the output.
#[derive(Debug)]
pub(super) struct Flow<'m> {
    /// Error bound, m: [`Config::error_bound`].
    pub error_bound_m: [u32; 5],
    pub load: Load,
    pub config: Config,
    pub mode: Mode,
    pub alignment: Option<Alignment>,
    pub counters: Counters,
    /// What is wrong now: bits of [`fault`].
    pub faults: u32,
    /// Source and content of the frames that `stream` and `correction` were made for.
    made_for: Option<(Source, u8)>,
    stream: Option<Stream>,
    correction: Option<Correction>,
    last: Last,
    /// The networks' failures in a row.
    failures: u8,
    /// The weights in use are to be stored.
    pub to_store: bool,
    /// The last block.
    pub block: Option<Block>,
    /// Blocks in which a correction was clipped, before the present state.
    clipped: u32,
    /// Number of the last sample, modulo 2^32; the first is 0.
    sample: u32,
    learner: BoardLearner<'m>,
    /// The stream that the learner was begun for; `None`: it must begin anew.
    begun: Option<StreamScale>,
    /// In mode learn: a promoted hypothesis corrects the samples.
    promoted: bool,
    /// The compensator has the learner's networks instead of the configuration's.
    learner_nets: bool,
    /// The standstill in progress has been used as an alignment.
    stood: bool,
}

impl<'m> Flow<'m> {
    pub fn new(config: Config, learner: Option<&'m mut dyn Learner>) -> Flow<'m> {
        Flow {
            mode: config.mode,
            error_bound_m: config.error_bound().table(),
            load: Load::default(),
            config,
            alignment: None,
            counters: Counters::default(),
            faults: 0,
            made_for: None,
            stream: None,
            correction: None,
            last: Last::default(),
            failures: 0,
            to_store: false,
            block: None,
            clipped: 0,
            sample: u32::MAX,
            learner: BoardLearner(learner),
            begun: None,
            promoted: false,
            learner_nets: false,
            stood: false,
        }
    }

    /// Begins anew with another configuration. The learner begins from its datasheet. The
    /// navigation computer's alignment stays: after it corrections change only slowly.
    #[inline(never)]
    pub fn begin_anew(&mut self, config: Config) {
        let (learner, alignment) = (self.learner.0.take(), self.alignment);
        *self = Flow::new(config, learner);
        self.alignment = alignment;
    }

    /// There is a correction, which may be zero, or be fading out.
    pub fn corrects(&self) -> bool {
        self.correction.is_some()
    }

    /// A frame in, the same frame out.
    pub fn frame(&mut self, mut frame: Checked, out: &mut impl Line) {
        let reading = frame.read();
        let Ok(reading) = &reading else {
            return; // a Checked frame of a sensor has a sample
        };
        let made_for = Some((frame.source(), frame.content()));
        let mut sample = reading.sample;
        let correct = self.made_for == made_for && reading.valid != Axes::NONE;
        let mut saturated = Axes::NONE;
        match &mut self.correction {
            Some(Correction { compensator, state }) if correct => {
                compensator.correct(state, &mut sample);
                saturated = self.change(&mut frame, &sample);
            }
            _ if frame.always_changes(&self.config.sensor) => {
                saturated = self.change(&mut frame, &sample)
            }
            _ => {}
        }
        let sent = out.send(frame.bytes()).is_ok();
        // the frame has left: no work is urgent until the next one is complete
        self.flag(fault::OUTPUT_FULL, !sent);
        count(&mut self.counters.dropped, u32::from(!sent));
        self.flag(fault::SATURATED, saturated != Axes::NONE);
        count(&mut self.counters.saturated, saturated.0.count_ones());
        count(&mut self.counters.frames, 1);
        if self.made_for != made_for {
            self.make(frame.source(), frame.content());
        }
        self.follow(reading);
    }

    /// Puts a sample into a frame. Gives the axes that saturate.
    fn change(&self, frame: &mut Checked, sample: &RawSample) -> Axes {
        let change = Change {
            sample,
            mark: self.config.mark && self.faults & fault::NETWORK != 0 && !self.observes_only(),
            settings: &self.config.sensor,
        };
        frame.change(&change).unwrap_or(Axes::NONE)
    }

    /// Counts gaps and feeds the networks with the sample of the frame that has just left.
    fn follow(&mut self, reading: &Reading) {
        let bad = reading.present.0 & !reading.valid.0;
        self.flag(fault::SENSOR, bad != 0);
        let stream = self.stream.as_ref();
        let gap = stream.map(|stream| stream.gap(&mut self.last, reading));
        let counters = &mut self.counters;
        match gap {
            Some(Gap::Duplicate) => {
                count(&mut counters.duplicates, 1);
                return; // sent on, but the sample counts once
            }
            Some(Gap::Missed(frames)) => {
                count(&mut counters.missed, frames);
                self.sample = self.sample.wrapping_add(frames);
            }
            Some(Gap::Jump) => count(&mut counters.jumps, 1),
            Some(Gap::None) | None => {}
        }
        self.sample = self.sample.wrapping_add(1);
        if matches!(gap, Some(Gap::Missed(_) | Gap::Jump)) || bad != 0 {
            self.gap();
        }
        let Some(Correction { compensator, state }) = &mut self.correction else {
            return;
        };
        if let Some(learner) = &mut self.learner.0
            && self.begun.is_some()
        {
            learner.sample(self.sample, &reading.sample);
        }
        if bad == 0
            && let Some(block) = compensator.accumulate(state, &reading.sample)
        {
            self.end_of_block(block);
        }
    }

    fn end_of_block(&mut self, block: Block) {
        count(&mut self.counters.blocks, 1);
        let failed = block.fault.is_some();
        self.flag(fault::NETWORK, failed);
        self.failures = if failed {
            self.failures.saturating_add(1)
        } else {
            0
        };
        let zero = block.rate_error == [0.0; 3] && block.force_error == [0.0; 3];
        self.block = Some(block);
        self.promote(&block);
        if let (Some(learner), Some(_)) = (&mut self.learner.0, self.begun) {
            learner.block(self.sample, &block);
        }
        if self.mode == Mode::Bypass && zero {
            self.correction = None; // faded out
        }
    }

    /// Whether the networks have failed for too long.
    pub fn has_failed(&self) -> bool {
        self.failures >= FAILURES
    }

    /// Samples should be corrected, but their units are not known.
    pub fn is_lost(&self) -> bool {
        self.mode != Mode::Bypass && self.faults & fault::UNITS != 0
    }

    /// The sensor has been silent for too long.
    pub fn silence(&mut self) {
        self.gap();
        if let Some(learner) = &mut self.learner.0 {
            learner.silence();
        }
    }

    /// The stream has a gap: damage, silence, lost bytes.
    pub fn gap(&mut self) {
        if let Some(Correction { compensator, state }) = &mut self.correction {
            compensator.give_up_block(state);
        }
        if let Some(learner) = &mut self.learner.0 {
            learner.gap();
        }
    }

    /// A correction for frames of this kind, when one is wanted.
    #[inline(never)]
    fn make(&mut self, source: Source, content: u8) {
        self.made_for = Some((source, content));
        let stream = source.stream(&self.config.sensor, content);
        if stream.is_some() && stream == self.stream && self.correction.is_some() {
            return; // other content, same units: a STIM300 that now sends temperatures too
        }
        self.keep_count();
        self.stream = stream;
        let slow = self.alignment == Some(Alignment::Finished) || self.mode == Mode::Learn;
        let slew = slow.then_some(self.config.slew);
        let wanted = self.mode != Mode::Bypass;
        (self.promoted, self.learner_nets) = (false, false);
        let off = self.observes_only();
        self.correction = stream.filter(|_| wanted).and_then(|stream| {
            let compensator = compensator(&stream, &self.config, slew)?;
            let state = compensator.power_on(off);
            Some(Correction { compensator, state })
        });
        if let Some(learner) = &mut self.learner.0 {
            learner.restart();
        }
        self.teach();
        self.failures = 0;
        self.flag(fault::NETWORK, false);
        self.flag(fault::UNITS, wanted && self.correction.is_none());
    }

    /// Forgets the stream's units and rate: the next frame decides anew.
    pub fn forget(&mut self) {
        self.keep_count();
        self.made_for = None;
        self.stream = None;
        self.correction = None;
        self.last = Last::default();
    }

    /// The sensor has told its configuration.
    pub fn configured(&mut self, stim: stim300::config::Config) {
        if self.config.sensor.stim300.config != stim {
            self.config.sensor.stim300.config = stim;
            self.made_for = None;
        }
    }

    /// Another mode; the caller has checked that it is allowed.
    pub fn set_mode(&mut self, mode: Mode) {
        let fade = self.alignment == Some(Alignment::Finished);
        self.mode = mode;
        self.promoted = false;
        match &mut self.correction {
            Some(Correction { compensator, state }) if fade => {
                state.off = mode != Mode::Frozen;
                if core::mem::take(&mut self.learner_nets) {
                    compensator.exchange(state, self.config.nets, Default::default());
                }
            }
            _ => {
                self.keep_count();
                self.correction = None;
                self.made_for = None;
            }
        }
        self.failures = 0;
        self.teach();
    }

    /// The navigation computer's alignment. From its end on corrections change only slowly.
    pub fn align(&mut self, alignment: Alignment) {
        self.alignment = Some(alignment);
        if let Some(learner) = &mut self.learner.0 {
            learner.align(alignment);
        }
        if alignment == Alignment::Started && self.mode == Mode::Learn {
            self.activate(true, None);
        }
        let learns = self.mode == Mode::Learn;
        if let Some(correction) = &mut self.correction {
            // a fade in progress stays one
            let slow = alignment == Alignment::Finished || correction.state.off || learns;
            correction.compensator.slew = slow.then_some(self.config.slew);
        }
    }

    /// Other networks from the next sample on. The block in progress is given up, and the estimate
    /// is held until they have stepped.
    #[inline(never)]
    pub fn set_nets(&mut self, nets: Nets) {
        self.config.nets = nets;
        self.flag(fault::WEIGHTS, false);
        self.failures = 0;
        self.begun = None;
        (self.promoted, self.learner_nets) = (false, false);
        if let Some(Correction { compensator, state }) = &mut self.correction {
            compensator.give_up_block(state);
            compensator.exchange(state, nets, Default::default());
        }
        self.teach();
    }

    /// Blocks given up, corrections clipped.
    pub fn blocks(&self) -> (u32, u32) {
        let state = self.correction.as_ref().map(|c| &c.state);
        let given_up = state.map_or(0, |s| s.given_up);
        let clipped = state.map_or(0, |s| s.clipped);
        (
            self.counters.given_up.saturating_add(given_up),
            self.clipped.saturating_add(clipped),
        )
    }

    /// Keeps a state's counters before it is dropped.
    fn keep_count(&mut self) {
        (self.counters.given_up, self.clipped) = self.blocks();
        if let Some(correction) = &mut self.correction {
            correction.state.given_up = 0;
            correction.state.clipped = 0;
        }
    }

    pub fn flag(&mut self, bit: u32, set: bool) {
        self.faults = if set {
            self.faults | bit
        } else {
            self.faults & !bit
        };
    }
}

/// Adds to a counter, which saturates.
pub(super) fn count(counter: &mut u32, by: u32) {
    *counter = counter.saturating_add(by);
}
