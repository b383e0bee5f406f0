//! A block or a fix in parts, each short enough to be computed between two samples. Part for part
//! it is the arithmetic of [`Bank::propagate`], [`Bank::fix`] and [`Bank::step`].

use super::table::LARGEST;
use super::{ALL, Bank, NAV, OUTPUTS, TRIADS, ZERO_CORRECTION, index};
use crate::fix::OBSERVATIONS;
use lrnn_nostd::Real;
use lrnn_nostd::learn::kalman::{
    COVARIANCE_PARTS, DEFERRED_PARTS, MAX_DEFERRED, Transition, Workspace,
};

const LARGE_ONLY: u8 = 1 << LARGEST;
const SMALL: u8 = ALL & !LARGE_ONLY;

// Parts are numbered in the order in which they are computed. Each constant is the first part of
// its kind: covariances of the small hypotheses, then of the largest; the observations of a fix;
// the end of the fix; the networks' step; no part left.

const PROPAGATE_LARGE: usize = LARGEST;
const UPDATE: usize = PROPAGATE_LARGE + COVARIANCE_PARTS;
/// Observations that are deferred together, two parts each, and the change that they make in the
/// largest covariance.
const GROUP: usize = 2 * MAX_DEFERRED + DEFERRED_PARTS;
const FINISH_UPDATE: usize = UPDATE + OBSERVATIONS / MAX_DEFERRED * GROUP;
const STEP: usize = FINISH_UPDATE + 2;
const END: usize = STEP + 2;

/// Deferred work, in this order: the covariances over an interval, a fix at its end, the networks'
/// step.
#[derive(Clone, Debug)]
pub struct Work<T: Real = f32> {
    next: usize,
    block: Transition<NAV, T>,
    workspace: Workspace<NAV, OUTPUTS, T>,
    fix: Option<([T; OBSERVATIONS], [T; OBSERVATIONS])>,
    inputs: Option<[[T; 3]; TRIADS]>,
    accepted: bool,
    /// The interval is an alignment instead: `block.gamma` and `block.q` then hold its `by` and
    /// `rest`.
    aligns: bool,
    /// The refused observations of the last fix, one bit each.
    pub refused: u8,
}

impl<T: Real> Work<T> {
    /// All zeros, so that a static one takes no room in flash.
    pub const ZEROED: Self = Self {
        next: 0,
        block: Transition::ZEROED,
        workspace: Workspace::ZEROED,
        fix: None,
        inputs: None,
        accepted: false,
        aligns: false,
        refused: 0,
    };

    /// All parts are done.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.next >= END
    }

    /// An interval that the navigator has passed. Its means are propagated already
    /// ([`Bank::propagate_mean`]).
    pub fn interval(&mut self, block: &Transition<NAV, T>) {
        self.block = *block;
        self.aligns = false;
        self.next = 0;
    }

    /// A new navigator, aligned at standstill. Its means are set already ([`Bank::align_means`]);
    /// `by` and `rest` as in [`Bank::align`].
    pub fn alignment(&mut self, by: &[[T; OUTPUTS]; NAV], rest: &[[T; NAV]; NAV]) {
        (self.block.gamma, self.block.q) = (*by, *rest);
        self.aligns = true;
        self.next = 0;
    }

    /// A fix at the end of the interval.
    pub fn fix(&mut self, z: [T; OBSERVATIONS], variance: [T; OBSERVATIONS]) {
        self.fix = Some((z, variance));
        self.refused = 0;
        self.next = self.next.min(UPDATE);
    }

    /// The networks step at the end.
    pub fn step(&mut self, inputs: [[T; 3]; TRIADS]) {
        self.inputs = Some(inputs);
        self.next = self.next.min(STEP);
    }

    /// Drops all work.
    pub fn clear(&mut self) {
        self.next = END;
        self.fix = None;
        self.inputs = None;
    }
}

impl<T: Real> Bank<T> {
    /// The means of [`Bank::propagate`]; the rest follows by [`Bank::work`].
    pub fn propagate_mean(&mut self, block: &Transition<NAV, T>, applied: &[T; OUTPUTS]) {
        self.each(|h| h.propagate_mean(block, applied));
    }

    /// The means of [`Bank::align`]; the rest follows by [`Bank::work`].
    pub fn align_means(&mut self, by: &[[T; OUTPUTS]; NAV], applied: &[T; OUTPUTS]) {
        self.each(|h| h.align_mean(by, applied));
    }

