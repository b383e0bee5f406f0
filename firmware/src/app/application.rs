//! The application: what runs in one pass of the frame path.

mod aged;
mod blackbox;
mod detected;
mod health_check;
mod integrity;
mod links;
mod parts;
mod power_on;
mod reconfigure;
mod sampled;
mod sensor;
mod service;
mod start_up;
mod updating;

use super::config::Config;
use super::flow::{Flow, Pending, configure};
use super::job::{Done, Job};
use super::lines::Lines;
use super::phase::{Machine, Phase};
use super::reverse::Reverse;
use super::server::wear::digest;
use super::server::{self, InitialState, Renewal, Server};
use crate::compensator::Block;
use crate::configuration::SerialLines;
use crate::configuration::record::{self, Record};
use crate::fix::Fix;
use crate::learn::exchange::{Answer, Background, Exchange};
use crate::learn::{Learner, Report, Solution, Trials};
use crate::link::cut::Behind;
use crate::link::{Clock, Line};
use crate::model::Nets;
use crate::store::{self, Content, Progress, Step};
use crate::wire::adis::{self, uart};
use crate::wire::command::key::Key;
use crate::wire::command::{Counters, fault};
use crate::wire::{Checked, Error};

use parts::{Commands, Gnss, SensorLink, SpiSensor, Upkeep};

/// Most bytes taken from a line in one pass.
const PIECE: usize = 64;

/// The command link and the receiver wait no longer than this for a pause between frames,
/// microseconds.
pub const PATIENCE_US: u64 = 20_000;

/// A minute, microseconds.
const MINUTE_US: u64 = 60_000_000;

/// The application.
#[derive(Debug)]
pub struct App<'m> {
    machine: Machine,
    /// The flow from frames to the output stream.
    flow: Flow<'m>,
    link: SensorLink,
    spi: SpiSensor,
    reverse: Reverse,
    commands: Commands,
    gnss: Gnss,
    upkeep: Upkeep,
    /// Lines that the board must reopen.
    to_open: Option<SerialLines>,
    /// Time at which the command link and the receiver were last served, microseconds.
    served_us: u64,
}

