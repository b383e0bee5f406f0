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
mod held;
mod judged;
mod observe;
mod proportional;
mod settled;
mod shown;
mod start;
mod take;

use super::age::FixAge;
use super::antenna::Antenna;
use super::bank::{Bank, HYPOTHESES, STORED, Scratch, ZERO_CORRECTION};
use super::prior::{NAV, Shapes};
use super::quantise::{Scale, flat, split};
use super::rehearsal::Rehearsal;
use super::settings::Settings;
use super::unit::{Head, Unit};
use super::{Learner, Report, Solution, Trials, Winner};
use crate::align::Align;
use crate::compensator::Block;
use crate::control::{Alignment, Reason};
use crate::fix::{Fix, Heading};
use crate::inputs::Sources;
use crate::model::Nets;
use crate::nav;
use crate::sample::{Counts, RawSample, StreamScale};
use lrnn_nostd::State;
use lrnn_nostd::learn::kalman::OUTPUTS;
use observe::{Mean, Rest};

/// The large part of a learner, to be static; at most [`ROOM`] bytes.
#[derive(Debug)]
pub struct Memory {
    bank: Bank,
    /// Which hypotheses have proved themselves.
    rehearsal: Rehearsal,
    /// Lever arm and delay of the fixes.
    antenna: Antenna,
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
    };
}

/// An estimate may move by this share of the datasheet's bias and count as settled (assumed).
const SETTLES: f32 = 0.1;

/// Standard deviations of the navigator's errors until the alignment.
const UNALIGNED: [f32; NAV] = [1.0; NAV];

/// A drive that has covered nothing yet.
const NOWHERE: (f32, [f32; 2]) = (0.0, [f32::INFINITY, f32::NEG_INFINITY]);

/// Counters; each saturates.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    used: u32,
    /// Of these, with a refused component.
    refused: u32,
    promotions: u32,
    rollbacks: u32,
    /// Fixes that were too old.
    late: u32,
    /// Alignments in motion that were refused.
    alignments: u32,
}

pub use start::Started;

use aligning::Seen;
use course::Course;
use gaps::Recent;
use held::Held;
use judged::Judged;
use proportional::{Proportional, Ratios};
use settled::Settled;
use start::Probation;

/// Learns both networks from the receiver's fixes.
#[derive(Debug)]
pub struct FixLearner<'m> {
    memory: &'m mut Memory,
    scratch: Scratch,
    settings: Settings,
    /// `None` until the learner has begun.
    stream: Option<StreamScale>,
    /// Scale of the counts; from the first sample on.
    scale: Option<Scale>,
    align: Option<Align>,
    course: Course,
    /// The last position, while the receiver gives no velocity and nothing navigates.
    seen: Option<Seen>,
    /// How the navigator was started last.
    started: Option<Started>,
    /// How the vehicle has moved of late.
    recent: Recent,
    /// What it has turned and gained.
    proportional: Proportional,
    /// Number of the first sample.
    first: u32,
    /// The last sample and its number.
    last: Option<(u32, Counts)>,
    /// Time of validity of the last fix used.
    last_fix_ms: Option<u32>,
    age: FixAge,
    /// Time of validity of the last fix whose refusals count.
    counted_ms: Option<u32>,
    /// A fix that waits, so that little comes together.
    held: Held,
    /// Where the vehicle stands, if the receiver measures no velocity.
    rest: Option<Rest>,
    /// How it moves by a receiver that does, while the sensors are still.
    mean: Mean,
    /// The hypothesis in force after the last fix.
    running: usize,
    /// Whether its estimate has settled.
    settled: Settled,
    /// Which hypothesis knows the unit best, and whether what it knows has settled.
    knows_best: usize,
    unit_settled: Settled,
    /// Of a navigator that was aligned in motion.
    probation: Probation,
    /// What was known of the unit when the drive began and when the learner began, and what is
    /// remembered of it.
    before: Head,
    base: Head,
    unit: Unit,
    /// The first networks of the hypotheses that are driven by inputs.
    shapes: Shapes,
    judged: Judged,
    /// Of this drive: seconds beside fixes, and the lowest and highest temperature in them.
    covered: (f32, [f32; 2]),
    tally: Tally,
}

