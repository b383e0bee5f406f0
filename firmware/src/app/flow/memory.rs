//! The memory of the unit over power-off: when the learner records it, and when it gets it back.
//!
//! A memory is stored behind the newest record while samples are corrected. Nobody announces the
//! end of a drive, so records come early, and the rarer the longer it lasts: whenever the power
//! goes, at least two thirds of what was learnt are stored, or all but the last two hours. It
//! comes back at the next power-on of the board or of the sensor, before the learner begins.

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
    /// Learning time at the last record, stored or not, s.
    last_s: f32,
    seen: Notes,
    /// Notes of the store when the drive began.
    before: Notes,
    /// Records that the store still has room for.
    pub left: u32,
}

impl Default for Memo {
    /// Of a store with room.
    fn default() -> Memo {
        Memo {
            held: None,
            of_another: false,
            asked: None,
            waits: None,
            learnt_s: 0.0,
            new_s: 0.0,
            last_s: 0.0,
            seen: Notes::default(),
            before: Notes::default(),
            left: u32::MAX,
        }
    }
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

    /// A record has been stored, with the recorded memory if there is one, or could not be.
    pub fn stored(&mut self, done: bool) {
        self.last_s = self.learnt_s;
        self.left = self.left.saturating_sub(1);
        if let Some((notes, _)) = self.waits.take()
            && done
        {
            (self.held, self.of_another) = (Some(notes), false);
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
        (self.asked, self.waits) = (None, None);
    }

    /// The learner restarts within a drive: results that it has not recorded are lost.
    pub fn drop_new(&mut self) {
        self.learnt_s -= core::mem::take(&mut self.new_s);
        self.last_s = self.last_s.min(self.learnt_s);
    }

    /// Another unit is configured, of which the store has nothing.
    pub fn exchange_unit(&mut self) {
        *self = Memo {
            of_another: self.of_another || self.held.is_some(),
            left: self.left,
            ..Memo::default()
        };
    }

    /// Another drive begins: the sensor was powered on.
    fn begin_drive(&mut self) {
        *self = Memo {
            held: self.held,
            of_another: self.of_another,
            before: self.held.unwrap_or_default(),
            left: self.left,
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
            memo.learn(
                seconds,
                Some(celsius).filter(|t| reports && *t != REFERENCE_DEGC),
            );
        }
    }

    /// Records new results at once, by command.
    pub fn take_down_now(&mut self) {
        if self.pending.memo.new_s > 0.0 {
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Learning times of the records of a drive of this length, with room for so many of them.
    fn records(seconds: u32, left: u32) -> Vec<f32> {
        let mut memo = Memo {
            left,
            ..Memo::default()
        };
        let mut at = Vec::new();
        for _ in 0..seconds / 10 {
            memo.learn(10.0, None);
            if memo.is_due() {
                let full = memo.left == 0;
                memo.stored(!full);
                at.push(memo.learnt_s);
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