impl<'m> App<'m> {
    /// An application by its configuration. The first [`App::poll`] starts it.
    pub fn new(config: Config) -> App<'m> {
        App::with_learner(config, None)
    }

    /// An application with a learner, for mode learn. Not inlined, so that it is on the caller's
    /// stack once.
    #[inline(never)]
    pub fn with_learner(config: Config, learner: Option<&'m mut dyn Learner>) -> App<'m> {
        let record = config
            .configuration
            .as_ref()
            .map(record::encode)
            .unwrap_or_default();
        let stored = config.store && !record.is_empty();
        let mut app = App::blank();
        app.begin(config, InitialState::record(record, stored), learner);
        app
    }

    /// An application before power-on, without a store, a learner or a configuration.
    /// [`App::boot`] follows, in the place where it stays: it is too large to be on the stack
    /// twice.
    #[must_use]
    #[inline(never)]
    pub fn blank() -> App<'m> {
        App {
            machine: Machine::new(),
            link: SensorLink::new(None),
            flow: Flow::blank(),
            spi: SpiSensor::default(),
            reverse: Reverse::default(),
            commands: Commands::new(InitialState::record(Record::new(), false)),
            gnss: Gnss::new(None),
            upkeep: Upkeep::default(),
            to_open: None,
            served_us: 0,
        }
    }

    /// The state at power-on of one that is [`App::blank`].
    #[inline(never)]
    fn begin(&mut self, config: Config, held: InitialState, learner: Option<&'m mut dyn Learner>) {
        self.flow.learning.attach(learner);
        configure(&mut self.flow.learning.port, true, &config);
        self.upkeep.as_recorded = App::agree(&config, &held.record);
        self.to_open = Some(config.lines()).filter(|lines| *lines != SerialLines::DEFAULT);
        self.link = SensorLink::new(config.format);
        self.commands.server = Server::new(held);
        self.gnss.restart(config.receiver());
        self.flow.pending = Pending::new(config.store && config.configuration.is_some());
        self.flow.set_config(config);
    }

    /// State of the state machine.
    pub fn phase(&self) -> Phase {
        self.machine.phase()
    }

    /// Counters since power-on.
    pub fn counters(&self) -> Counters {
        server::counters(&self.flow, &self.machine)
    }

    /// Faults in force: bits of [`fault`]; those of the board included.
    pub fn faults(&self) -> u32 {
        server::faults(&self.flow, &self.machine)
    }

    /// The latest fix that the receiver vouches for.
    pub fn fix(&self) -> Option<&Fix> {
        self.gnss.fix.as_ref()
    }

    /// The correction in force: rad/s, m/s2.
    pub fn correction(&self) -> [[f32; 3]; 2] {
        self.flow.corrector.estimate()
    }

    /// The latest block and the networks' output for it.
    pub fn block(&self) -> Option<&Block> {
        self.flow.corrector.block.as_ref()
    }

    /// The learner's report.
    pub fn learning(&self) -> Report {
        self.flow.learning.report()
    }

    /// Solution of the learner's navigator; `None` while it does not navigate.
    pub fn solution(&self) -> Option<Solution> {
        self.flow.learning.solution()
    }

    /// State of the learner's hypotheses; `None` where it has none.
    pub fn trials(&self) -> Option<Trials> {
        self.flow.learning.trials()
    }

    /// The learner's answer to the block before the last one; `None` before the first one.
    pub fn answer(&self) -> Option<&Answer> {
        self.flow.learning.answer()
    }

    /// The weights learnt, by [`App::answer`].
    pub fn learnt(&self) -> Option<Nets> {
        self.answer().map(|answer| answer.learnt.0)
    }

    /// From now on the learner is not run within [`App::poll`], but by [`Background::turn`], at a
    /// lower priority than that of [`App::poll`]. `None`: there is no learner, or this has been
    /// done.
    pub fn split(&mut self, exchange: &'m mut Exchange) -> Option<Background<'m>> {
        self.flow.learning.port.split(exchange)
    }

    /// The networks in use.
    pub fn nets(&self) -> &Nets {
        &self.flow.config.nets
    }

    /// Whether [`App::job`] has something to do.
    pub fn wants_to_store(&self) -> bool {
        let of_old = self.commands.server.updates.is_on_trial(); // what it could not read
        self.flow.pending.is_due() && !self.commands.storing && !of_old
    }

    /// Whether the record may be stored in a way that halts the processor for long, as erasing
    /// flash does. If not, samples are being corrected, and none may be lost.
    pub fn may_halt(&self) -> bool {
        self.flow.pending.commanded
    }

    /// Hands what is to be stored to `save` and a step of how ([`crate::store::Store::carry_out`]),
    /// which gives how far it is. To be called in every pass while [`App::wants_to_store`], where
    /// the learner runs within [`App::poll`].
    pub fn store<P: Into<Progress>>(&mut self, save: impl FnOnce(Step, &Content) -> P) {
        if let Some(job) = self.job() {
            let content = job.content(self.flow.learning.port.learner());
            let progress = save(job.step, &content).into();
            self.stored(&job.done(progress));
        }
    }

    /// A job was given, and [`App::stored`] has not followed.
    pub fn is_storing(&self) -> bool {
        self.commands.storing
    }

    /// The next record to store: the weights for the next power-on, the configuration record in
    /// use, and the learner's memory. The weights are those in use, or those learnt for the next
    /// power-on that have proved themselves. [`App::stored`] must follow, before there is another
    /// job.
    pub fn job(&mut self) -> Option<Job> {
        if !self.wants_to_store() {
            return None;
        }
        self.commands.storing = true;
        let flow = &self.flow;
        Some(Job {
            step: flow.pending.step(),
            nets: *flow.pending.nets(&flow.config.nets),
            record: self.commands.server.record.clone(),
            remembers: flow.memory_to_store(),
            unit: flow.config.configuration.as_ref().map_or(0, store::unit),
            minutes: (self.served_us / MINUTE_US) as u32, // 8000 years
            key: self.commands.server.guard.key,
            edition: flow.pending.edition,
        })
    }

    /// Reports the progress of the job.
    pub fn stored(&mut self, done: &Done) {
        let &Done {
            step,
            edition,
            progress,
        } = done;
        self.commands.storing = false;
        let flow = &mut self.flow;
        // something else is to be stored by now, from the beginning
        let overtaken = match step {
            Step::Begin | Step::GoOn => flow.pending.commanded,
            Step::Save | Step::Renew => false,
        };
        if overtaken || edition != flow.pending.edition && !flow.pending.commanded {
            return;
        }
        let last = flow.pending.is_last_renewal();
        let done = match (progress, step) {
            (Progress::GoesOn, Step::Renew) => !last,
            (Progress::GoesOn, _) => {
                flow.pending.begun = true;
                return;
            }
            (progress, _) => progress == Progress::Done,
        };
        if step == Step::Renew && (last || !done) {
            flow.config.store_faults.other_key = !done;
        }
        let record = &self.commands.server.record;
        if flow.pending.commanded {
            self.commands.server.stored = done && !record.is_empty();
            flow.pending.config_stored = self.commands.server.stored;
        }
        let known = done && flow.pending.commanded;
        let key = &self.commands.server.guard.key;
        let nets = flow.pending.nets(&flow.config.nets);
        let held = known.then(|| digest(nets, record, key));
        self.commands.server.wear.holds(held);
        flow.pending.stored(done);
        self.flow.config.store_faults.unread &= !done;
        self.flow.health.flag(fault::STORE, !done);
    }

    /// The key in use, to be stored.
    pub fn key(&self) -> &Key {
        &self.commands.server.guard.key
    }

    /// The key that the store holds, before the first pass.
    pub fn set_key(&mut self, key: Key) {
        self.commands.server.guard.key = key;
    }

    /// Random bytes of the board, for the challenges of the command link. A board without a random
    /// number generator has none to give.
    pub fn seed(&mut self, random: [u8; 32]) {
        self.commands.server.guard.seed(random);
    }

    /// Gives the memory of the unit in the store ([`crate::store::Store::memory`]), before the
    /// first pass. It is used if it belongs to the configured unit.
    pub fn recall(&mut self, memory: &[u8]) {
        self.flow.recall(memory);
    }

    /// Settings with which the board must reopen the lines of the sensor, the navigation computer
    /// and the receiver. Given once, when a configuration asks for other lines than those in use. A
    /// board opens [`SerialLines::DEFAULT`] at start.
    pub fn to_open(&mut self) -> Option<SerialLines> {
        self.to_open.take()
    }

    /// A burst of an ADIS that the board has just fetched over SPI (`wire::adis::spi`). It takes
    /// the place of the sensor's line: its corrected reply goes to `out` at once. [`App::poll`],
    /// which the board calls afterwards, still serves the clock and the other lines.
    ///
    /// # Errors
    /// What is wrong with the reply, which is then counted and not sent; [`Error::Content`] when no
    /// ADIS is configured.
    pub fn burst(
        &mut self,
        reply: &mut [u8],
        out: &mut impl Line,
        clock: &impl Clock,
    ) -> Result<(), Error> {
        let configuration = self.flow.config.sensor.adis.ok_or(Error::Content)?;
        let done = self.corrected_burst(&configuration, reply, out, clock);
        self.note_state(); // with the burst, and not with what comes on the sensor's line next
        done
    }

    fn corrected_burst(
        &mut self,
        configuration: &adis::Settings,
        reply: &mut [u8],
        out: &mut impl Line,
        clock: &impl Clock,
    ) -> Result<(), Error> {
        let now = clock.now_us();
        self.flow.blackbox.burst(now, reply);
        self.heard(now);
        self.link.sampled_us = now;
        if self.machine.phase() == Phase::Start {
            self.start(out, now);
        }
        let mut buffer = [0; uart::LONGEST];
        let leaving = configuration.leaving(reply, now as u32, &mut buffer);
        if let (Phase::Fault(_), Ok(bytes)) = (self.machine.phase(), &leaving) {
            self.raw(bytes, &mut Behind::nothing(out));
            return Ok(());
        }
        match leaving.and_then(|bytes| Checked::burst(configuration, bytes)) {
            Ok(frame) => {
                self.flow.frame(frame, &mut Behind::nothing(out));
                self.flow.health.flag(fault::UNKNOWN_FORMAT, false);
            }
            Err(error) => {
                self.flow.health.counters.bad_checksums.add(1);
                self.flow.gap();
                return Err(error);
            }
        }
        self.after_frames(out);
        Ok(())
    }

    /// The receiver's time pulse has risen at this time of the board's clock, microseconds. The age
    /// of the fixes then follows from it: see [`Fix::age`]. Without effect unless the configuration
    /// says that the pulse is wired. To be called before the next [`App::poll`].
    pub fn pulse(&mut self, at_us: u64) {
        let configuration = self.flow.config.configuration.as_ref();
        if configuration.is_some_and(|configuration| configuration.receiver.pulse) {
            let pulses = &mut self.flow.receiver_status.pulses;
            *pulses = pulses.saturating_add(1);
            if let Some(second) = self.gnss.pulse.rose(at_us) {
                self.flow.clock.pulse(second, at_us);
            }
        }
    }

    /// How many bytes of the sensor the next pass needs to find work on its line, at least 1. Fewer
    /// bytes need not wake a board. The clock and the other lines must.
    pub fn needs(&self) -> usize {
        match self.machine.phase() {
            Phase::Run(_) if !self.is_at_spi() => self.link.framer.needs(),
            _ => 1,
        }
    }

    /// One pass. True: there may be more work, call again at once. False: sleep until the next
    /// interrupt.
    pub fn poll<S: Line, N: Line, C: Line, G: Line>(
        &mut self,
        lines: &mut Lines<S, N, C, G>,
        clock: &impl Clock,
    ) -> bool {
        let now = clock.now_us();
        self.flow.blackbox.pass(now);
        if self.flow.health.load.look(now, clock) {
            self.look_for_frames(now);
            self.upkeep.due = true;
        }
        if !self.link.framer.is_intact() {
            self.reset_framer();
        }
        if self.machine.phase() == Phase::Start {
            self.start(&mut lines.navigation, now);
        }
        let before = self.link.taken;
        let more = if lines.sensor.is_idle() {
            self.watch_silence(now, &mut lines.navigation);
            false
        } else {
            self.receive(&mut lines.sensor, &mut lines.navigation, now)
        };
        (self.flow).watch_rate(now, matches!(self.machine.phase(), Phase::Run(_)));
        lines.navigation.poll();
        lines.sensor.poll();
        lines.command.poll();
        // frames go first, but the other links do not wait for ever
        // a line that never says that it is idle may have had none
        let took = self.link.taken != before;
        let pause = self.link.framer.pending() == 0 && !is_within(&mut lines.navigation) && !took;
        let waited = now.saturating_sub(self.served_us) >= PATIENCE_US;
        let busy = if pause || waited {
            self.served_us = now;
            self.serve_links(lines, now)
        } else {
            took && self.links_wait(lines, now)
        };
        self.note_pass(now);
        more || busy
    }

    /// Whether the other links need a pass of their own before the next frame:
    /// [`Self::serve_links`].
    #[inline(always)]
    fn links_wait<S: Line, N: Line, C: Line, G: Line>(
        &self,
        lines: &Lines<S, N, C, G>,
        now: u64,
    ) -> bool {
        self.upkeep.due
            || self.commands.server.renewal != Renewal::None
            || self.commands.server.is_waiting()
            || !self.commands.unread.is_empty()
            || !self.reverse.rests(&self.flow)
            || self.gnss.receiver.is_due(now)
            || !lines.navigation.is_idle()
            || !lines.command.is_idle()
            || !lines.gnss.is_idle()
    }

    /// Bytes back to the sensor, and one turn of what else is not urgent: a configuration that was
    /// taken, the receiver, the look once a second, a request. True: there may be more.
    #[inline(never)]
    fn serve_links<S: Line, N: Line, C: Line, G: Line>(
        &mut self,
        lines: &mut Lines<S, N, C, G>,
        now: u64,
    ) -> bool {
        self.flow.take_reply();
        let back = self.back(&mut lines.navigation, &mut lines.sensor, now);
        if self.commands.server.renewal != Renewal::None {
            self.renew(&mut lines.navigation, &mut lines.command, now);
            return true;
        }
        let gnss = !lines.gnss.is_idle() || self.gnss.receiver.is_due(now);
        if gnss && self.gnss(&mut lines.gnss, now) {
            return true;
        }
        if core::mem::take(&mut self.upkeep.due) {
            let (sample, at_us) = (self.flow.sample(), self.link.sampled_us);
            self.flow.clock.sample(sample, at_us);
            self.scrub(&mut lines.navigation, now);
            return true;
        }
        self.command(&mut lines.command, now) || back
    }
}

/// Whether a frame that is cut through is under way.
#[inline(always)]
fn is_within(navigation: &mut impl Line) -> bool {
    let mut within = false;
    navigation.cut(&mut |cut| within = cut.is_within());
    within
}
