//! One frame through the device: read, correct, send. All other work follows when the frame has
//! left.

mod boxed;
mod channels;
mod cut;
mod follow;
mod guarded;
mod keep;
mod learning;
mod make;
mod memory;
mod plausible;
mod sound;
mod still;

use super::blackbox::{BlackBox, What};
use super::config::Config;
use super::counts::{Count, Counts};
use super::load::Load;
use crate::compensator::{Block, Compensator, Limit, State, of_nets};
use crate::control::{Alignment, Mode, Reason};
use crate::learn::Settings;
use crate::learn::exchange::{Anew, Port};
use crate::link::Line;
use crate::link::cut::Behind;
use crate::plausibility::{self, Plausibility};
use crate::sample::{Axes, RawSample, StreamScale};
use crate::wire::command::fault;
use crate::wire::receiver::Heard;
use crate::wire::sequence::Last;
use crate::wire::{Change, Checked, Reading, Stream, USUAL};
pub(super) use boxed::FOLLOWS;
use channels::Channels;
use guarded::Guarded;
use keep::Keep;
pub(super) use memory::through_configuration;
use still::Still;

/// What is known of the units that the frames do not tell but the sensor does (STIM300).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Told {
    /// Nothing yet. They are believed to be as configured: the sensor's receiving side need not be
    /// wired.
    AsConfigured,
    /// The sensor may have changed them since it told them.
    Unknown,
    /// The sensor has told them since its last start.
    BySensor,
}

/// The correction of a stream's frames.
#[derive(Debug)]
struct Correction {
    compensator: Compensator,
    state: State,
}

/// Everything between the sensor's framer and the output.
#[derive(Debug)]
pub(super) struct Flow<'m> {
    /// Latitude of the last fix, rad.
    latitude: Option<f64>,
    pub load: Load,
    pub config: Config,
    /// Check of its networks.
    nets_sum: u32,
    pub mode: Mode,
    pub alignment: Option<Alignment>,
    pub counters: Counts,
    /// What is wrong now: bits of [`fault`].
    pub faults: u32,
    /// What was told of the sensor and what the board found disagree: bits of [`fault`]. Nothing is
    /// corrected then.
    pub other_sensor: u32,
    /// The kinds of frames that `correction` was made for.
    channels: Channels,
    /// Of the samples that make blocks, and the axes that they have.
    stream: Option<Stream>,
    present: Axes,
    /// Its frames have neither counter nor time.
    uncounted: bool,
    /// When the frames came that are being read, microseconds.
    pub now_us: u64,
    /// Another stream makes the blocks, and the learner has not been told.
    leads_anew: bool,
    correction: Guarded<Correction>,
    /// What the place of `correction` was made for while there is none: see [`Flow::prepare`].
    prepared: Option<(Stream, Option<Limit>)>,
    last: Last,
    still: Still,
    told: Told,
    /// No good sample has come since the sensor's start.
    fresh: bool,
    /// The sensor was silent before the next frame, microseconds.
    silent_us: Option<u64>,
    /// Bytes that belong to no frame, since the last frame.
    unframed: u32,
    /// Frames of other kinds than those that make blocks, and the number of all frames when their
    /// count began.
    aside: (u32, Count),
    /// The networks' failures in a row.
    failures: u8,
    /// What is to be stored, and what the store holds for the next power-on.
    pub keep: Keep,
    /// What the receiver has sent.
    pub heard: Heard,
    /// The last block.
    pub block: Option<Block>,
    /// Blocks in which a correction was clipped, before the present state.
    clipped: Count,
    /// Number of the last sample, modulo 2^64; the first is 0.
    sample: u64,
    pub learner: Port<'m>,
    /// What the learner has said to a reference or a heading.
    verdict: Option<Result<(), Reason>>,
    /// The stream that the learner was begun for; `None`: it must begin anew.
    begun: Option<StreamScale>,
    /// In mode learn: a promoted hypothesis corrects the samples.
    promoted: bool,
    /// The compensator has the learner's networks instead of the configuration's.
    learner_nets: bool,
    /// The standstill in progress has been used as an alignment.
    stood: bool,
    /// The last fix: whether it shows a standstill, and the number of the sample before it.
    stands: Option<(bool, u64)>,
    /// What was told, against what is seen.
    plausibility: Plausibility,
    /// They disagree: nothing is corrected or learnt.
    disagrees: bool,
    /// The samples of the stream are floats.
    floats: bool,
    pub blackbox: BlackBox<'m>,
}

