//! The memory of the unit over power-off: when the learner records it, and when it gets it back.
//!
//! A memory is stored behind the newest record while samples are corrected, so it waits for a
//! standstill, as the networks do ([`super::keep`]). It comes back at the next power-on of the
//! board or of the sensor, before the learner begins.

use super::{Flow, configure};
use crate::app::config::Config;
use crate::app::job::Remembers;
use crate::compensator::Block;
use crate::control::Mode;
use crate::inputs::REFERENCE_DEGC;
use crate::learn::MEMORY_LEN;
use crate::learn::exchange::{Anew, Order, Port};
use crate::store::{Notes, unit};
use crate::wire::command::Remembered;

/// Learning time since the last record after which another one is worth storing, s.
const LEAST_S: f32 = 60.0;
/// While the vehicle moves, so much, s.
const LATEST_S: f32 = 300.0;
/// Least time between two records of a drive, s. It grows by half with each of them up to the most.
const PAUSE_S: f32 = 600.0;
const LONGEST_PAUSE_S: f32 = 3600.0;

/// Memory of the unit in the store.
#[derive(Debug, Default)]
pub(in crate::app) struct Memo {
    /// Notes of the stored memory; `None`: the store has none of this unit.
    pub held: Option<Notes>,
    /// The stored memory is of another unit.
    pub of_another: bool,
    /// The learner was asked to take down what it knows, to which these notes belong.
    asked: Option<Notes>,
    /// Notes and length of what the learner has taken down to be stored.
    waits: Option<(Notes, usize)>,
    /// Of this drive: learning time in all and since the last record, s; temperatures.
    learnt_s: f32,
    new_s: f32,
    seen: Notes,
    /// Until the next record, s, and how long the last wait was.
    pause_s: f32,
    pause: f32,
    /// Notes of the store when the drive began.
    before: Notes,
}

impl Memo {
    /// Something was learnt that the store does not hold.
    pub fn has_learnt(&self) -> bool {
        self.waits() || self.new_s > 0.0
    }

    /// Something was taken down and waits to be stored.
    pub fn waits(&self) -> bool {
        self.waits.is_some()
    }

    /// The learner has not replied yet.
    pub fn is_asked(&self) -> bool {
        self.asked.is_some()
    }

    /// The recorded memory has been stored, or could not be.
    pub fn stored(&mut self, done: bool) {
        if let Some((notes, _)) = self.waits.take()
            && done
        {
            (self.held, self.of_another) = (Some(notes), false);
            self.new_s = 0.0;
        }
    }

    /// Gives up the pending memory. It is recorded again later.
    pub fn give_up(&mut self) {
        (self.asked, self.waits) = (None, None);
    }

    /// The learner restarts within a drive: results that it has not recorded are lost.
    pub fn drop_new(&mut self) {
        self.learnt_s -= core::mem::take(&mut self.new_s);
    }

    /// Another unit is configured, of which the store has nothing.
    pub fn exchange_unit(&mut self) {
        *self = Memo {
            of_another: self.of_another || self.held.is_some(),
            ..Memo::default()
        };
    }

    /// Another drive begins: the sensor was powered on.
    fn begin_drive(&mut self) {
        *self = Memo {
            held: self.held,
            of_another: self.of_another,
            before: self.held.unwrap_or_default(),
            ..Memo::default()
        };
    }

    /// Counts seconds of this drive that were learnt from, at a temperature in degrees C.
    fn learn(&mut self, seconds: f32, celsius: Option<f32>) {
        self.learnt_s += seconds;
        self.new_s += seconds;
        if let Some(celsius) = celsius {
            self.seen.see(celsius);
        }
    }

    /// The notes of the drives before and this one.
    fn notes(&self, unit: u32) -> Notes {
        let mut notes = Notes {
            unit,
            drives: self.before.drives.saturating_add(1),
            // `as` saturates
            minutes: (self.before.minutes).saturating_add((self.learnt_s / 60.0) as u32),
            temperatures: self.before.temperatures,
        };
        for celsius in self.seen.temperatures.into_iter().flatten() {
            notes.see(f32::from(celsius));
        }
        notes
    }
}

