//! One frame through the device: read, correct, send. All other work follows when the frame has
//! left.

mod at_rest;
mod blackbox;
mod channels;
mod continuity;
mod corrector;
mod cut;
mod follow;
mod guarded;
mod integrity;
mod learning;
mod make;
mod memory;
mod pending;
mod plausible;
mod sampled;
mod session;
mod stuck;

pub(super) use self::blackbox::FOLLOWS;
use super::blackbox::{BlackBox, EventKind};
use super::clock::Clock;
use super::config::Config;
use super::health::Health;
use crate::compensator::of_nets;
use crate::learn::Settings;
use crate::learn::exchange::{Port, RestartReason};
use crate::link::Line;
use crate::link::cut::Behind;
use crate::sample::{Axes, RawSample};
use crate::wire::command::fault;
use crate::wire::receiver::ReceiverStatus;
use crate::wire::{Change, Checked, Reading, USUAL};
use continuity::Continuity;
pub(super) use continuity::Units;
use corrector::{Correction, Corrector};
use learning::Learning;
pub(super) use pending::Pending;
use session::Session;

/// Everything between the sensor's framer and the output stream.
#[derive(Debug)]
pub(super) struct Flow<'m> {
    pub config: Config,
    pub health: Health,
    pub corrector: Corrector,
    pub continuity: Continuity,
    pub session: Session,
    pub learning: Learning<'m>,
    /// Content to store, and content of the store for the next power-on.
    pub pending: Pending,
    /// State of the receiver's stream.
    pub receiver_status: ReceiverStatus,
    /// Times of the samples by the receiver's clock.
    pub clock: Clock,
    pub blackbox: BlackBox<'m>,
}

impl<'m> Flow<'m> {
    /// Before power-on, without a learner; [`Flow::set_config`] follows.
    pub fn blank() -> Flow<'m> {
        let config = Config::default();
        Flow {
            health: Health::new(&config),
            corrector: Corrector::new(of_nets(&config.nets)),
            continuity: Continuity::new(),
            session: Session::new(config.mode),
            learning: Learning::new(),
            pending: Pending::default(),
            receiver_status: ReceiverStatus::default(),
            clock: Clock::default(),
            blackbox: BlackBox::default(),
            config,
        }
    }

    /// Begins with this configuration, which the learner has already ([`configure`]).
    pub fn set_config(&mut self, config: Config) {
        self.health = Health::new(&config);
        self.corrector = Corrector::new(of_nets(&config.nets));
        self.session.restart(config.mode);
        self.config = config;
    }

    /// Restarts with another configuration, which the learner has already ([`configure`]). The
    /// navigation computer's alignment stays: after it corrections change only slowly. What the
    /// sensor itself has reported is believed rather than the configuration.
    #[inline(never)]
    pub fn restart(&mut self, config: Config) {
        let stim300 = self.config.sensor.stim300.config;
        self.set_config(config);
        self.continuity.restart();
        self.learning.restart();
        self.receiver_status = ReceiverStatus::default();
        self.clock = Clock::default();
        if self.continuity.units == Units::Reported {
            self.config.sensor.stim300.config = stim300;
        }
        self.blackbox.part();
        self.blackbox.event(EventKind::Configured, 0);
    }

    /// The most that corrections can add to a position, m: [`Config::error_bound`].
    pub fn error_bound_m(&self) -> [u32; 5] {
        let words = self.health.plausibility.rate.words();
        self.config
            .error_bound(self.session.latitude, words)
            .table()
    }

    /// A frame in, the same frame out. By itself: within the loop over what has come, the compiler
    /// would prepare each address beforehand and put it aside, at one instruction more each.
    #[inline(never)]
    pub fn frame(&mut self, frame: Checked, out: &mut Behind<impl Line>) {
        self.through::<false>(frame, out);
    }

    /// [`Self::frame`] for the usual frames, for which the compiler knows format and length.
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
        let known = self.corrector.channels.is(content)
            || self.another((frame.source(), content), frame.bytes().len(), reading);
        if !known {
            self.make((frame.source(), content), reading.present);
            self.see_kind(&reading.sample);
        }
        let correct = reading.valid != Axes::NONE && (known || self.corrector.channels.is(content));
        let mut saturated = Axes::NONE;
        match self.corrector.correction.get_mut() {
            Some(Correction { compensator, state }) if correct => {
                let output = self.corrector.channels.current();
                let early = !KNOWN && self.config.lines().cut_through;
                let (sample, over) = compensator.corrected(state, output, &reading.sample, early);
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
        if let Some(Correction { compensator, state }) = self.corrector.correction.get_mut()
            && correct
        {
            let output = self.corrector.channels.current();
            compensator.anticipate(state, output, &reading.sample, reading.valid);
        }
        self.blackbox.left(frame.bytes());
        // the frame has left: no work is urgent until the next one is complete
        let configuration = self.health.has(fault::OUTPUT_FULL | fault::SATURATED);
        if configuration || !sent || saturated != Axes::NONE {
            self.health.sent_with(sent, saturated);
        }
        self.health.counters.frames.add(1);
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

    /// `change` for any frame.
    #[inline(never)]
    fn change_any(&self, frame: &mut Checked, sample: &RawSample) -> Axes {
        self.change(frame, sample)
    }

    /// A frame that is changed gets the mark of our own fault.
    fn marks(&self) -> bool {
        self.config.mark && self.health.has(fault::NETWORK) && !self.observes_only()
    }
}

/// Gives the learner the settings of its unit. It then begins from the datasheet. What it knew of
/// the unit stays if it is the same unit. What it has learnt since is dropped and not remembered:
/// the drive goes on, and what one turn-on shows would count twice.
#[inline(never)]
pub(super) fn configure(learner: &mut Port, same_unit: bool, config: &Config) {
    if let Some(configuration) = &config.configuration {
        learner.restart_learner(RestartReason::Configured {
            settings: Settings::of(configuration),
            same_unit,
        });
    }
}

/// Reads any frame.
#[inline(never)]
fn reading_of(frame: &Checked) -> Option<Reading> {
    frame.reading()
}