impl<'m> FixLearner<'m> {
    /// A learner that waits for [`Learner::begin`]. Until then, or until [`Learner::configure`],
    /// it reports nothing of the antenna.
    pub fn new(memory: &'m mut Memory, settings: Settings) -> FixLearner<'m> {
        memory.rehearsal.begin();
        memory.antenna.begin_nothing();
        FixLearner {
            memory,
            scratch: Scratch::ZEROED,
            settings,
            stream: None,
            scale: None,
            align: None,
            course: Course::Waits,
            seen: None,
            started: None,
            recent: Recent::default(),
            proportional: Proportional::default(),
            first: 0,
            last: None,
            last_fix_ms: None,
            age: FixAge::default(),
            counted_ms: None,
            held: Held::default(),
            rest: None,
            mean: Mean::default(),
            running: ZERO_CORRECTION,
            settled: Settled::default(),
            knows_best: ZERO_CORRECTION,
            unit_settled: Settled::default(),
            probation: Probation::default(),
            before: Head::NEW,
            base: Head::NEW,
            unit: Unit::NEW,
            shapes: Shapes::NONE,
            judged: Judged::NONE,
            covered: NOWHERE,
            tally: Tally::default(),
        }
    }

    /// No sample follows: a fix that waits is used at once.
    pub fn end(&mut self) {
        if let Some((number, fix)) = self.held.take() {
            self.take_fix(number, &fix);
        }
    }

    /// The networks that hypotheses are driven by, from those that correct this drive.
    #[inline(never)]
    fn begin_shapes(&mut self) {
        let Settings { sheet, inputs, .. } = &self.settings;
        let told = self.shapes.driven;
        self.shapes = Shapes::new(&told, sheet, inputs);
    }

    /// The hypothesis that believes the networks that correct this drive, if they do anything.
    #[inline(never)]
    fn begin_stored(&mut self) {
        let told = &self.shapes.driven;
        if *told != [Nets::NONE.gyro, Nets::NONE.accel] {
            let bank = &mut self.memory.bank;
            bank.begin_stored(told, &self.settings.sheet, UNALIGNED);
        }
    }

    /// The hypotheses begin but for [`STORED`], one by one, so that the stack holds one prior.
    #[inline(never)]
    fn begin_hypotheses(&mut self, stream: &StreamScale) {
        let bank = &mut self.memory.bank;
        let mut of_unit = self.settings.sheet;
        of_unit.turn_on = self.base.turn_on(&self.settings.sheet);
        let block_s = f64::from(stream.block_s());
        for hypothesis in 0..HYPOTHESES {
            if !bank.takes_part_as_stored(hypothesis) {
                bank.begin_some(1 << hypothesis, &of_unit, &self.shapes, block_s, UNALIGNED);
            }
        }
    }

    fn begin_antenna(&mut self) {
        let block_s = self.stream.map_or(1.0, |stream| stream.block_s());
        self.memory.antenna.begin(&self.settings, block_s.into());
    }

    /// What is remembered of the unit.
    #[inline(never)]
    fn begin_known(&mut self) {
        let bank = &mut self.memory.bank;
        // what a new unit has taken down in this drive is not known before it
        let knows = self.base.count > 0.0 && self.unit.recall(bank, &self.shapes);
        if !knows {
            self.base = Head::NEW;
        }
        let known = (knows && self.base.drives > 0).then(|| self.unit.values());
        self.judged.begin(self.base.judged, known);
        bank.reset_networks();
    }

    /// The first part of [`Learner::begin`].
    #[inline(never)]
    fn begin_bank(&mut self) {
        let Settings {
            sheet,
            gates,
            inputs,
            ..
        } = &self.settings;
        self.base = self.before;
        self.memory.bank.begins((sheet, inputs), *gates);
        self.covered = NOWHERE;
        self.tally = Tally::default();
        self.forget_stream();
    }

    /// The stream begins anew.
    fn anew(&mut self) {
        self.running = ZERO_CORRECTION;
        self.scale = None;
        self.forget_stream();
    }

    /// All that the samples and fixes so far have led to.
    fn forget_stream(&mut self) {
        self.memory.antenna.clear();
        self.settled = Settled::default();
        self.unit_settled = Settled::default();
        self.align = None;
        self.course = Course::Waits;
        self.seen = None;
        self.started = None;
        self.recent = Recent::default();
        self.proportional = Proportional::default();
        self.probation = Probation::default();
        self.last = None;
        self.last_fix_ms = None;
        self.counted_ms = None;
        self.held = Held::default();
        self.rest = None;
        self.mean = Mean::default();
        self.age = FixAge::default();
    }

    /// Drops the navigator. An alignment in motion begins with the next fix.
    fn lose(&mut self) {
        match &mut self.course {
            Course::Aligns(motion) => motion.gap(),
            course => *course = Course::Waits,
        }
        if let Some(align) = &mut self.align {
            align.gap();
        }
        self.memory.rehearsal.interrupted();
        self.held.take();
        self.settled = Settled::default();
        self.unit_settled = Settled::default();
        self.put_in_force(ZERO_CORRECTION);
    }

    /// A sample comes to the alignment at standstill.
    fn gather(&mut self, number: u32, counts: &Counts) {
        if self.last.is_none() && self.align.is_none() {
            self.first = number;
        }
        self.last = Some((number, *counts));
        let (Some(scale), Some(stream)) = (&self.scale, &self.stream) else {
            return;
        };
        let sensors = self.settings.sensors();
        let align = self
            .align
            .get_or_insert_with(|| Align::new(sensors, scale.lsb, stream.period_s));
        align.sample(counts);
    }

    /// The interval in progress is over. False: nothing navigates.
    fn interval_is_over(&mut self) -> bool {
        self.memory.antenna.clear();
        let fails = self.probation.fails();
        let lost = (self.course.navigator()).is_some_and(|navigator| navigator.faults().lost);
        if fails || lost {
            self.tally.alignments = self.tally.alignments.saturating_add(u32::from(fails));
            self.lose();
            return false;
        }
        let navigator = self.course.navigator_mut();
        navigator.map(|navigator| navigator.end_piece()).is_some()
    }

    /// How the errors have moved in it. False: not at all, by a fix that arrived after the block's
    /// last sample.
    fn take_transition(&mut self) -> bool {
        let Some(navigator) = self.course.navigator_mut() else {
            return false;
        };
        let mut block = navigator.take_transition();
        if block.time <= 0.0 {
            return false;
        }
        let ratios = Ratios {
            scale: self.settings.scale,
            misalignment: self.settings.misalignment[1],
            g_sensitivity: self.settings.g_sensitivity,
        };
        let state = navigator.state();
        let grown = self.proportional.moves(&state, block.time, &ratios);
        for (i, variance) in grown.as_flattened().iter().enumerate() {
            block.q[i][i] += variance;
        }
        self.scratch.block = block;
        true
    }

    /// The estimate that was subtracted in the interval.
    fn applied(&self) -> [f32; OUTPUTS] {
        let navigator = self.course.navigator();
        navigator.map_or([0.0; OUTPUTS], |navigator| flat(navigator.estimate()))
    }

    /// All means move with the navigator, and so do the shadows of the rehearsals.
    fn move_means(&mut self) {
        let applied = self.applied();
        let block = &self.scratch.block;
        self.memory.bank.propagate_mean(block, &applied);
        self.memory.antenna.interval(block, &applied);
        self.memory.rehearsal.interval(block, &applied);
        self.settled.passes(block.time);
        self.unit_settled.passes(block.time);
    }

    /// What is in force.
    #[inline(never)]
    fn in_force(&self) -> Option<Winner> {
        if self.running == ZERO_CORRECTION {
            return None;
        }
        let (bank, running) = (&self.memory.bank, self.running);
        let [gyro, accel] = bank.nets_of(running);
        Some(Winner {
            nets: Nets { gyro, accel },
            states: bank.states_of(running),
            estimate: split(bank.estimate_of(running)),
            sigma: split(&self.at_least(bank.bias_sigma())),
            settled: self.settled.is_settled(),
        })
    }

    /// Corrects the navigator by what the last fix showed: gives by how much. `None`: it is lost.
    fn correct(&mut self) -> Option<[f32; NAV]> {
        let navigator = self.course.navigator_mut()?;
        let bank = &mut self.memory.bank;
        let [gyro, accel] = split(bank.navigating_estimate());
        let error = bank.feed_back();
        if !navigator.feed_back(&error) || !navigator.set_estimate(gyro, accel) {
            self.lose();
            return None;
        }
        Some(error)
    }

    fn corrected(&mut self, error: &[f32; NAV]) {
        self.memory.antenna.feed_back(error);
        self.memory.rehearsal.feed_back(error);
        if let Some(navigator) = self.course.navigator_mut() {
            navigator.set_lever_arm(self.memory.antenna.arm());
            self.proportional.set(&navigator.state());
        }
    }

    /// What a block says to the networks: their inputs.
    fn take_inputs(&mut self, sources: &Sources) -> [[f32; 3]; 2] {
        self.recent.block(sources, self.settings.sheet.range);
        if let (true, Some(stream)) = (self.course.navigates(), &self.stream) {
            (self.judged).block(&self.memory.bank, &self.shapes, &self.settings.sheet);
            let (seconds, [low, high]) = &mut self.covered;
            *seconds += stream.block_s();
            *low = low.min(sources.temperature);
            *high = high.max(sources.temperature);
        }
        let [gyro, accel] = &self.settings.inputs;
        [sources.select(gyro), sources.select(accel)]
    }

    fn falls_silent(&mut self) {
        self.lose();
        self.held = Held::default();
        self.last = None;
    }

    /// The navigator's solution, less the error that the last fix has shown; `None` while it does
    /// not navigate. Where a block ends it is that of the last sample; within a block it is up to
    /// 50 ms older.
    pub fn nav(&self) -> Option<nav::State> {
        self.less(*self.memory.bank.error_state())
    }

    /// The same as the hypothesis in force sees it: where free-inertial navigation with its
    /// correction begins.
    pub fn nav_in_force(&self) -> Option<nav::State> {
        self.less(*self.memory.bank.error_state_of(self.running))
    }

    fn less(&self, error: [f32; NAV]) -> Option<nav::State> {
        let mut navigator = self.course.navigator()?.clone();
        navigator.feed_back(&error);
        Some(navigator.state())
    }

    /// The rehearsals, for reading.
    pub fn rehearsal(&self) -> &Rehearsal {
        &self.memory.rehearsal
    }

    /// The hypothesis in force.
    pub fn running(&self) -> usize {
        self.running
    }

    /// The hypotheses, for reading.
    pub fn bank(&self) -> &Bank {
        &self.memory.bank
    }
}

impl Learner for FixLearner<'_> {
    fn configure(&mut self, settings: &Settings) {
        self.settings = *settings;
        self.memory.antenna.configure(settings);
        self.stream = None;
        self.running = ZERO_CORRECTION;
        self.tally = Tally::default();
        self.restart();
    }

