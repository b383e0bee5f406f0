//! Learning from plain fixes (way C): a navigator of its own integrates the sensors' samples and is
//! compared with the receiver.
//!
//! ```text
//! samples -> align -> nav -> at each fix: innovation -> bank of hypotheses -> networks and biases
//! ```
//!
//! The navigator starts in one of these ways ([`crate::control::Way`]):
//! - After a standstill of [`Settings::align_s`] seconds or by command, with sensors that find
//!   north: [`crate::align::Align`].
//! - In motion, with any sensors: [`crate::align::motion`]. It runs beside the other one, also
//!   after the navigator was lost, and waits while the vehicle stands and the other one can do it.
//! - From a known state: [`FixLearner::navigate_from`].
//!
//! At the end of a block the navigator is corrected by what the last fix showed. From then on it
//! subtracts from the samples what the running hypothesis estimated one block earlier. All
//! hypotheses know the difference to their present estimates, so that this costs no accuracy.

mod aligning;
mod chosen;
mod course;
#[cfg(test)]
pub(in crate::learn) mod drive;
mod gaps;
mod judged;
mod learner;
mod level;
mod observe;
mod parts;
mod pending;
mod proportional;
mod reports;
mod rests;
mod start;
mod take;
mod wheels;

use super::Winner;
use super::antenna::Antenna;
use super::bank::{ALL, Bank, HYPOTHESES, STORED, Scratch, ZERO_CORRECTION};
use super::prior::{NAV, Shapes};
use super::quantise::split;
use super::rehearsal::Rehearsal;
use super::settings::Settings;
use super::unit::Head;
use crate::align::Align;
use crate::inputs::Sources;
use crate::model::Nets;
use crate::nav;
use crate::sample::{Counts, StreamScale};
use lrnn_nostd::learn::kalman::Correction;

/// The large part of a learner, to be static; at most [`ROOM`] bytes.
#[derive(Debug)]
pub struct Memory {
    bank: Bank,
    /// Rehearsals, by which hypotheses prove themselves.
    rehearsal: Rehearsal,
    /// Lever arm and delay of the fixes.
    antenna: Antenna,
    /// The interval, and memory of the updates.
    scratch: Scratch,
}

/// Bytes that a [`Memory`] may take: the core-coupled memory of an STM32F405.
pub const ROOM: usize = 64 * 1024;
const _: () = assert!(size_of::<Memory>() <= ROOM);

impl Memory {
    /// All zeros, so that it takes no room in flash.
    pub const ZEROED: Memory = Memory {
        bank: Bank::ZEROED,
        rehearsal: Rehearsal::ZEROED,
        antenna: Antenna::ZEROED,
        scratch: Scratch::ZEROED,
    };
}

/// Standard deviations of the navigator's errors until the alignment.
const UNALIGNED: [f32; NAV] = [1.0; NAV];

/// A drive that has covered nothing yet.
const NOWHERE: (f32, [f32; 2]) = (0.0, [f32::INFINITY, f32::NEG_INFINITY]);

/// Counters; each saturates.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    used: u32,
    /// Number of these with a refused component.
    refused: u32,
    promotions: u32,
    rollbacks: u32,
    /// Fixes that were too old.
    late: u32,
    /// Alignments in motion that were refused, and navigators that were given up.
    alignments: u32,
    /// Navigators that had lost their way.
    given_up: u32,
}

pub use chosen::REFUSED;
pub use start::Started;

use course::Course;
use parts::{Choice, FixTimes, Motion, Navigation, Remembered, Samples};
use start::Verdict;

/// Learns both networks from the receiver's fixes.
#[derive(Debug)]
pub struct FixLearner<'m> {
    memory: &'m mut Memory,
    settings: Settings,
    samples: Samples,
    navigation: Navigation,
    motion: Motion,
    fix_times: FixTimes,
    choice: Choice,
    remembered: Remembered,
    /// The first networks of the hypotheses that are driven by inputs.
    shapes: Shapes,
    tally: Tally,
}