impl Flow<'_> {
    /// Gives the memory found in the store at power-on. It is used if it is of this unit.
    pub fn recall(&mut self, memory: &[u8]) {
        let (Some(configuration), Some((notes, learnt))) =
            (&self.config.configuration, Notes::of(memory))
        else {
            return;
        };
        let memo = &mut self.pending.memo;
        memo.of_another = notes.unit != unit(configuration);
        if memo.of_another {
            return;
        }
        memo.held = Some(notes);
        memo.before = notes;
        self.learning.port.recall(learnt);
    }

    /// Every [`super::keep::LOOK_S`] in mode learn: what was learnt meanwhile counts.
    pub(super) fn count_learnt(&mut self, block: &Block, seconds: f32) {
        let memo = &mut self.pending.memo;
        memo.pause_s = (memo.pause_s - seconds).max(0.0);
        if self
            .learning
            .port
            .answer()
            .is_some_and(|answer| answer.navigates)
        {
            let celsius = block.sources.temperature;
            let configuration = self.config.configuration.as_ref();
            let tells = configuration
                .is_some_and(|configuration| configuration.has_thermometer() != Some(false));
            memo.learn(
                seconds,
                Some(celsius).filter(|t| tells && *t != REFERENCE_DEGC),
            );
        }
    }

    /// Makes the learner record its memory, if that is due. `with_nets`: networks are stored
    /// anyway.
    pub(super) fn take_down(&mut self, stands: bool, with_nets: bool) {
        let memo = &self.pending.memo;
        let enough = if stands { LEAST_S } else { LATEST_S };
        if memo.pause_s <= 0.0 && memo.new_s >= enough || with_nets {
            self.ask_to_remember();
        }
    }

    /// Records new results at once, by command.
    pub fn take_down_now(&mut self) {
        if self.pending.memo.new_s > 0.0 {
            self.ask_to_remember();
        }
    }

    fn ask_to_remember(&mut self) {
        if let Some(configuration) = self
            .config
            .configuration
            .as_ref()
            .filter(|_| self.learning.exists())
        {
            let memo = &mut self.pending.memo;
            memo.asked = Some(memo.notes(unit(configuration)));
            self.learning.port.hand_over(&Order::Remember);
            self.take_reply();
        }
    }

    /// The learner has taken down so many bytes.
    pub(super) fn remembers(&mut self, len: usize) {
        let memo = &mut self.pending.memo;
        let notes = memo.asked.take();
        memo.waits = notes
            .map(|notes| (notes, len.min(MEMORY_LEN)))
            .filter(|_| len > 0);
        if memo.waits.is_some() && !self.pending.commanded {
            memo.pause = (1.5 * memo.pause).clamp(PAUSE_S, LONGEST_PAUSE_S);
            memo.pause_s = memo.pause;
        }
    }

    /// The memory that goes with what is stored now.
    pub fn memory_to_store(&self) -> Remembers {
        let memo = &self.pending.memo;
        match memo.waits {
            Some((notes, len)) => Remembers::New(notes, len),
            None if memo.held.is_some() => Remembers::Same,
            None => Remembers::Nothing,
        }
    }

    /// Report of the stored memory, for the command link.
    pub fn remembered(&self) -> Remembered {
        let memo = &self.pending.memo;
        let notes = memo.held.unwrap_or_default();
        let stored = self.session.mode == Mode::Frozen
            || self.session.acts_from_power_on(self.config.activation);
        Remembered {
            drives: notes.drives,
            minutes: notes.minutes,
            temperatures: notes.temperatures,
            acts: stored && self.corrector.in_force(),
            of_another: memo.of_another,
        }
    }

    /// The sensor was powered on: what was learnt until then is the prior of the next drive.
    pub(super) fn next_drive(&mut self) {
        self.pending.memo.begin_drive();
        self.learning.port.begin_anew(Anew::Drive);
    }
}

/// Another configuration has come. What the learner knew of the unit stays if it is the same unit.
/// What it has learnt since is dropped and not remembered: the drive goes on, and what one turn-on
/// shows would count twice.
pub(in crate::app) fn through_configuration(learner: &mut Port, same: bool, config: &Config) {
    if !same {
        learner.hand_over(&Order::ForgetUnit);
    }
    configure(learner, config);
}
