//! Learning from plain fixes (way C): the sensors' words through a navigator of its own, compared with the receiver.
//!
//! ```text
//! words -> align -> nav -> at each fix: innovation -> bank of hypotheses -> the winner's networks and biases
//! ```
//! The vehicle has to stand once, for [`Settings::align_s`] seconds or by command; the fix after that starts the navigator.
//!
//! **When what is done.** What is cheap is done where it happens: sums of words, a piece of navigation, the means of the hypotheses,
//! feedback. What is dear (covariances, networks with their gradients) is put off to [`Learner::work`] in parts and is finished, as a
//! rule long since, where the next block or fix begins. So nothing depends on when the parts were done.
//! At the end of a block the navigator is corrected by what the last fix found, and what it takes out of the words from then on is the
//! running hypothesis' estimate of the block before: a difference to the present one is known to all hypotheses and costs nothing.

use super::age::FixAge;
use super::bank::{Bank, Work, ZERO_CORRECTION};
use super::prior::NAV;
use super::quantise::{Scale, divisor, flat, split};
use super::settings::Settings;
use super::{Learner, Report, Winner};
use crate::align::Align;
use crate::compensator::Block;
use crate::control::{Alignment, Reason};
use crate::fix::{Fix, OBSERVATIONS};
use crate::model::Nets;
use crate::nav::{self, Navigator};
use crate::sample::{Counts, RawSample, StreamScale};
use lrnn_nostd::State;
use lrnn_nostd::learn::kalman::{OUTPUTS, Transition};

/// The large part of a learner, to be static, of at most [`ROOM`] bytes.
#[derive(Debug)]
pub struct Memory {
    bank: Bank,
    work: Work,
}

/// Bytes that a [`Memory`] may take: the core-coupled memory of an STM32F405.
pub const ROOM: usize = 64 * 1024;
const _: () = assert!(size_of::<Memory>() <= ROOM);

impl Memory {
    /// All zeros, so that it takes no room in flash.
    pub const ZEROED: Memory = Memory {
        bank: Bank::ZEROED,
        work: Work::ZEROED,
    };
}

/// Fixes closer to each other than this are not all used, ms.
const FIX_MS: u32 = 900;
/// A vehicle that the receiver calls faster does not stand, m/s.
const STANDS_MPS: f32 = 0.3;
/// Seconds after which a standstill is believed, and the standard deviation of its velocity, m/s (as `host_sim::learning::teacher`).
const STILL_S: u32 = 3;
const STILL_MPS: f32 = 0.01;
/// Errors are linear up to a heading error of this standard deviation, rad.
const MAX_HEADING: f32 = 0.1;
/// The longest hole that is bridged by the word before it, s; what turns and pushes are then missed, rad/s and m/s2 (assumed).
const BRIDGE_S: f64 = 0.1;
const MISSED: [f32; 2] = [0.1, 1.0];

/// Counts of what happened, each held at its end.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    used: u32,
    refused: u32,
    promotions: u32,
    rollbacks: u32,
    late: u32,
}

/// Learns both networks from the receiver's fixes.
#[derive(Debug)]
pub struct FixLearner<'m> {
    memory: &'m mut Memory,
    settings: Settings,
    stream: Option<StreamScale>,
    scale: Option<Scale>,
    align: Option<Align>,
    navigator: Option<Navigator>,
    /// The last word and its number.
    last: Option<(u32, Counts)>,
    last_fix_ms: Option<u32>,
    age: FixAge,
    /// A fix is being worked on.
    fixing: bool,
    running: usize,
    tally: Tally,
}