impl<'m> FixLearner<'m> {
    /// A learner that waits for [`begin`](super::Learner::begin). Until then, or until
    /// [`configure`](super::Learner::configure), it reports nothing of the antenna.
    pub fn new(memory: &'m mut Memory, settings: Settings) -> FixLearner<'m> {
        memory.rehearsal.begin();
        memory.antenna.begin_nothing();
        FixLearner {
            memory,
            settings,
            samples: Samples::default(),
            navigation: Navigation::new(),
            motion: Motion::default(),
            fix_times: FixTimes::default(),
            choice: Choice::new(),
            remembered: Remembered::NOTHING,
            shapes: Shapes::NONE,
            tally: Tally::default(),
        }
    }

    /// No sample follows: a fix that waits is used at once.
    pub fn end(&mut self) {
        if let Some((number, fix)) = self.fix_times.pending.take() {
            self.take_fix(number, &fix);
        }
    }

    /// The networks that hypotheses are driven by, from those that correct this drive.
    #[inline(never)]
    fn begin_shapes(&mut self) {
        let Settings { sheet, inputs, .. } = &self.settings;
        let driven = self.shapes.driven;
        self.shapes = Shapes::new(&driven, sheet, inputs);
    }

    /// The hypothesis that believes the networks that correct this drive, if they do anything.
    #[inline(never)]
    fn begin_stored(&mut self) {
        let (driven, maps) = (&self.shapes.driven, &self.choice.stored_maps);
        if *driven != [Nets::NONE.gyro, Nets::NONE.accel] || *maps != Nets::NONE.maps {
            let bank = &mut self.memory.bank;
            bank.begin_stored((driven, maps), &self.settings.sheet, UNALIGNED);
        }
    }

    /// The hypotheses in the bits `which` begin but for [`STORED`], one by one, so that the stack
    /// holds one prior.
    #[inline(never)]
    fn begin_hypotheses(&mut self, which: u8, stream: &StreamScale) {
        let bank = &mut self.memory.bank;
        let mut of_unit = self.settings.sheet;
        of_unit.turn_on = self.remembered.base.turn_on(&self.settings.sheet);
        let block_s = f64::from(stream.block_s());
        for hypothesis in 0..HYPOTHESES {
            if which >> hypothesis & 1 == 1 && !bank.takes_part_as_stored(hypothesis) {
                bank.begin_some(1 << hypothesis, &of_unit, &self.shapes, block_s, UNALIGNED);
            }
        }
    }

    fn begin_antenna(&mut self) {
        let block_s = self.samples.stream.map_or(1.0, |stream| stream.block_s());
        self.memory.antenna.begin(&self.settings, block_s.into());
    }

    /// Begins with the memory of the unit.
    #[inline(never)]
    fn begin_known(&mut self) {
        let bank = &mut self.memory.bank;
        // not from what this drive has taken down: its turn-on would count twice
        let unit = &self.remembered.before;
        let knows = self.remembered.base.count > 0.0 && unit.recall(bank, &self.shapes);
        if knows {
            unit.carry(&mut self.memory.rehearsal);
            if self.remembered.base.refuted && !bank.takes_part(STORED) {
                // what is remembered does not act, but is on trial
                let sheet = &self.settings.sheet;
                let nets = self.shapes.constant(&unit.biases());
                bank.begin_stored((&nets, &Nets::NONE.maps), sheet, UNALIGNED);
            }
        } else {
            self.remembered.base = Head::NEW;
        }
        let known =
            (knows && self.remembered.base.drives > 0).then(|| self.remembered.before.values());
        self.remembered
            .judged
            .begin(self.remembered.base.judged, known);
        bank.reset_networks();
    }

    /// The first part of [`Learner::begin`](super::Learner::begin).
    #[inline(never)]
    fn begin_bank(&mut self) {
        let Settings {
            sheet,
            gates,
            inputs,
            ..
        } = &self.settings;
        self.remembered.base = self.remembered.before.head;
        self.memory.bank.begins((sheet, inputs), *gates);
        self.memory.bank.considers(&self.settings.considered());
        self.remembered.covered = NOWHERE;
        self.tally = Tally::default();
        self.forget_stream();
    }

    /// The stream restarts.
    fn restart_stream(&mut self) {
        self.choice.running = ZERO_CORRECTION;
        self.samples.scale = None;
        self.forget_stream();
    }

    /// All that the samples and fixes so far have led to.
    fn forget_stream(&mut self) {
        self.memory.antenna.clear();
        self.navigation.reset();
        self.motion = Motion::default();
        self.samples.last = None;
        self.fix_times = FixTimes::default();
    }

    /// Drops the navigator, without a doubt of what it has shown. An alignment in motion begins
    /// with the next fix.
    fn lose(&mut self) {
        match &mut self.navigation.course {
            Course::Aligns(motion) => motion.gap(),
            course => *course = Course::Waits,
        }
        if let Some(align) = &mut self.navigation.align {
            align.gap();
        }
        self.memory.rehearsal.interrupted();
        self.fix_times.pending.take();
    }

    /// Drops a navigator that was aligned wrongly: what it has shown is in doubt.
    fn distrust(&mut self) {
        self.lose();
        self.memory.rehearsal.doubt();
        self.put_in_force(ZERO_CORRECTION);
    }

    /// Drops a navigator that has lost its way, and all that this drive has taught, also what has
    /// been stored of it. The second time the memory of the unit is in doubt too. What acts from
    /// power-on takes no further part; what has been found harmful of it stays so.
    fn begin_again(&mut self) {
        let Some(stream) = self.samples.stream else {
            return;
        };
        let harms = self.stored_harms();
        let remembered = &mut self.remembered;
        remembered.harmful = harms;
        remembered.before.head.refuted |= harms;
        remembered.unit.clone_from(&remembered.before);
        remembered.withdraws |= remembered.taken_down || harms;
        remembered.taken_down = false;
        let tally = Tally {
            given_up: self.tally.given_up.saturating_add(1),
            ..self.tally
        };
        self.begin_bank();
        self.tally = tally;
        if tally.given_up > 1 {
            self.remembered.base = Head::NEW;
        }
        self.memory.rehearsal.begin();
        self.begin_from_memory(&stream);
        self.put_in_force(ZERO_CORRECTION);
    }

    /// A drive begins with what is known of the unit.
    fn begin_drive(&mut self) {
        let remembered = &mut self.remembered;
        remembered.before.clone_from(&remembered.unit);
        (remembered.taken_down, remembered.withdraws) = (false, false);
        remembered.harmful = false;
    }

    /// The hypotheses and the antenna begin, with the memory of the unit.
    fn begin_from_memory(&mut self, stream: &StreamScale) {
        self.begin_hypotheses(ALL, stream);
        self.begin_antenna();
        self.begin_known();
    }

    /// A sample comes to the alignment at standstill.
    fn gather(&mut self, number: u32, counts: &Counts) {
        if self.samples.last.is_none() && self.navigation.align.is_none() {
            self.samples.first = number;
        }
        self.samples.last = Some((number, *counts));
        let (Some(scale), Some(stream)) = (&self.samples.scale, &self.samples.stream) else {
            return;
        };
        let sensors = self.settings.sensors();
        let align = self
            .navigation
            .align
            .get_or_insert_with(|| Align::new(sensors, scale.lsb, stream.period_s));
        align.sample(counts);
    }

    /// The interval in progress is over. False: nothing navigates.
    fn interval_is_over(&mut self) -> bool {
        self.memory.antenna.clear();
        let verdict = self.navigation.probation.verdict();
        let lost =
            (self.navigation.course.navigator()).is_some_and(|navigator| navigator.faults().lost);
        if verdict != Verdict::Good {
            self.tally.alignments = self.tally.alignments.saturating_add(1);
            match verdict {
                Verdict::Wrong => self.begin_again(),
                _ => self.distrust(),
            }
            return false;
        }
        if lost || core::mem::take(&mut self.navigation.astray) {
            self.lose();
            return false;
        }
        let navigator = self.navigation.course.navigator_mut();
        navigator.map(|navigator| navigator.end_piece()).is_some()
    }

    /// Changes of the errors in it. False: none, by a fix that arrived after the block's last
    /// sample.
    fn take_transition(&mut self) -> bool {
        let Some(navigator) = self.navigation.course.navigator_mut() else {
            return false;
        };
        let mut block = navigator.take_transition();
        if block.time <= 0.0 {
            return false;
        }
        block.proportional = navigator.proportional_effects().of_maps(block.time);
        self.memory
            .bank
            .feels(&block, navigator.proportional_effects());
        navigator.clear_proportional();
        let sizes = self.settings.considered();
        let state = navigator.state();
        let grown = self.motion.proportional.moves(&state, block.time, &sizes);
        for i in 0..3 {
            block.q[i][i] += grown.by_force;
        }
        self.shrink_level_force(&mut block);
        let [a, b, c] = grown.turn;
        let [d, e, f] = grown.gain;
        self.memory.scratch.in_proportion = [a, b, c, d, e, f, 0.0, 0.0, 0.0];
        self.memory.scratch.block = block;
        true
    }

    /// The correction that was subtracted in the interval.
    fn applied(&self) -> Correction {
        let navigator = self.navigation.course.navigator();
        navigator.map_or(Correction::NONE, |navigator| *navigator.correction())
    }

    /// All means move with the navigator, and so do the shadows of the rehearsals.
    fn move_means(&mut self) {
        let applied = self.applied();
        let block = &self.memory.scratch.block;
        self.memory.bank.propagate_mean(block, &applied);
        self.memory.antenna.interval(block, &applied);
        self.memory
            .antenna
            .inflate(&self.memory.scratch.in_proportion);
        self.memory.rehearsal.interval(block, &applied);
    }

    /// The hypothesis in force.
    #[inline(never)]
    fn in_force(&self) -> Option<Winner> {
        if self.choice.running == ZERO_CORRECTION {
            return None;
        }
        let (bank, running) = (&self.memory.bank, self.choice.running);
        let [gyro, accel] = bank.nets_of(running);
        let maps = bank.maps_of(running);
        Some(Winner {
            nets: Nets { gyro, accel, maps },
            states: bank.states_of(running),
            estimate: split(&bank.output_of(running)),
        })
    }

    /// Corrects the navigator by what the last fix showed: gives by how much. `None`: it is lost.
    fn correct(&mut self) -> Option<[f32; NAV]> {
        let navigator = self.navigation.course.navigator_mut()?;
        let bank = &mut self.memory.bank;
        let correction = bank.navigating_correction();
        let error = bank.feed_back();
        if !navigator.feed_back(&error) || !navigator.set_correction(&correction) {
            self.lose();
            return None;
        }
        Some(error)
    }

    fn corrected(&mut self, error: &[f32; NAV]) {
        self.memory.antenna.feed_back(error);
        self.memory.rehearsal.feed_back(error);
        if let Some(navigator) = self.navigation.course.navigator_mut() {
            navigator.set_lever_arm(self.memory.antenna.arm());
            self.motion.proportional.set(&navigator.state());
        }
    }

    /// Inputs of the networks for a block.
    fn take_inputs(&mut self, sources: &Sources) -> [[f32; 3]; 2] {
        self.motion.recent.block(sources, self.settings.sheet.range);
        if let (true, Some(stream)) = (self.navigation.course.navigates(), &self.samples.stream) {
            (self.remembered.judged).block(&self.memory.bank, &self.shapes, &self.settings.sheet);
            let (seconds, [low, high]) = &mut self.remembered.covered;
            *seconds += stream.block_s();
            *low = low.min(sources.temperature);
            *high = high.max(sources.temperature);
        }
        let [gyro, accel] = &self.settings.inputs;
        [sources.select(gyro), sources.select(accel)]
    }

    /// How many samples are missing is not known, so the arrivals of fixes before cannot be
    /// compared with those to come.
    fn falls_silent(&mut self) {
        self.lose();
        self.fix_times.pending = pending::PendingFix::default();
        self.fix_times.age.begin_again();
        self.samples.last = None;
    }

    /// The navigator's solution, less the error that the last fix has shown; `None` while it does
    /// not navigate. Where a block ends it is that of the last sample; within a block it is up to
    /// 50 ms older.
    pub fn nav(&self) -> Option<nav::State> {
        self.less(*self.memory.bank.error_state())
    }

    /// The navigator's state as the hypothesis in force corrects it: where free-inertial navigation
    /// with its correction begins.
    pub fn nav_in_force(&self) -> Option<nav::State> {
        self.less(*self.memory.bank.error_state_of(self.choice.running))
    }

    fn less(&self, error: [f32; NAV]) -> Option<nav::State> {
        let mut navigator = self.navigation.course.navigator()?.clone();
        navigator.feed_back(&error);
        Some(navigator.state())
    }

    /// The rehearsals, for reading.
    pub fn rehearsal(&self) -> &Rehearsal {
        &self.memory.rehearsal
    }

    /// The hypothesis in force.
    pub fn running(&self) -> usize {
        self.choice.running
    }

    /// The hypotheses, for reading.
    pub fn bank(&self) -> &Bank {
        &self.memory.bank
    }
}

#[cfg(test)]
mod tests;