    /// Begins from what is remembered of the unit, or from the datasheet: the hypotheses have
    /// networks of their own. One of them believes `nets`, which correct this drive, and shows
    /// whether they should. Hidden layers of `nets` that pass their inputs on are the shape of the
    /// networks that are driven by inputs.
    fn begin(&mut self, nets: &Nets, stream: StreamScale) {
        self.shapes.driven = [nets.gyro, nets.accel];
        self.stream = Some(stream);
        self.running = ZERO_CORRECTION;
        self.scale = None;
        self.begin_bank();
        self.memory.rehearsal.begin();
        self.begin_stored();
        self.begin_shapes();
        (0..Shapes::<f32>::REACHES).for_each(|reach| self.shapes.reach(reach));
        self.begin_hypotheses(&stream);
        self.begin_antenna();
        self.begin_known();
    }

    fn restart(&mut self) {
        self.memory.rehearsal.interrupted();
        self.anew();
        self.memory.bank.reset_networks();
    }

    fn sample(&mut self, number: u32, sample: &RawSample) {
        let Some(stream) = self.stream else { return };
        let scale = *self
            .scale
            .get_or_insert_with(|| Scale::of(sample, &stream.lsb));
        let counts = scale.counts(sample);
        let missing = self.missing(number);
        if missing > 0 {
            self.go_across(missing, &counts);
        }
        self.take_sample(number, &counts);
    }