impl<'m> FixLearner<'m> {
    /// To be begun.
    pub fn new(memory: &'m mut Memory, settings: Settings) -> FixLearner<'m> {
        FixLearner {
            memory,
            settings,
            stream: None,
            scale: None,
            align: None,
            navigator: None,
            last: None,
            last_fix_ms: None,
            age: FixAge::default(),
            fixing: false,
            running: ZERO_CORRECTION,
            tally: Tally::default(),
        }
    }

    /// Does all deferred work. Afterwards it is known what the last fix led to.
    pub fn finish(&mut self) {
        let Memory { bank, work } = &mut *self.memory;
        while !work.is_done() {
            bank.work(work);
        }
        if core::mem::take(&mut self.fixing) {
            let refused = u32::from(work.refused != 0);
            self.tally.refused = self.tally.refused.saturating_add(refused);
            let before = core::mem::replace(&mut self.running, bank.running());
            if self.running != before {
                let of = if self.running == ZERO_CORRECTION {
                    &mut self.tally.rollbacks
                } else {
                    &mut self.tally.promotions
                };
                *of = of.saturating_add(1);
            }
        }
    }

    /// The navigator is of no use any more.
    fn lose(&mut self) {
        self.navigator = None;
        if let Some(align) = &mut self.align {
            align.gap();
        }
    }

    /// The interval up to now: what the navigator did, and the means of what the hypotheses make of it.
    fn cut(&mut self) -> Option<&mut Navigator> {
        self.finish();
        self.memory.work.clear();
        if self.navigator.as_ref()?.faults().lost {
            self.lose();
            return None;
        }
        let navigator = self.navigator.as_mut()?;
        let passed = navigator.take_transition();
        let block = Transition {
            phi: passed.phi,
            gamma: passed.gamma,
            q: passed.q,
            time: passed.time,
        };
        let Memory { bank, work } = &mut *self.memory;
        bank.propagate_mean(&block, &flat(navigator.estimate()));
        work.interval(&block);
        Some(navigator)
    }

    /// What the last fix found goes into the navigator.
    fn feed_back(&mut self) {
        let Some(navigator) = &mut self.navigator else {
            return;
        };
        let bank = &mut self.memory.bank;
        let [gyro, accel] = split(bank.estimate());
        if !navigator.feed_back(&bank.feed_back()) || !navigator.set_estimate(gyro, accel) {
            self.lose();
        }
    }

    /// Starts the navigator at a fix if the alignment is good for it.
    fn start(&mut self, fix: &Fix, sigmas: &[f32; OBSERVATIONS], age: f32) -> Option<()> {
        let align = self.align.as_mut()?;
        if align.gathered() < self.settings.align_s && !(align.is_over()) {
            return None;
        }
        if !align.is_solving() {
            // in parts, until the next fix
            align.solve(fix.position.latitude, fix.position.height);
            return None;
        }
        while align.sweep() {}
        let aligned = align.aligned()?;
        let bias = [
            self.settings.sheet.gyro_bias,
            self.settings.sheet.accel_bias,
        ];
        let [.., [.., heading]] = aligned.covariance(bias);
        if !(0.0..=MAX_HEADING * MAX_HEADING).contains(&heading) {
            align.restart(false); // longer will not do it
            return None;
        }
        let state = nav::State {
            position: fix
                .position
                .displaced(fix.velocity.map(|v| v * f64::from(age))),
            velocity: fix.velocity,
            q_bn: aligned.q_bn,
        };
        let mut by = [[0.0; OUTPUTS]; NAV];
        let mut rest = [[0.0; NAV]; NAV];
        for i in 0..3 {
            by[i] = aligned.by[i];
            for (entry, &value) in rest[i].iter_mut().zip(&aligned.rest[i]) {
                *entry = value;
            }
        }
        for (k, sigma) in sigmas.iter().enumerate() {
            let i = if k < 3 { 6 + k } else { k };
            if let Some(entry) = rest.get_mut(i).and_then(|row| row.get_mut(i)) {
                *entry = sigma * sigma;
            }
        }
        self.navigate(state, &by, &rest)
    }

    /// A navigator in this state at the end of the last sample. Its errors are `by` times the
    /// sensors' errors, plus others of covariance `rest`. `None`: no stream yet, or the state is
    /// outside the range of the equations.
    fn navigate(
        &mut self,
        state: nav::State,
        by: &[[f32; OUTPUTS]; NAV],
        rest: &[[f32; NAV]; NAV],
    ) -> Option<()> {
        let (stream, scale) = (self.stream?, self.scale?);
        let mut config = nav::Config::new(scale.lsb, stream.period_s, self.settings.noise);
        config.piece_samples = divisor(stream.block_samples, config.piece_samples);
        let navigator = Navigator::new(config, state).ok()?;
        self.finish();
        let Memory { bank, work } = &mut *self.memory;
        bank.align_means(by, &[0.0; OUTPUTS]);
        work.clear();
        work.alignment(by, rest);
        self.navigator = Some(navigator);
        Some(())
    }

    /// Starts the navigator in a known state, instead of an alignment at standstill: for recordings
    /// that have none. `state` holds at the end of the last sample (before the first: at the
    /// stream's start); `sigmas` are the standard deviations of its errors, in the order of
    /// [`NAV`]. A navigator that was running is replaced; what has been learnt stays.
    ///
    /// To be called after [`Learner::begin`]. A stream of float samples must have begun, because
    /// their resolution follows from the first one.
    ///
    /// # Errors
    /// [`Reason::NotAvailable`] before that, [`Reason::Range`] for a state that the navigator does
    /// not accept.
    pub fn navigate_from(&mut self, state: nav::State, sigmas: &[f32; NAV]) -> Result<(), Reason> {
        let stream = self.stream.ok_or(Reason::NotAvailable)?;
        self.scale
            .get_or_insert_with(|| Scale::counts_of(stream.lsb));
        let mut rest = [[0.0; NAV]; NAV];
        for (i, (row, sigma)) in rest.iter_mut().zip(sigmas).enumerate() {
            if let Some(entry) = row.get_mut(i) {
                *entry = sigma * sigma;
            }
        }
        let by = [[0.0; OUTPUTS]; NAV];
        self.navigate(state, &by, &rest).ok_or(Reason::Range)
    }

    /// The navigator's solution with all that is known; `None` while it does not navigate. It is
    /// that of the last sample where a block ends, and up to 50 ms older within a block.
    pub fn nav(&mut self) -> Option<nav::State> {
        self.finish();
        self.navigator.as_ref().map(|navigator| *navigator.state())
    }

    /// The hypotheses, for those who observe only. [`FixLearner::finish`] first, else what they
    /// tell is half made.
    pub fn bank(&self) -> &Bank {
        &self.memory.bank
    }

    /// Words that are missing before `number`: a short hole is bridged, a long one ends the navigation.
    fn bridge(&mut self, number: u32) {
        let Some((last, counts)) = self.last else {
            return;
        };
        let missing = number.wrapping_sub(last).wrapping_sub(1);
        if missing == 0 {
            return;
        }
        let time = f64::from(missing) * self.stream.map_or(0.0, |m| m.period_s);
        if let Some(align) = &mut self.align {
            align.gap();
        }
        if time > BRIDGE_S {
            return self.lose();
        }
        let Some(navigator) = &mut self.navigator else {
            return;
        };
        (0..missing).for_each(|_| navigator.sample(&counts));
        let [turn, push] = MISSED.map(|rate| rate * time as f32);
        let (turn, push) = (turn * turn, push * push);
        self.finish();
        let variance = [turn, turn, turn, push, push, push, 0.0, 0.0, 0.0];
        self.memory.bank.inflate(&variance);
    }
}

impl Learner for FixLearner<'_> {
    /// From the datasheet: the hypotheses have networks of their own.
    fn begin(&mut self, _: &Nets, stream: StreamScale) {
        let Settings { sheet, gates, .. } = &self.settings;
        let error_sigma = [1.0; NAV]; // until the alignment tells
        let Memory { bank, work } = &mut *self.memory;
        bank.begin(sheet, f64::from(stream.block_s()), error_sigma, *gates);
        work.clear();
        self.stream = Some(stream);
        self.running = ZERO_CORRECTION;
        self.tally = Tally::default();
        self.restart();
    }

