//! Pieces of work whose size is a parameter. They show how the cost grows with the size, and are
//! measured in the same way as those of fixed size.

use core::fmt;

use firmware::compensator::{self, Compensator, Limit};
use firmware::nav::Navigator;
use lrnn_nostd::Rational;
use lrnn_nostd::learn::kalman::{
    AllWeights, Biases, DiagonalWeights, NoParameters, OutputWeights, ParameterSet,
};

use crate::learning::{FixWork, ShadowSecondWork};
use crate::list::Measure;
use crate::navigation::{LSB, RATE, navigator, sample, verdict};
use crate::net;
use crate::work::{NetworkWork, Portable, WorkResult};

/// Measures every size, named by kind and size; before them `empty`, the loop without work.
///
/// # Errors
/// As [`Measure::measure`].
pub fn all(on: &mut impl Measure) -> fmt::Result {
    on.measure("empty", false, |input| (input, true))?;
    rate(on, "rate/100", 100)?;
    rate(on, "rate/200", 200)?;
    rate(on, "rate/500", 500)?;
    rate(on, "rate/1000", 1000)?;
    rate(on, "rate/2000", 2000)?;
    rate(on, "rate/4000", 4000)?;
    nets::<1>(on, "nets/1")?;
    nets::<2>(on, "nets/2")?;
    nets::<4>(on, "nets/4")?;
    nets::<8>(on, "nets/8")?;
    nets::<16>(on, "nets/16")?;
    fix::<NoParameters, 0, 0>(on, "weights/0", false)?;
    fix::<Biases, 6, 21>(on, "weights/6", false)?;
    fix::<OutputWeights, 24, 300>(on, "weights/24", true)?;
    fix::<DiagonalWeights, 96, 4656>(on, "weights/96", true)?;
    fix::<AllWeights, 132, 8778>(on, "weights/132", true)?;
    candidates::<1>(on, "candidates/1")?;
    candidates::<2>(on, "candidates/2")?;
    candidates::<4>(on, "candidates/4")?;
    candidates::<8>(on, "candidates/8")?;
    navigators::<1>(on, "navigators/1")?;
    navigators::<2>(on, "navigators/2")?;
    navigators::<4>(on, "navigators/4")?;
    coasts::<1>(on, "coasts/1")?;
    coasts::<2>(on, "coasts/2")?;
    coasts::<4>(on, "coasts/4")?;
    coasts::<12>(on, "coasts/12")
}

// Each in a function of its own, so that the memory of the works is not on the stack together.

#[inline(never)]
fn rate(on: &mut impl Measure, name: &'static str, samples: u16) -> fmt::Result {
    let mut work = RateWork::new(samples).ok_or(fmt::Error)?;
    on.measure(name, true, |input| work.run(input))
}

#[inline(never)]
fn nets<const K: usize>(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut work = NetsWork::<K>::new();
    on.measure(name, false, |input| work.run(input))
}

#[inline(never)]
fn fix<L: ParameterSet, const N: usize, const PACKED: usize>(
    on: &mut impl Measure,
    name: &'static str,
    long: bool,
) -> fmt::Result {
    let mut work = FixWork::<L, N, PACKED>::ZEROED;
    work.begin();
    on.measure(name, long, |input| work.run(input))
}

#[inline(never)]
fn candidates<const K: usize>(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut works = [Candidate::ZEROED; K];
    works.iter_mut().for_each(Candidate::begin);
    on.measure(name, true, |input| {
        works.iter_mut().fold(([0.0; 3], true), |last, work| {
            let (error, good) = work.run(input);
            (error, last.1 && good)
        })
    })
}

#[inline(never)]
fn navigators<const K: usize>(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut work = NavigatorsWork::<K>::new().ok_or(fmt::Error)?;
    on.measure(name, true, |input| work.run(input))
}

