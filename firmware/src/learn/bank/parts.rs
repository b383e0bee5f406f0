//! A block or a fix in parts, each short enough to be done between two words. Part for part it is the arithmetic of
//! [`Bank::predict`], [`Bank::fix`] and [`Bank::step`].

use super::{ALL, Bank, HYPOTHESES, NAV, OBSERVATIONS, OUTPUTS, TRIADS, index};
use lrnn_nostd::Real;
use lrnn_nostd::learn::kalman::{PARTS, Passage, Transition};

/// The last hypothesis is by far the largest: its parts are done one by one.
const LARGE: usize = HYPOTHESES - 1;
const LARGE_ONLY: u8 = 1 << LARGE;
const SMALL: u8 = ALL & !LARGE_ONLY;

const SPREAD_LARGE: usize = LARGE;
const OBSERVE: usize = SPREAD_LARGE + PARTS;
const SETTLE: usize = OBSERVE + 2 * OBSERVATIONS;
const STEP: usize = SETTLE + 2;
const END: usize = STEP + 2;

/// What is put off, in this order: the covariances over an interval, a fix at its end, the networks' step.
#[derive(Clone, Debug)]
pub struct Work<T: Real = f32> {
    next: usize,
    block: Transition<NAV, T>,
    passage: Passage<NAV, OUTPUTS, T>,
    fix: Option<([T; OBSERVATIONS], [T; OBSERVATIONS])>,
    inputs: Option<[[T; 3]; TRIADS]>,
    believed: bool,
    /// What the last fix had refused, one bit an observation.
    pub refused: u8,
}

impl<T: Real> Work<T> {
    /// All zeros; nothing to do is [`Work::is_done`].
    pub const BLANK: Self = Self {
        next: 0,
        block: Transition {
            phi: [[T::ZERO; NAV]; NAV],
            gamma: [[T::ZERO; OUTPUTS]; NAV],
            q: [[T::ZERO; NAV]; NAV],
            time: T::ZERO,
        },
        passage: Passage::BLANK,
        fix: None,
        inputs: None,
        believed: false,
        refused: 0,
    };

    /// Nothing is left to do.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.next >= END
    }

    /// An interval that the navigator has been through, its means carried ([`Bank::carry`]).
    pub fn interval(&mut self, block: &Transition<NAV, T>) {
        self.block = *block;
        self.next = 0;
    }

    /// A fix at the end of the interval.
    pub fn fix(&mut self, z: [T; OBSERVATIONS], variance: [T; OBSERVATIONS]) {
        self.fix = Some((z, variance));
        self.refused = 0;
        self.next = self.next.min(OBSERVE);
    }

    /// The networks step at the end.
    pub fn step(&mut self, inputs: [[T; 3]; TRIADS]) {
        self.inputs = Some(inputs);
        self.next = self.next.min(STEP);
    }

    /// Nothing is to be done.
    pub fn clear(&mut self) {
        self.next = END;
        self.fix = None;
        self.inputs = None;
    }
}

impl<T: Real> Bank<T> {
    /// The means of [`Bank::predict`]; the rest follows by [`Bank::work`].
    pub fn carry(&mut self, block: &Transition<NAV, T>, applied: &[T; OUTPUTS]) {
        self.each(|h| h.carry(block, applied));
    }

    /// A part of `work`, some ten thousand instructions; whether there is more.
    pub fn work(&mut self, work: &mut Work<T>) -> bool {
        match work.next {
            part @ 0..SPREAD_LARGE => {
                let (block, passage) = (&work.block, &mut work.passage);
                self.some(1 << part, |h| {
                    (0..PARTS).for_each(|part| h.spread(part, block, passage));
                });
            }
            part @ SPREAD_LARGE..OBSERVE => {
                let (block, passage) = (&work.block, &mut work.passage);
                self.some(LARGE_ONLY, |h| {
                    h.spread(part - SPREAD_LARGE, block, passage)
                });
            }
            part @ OBSERVE..SETTLE => self.observe(part - OBSERVE, work),
            SETTLE if work.fix.is_some() => self.some(SMALL, |h| h.settle()),
            part if part == SETTLE + 1 && work.fix.take().is_some() => {
                self.some(LARGE_ONLY, |h| h.settle());
                self.choose();
            }
            STEP => {
                if let Some(inputs) = work.inputs {
                    self.some(SMALL, |h| h.step(inputs));
                }
            }
            part if part == STEP + 1 => {
                if let Some(inputs) = work.inputs.take() {
                    self.some(LARGE_ONLY, |h| h.step(inputs));
                }
            }
            _ => {}
        }
        work.next = match work.next + 1 {
            OBSERVE if work.fix.is_none() => STEP,
            next => next,
        };
        if work.next == STEP && work.inputs.is_none() {
            work.next = END;
        }
        !work.is_done()
    }

    /// Two parts an observation.
    fn observe(&mut self, part: usize, work: &mut Work<T>) {
        let k = part / 2;
        let Some((z, variance)) = work.fix else {
            return;
        };
        let (Some(&z), Some(&variance)) = (z.get(k), variance.get(k)) else {
            return;
        };
        let which = if part.is_multiple_of(2) {
            work.believed = self.believes(k, z, variance);
            work.refused |= u8::from(!work.believed) << k;
            SMALL
        } else {
            LARGE_ONLY
        };
        if work.believed {
            let i = index(k);
            self.some(which, |h| h.observe(i, h.innovation(i, z, variance)));
        }
    }
}