    fn restart(&mut self) {
        let Memory { bank, work } = &mut *self.memory;
        work.clear();
        bank.reset_networks();
        self.fixing = false;
        self.scale = None;
        self.align = None;
        self.navigator = None;
        self.last = None;
        self.last_fix_ms = None;
        self.age = FixAge::default();
    }

    fn sample(&mut self, number: u32, words: &RawSample) {
        let Some(stream) = self.stream else { return };
        let scale = *self
            .scale
            .get_or_insert_with(|| Scale::of(words, &stream.lsb));
        let counts = scale.counts(words);
        self.bridge(number);
        self.last = Some((number, counts));
        let sensors = self.settings.sensors();
        let align = self
            .align
            .get_or_insert_with(|| Align::new(sensors, scale.lsb, stream.period_s));
        align.sample(&counts);
        if let Some(navigator) = &mut self.navigator {
            navigator.sample(&counts);
        }
    }

    fn block(&mut self, _: u32, block: &Block) {
        if self.stream.is_none() {
            return;
        }
        if self.cut().is_some() {
            self.feed_back();
        }
        self.memory.work.step([block.rate, block.force]);
    }

    /// The numbers of the words tell what is missing.
    fn gap(&mut self) {}

    fn silence(&mut self) {
        self.lose();
        self.last = None;
    }

