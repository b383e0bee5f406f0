//! The learner's side of the flow: what it receives, and when a promoted hypothesis corrects the
//! samples.

use super::{Correction, Flow, configure};
use crate::app::config::Activation;
use crate::compensator::Block;
use crate::control::{Alignment, Mode, Reason, Window};
use crate::fix::{Fix, Heading};
use crate::learn::exchange::{Answer, Order, Port, Reply, RestartReason};
use crate::learn::{Learner, Report, Solution, Trials};
use crate::sample::StreamScale;
use crate::wheels::WheelSpeed;
use crate::wire::command::{Estimate, fault};

/// Standstill that counts as an alignment where none is reported, s.
pub(super) const STANDS_S: u32 = 3;
/// A fix shows a standstill if its speed is less than so many of its standard deviations, and less
/// than this, m/s. It does so for this time, s.
const FIX_SIGMAS: f32 = 5.0;
const FIX_SPEED: f32 = 0.1;
const FIX_LASTS_S: f64 = 2.0;
/// Fixes come when the newest one is no older than this, s.
const FIXES_COME_S: f64 = 5.0;

/// The learner, as the frame path sees it.
#[derive(Debug)]
pub(in crate::app) struct Learning<'m> {
    pub port: Port<'m>,
    /// The stream that the learner was begun for; `None`: it must restart.
    begun: Option<StreamScale>,
    /// Number of the last reference or heading, modulo 256, and the learner's verdict on it.
    question: u8,
    verdict: Option<Result<(), Reason>>,
}

impl<'m> Learning<'m> {
    /// No learner yet.
    pub fn new() -> Learning<'m> {
        Learning {
            port: Port::NONE,
            begun: None,
            question: 0,
            verdict: None,
        }
    }

    /// Number of a new question. A verdict on an older one, which nobody waits for, is dropped.
    fn next_question(&mut self) -> u8 {
        (self.question, self.verdict) = (self.question.wrapping_add(1), None);
        self.question
    }

    /// A learner that has not begun yet, to be run at once.
    #[inline(never)]
    pub fn attach(&mut self, learner: Option<&'m mut dyn Learner>) {
        self.port = Port::here(learner);
    }

    /// The answer to the last block but one comes into force. By itself, so that its stack is free
    /// again afterwards.
    #[inline(never)]
    pub fn end_block(&mut self) {
        self.port.end_block();
    }

    /// The learner begins again with the next stream.
    pub fn restart(&mut self) {
        (self.begun, self.verdict) = (None, None);
    }

    /// The learner begins again with the next stream, but still owes its verdict.
    pub fn end(&mut self) {
        self.begun = None;
    }

    /// The stream that the learner was begun for.
    pub fn begun(&self) -> Option<StreamScale> {
        self.begun
    }

    /// The learner follows the stream.
    #[inline(always)]
    pub fn follows(&self) -> bool {
        self.begun.is_some()
    }

    /// Whether there is a learner.
    pub fn exists(&self) -> bool {
        self.port.exists()
    }

    /// The learner's answer to the block before the last one, once it has had one.
    pub fn answer(&self) -> Option<&Answer> {
        self.port.answer().filter(|_| self.follows())
    }

    /// The learner's report.
    pub fn report(&self) -> Report {
        self.port.view().map(|view| view.report).unwrap_or_default()
    }

    /// Solution of the learner's navigator.
    pub fn solution(&self) -> Option<Solution> {
        self.port.view()?.solution
    }

    /// State of the learner's hypotheses.
    pub fn trials(&self) -> Option<Trials> {
        self.port.view()?.trials
    }
}

