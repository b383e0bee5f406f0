//! The learner's side of the flow: what it is told, and when what it stands by corrects the words.

use super::{Correction, Flow};
use crate::app::config::Activation;
use crate::compensator::Block;
use crate::control::{Alignment, Mode, Reason, Window};
use crate::fix::Fix;
use crate::learn::{Learner, Report};
use crate::model::Nets;
use crate::wire::command::Estimate;

/// Standstill that counts as an alignment where nobody tells, s.
const STANDS_S: u32 = 3;

/// The board's learner, if it has one. `Debug` leaves out the learner's numbers, which would bring
/// the formatting of floats into every image.
pub(super) struct BoardLearner<'m>(pub Option<&'m mut dyn Learner>);

impl core::fmt::Debug for BoardLearner<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(if self.0.is_some() { "Learner" } else { "None" })
    }
}

impl Flow<'_> {
    /// In mode learn, what the learner stands by comes into force where an alignment lets it, and goes when it has lost.
    pub(super) fn promote(&mut self, block: &Block) {
        let still_s = self.report().still_s;
        if still_s < STANDS_S {
            self.stood = false;
        }
        if self.mode != Mode::Learn || self.alignment == Some(Alignment::Started) {
            return;
        }
        let stands = still_s >= STANDS_S && !self.stood;
        match self.config.activation {
            Activation::Standstill if stands => {
                self.stood = true;
                self.activate(true, Some(block));
            }
            Activation::Faded => self.activate(false, Some(block)),
            _ if self.active && self.report().winner == 0 => self.activate(false, None),
            _ => {}
        }
    }

    /// The learner's networks instead of those in use, or nothing where it stands by nothing; at once, or no faster than the slew
    /// limit. `block`: the one that the learner has not seen yet.
    pub(super) fn activate(&mut self, at_once: bool, block: Option<&Block>) {
        let (Some(learner), Some(Correction { compensator, state })) =
            (&mut self.learner.0, &mut self.correction)
        else {
            return;
        };
        let winner = learner.winner();
        self.active = winner.is_some();
        state.off = !self.active;
        if let Some(winner) = winner {
            self.foreign = true;
            compensator.exchange(state, winner.nets, winner.states);
            let said = match block {
                Some(block) => compensator.step_again(state, block),
                None => winner.estimate,
            };
            if at_once {
                compensator.force(state, &said);
            }
        } else if at_once {
            compensator.force(state, &[[0.0; 3]; 2]);
        }
    }

    /// Words go through as they came, but the networks step.
    pub(super) fn observes_only(&self) -> bool {
        matches!(self.mode, Mode::Shadow | Mode::Learn) && !self.active
    }

    /// Whether there is a learner.
    pub fn can_learn(&self) -> bool {
        self.learner.0.is_some()
    }

    /// In modes learn and shadow the learner is begun with what it does not know yet. From then on it follows in every mode.
    pub(super) fn teach(&mut self) {
        let (Some(learner), Some(correction)) = (&mut self.learner.0, &self.correction) else {
            return;
        };
        let stream = Some(correction.compensator.scale());
        if self.begun != stream {
            self.begun = stream.filter(|_| matches!(self.mode, Mode::Shadow | Mode::Learn));
            if let Some(stream) = self.begun {
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
        learner.reference(window)
    }

    /// A good fix of the receiver.
    pub fn fix(&mut self, fix: &Fix) {
        if let (Some(learner), Some(_)) = (&mut self.learner.0, self.begun) {
            learner.fix(self.sample, fix);
        }
    }

    /// A piece of learning that was put off; whether there is more.
    pub fn work(&mut self) -> bool {
        self.learner
            .0
            .as_mut()
            .is_some_and(|learner| learner.work())
    }

    /// What was learnt.
    pub fn learnt(&mut self) -> Option<(Nets, [lrnn_nostd::State; 2])> {
        self.begun?;
        self.learner.0.as_mut().map(|learner| learner.learnt())
    }

    /// Use what was learnt: it has seen the same blocks, so that nothing begins anew.
    #[inline(never)]
    pub fn commit_learnt(&mut self) -> Result<(), Reason> {
        let (nets, states) = self.learnt().ok_or(Reason::NotAvailable)?;
        self.config.nets = nets;
        self.failures = 0;
        self.foreign = false;
        if let Some(Correction { compensator, state }) = &mut self.correction {
            compensator.exchange(state, nets, states);
        }
        Ok(())
    }

    /// What the learner tells.
    pub fn report(&self) -> Report {
        let report = self.learner.0.as_ref().map(|learner| learner.report());
        report.unwrap_or_default()
    }

    /// What the networks say.
    pub fn estimate(&self) -> Estimate {
        let Report {
            window,
            estimate,
            used,
            doubted,
            ..
        } = self.report();
        let correction = self.correction.as_ref();
        Estimate {
            sample: self.sample,
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