impl<'m> Flow<'m> {
    /// The learner has been told of the unit ([`configure`]).
    pub fn new(config: Config, learner: Port<'m>) -> Flow<'m> {
        let unread = if config.unread { fault::STORE } else { 0 };
        let faults = unread | if config.other_unit { fault::WEIGHTS } else { 0 };
        let keep = Keep::new(config.store && config.told.is_some());
        Flow {
            keep,
            mode: config.mode,
            latitude: None,
            load: Load::default(),
            plausibility: Plausibility::new(config.told.as_ref().map(plausibility::Told::of)),
            disagrees: false,
            nets_sum: of_nets(&config.nets),
            config,
            alignment: None,
            counters: Counts::default(),
            faults,
            other_sensor: 0,
            channels: Channels::default(),
            stream: None,
            present: Axes::NONE,
            uncounted: false,
            now_us: 0,
            leads_anew: false,
            correction: Guarded::nothing(Correction {
                compensator: Compensator::BLANK,
                state: State::default(),
            }),
            prepared: None,
            last: Last::default(),
            still: Still::default(),
            told: Told::AsConfigured,
            fresh: true,
            silent_us: None,
            unframed: 0,
            aside: (0, Count::default()),
            failures: 0,
            heard: Heard::default(),
            block: None,
            clipped: Count::default(),
            sample: u64::MAX,
            learner,
            verdict: None,
            begun: None,
            promoted: false,
            learner_nets: false,
            stood: false,
            stands: None,
            floats: false,
            blackbox: BlackBox::default(),
        }
    }

    /// Begins anew with another configuration, of which the learner has been told ([`configure`]).
    /// The navigation computer's alignment stays: after it corrections change only slowly. What the
    /// sensor itself has told is believed rather than the configuration.
    #[inline(never)]
    pub fn begin_anew(&mut self, config: Config) {
        let learner = core::mem::replace(&mut self.learner, Port::NONE);
        let alignment = self.alignment;
        let (told, stim300) = (self.told, self.config.sensor.stim300.config);
        let (fresh, keep) = (self.fresh, core::mem::take(&mut self.keep));
        let blackbox = core::mem::take(&mut self.blackbox);
        *self = Flow::new(config, learner);
        (self.fresh, self.keep) = (fresh, keep);
        self.blackbox = blackbox;
        self.blackbox.part();
        self.blackbox.event(What::Configured, 0);
        self.alignment = alignment;
        self.told = told;
        if told == Told::BySensor {
            self.config.sensor.stim300.config = stim300;
        }
    }

    /// There is a correction, which may be zero, or be fading out.
    pub fn corrects(&self) -> bool {
        self.correction.is_some()
    }

    /// The most that corrections can add to a position, m: [`Config::error_bound`].
    pub fn error_bound_m(&self) -> [u32; 5] {
        let words = self.plausibility.rate.words();
        self.config.error_bound(self.latitude, words).table()
    }

    /// A correction other than zero is in force.
    pub fn in_force(&self) -> bool {
        let correction = self.correction.get();
        correction.is_some_and(|c| c.state.estimate() != [[0.0; 3]; 2])
    }

    /// A frame in, the same frame out. By itself: within the loop over what has come, the compiler
    /// would prepare each address beforehand and put it aside, at one instruction more each.
    #[inline(never)]
    pub fn frame(&mut self, frame: Checked, out: &mut Behind<impl Line>) {
        self.through::<false>(frame, out);
    }

    /// The same once more for the usual frames, where the compiler knows format and length.
    #[inline(never)]
    pub fn usual(&mut self, frame: &mut [u8; USUAL], out: &mut Behind<impl Line>) {
        self.through::<true>(Checked::of_usual(frame), out);
    }

    /// `KNOWN`: reading and changing the frame are worth to be here, since most of them falls away.
    #[inline(always)]
    fn through<const KNOWN: bool>(&mut self, mut frame: Checked, out: &mut Behind<impl Line>) {
        let reading = if KNOWN {
            frame.reading()
        } else {
            reading_of(&frame)
        };
        let Some(reading) = &reading else {
            return; // a Checked frame of a sensor has a sample
        };
        // before anything is changed: the identifier may be
        let content = frame.content();
        let known = self.channels.is(content) || self.another(content, &frame, reading);
        if !known {
            self.make((frame.source(), content), reading.present);
            self.see_kind(&reading.sample);
        }
        let correct = reading.valid != Axes::NONE && (known || self.channels.is(content));
        let mut saturated = Axes::NONE;
        match self.correction.get_mut() {
            Some(Correction { compensator, state }) if correct => {
                let outlet = self.channels.current();
                let early = !KNOWN && self.config.lines().cut_through;
                let (sample, over) = compensator.corrected(state, outlet, &reading.sample, early);
                let unfit = if KNOWN {
                    self.change(&mut frame, &sample)
                } else {
                    self.change_any(&mut frame, &sample)
                };
                saturated = Axes(over.0 | unfit.0);
            }
            _ if frame.always_changes(&self.config.sensor) => {
                saturated = self.change_any(&mut frame, &reading.sample)
            }
            _ => {}
        }
        let sent = out.send(frame.bytes()).is_ok();
        self.blackbox.left(frame.bytes());
        // the frame has left: no work is urgent until the next one is complete
        let told = self.faults & (fault::OUTPUT_FULL | fault::SATURATED) != 0;
        if told || !sent || saturated != Axes::NONE {
            self.not_as_owed(sent, saturated);
        }
        self.counters.frames.add(1);
        if reading.valid != reading.present && frame.starts_up() {
            self.restarted();
        }
        if !known {
            self.made();
        }
        if self.blackbox.wants_frame() {
            self.blackbox.frame(frame.bytes());
        }
        self.follow(reading);
    }

    /// A frame could not be sent or be corrected in full, or none of late.
    #[cold]
    #[inline(never)]
    fn not_as_owed(&mut self, sent: bool, saturated: Axes) {
        self.flag(fault::OUTPUT_FULL, !sent);
        self.counters.dropped.add(u32::from(!sent));
        self.flag(fault::SATURATED, saturated != Axes::NONE);
        self.counters.saturated.add(saturated.0.count_ones());
    }

    /// Puts a sample into a frame. Gives the axes that saturate.
    #[inline(always)]
    fn change(&self, frame: &mut Checked, sample: &RawSample) -> Axes {
        let change = Change {
            sample,
            mark: self.marks(),
            settings: &self.config.sensor,
        };
        frame.change(&change).unwrap_or(Axes::NONE)
    }

    /// The same of any frame.
    #[inline(never)]
    fn change_any(&self, frame: &mut Checked, sample: &RawSample) -> Axes {
        self.change(frame, sample)
    }

    /// A frame that is changed gets the mark of our own fault.
    fn marks(&self) -> bool {
        self.config.mark && self.faults & fault::NETWORK != 0 && !self.observes_only()
    }

    pub fn flag(&mut self, bit: u32, set: bool) {
        self.faults = if set {
            self.faults | bit
        } else {
            self.faults & !bit
        };
    }
}

/// Tells the learner of the unit, which then begins from its datasheet. Not within [`Flow::new`],
/// so that the stack does not hold both.
#[inline(never)]
pub(super) fn configure(learner: &mut Port, config: &Config) {
    if let Some(told) = &config.told {
        learner.begin_anew(Anew::Configured(Settings::of(told)));
    }
}

/// What any frame holds.
#[inline(never)]
fn reading_of(frame: &Checked) -> Option<Reading> {
    frame.reading()
}