#[inline(never)]
fn coasts<const K: usize>(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut work = ShadowSecondWork::<K>::ZEROED;
    work.begin();
    on.measure(name, true, |input| work.run(input))
}

/// A hypothesis of the learner that learns the 24 output weights from a fix.
type Candidate = FixWork<OutputWeights, 24, 300>;

/// Seconds after which the navigator starts again: no navigator runs for hours without a fix.
const FRESH: u32 = 300;

/// A second of data: each sample passes through the compensator with two networks, which step once,
/// and into the navigator. At the end the transition of the navigator is taken.
#[derive(Clone, Debug)]
pub struct RateWork {
    compensator: Compensator,
    state: compensator::State,
    navigator: Navigator,
    start: Navigator,
    seconds: u32,
    samples: u16,
}

impl RateWork {
    /// Never `None`: the configuration is valid for every rate that is measured.
    pub fn new(samples: u16) -> Option<Self> {
        let limit = Limit {
            gyro: 1e-4,
            accel: 0.1,
        };
        let dt = 1.0 / f64::from(samples);
        let start = navigator(samples.into(), None)?;
        Some(Self {
            compensator: Compensator::new(net(), net(), LSB, dt, samples, limit).ok()?,
            state: compensator::State::default(),
            navigator: start.clone(),
            start,
            seconds: 0,
            samples,
        })
    }

    /// One repetition.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> WorkResult {
        self.seconds += 1;
        if self.seconds.is_multiple_of(FRESH) {
            self.navigator = self.start.clone();
        }
        for _ in 0..self.samples {
            let sample = sample(input, self.samples.into());
            let (corrected, _) = self.compensator.process(&mut self.state, sample);
            self.navigator.sample(&corrected);
        }
        let transition = self.navigator.take_transition();
        let (found, good) = verdict(&self.navigator, transition.phi[8][5]);
        let whole = (transition.time - 1.0).abs() < 1e-3;
        (found, good && whole && self.state.faults == 0)
    }
}

/// K networks, each with its own state, exact gradient and weights. All make a step and move their
/// weights.
#[derive(Clone, Debug)]
pub struct NetsWork<const K: usize>([NetworkWork<Portable<Rational>>; K]);

impl<const K: usize> NetsWork<K> {
    /// In the state before the first step.
    pub fn new() -> Self {
        Self(core::array::from_fn(|_| NetworkWork::new()))
    }

    /// One repetition.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> WorkResult {
        let mut last = ([0.0; 3], true);
        for net in &mut self.0 {
            let (error, good) = net.descent(input);
            last = (error, last.1 && good);
        }
        last
    }
}

impl<const K: usize> Default for NetsWork<K> {
    fn default() -> Self {
        Self::new()
    }
}

/// A second of 200 samples in K navigators of their own, each with its transition at the end.
#[derive(Clone, Debug)]
pub struct NavigatorsWork<const K: usize> {
    navigators: [Navigator; K],
    start: Navigator,
    seconds: u32,
}

impl<const K: usize> NavigatorsWork<K> {
    /// Never `None`: the configuration is valid.
    pub fn new() -> Option<Self> {
        let start = navigator(RATE, None)?;
        Some(Self {
            navigators: core::array::from_fn(|_| start.clone()),
            start,
            seconds: 0,
        })
    }

    /// One repetition.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> WorkResult {
        self.seconds += 1;
        if self.seconds.is_multiple_of(FRESH) {
            self.navigators.fill(self.start.clone());
        }
        let sample = sample(input, RATE);
        for _ in 0..RATE {
            self.navigators.iter_mut().for_each(|n| n.sample(&sample));
        }
        let mut last = ([0.0; 3], true);
        for navigator in &mut self.navigators {
            let transition = navigator.take_transition();
            let (found, good) = verdict(navigator, transition.phi[8][5]);
            let whole = (transition.time - 1.0).abs() < 1e-3;
            last = (found, last.1 && good && whole);
        }
        last
    }
}
