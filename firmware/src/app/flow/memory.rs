//! The memory of the unit over power-off: when the learner records it, and when it gets it back.
//!
//! A memory is stored behind the newest record while samples are corrected. Nobody announces the
//! end of a drive, so records come early, and the rarer the longer it lasts: whenever the power
//! goes, at least two thirds of what was learnt are stored, or all but the last two hours. It
//! comes back at the next power-on of the board or of the sensor, before the learner begins.

use super::Flow;
use crate::app::job::Remembers;
use crate::compensator::Block;
use crate::control::Mode;
use crate::inputs::REFERENCE_DEGC;
use crate::learn::MEMORY_LEN;
use crate::learn::exchange::{Order, RestartReason};
use crate::store::{Notes, unit};
use crate::wire::command::Remembered;

/// Learning time after which another record is due: half as much as before the last one, and no
/// less and no more than this, s.
const GROWS: f32 = 0.5;
const PAUSE_S: [f32; 2] = [10.0, 7200.0];
/// Where the store has room for so few records, they come later: after three times as much as
/// before the last one, and no less than this, s.
const FEW: u32 = 2;
const FEW_GROWS: f32 = 3.0;
const FEW_S: f32 = 120.0;

/// Memory of the unit in the store.
#[derive(Debug)]
pub(in crate::app) struct UnitMemory {
    /// Notes of the stored memory; `None`: the store has none of this unit.
    pub stored_notes: Option<Notes>,
    /// The stored memory is of another unit.
    pub is_of_another_unit: bool,
    /// The learner was asked to take down what it knows, to which these notes belong.
    requested: Option<Notes>,
    /// Notes and length of what the learner has taken down to be stored.
    unsaved: Option<(Notes, usize)>,
    /// Of this drive: learning time in all and since the last record, s; temperatures.
    learnt_s: f32,
    new_s: f32,
    /// Learning time at the last record, stored or not, s.
    last_s: f32,
    this_drive: Notes,
    /// Notes of the store when the drive began.
    before: Notes,
    /// Records that the store still has room for.
    pub left: u32,
}

impl Default for UnitMemory {
    /// Of a store with room.
    fn default() -> UnitMemory {
        UnitMemory {
            stored_notes: None,
            is_of_another_unit: false,
            requested: None,
            unsaved: None,
            learnt_s: 0.0,
            new_s: 0.0,
            last_s: 0.0,
            this_drive: Notes::default(),
            before: Notes::default(),
            left: u32::MAX,
        }
    }
}

impl UnitMemory {
    /// Something was learnt that the store does not hold.
    pub fn has_learnt(&self) -> bool {
        self.has_unsaved() || self.new_s > 0.0
    }

    /// Something was taken down and waits to be stored.
    pub fn has_unsaved(&self) -> bool {
        self.unsaved.is_some()
    }

    /// The learner has not replied yet.
    pub fn is_requested(&self) -> bool {
        self.requested.is_some()
    }

    /// A record has been stored, with the recorded memory if there is one, or could not be.
    pub fn stored(&mut self, done: bool) {
        self.last_s = self.learnt_s;
        self.left = self.left.saturating_sub(1);
        if let Some((notes, _)) = self.unsaved.take()
            && done
        {
            (self.stored_notes, self.is_of_another_unit) = (Some(notes), false);
            self.new_s = 0.0;
        }
    }

    /// So much was learnt since the last record that another one is worth storing.
    pub fn is_due(&self) -> bool {
        let [least, most] = PAUSE_S;
        let (grows, least) = if self.left <= FEW {
            (FEW_GROWS, FEW_S)
        } else {
            (GROWS, least)
        };
        self.learnt_s - self.last_s >= (grows * self.last_s).clamp(least, most)
    }

    /// Gives up the pending memory. It is recorded again later.
    pub fn give_up(&mut self) {
        (self.requested, self.unsaved) = (None, None);
    }

    /// The learner restarts within a drive: results that it has not recorded are lost.
    pub fn drop_new(&mut self) {
        self.learnt_s -= core::mem::take(&mut self.new_s);
        self.last_s = self.last_s.min(self.learnt_s);
    }

    /// Another unit is configured, of which the store has nothing.
    pub fn exchange_unit(&mut self) {
        *self = UnitMemory {
            is_of_another_unit: self.is_of_another_unit || self.stored_notes.is_some(),
            left: self.left,
            ..UnitMemory::default()
        };
    }

    /// Another drive begins: the sensor was powered on.
    fn begin_drive(&mut self) {
        *self = UnitMemory {
            stored_notes: self.stored_notes,
            is_of_another_unit: self.is_of_another_unit,
            before: self.stored_notes.unwrap_or_default(),
            left: self.left,
            ..UnitMemory::default()
        };
    }

