//! The learner's side of the flow: what it receives, and when a promoted hypothesis corrects the
//! samples.

use super::{Correction, Flow};
use crate::app::config::Activation;
use crate::compensator::Block;
use crate::control::{Alignment, Mode, Reason, Window};
use crate::fix::{Fix, Heading};
use crate::learn::{Known, Learner, Report, Solution, Trials};
use crate::model::Nets;
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

/// The board's learner, if it has one. `Debug` leaves out the learner's numbers, which would bring
/// the formatting of floats into every image.
pub(in crate::app) struct BoardLearner<'m>(pub Option<&'m mut dyn Learner>);

impl core::fmt::Debug for BoardLearner<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(if self.0.is_some() { "Learner" } else { "None" })
    }
}

impl Flow<'_> {
    /// In mode learn: what was learnt comes into force where an alignment allows it and goes when
    /// it is given up; or it is kept for the next power-on.
    pub(super) fn promote(&mut self, block: &Block) {
        let live = self.mode == Mode::Learn && self.config.activation == Activation::Faded;
        let hold = live && self.promoted && !self.disagrees && !self.fixes_come();
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
        let still_s = (self.learner.0.as_ref()).map_or(0, |learner| learner.still_s());
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
                self.activate(self.alignment.is_none(), Some(block));
            }
            // even samples alone may be a smooth ride: nothing may jump then
            (Activation::Standstill, None) if stands => self.activate(false, Some(block)),
            (Activation::Faded, _) if self.fixes_come() => self.activate(false, Some(block)),
            _ if self.promoted && self.report().winner == 0 => self.activate(false, None),
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
    /// settled does not come into force, and what is in force stays then. `block` is the one that
    /// the learner has not seen yet.
    pub(super) fn activate(&mut self, at_once: bool, block: Option<&Block>) {
        if self.disagrees {
            return;
        }
        let (Some(learner), Some(Correction { compensator, state })) =
            (&mut self.learner.0, self.correction.get_mut())
        else {
            return;
        };
        match learner.winner() {
            Some(winner) if winner.settled => {
                (self.promoted, self.learner_nets) = (true, true);
                state.off = false;
                compensator.exchange(state, winner.nets, winner.states);
                let output = match block {
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
        self.learner.0.is_some()
    }

    /// In modes learn and shadow the learner begins when the stream or the networks are new to it.
    /// From then on it follows in every mode.
    pub(super) fn teach(&mut self) {
        let (Some(learner), Some(correction)) = (&mut self.learner.0, self.correction.get()) else {
            return;
        };
        let stream = Some(correction.compensator.scale());
        if self.begun != stream {
            let learns = matches!(self.mode, Mode::Shadow | Mode::Learn) && !self.disagrees;
            self.begun = stream.filter(|_| learns);
            if let Some(stream) = self.begun {
                self.keep.memo.drop_new();
                learner.begin(&self.config.nets, stream);
            }
        }
    }

    /// A reference of the navigation computer.
    pub fn reference(&mut self, window: &Window) -> Result<(), Reason> {
        let learner = self.learner.0.as_mut().ok_or(Reason::NotAvailable)?;
        if self.mode != Mode::Learn {
            return Err(Reason::Mode);
        }
        if self.disagrees {
            return Err(Reason::NotAvailable);
        }
        learner.reference(window)
    }

    /// Number of the last sample, modulo 2^32.
    pub fn sample(&self) -> u32 {
        self.sample as u32
    }

    /// A heading that somebody knows, for the learner's alignment in progress.
    pub fn heading(&mut self, heading: Heading) -> Result<(), Reason> {
        let learner = self.learner.0.as_mut().filter(|_| self.begun.is_some());
        learner.ok_or(Reason::NotAvailable)?.heading(heading)
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
        if let (Some(learner), Some(_)) = (&mut self.learner.0, self.begun) {
            learner.fix(self.sample as u32, fix);
        }
    }

    /// One part of the learner's deferred work. True: there is more.
    pub fn work(&mut self) -> bool {
        self.learner
            .0
            .as_mut()
            .is_some_and(|learner| learner.work())
    }

    /// The learner has work left, and a request must not make it be done at once.
    pub fn is_busy(&self) -> bool {
        self.ended || (self.learner.0.as_ref()).is_some_and(|learner| learner.is_busy())
    }

    /// The weights learnt and the networks' states.
    pub fn learnt(&mut self) -> Option<(Nets, [lrnn_nostd::State; 2])> {
        self.begun?;
        self.learner.0.as_mut().map(|learner| learner.learnt())
    }

    /// Uses the weights learnt. Their networks have seen the same blocks, so that no state is
    /// reset.
    #[inline(never)]
    pub fn commit_learnt(&mut self) -> Result<(), Reason> {
        let (nets, states) = self.learnt().ok_or(Reason::NotAvailable)?;
        self.take_nets(nets);
        self.note_nets();
        self.keep.forget_next();
        self.flag(fault::WEIGHTS, false);
        self.failures = 0;
        self.learner_nets = false;
        let off = self.is_off();
        if let Some(Correction { compensator, state }) = self.correction.get_mut() {
            compensator.exchange(state, nets, states);
            state.off = off;
        }
        Ok(())
    }

    /// The learner's report.
    pub fn report(&self) -> Report {
        let report = self.learner.0.as_ref().map(|learner| learner.report());
        report.unwrap_or_default()
    }

    /// [`Report::antenna`] alone.
    pub fn antenna(&self) -> Known {
        let known = self.learner.0.as_ref().map(|learner| learner.antenna());
        known.unwrap_or_default()
    }

    /// What the learner's navigator knows.
    pub fn solution(&self) -> Option<Solution> {
        self.learner.0.as_ref()?.solution()
    }

    /// How the learner's hypotheses stand.
    pub fn trials(&self) -> Option<Trials> {
        self.learner.0.as_ref()?.trials()
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