impl Flow<'_> {
    /// In mode learn: learnt networks come into force where an alignment allows it, and go when
    /// they are given up; or they are stored for the next power-on.
    pub(super) fn promote(&mut self, block: &Block) {
        let live = self.session.mode == Mode::Learn && self.config.activation == Activation::Faded;
        let follows = self.fixes_come() && !self.learning.port.is_stopped();
        let hold = live && self.session.promoted && !self.health.disagrees && !follows;
        if let Some(correction) = self.corrector.correction.get_mut() {
            correction.state.hold = hold;
        }
        if self.session.mode != Mode::Learn || self.health.disagrees {
            return;
        }
        let correction = self.corrector.correction.get();
        let block_s = correction.map(|c| c.compensator.scale().block_s());
        self.retain(block, block_s.unwrap_or_default());
        match self.config.activation {
            Activation::NextPowerOn => return,
            Activation::FirstRest => return self.correct_at_rest(block_s.unwrap_or_default()),
            Activation::Commanded | Activation::Standstill | Activation::Faded => {}
        }
        let answer = self.learning.port.answer();
        let still_s = answer.map_or(0, |answer| answer.still_s);
        let given_up = answer.is_some_and(|answer| answer.winner.is_none());
        if still_s < STANDS_S {
            self.session.stood = false;
        }
        if self.session.alignment == Some(Alignment::Started) {
            return;
        }
        let stands = still_s >= STANDS_S && !self.session.stood;
        match (self.config.activation, self.fix_shows_standstill()) {
            // where alignments are reported, a standstill is none
            (Activation::Standstill, Some(true)) if stands => {
                self.session.stood = true;
                self.activate(self.session.alignment.is_none());
            }
            // even samples alone may be a smooth ride: nothing may jump then
            (Activation::Standstill, None) if stands => self.activate(false),
            (Activation::Faded, _) if self.fixes_come() => self.activate(false),
            _ if self.session.promoted && given_up => self.activate(false),
            _ => {}
        }
    }

    /// Whether fixes come, so that the navigation computer can follow a correction that moves.
    /// While it navigates without them, a correction in force does not move: what it took off
    /// before is in the computer's attitude.
    fn fixes_come(&self) -> bool {
        self.session.stands.is_some_and(|(_, sample)| {
            self.continuity.sample.wrapping_sub(sample) as f64
                <= FIXES_COME_S * self.corrector.rate()
        })
    }

    /// Whether the newest fix shows that the vehicle stands; `None`: it is too old, or there is
    /// none.
    fn fix_shows_standstill(&self) -> Option<bool> {
        let (stands, sample) = self.session.stands?;
        let samples = self.continuity.sample.wrapping_sub(sample);
        (samples as f64 <= FIX_LASTS_S * self.corrector.rate()).then_some(stands)
    }

    /// Takes the networks of the promoted hypothesis instead of those in use, or the zero
    /// correction when there is none; at once, or no faster than the slew limit.
    pub(super) fn activate(&mut self, at_once: bool) {
        let answer = self
            .learning
            .port
            .answer()
            .filter(|_| !self.health.disagrees);
        let (Some(answer), Some(Correction { compensator, state })) =
            (answer, self.corrector.correction.get_mut())
        else {
            return; // where the learner has not answered yet, what is in force stays
        };
        match answer.winner {
            Some(winner) => {
                (self.session.promoted, self.session.learner_nets) = (true, true);
                state.off = false;
                compensator.exchange(state, winner.nets, winner.states);
                // the block that they have not processed
                let output = match &self.corrector.block {
                    Some(block) => compensator.step_again(state, block),
                    None => winner.estimate,
                };
                if at_once {
                    compensator.force(state, &output);
                }
            }
            None => {
                self.session.promoted = false;
                state.off = true;
                if at_once {
                    compensator.force_zero(state);
                }
            }
        }
    }

    /// Samples pass through unchanged, or soon will, but the networks step.
    pub(super) fn observes_only(&self) -> bool {
        let live = self.session.mode == Mode::Learn
            && !(self.session).acts_from_power_on(self.config.activation);
        self.health.disagrees || self.session.mode == Mode::Shadow || live && !self.session.promoted
    }

    /// In modes learn and shadow the learner begins when the stream or the networks are new to it.
    /// From then on it follows in every mode.
    pub(super) fn teach(&mut self) {
        let Some(correction) = self
            .corrector
            .correction
            .get()
            .filter(|_| self.learning.exists())
        else {
            return;
        };
        let stream = Some(correction.compensator.scale());
        if self.learning.begun != stream {
            let learns =
                matches!(self.session.mode, Mode::Shadow | Mode::Learn) && !self.health.disagrees;
            self.learning.begun = stream.filter(|_| learns);
            if let Some(stream) = self.learning.begun {
                self.pending.unit_memory.drop_new();
                self.restart_learner(RestartReason::Begin(self.config.nets, stream));
            }
        }
    }

    /// Restarts the learner; one that has missed a configuration gets it before.
    pub(super) fn restart_learner(&mut self, reason: RestartReason) {
        if self.learning.port.owes_configuration() {
            configure(&mut self.learning.port, true, &self.config);
        }
        self.learning.port.restart_learner(reason);
    }

    /// A reference of the navigation computer. [`Flow::verdict`] follows.
    pub fn reference(&mut self, window: &Window) -> Result<(), Reason> {
        if !self.learning.exists() {
            return Err(Reason::NotAvailable);
        }
        if self.session.mode != Mode::Learn {
            return Err(Reason::Mode);
        }
        let number = self.learning.next_question();
        self.ask(&Order::Reference(number, *window))
    }

    /// A heading that somebody knows, for the learner's alignment in progress. [`Flow::verdict`]
    /// follows.
    pub fn heading(&mut self, heading: Heading) -> Result<(), Reason> {
        let number = self.learning.next_question();
        self.ask(&Order::Heading(number, heading))
    }

    /// Speed by the wheels.
    pub fn wheel_speed(&mut self, speed: WheelSpeed) -> Result<(), Reason> {
        let configured = self.config.configuration.as_ref();
        if configured.is_none_or(|configuration| configuration.wheels.is_none()) {
            return Err(Reason::NotConfigured);
        }
        if !speed.is_plausible() {
            return Err(Reason::Range);
        }
        self.ask(&Order::WheelSpeed(self.sample(), speed))
    }

    fn ask(&mut self, order: &Order) -> Result<(), Reason> {
        if self.health.disagrees || !self.learning.follows() {
            return Err(Reason::NotAvailable);
        }
        self.learning.port.hand_over(order);
        Ok(())
    }

    /// Verdict of the learner on a reference or a heading; `None` until it has given one.
    pub fn verdict(&mut self) -> Option<Result<(), Reason>> {
        self.take_reply();
        if self.learning.port.is_stopped() {
            return Some(Err(Reason::NotAvailable));
        }
        self.learning.verdict.take()
    }

    /// Takes what the learner has replied.
    pub fn take_reply(&mut self) {
        self.learning.port.look();
        match self.learning.port.reply() {
            Some(Reply::Verdict(number, verdict)) if number == self.learning.question => {
                self.learning.verdict = Some(verdict);
            }
            Some(Reply::Verdict(..)) => {}
            Some(Reply::Remembered(len)) => self.remembers(len),
            None if self.learning.port.is_stopped() => self.pending.unit_memory.give_up(),
            None => {}
        }
    }

    /// Number of the last sample, modulo 2^32.
    pub fn sample(&self) -> u32 {
        self.continuity.sample as u32
    }

    /// A good fix of the receiver.
    pub fn fix(&mut self, fix: &Fix) {
        self.blackbox.fix(fix.time_ms);
        if fix.has(0..2) {
            self.session.latitude = Some(fix.position.latitude);
        }
        if let Some((speed, sigma)) = fix.speed() {
            self.judge_speed(speed, sigma);
            let stands = speed < (FIX_SIGMAS * sigma).min(FIX_SPEED);
            self.session.stands = Some((stands, self.continuity.sample));
        }
        if self.learning.follows() {
            (self.learning.port).hand_over(&Order::Fix(self.continuity.sample as u32, *fix));
        }
    }

    /// Uses the weights learnt. Their networks have processed the same blocks but the last one, so
    /// that no state is reset.
    #[inline(never)]
    pub fn commit_learnt(&mut self) -> Result<(), Reason> {
        let (nets, states) = self.learning.answer().ok_or(Reason::NotAvailable)?.learnt;
        self.take_nets(nets);
        self.note_nets();
        self.pending.forget_next();
        self.health.flag(fault::WEIGHTS, false);
        self.corrector.forgive();
        self.session.learner_nets = false;
        let off = self.is_off();
        if let Some(Correction { compensator, state }) = self.corrector.correction.get_mut() {
            compensator.exchange(state, nets, states);
            if let Some(block) = &self.corrector.block {
                compensator.step_again(state, block);
            }
            state.off = off;
        }
        Ok(())
    }

    /// The estimates of the networks in use and of the learner.
    pub fn estimate(&self) -> Estimate {
        let Report {
            window,
            estimate,
            used,
            doubted,
            ..
        } = self.learning.report();
        Estimate {
            sample: self.sample(),
            counter: self.continuity.last.counter(),
            window,
            in_force: self.corrector.estimate(),
            network_output: self.corrector.network_output(),
            learnt: estimate,
            used,
            doubted,
        }
    }
}