    /// Computes one part of `work`, some ten thousand instructions. True: there is more.
    pub fn work(&mut self, work: &mut Work<T>) -> bool {
        match work.next {
            part @ 0..PROPAGATE_LARGE => {
                (0..COVARIANCE_PARTS).for_each(|of| self.propagate_covariance(part, of, work))
            }
            part @ PROPAGATE_LARGE..UPDATE => {
                self.propagate_covariance(LARGEST, part - PROPAGATE_LARGE, work)
            }
            part @ UPDATE..FINISH_UPDATE => self.update(part - UPDATE, work),
            FINISH_UPDATE if work.fix.is_some() => self.some(SMALL, |h| h.finish_update()),
            part if part == FINISH_UPDATE + 1 && work.fix.take().is_some() => {
                self.some(LARGE_ONLY, |h| h.finish_update());
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
            UPDATE if work.fix.is_none() => STEP,
            next => next,
        };
        if work.next == STEP && work.inputs.is_none() {
            work.next = END;
        }
        !work.is_done()
    }

    /// A part of a hypothesis' covariance over the interval, or after the alignment.
    fn propagate_covariance(&mut self, which: usize, part: usize, work: &mut Work<T>) {
        let (block, workspace) = (&work.block, &mut work.workspace);
        if !work.aligns {
            return self.some(1 << which, |h| {
                h.propagate_covariance(part, block, workspace)
            });
        }
        let (by, rest) = (&block.gamma, &block.q);
        let rest = if which == ZERO_CORRECTION {
            self.unmodelled(by, rest)
        } else {
            *rest
        };
        self.some(1 << which, |h| {
            h.align_covariance(part, by, &rest, workspace)
        });
    }

    fn update(&mut self, part: usize, work: &mut Work<T>) {
        let (group, part) = (part / GROUP, part % GROUP);
        if part >= 2 * MAX_DEFERRED {
            return self.some(LARGE_ONLY, |h| _ = h.apply_deferred());
        }
        let k = group * MAX_DEFERRED + part / 2;
        let Some((z, variance)) = work.fix else {
            return;
        };
        let (Some(&z), Some(&variance)) = (z.get(k), variance.get(k)) else {
            return;
        };
        let which = if part.is_multiple_of(2) {
            work.accepted = self.accepts(k, z, variance);
            work.refused |= u8::from(!work.accepted) << k;
            SMALL
        } else {
            LARGE_ONLY
        };
        if work.accepted {
            let i = index(k);
            self.some(which, |h| h.update(i, h.innovation(i, z, variance)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::Settings;
    use crate::learn::bank::Gates;
    use crate::learn::bank::HYPOTHESES;

    /// Plain repeatable numbers between -1 and 1.
    struct Numbers(u32);

    impl Numbers {
        fn next(&mut self, size: f32) -> f32 {
            self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            size * ((self.0 >> 8) as f32 / 8_388_608.0 - 1.0)
        }

        fn block(&mut self) -> Transition<NAV, f32> {
            let mut block: Transition<NAV, f32> = Work::ZEROED.block;
            block.time = 1.0;
            for i in 0..3 {
                for j in 0..3 {
                    block.gamma[i][j] = self.next(1.0);
                    block.gamma[3 + i][3 + j] = self.next(1.0);
                    block.phi[3 + i][j] = self.next(10.0);
                }
                block.phi[6 + i][3 + i] = 1.0;
                block.q[i][i] = 1e-12;
                block.q[3 + i][3 + i] = 1e-6;
            }
            (0..NAV).for_each(|i| block.phi[i][i] = 1.0);
            block
        }
    }

    fn same(a: &Bank, b: &Bank) {
        assert_eq!(a.running(), b.running());
        assert_eq!(a.feed_back_of(), b.feed_back_of());
        for h in 0..HYPOTHESES {
            assert_eq!(a.estimate_of(h), b.estimate_of(h), "{h}");
            assert_eq!(a.evidence(h).to_bits(), b.evidence(h).to_bits(), "{h}");
        }
        assert!(a.hypotheses == b.hypotheses);
    }

    impl Bank {
        fn feed_back_of(&self) -> [f32; NAV] {
            *self.get(self.running).error_state()
        }
    }

    /// In parts and at once, with outliers and fixes that are no numbers.
    #[test]
    fn parts_are_the_whole() {
        let sheet = Settings::MEDIUM.sheet;
        let new = || Bank::new(&sheet, 1.0, [1e-2; NAV], Gates::default());
        let (mut whole, mut parted) = (Box::new(new()), Box::new(new()));
        let mut work: Work = Work::ZEROED;
        let mut numbers = Numbers(7);
        for k in 0..60 {
            let block = numbers.block();
            let mut z = [1.0, 1.0, 1.0, 0.1, 0.1, 0.1].map(|size| numbers.next(size));
            let variance = [1.0, 1.0, 1.0, 0.01, 0.01, 0.01];
            let inputs = [0.2, 2.0].map(|size| [0; 3].map(|_| numbers.next(size)));
            match k {
                20 => z[1] = f32::NAN,
                30 => z[4] = 1e6,
                _ => {}
            }
            let applied = [1e-7; OUTPUTS];
            whole.propagate(&block, &applied);
            let refused = whole.fix(&z, &variance);
            whole.step(inputs);

            parted.propagate_mean(&block, &applied);
            work.clear();
            work.interval(&block);
            work.fix(z, variance);
            work.step(inputs);
            let parts = 1 + (0..).take_while(|_| parted.work(&mut work)).count();
            assert_eq!(parts, END);
            assert_eq!(work.refused, refused);
            assert_eq!(refused != 0, k == 20 || k == 30, "{k} {refused}");
            same(&whole, &parted);
        }
        // an alignment, an interval without a fix, and a step without an interval
        let (by, rest) = (numbers.block().gamma, numbers.block().q);
        whole.align(&by, &rest, &[1e-7; OUTPUTS]);
        parted.align_means(&by, &[1e-7; OUTPUTS]);
        work.clear();
        work.alignment(&by, &rest);
        while parted.work(&mut work) {}
        same(&whole, &parted);
        let (block, applied) = (numbers.block(), [0.0; OUTPUTS]);
        whole.propagate(&block, &applied);
        parted.propagate_mean(&block, &applied);
        work.clear();
        work.interval(&block);
        while parted.work(&mut work) {}
        same(&whole, &parted);
        whole.step([[0.1; 3]; 2]);
        work.clear();
        work.step([[0.1; 3]; 2]);
        assert_eq!(1 + (0..).take_while(|_| parted.work(&mut work)).count(), 2);
        same(&whole, &parted);
    }
}