    fn block(&mut self, _: u32, block: &Block) {
        if self.stream.is_some() {
            self.end_block(&block.sources);
        }
    }

    /// The numbers of the samples show what is missing. The next one begins a block.
    fn gap(&mut self) {
        self.held.gap();
    }

    fn silence(&mut self) {
        self.falls_silent();
    }

    fn fix(&mut self, number: u32, fix: &Fix) {
        let navigates = self.course.navigates().then_some(self.stream).flatten();
        if !navigates.is_some_and(|stream| self.held.takes(number, fix, &stream)) {
            self.take_fix(number, fix);
        }
    }

    fn align(&mut self, alignment: Alignment) {
        let navigates = self.course.navigates();
        match (&mut self.align, alignment) {
            (Some(align), Alignment::Started) if !navigates => align.restart(true),
            (Some(align), Alignment::Finished) => align.finish_command(),
            _ => {}
        }
    }

    fn heading(&mut self, heading: Heading) -> Result<(), Reason> {
        self.take_heading(heading)
    }

    fn winner(&mut self) -> Option<Winner> {
        self.in_force()
    }

    fn for_next_power_on(&mut self) -> Option<Winner> {
        self.of_unit()
    }

    fn remember(&mut self) -> usize {
        self.take_down()
    }

    fn next_drive(&mut self) {
        self.remember();
        self.before = self.unit.head;
        self.restart();
    }