    fn fix(&mut self, number: u32, fix: &Fix) {
        let Some(stream) = self.stream else { return };
        let least = self.settings.fix_age_s;
        let age = self
            .age
            .arrived(number, fix.time_ms, stream.period_s, least);
        let since = self.last_fix_ms.map(|last| fix.time_ms.wrapping_sub(last));
        if since.is_some_and(|ms| ms < FIX_MS) {
            return;
        }
        let (Some(sigmas), Some(align)) = (fix.sigmas, &mut self.align) else {
            return;
        };
        let Some(age) = age else {
            self.tally.late = self.tally.late.saturating_add(1);
            return;
        };
        self.last_fix_ms = Some(fix.time_ms);
        let [.., sigma] = sigmas;
        let speed = nav::speed(&fix.velocity);
        if speed > STANDS_MPS.max(5.0 * sigma) {
            align.moves();
        }
        let still = align.still() >= STILL_S;
        if self.navigator.is_none() {
            self.start(fix, &sigmas, age);
            return;
        }
        let (mut fix, mut sigmas) = (*fix, sigmas);
        if still {
            fix.velocity = [0.0; 3];
            let [.., x, y, z] = &mut sigmas;
            [*x, *y, *z] = [STILL_MPS; 3];
        }
        let Some(navigator) = self.cut() else { return };
        let nav::Innovation { position, velocity } = navigator.innovation(&fix, age);
        let ([a, b, c], [d, e, f]) = (position, velocity);
        self.memory
            .work
            .fix([a, b, c, d, e, f], sigmas.map(|sigma| sigma * sigma));
        self.fixing = true;
        self.tally.used = self.tally.used.saturating_add(1);
    }

    fn align(&mut self, alignment: Alignment) {
        let navigates = self.navigator.is_some();
        match (&mut self.align, alignment) {
            (Some(align), Alignment::Started) if !navigates => align.restart(true),
            (Some(align), Alignment::Finished) => align.finish_command(),
            _ => {}
        }
    }

    fn work(&mut self) -> bool {
        let Memory { bank, work } = &mut *self.memory;
        if self.align.as_mut().is_some_and(Align::sweep) {
            return true;
        }
        self.stream.is_some() && !work.is_done() && bank.work(work)
    }

    fn winner(&mut self) -> Option<Winner> {
        self.finish();
        if self.running == ZERO_CORRECTION {
            return None;
        }
        let bank = &self.memory.bank;
        let [gyro, accel] = bank.nets();
        Some(Winner {
            nets: Nets { gyro, accel },
            states: bank.states(),
            estimate: split(bank.estimate()),
        })
    }

    fn learnt(&mut self) -> (Nets, [State; 2]) {
        self.finish();
        let [gyro, accel] = self.memory.bank.nets();
        (Nets { gyro, accel }, self.memory.bank.states())
    }

    fn report(&self) -> Report {
        Report {
            estimate: split(self.memory.bank.estimate()),
            fixes: self.tally.used,
            refused: self.tally.refused,
            late: self.tally.late,
            winner: self.running as u8,
            promotions: self.tally.promotions,
            rollbacks: self.tally.rollbacks,
            navigates: self.navigator.is_some(),
            still_s: self.align.as_ref().map_or(0, Align::still),
            ..Report::default()
        }
    }
}

#[cfg(test)]
mod tests;
