//! The learner's side of the flow: what it receives, and when a promoted hypothesis corrects the
//! samples.

use super::{Correction, Flow};
use crate::app::config::Activation;
use crate::compensator::Block;
use crate::control::{Alignment, Mode, Reason, Window};
use crate::fix::{Fix, Heading};
use crate::learn::exchange::{Anew, Answer, Order, Reply};
use crate::learn::{Known, Report, Solution, Trials};
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

impl Flow<'_> {
    /// In mode learn: what was learnt comes into force where an alignment allows it and goes when
    /// it is given up; or it is kept for the next power-on.
    pub(super) fn promote(&mut self, block: &Block) {
        let live = self.mode == Mode::Learn && self.config.activation == Activation::Faded;
        let follows = self.fixes_come() && !self.learner.is_stopped();
        let hold = live && self.promoted && !self.disagrees && !follows;
        if let Some(correction) = self.correction.get_mut() {
            correction.state.hold = hold;
        }
        if self.mode != Mode::Learn || self.disagrees {
            return;
        }
        let correction = self.correction.get();
        let block_s = correction.map(|c| c.compensator.scale().block_s());
        self.keep(block, block_s.unwrap_or_default());
        if self.config.activation == Activation::NextPowerOn {
            return;
        }
        let answer = self.learner.answer();
        let still_s = answer.map_or(0, |answer| answer.still_s);
        let given_up = answer.is_some_and(|answer| answer.winner.is_none());
        if still_s < STANDS_S {
            self.stood = false;
        }
        if self.alignment == Some(Alignment::Started) {
            return;
        }
        let stands = still_s >= STANDS_S && !self.stood;
        match (self.config.activation, self.fix_shows_standstill()) {
            // where alignments are reported, a standstill is none
            (Activation::Standstill, Some(true)) if stands => {
                self.stood = true;
                self.activate(self.alignment.is_none());
            }
            // even samples alone may be a smooth ride: nothing may jump then
            (Activation::Standstill, None) if stands => self.activate(false),
            (Activation::Faded, _) if self.fixes_come() => self.activate(false),
            _ if self.promoted && given_up => self.activate(false),
            _ => {}
        }
    }

    /// Whether fixes come, so that the navigation computer can follow a correction that moves.
    /// While it navigates without them, a correction in force does not move: what it took off
    /// before is in the computer's attitude.
    fn fixes_come(&self) -> bool {
        let rate = self.stream.map_or(0.0, |stream| stream.rate);
        self.stands.is_some_and(|(_, sample)| {
            self.sample.wrapping_sub(sample) as f64 <= FIXES_COME_S * rate
        })
    }

    /// Whether the newest fix shows that the vehicle stands; `None`: it is too old, or there is
    /// none.
    fn fix_shows_standstill(&self) -> Option<bool> {
        let (stands, sample) = self.stands?;
        let samples = self.sample.wrapping_sub(sample);
        let rate = self.stream.map_or(0.0, |stream| stream.rate);
        (samples as f64 <= FIX_LASTS_S * rate).then_some(stands)
    }

    /// Takes the networks of the promoted hypothesis instead of those in use, or the zero
    /// correction when there is none; at once, or no faster than the slew limit. What has not
    /// settled does not come into force, and what is in force stays then.
    pub(super) fn activate(&mut self, at_once: bool) {
        let answer = self.learner.answer().filter(|_| !self.disagrees);
        let (Some(answer), Some(Correction { compensator, state })) =
            (answer, self.correction.get_mut())
        else {
            return; // where the learner has not answered yet, what is in force stays
        };
        match answer.winner {
            Some(winner) if winner.settled => {
                (self.promoted, self.learner_nets) = (true, true);
                state.off = false;
                compensator.exchange(state, winner.nets, winner.states);
                // the block that they have not seen
                let output = match &self.block {
                    Some(block) => compensator.step_again(state, block),
                    None => winner.estimate,
                };
                if at_once {
                    compensator.force(state, &output);
                }
            }
            Some(_) if self.promoted => {}
            _ => {
                self.promoted = false;
                state.off = true;
                if at_once {
                    compensator.force(state, &[[0.0; 3]; 2]);
                }
            }
        }
    }

    /// Samples pass through unchanged, or soon will, but the networks step.
    pub(super) fn observes_only(&self) -> bool {
        let live = self.mode == Mode::Learn && !self.acts_from_power_on();
        self.disagrees || self.mode == Mode::Shadow || live && !self.promoted
    }

    /// Whether there is a learner.
    pub fn can_learn(&self) -> bool {
        self.learner.exists()
    }

    /// In modes learn and shadow the learner begins when the stream or the networks are new to it.
    /// From then on it follows in every mode.
    pub(super) fn teach(&mut self) {
        let Some(correction) = self.correction.get().filter(|_| self.learner.exists()) else {
            return;
        };
        let stream = Some(correction.compensator.scale());
        if self.begun != stream {
            let learns = matches!(self.mode, Mode::Shadow | Mode::Learn) && !self.disagrees;
            self.begun = stream.filter(|_| learns);
            if let Some(stream) = self.begun {
                self.keep.memo.drop_new();
                (self.learner).begin_anew(Anew::Begin(self.config.nets, stream));
            }
        }
    }

    /// A reference of the navigation computer. [`Flow::verdict`] follows.
    pub fn reference(&mut self, window: &Window) -> Result<(), Reason> {
        if !self.can_learn() {
            return Err(Reason::NotAvailable);
        }
        if self.mode != Mode::Learn {
            return Err(Reason::Mode);
        }
        self.ask(&Order::Reference(*window))
    }

    /// A heading that somebody knows, for the learner's alignment in progress. [`Flow::verdict`]
    /// follows.
    pub fn heading(&mut self, heading: Heading) -> Result<(), Reason> {
        self.ask(&Order::Heading(heading))
    }

    fn ask(&mut self, order: &Order) -> Result<(), Reason> {
        if self.disagrees || self.begun.is_none() {
            return Err(Reason::NotAvailable);
        }
        self.learner.hand_over(order);
        Ok(())
    }

    /// What the learner says to a reference or a heading, once it has: `None` before.
    pub fn verdict(&mut self) -> Option<Result<(), Reason>> {
        self.take_reply();
        if self.learner.is_stopped() {
            return Some(Err(Reason::NotAvailable));
        }
        self.verdict.take()
    }

    /// Takes what the learner has replied.
    pub fn take_reply(&mut self) {
        self.learner.look();
        match self.learner.reply() {
            Some(Reply::Verdict(verdict)) => self.verdict = Some(verdict),
            Some(Reply::Remembered(len)) => self.remembers(len),
            None if self.learner.is_stopped() => self.keep.memo.give_up(),
            None => {}
        }
    }

    /// Number of the last sample, modulo 2^32.
    pub fn sample(&self) -> u32 {
        self.sample as u32
    }

    /// A good fix of the receiver.
    pub fn fix(&mut self, fix: &Fix) {
        self.blackbox.fix(fix.time_ms);
        if fix.has(0..2) {
            self.latitude = Some(fix.position.latitude);
        }
        if let Some((speed, sigma)) = fix.speed() {
            self.judge_speed(speed, sigma);
            let stands = speed < (FIX_SIGMAS * sigma).min(FIX_SPEED);
            self.stands = Some((stands, self.sample));
        }
        if self.begun.is_some() {
            (self.learner).hand_over(&Order::Fix(self.sample as u32, *fix));
        }
    }

    /// The learner's answer to the block before the last one, once it has had one.
    pub fn answer(&self) -> Option<&Answer> {
        self.learner.answer().filter(|_| self.begun.is_some())
    }

    /// Uses the weights learnt. Their networks have seen the same blocks but the last one, so that
    /// no state is reset.
    #[inline(never)]
    pub fn commit_learnt(&mut self) -> Result<(), Reason> {
        let (nets, states) = self.answer().ok_or(Reason::NotAvailable)?.learnt;
        self.take_nets(nets);
        self.note_nets();
        self.keep.forget_next();
        self.flag(fault::WEIGHTS, false);
        self.failures = 0;
        self.learner_nets = false;
        let off = self.is_off();
        if let Some(Correction { compensator, state }) = self.correction.get_mut() {
            compensator.exchange(state, nets, states);
            if let Some(block) = &self.block {
                compensator.step_again(state, block);
            }
            state.off = off;
        }
        Ok(())
    }

    /// The learner's report.
    pub fn report(&self) -> Report {
        self.learner
            .view()
            .map(|view| view.report)
            .unwrap_or_default()
    }

    /// [`Report::antenna`] alone.
    pub fn antenna(&self) -> Known {
        self.report().antenna
    }

    /// What the learner's navigator knows.
    pub fn solution(&self) -> Option<Solution> {
        self.learner.view()?.solution
    }

    /// How the learner's hypotheses stand.
    pub fn trials(&self) -> Option<Trials> {
        self.learner.view()?.trials
    }

    /// The estimates of the networks in use and of the learner.
    pub fn estimate(&self) -> Estimate {
        let Report {
            window,
            estimate,
            used,
            doubted,
            ..
        } = self.report();
        let correction = self.correction.get();
        Estimate {
            sample: self.sample(),
            counter: self.last.counter(),
            window,
            in_force: correction.map_or([[0.0; 3]; 2], |c| c.state.estimate()),
            network_output: self
                .block
                .map_or([[0.0; 3]; 2], |block| block.network_output),
            learnt: estimate,
            used,
            doubted,
        }
    }
}