    fn write_memory(&self, start: usize, piece: &mut [u8]) {
        self.unit.write(start, piece);
    }

    fn recall(&mut self, memory: &[u8]) {
        self.unit.read(memory);
        self.before = self.unit.head;
    }

    fn learnt(&mut self) -> (Nets, [State; 2]) {
        let (bank, running) = (&self.memory.bank, self.running);
        let [gyro, accel] = bank.nets_of(running);
        (Nets { gyro, accel }, bank.states_of(running))
    }

    fn solution(&self) -> Option<Solution> {
        self.solved()
    }

    fn trials(&self) -> Option<Trials> {
        Some(self.tried())
    }

    fn report(&self) -> Report {
        Report {
            estimate: split(self.memory.bank.estimate_of(self.running)),
            fixes: self.tally.used,
            refused: self.tally.refused,
            late: self.tally.late,
            winner: self.running as u8,
            promotions: self.tally.promotions,
            rollbacks: self.tally.rollbacks,
            navigates: self.course.navigates(),
            still_s: self.align.as_ref().map_or(0, Align::still),
            antenna: self.memory.antenna.known(),
            stored_harms: self.memory.bank.takes_part(STORED)
                && self.memory.rehearsal.harms(STORED),
            ..self.aligned()
        }
    }
}

#[cfg(test)]
mod tests;