    /// Counts seconds of this drive that were learnt from, at a temperature in degrees C.
    fn learn(&mut self, seconds: f32, celsius: Option<f32>) {
        self.learnt_s += seconds;
        self.new_s += seconds;
        if let Some(celsius) = celsius {
            self.this_drive.see(celsius);
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
        for celsius in self.this_drive.temperatures.into_iter().flatten() {
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
        let memory = &mut self.pending.unit_memory;
        memory.is_of_another_unit = notes.unit != unit(configuration);
        if memory.is_of_another_unit {
            return;
        }
        memory.stored_notes = Some(notes);
        memory.before = notes;
        self.learning.port.recall(learnt);
    }

    /// Every [`super::pending::CHECK_INTERVAL_S`] in mode learn: what was learnt meanwhile counts.
    pub(super) fn count_learnt(&mut self, block: &Block, seconds: f32) {
        let memory = &mut self.pending.unit_memory;
        if self
            .learning
            .port
            .answer()
            .is_some_and(|answer| answer.navigates)
        {
            let celsius = block.sources.temperature;
            let configuration = self.config.configuration.as_ref();
            let reports = configuration
                .is_some_and(|configuration| configuration.has_thermometer() != Some(false));
            memory.learn(
                seconds,
                Some(celsius).filter(|t| reports && *t != REFERENCE_DEGC),
            );
        }
    }

    /// Records new results at once, by command.
    pub fn take_down_now(&mut self) {
        if self.pending.unit_memory.new_s > 0.0 {
            self.ask_to_remember();
        }
    }

    /// Makes the learner record its memory.
    pub(super) fn ask_to_remember(&mut self) {
        if let Some(configuration) = self
            .config
            .configuration
            .as_ref()
            .filter(|_| self.learning.exists())
        {
            let memory = &mut self.pending.unit_memory;
            memory.requested = Some(memory.notes(unit(configuration)));
            self.learning.port.hand_over(&Order::Remember);
            self.take_reply();
        }
    }

    /// The learner has taken down so many bytes.
    pub(super) fn remembers(&mut self, len: usize) {
        let memory = &mut self.pending.unit_memory;
        let notes = memory.requested.take();
        memory.unsaved = notes
            .map(|notes| (notes, len.min(MEMORY_LEN)))
            .filter(|_| len > 0);
    }

    /// The memory that goes with what is stored now.
    pub fn memory_to_store(&self) -> Remembers {
        let memory = &self.pending.unit_memory;
        match memory.unsaved {
            Some((notes, len)) => Remembers::New(notes, len),
            None if memory.stored_notes.is_some() => Remembers::Same,
            None => Remembers::Nothing,
        }
    }

    /// Report of the stored memory, for the command link.
    pub fn remembered(&self) -> Remembered {
        let memory = &self.pending.unit_memory;
        let notes = memory.stored_notes.unwrap_or_default();
        let stored = self.session.mode == Mode::Frozen
            || self.session.acts_from_power_on(self.config.activation);
        Remembered {
            drives: notes.drives,
            minutes: notes.minutes,
            temperatures: notes.temperatures,
            acts: stored && self.corrector.in_force(),
            of_another: memory.is_of_another_unit,
        }
    }

    /// The sensor was powered on: what was learnt until then is the prior of the next drive.
    pub(super) fn next_drive(&mut self) {
        self.pending.unit_memory.begin_drive();
        self.restart_learner(RestartReason::Drive);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Learning times of the records of a drive of this length, with room for so many of them.
    fn records(seconds: u32, left: u32) -> Vec<f32> {
        let mut memory = UnitMemory {
            left,
            ..UnitMemory::default()
        };
        let mut at = Vec::new();
        for _ in 0..seconds / 10 {
            memory.learn(10.0, None);
            if memory.is_due() {
                let full = memory.left == 0;
                memory.stored(!full);
                at.push(memory.learnt_s);
            }
        }
        at
    }

    #[test]
    fn records_get_rarer_and_the_last_ones_wait() {
        let early = [10.0, 20.0, 30.0, 50.0, 80.0, 120.0, 180.0, 270.0];
        assert_eq!(records(330, 99), early);
        assert_eq!(records(2000, 2), [120.0, 480.0, 1920.0]);
        assert_eq!(records(800, 4), [10.0, 20.0, 140.0, 560.0]);
        let long = records(100_000, 99);
        let last = long.windows(2).map(|two| two[1] - two[0]).next_back();
        assert_eq!(last, Some(7200.0));
    }
}
