//! The recursion as a Cortex-M likes it: everything about one parameter while its three values are in registers.

use super::columns::{BY_COLUMN, Columns};
use super::motion::Motion;
use crate::real::Real;
use crate::shape::{B, Feedback, NEURONS, PARAMS_PER_LAYER, R};
use crate::weights::Layer;

/// Columns in straight code; all lengths are multiples of it.
const BLOCK: usize = 3;

/// Keeps the compiler from mixing the columns: there are registers for one, and of several it spills. No instruction.
#[inline(always)]
pub(super) fn in_order() {
    if BY_COLUMN {
        core::sync::atomic::compiler_fence(core::sync::atomic::Ordering::SeqCst);
    }
}

/// l > m: s_j = sum_i r_ji s_i(k-1) + sum_i w_ji below_i(k) for LEN parameters of the layers below, from `first` on.
#[inline(always)]
pub(super) fn inherit<F: Feedback, T: Real, const N: usize, const M: usize, const LEN: usize>(
    first: usize,
    s: &mut Columns<T, N>,
    below: &Columns<T, M>,
    m: &Motion<T>,
    then: &mut impl Then<T>,
) {
    for block in 0..LEN / BLOCK {
        for k in 0..BLOCK {
            let k = BLOCK * block + k;
            let (under, before) = (below.at(first + k), s.at(first + k));
            let after = m.inherited(m.fed_back::<F>(before), under);
            s.put(first + k, after);
            then.then(k, &after);
            in_order();
        }
        then.pause();
    }
}

/// l = m: s_j = sum_i r_ji s_i(k-1) for the layer's own parameters, the last 21 of N, and f'(x_p) d more for those of unit p = j.
#[inline(always)]
pub(super) fn own<F: Feedback, T: Real, const N: usize>(
    s: &mut Columns<T, N>,
    m: &Motion<T>,
    then: &mut impl Then<T>,
) {
    unit::<F, T, N, 0>(s, m, then);
    unit::<F, T, N, 1>(s, m, then);
    unit::<F, T, N, 2>(s, m, then);
}

/// The seven parameters of unit P: straight code, since P is known when it is compiled.
#[inline(always)]
fn unit<F: Feedback, T: Real, const N: usize, const P: usize>(
    s: &mut Columns<T, N>,
    m: &Motion<T>,
    then: &mut impl Then<T>,
) {
    let first = N - PARAMS_PER_LAYER;
    let mut one = |k: usize, direct: Option<T>| {
        let mut after = m.fed_back::<F>(s.at(first + k));
        if let Some(direct) = direct {
            after[P] += direct;
        }
        s.put(first + k, after);
        then.then(k, &after);
        in_order();
    };
    for q in 0..NEURONS {
        one(NEURONS * P + q, Some(m.slope[P] * m.below[q]));
    }
    for q in 0..NEURONS {
        let direct = (F::FULL || P == q).then(|| m.slope[P] * m.last[q]);
        one(R + NEURONS * P + q, direct);
    }
    one(B + P, Some(m.slope[P]));
    then.pause();
}

/// What is done with s_j, j = 0..3, of parameter `k` of a part as soon as it is known.
pub(super) trait Then<T> {
    fn then(&mut self, k: usize, s: &[T; NEURONS]);
    /// After a block of parameters.
    fn pause(&mut self);
}

/// Nothing.
pub(super) struct Nothing;

/// A sum of products of all values: finite only if every value is, since no product and no sum with a non-finite value is finite. It
/// may overflow although all values are finite, so what it says is to look at each.
pub(super) struct Alarm<T> {
    sum: T,
    held: Option<T>,
}

/// theta -= sum_j g_j s_j of a part of a layer's parameters. In each of the new theta all three s_j have a part: they are what
/// the alarm looks at.
pub(super) struct Part<'a, T> {
    pub(super) theta: &'a mut [T],
    pub(super) g: [T; NEURONS],
    pub(super) alarm: &'a mut Alarm<T>,
}

/// The same of a layer's 21 parameters.
pub(super) struct Whole<'a, T> {
    pub(super) layer: &'a mut Layer<T>,
    pub(super) g: [T; NEURONS],
    pub(super) alarm: &'a mut Alarm<T>,
}

impl<T> Then<T> for Nothing {
    #[inline(always)]
    fn then(&mut self, _: usize, _: &[T; NEURONS]) {}
    #[inline(always)]
    fn pause(&mut self) {}
}

impl<T: Real> Alarm<T> {
    pub(super) const SILENT: Self = Self {
        sum: T::ZERO,
        held: None,
    };

    #[inline(always)]
    pub(super) fn is_silent(&self) -> bool {
        self.sum.is_finite()
    }

    #[inline(always)]
    fn look(&mut self, value: T) {
        match self.held.take() {
            Some(held) => self.sum += held * value,
            None => self.held = Some(value),
        }
    }

    /// Nothing is held from one block to the next: loops over blocks stay loops.
    #[inline(always)]
    fn settle(&mut self) {
        if let Some(held) = self.held.take() {
            self.sum += held;
        }
    }
}

impl<T: Real> Then<T> for Alarm<T> {
    #[inline(always)]
    fn then(&mut self, _: usize, [a, b, c]: &[T; NEURONS]) {
        self.sum += *a * *b;
        self.sum += *c;
    }
    #[inline(always)]
    fn pause(&mut self) {}
}

impl<T: Real> Then<T> for Part<'_, T> {
    #[inline(always)]
    fn then(&mut self, k: usize, s: &[T; NEURONS]) {
        if let Some(theta) = self.theta.get_mut(k) {
            descend(theta, &self.g, s);
            self.alarm.look(*theta);
        }
    }
    #[inline(always)]
    fn pause(&mut self) {
        self.alarm.settle();
    }
}

impl<T: Real> Then<T> for Whole<'_, T> {
    #[inline(always)]
    fn then(&mut self, k: usize, s: &[T; NEURONS]) {
        let Layer { w, r, b } = self.layer;
        let theta = match k {
            0..R => w.as_flattened_mut().get_mut(k),
            R..B => r.as_flattened_mut().get_mut(k - R),
            _ => b.get_mut(k - B),
        };
        if let Some(theta) = theta {
            descend(theta, &self.g, s);
            self.alarm.look(*theta);
        }
    }
    #[inline(always)]
    fn pause(&mut self) {
        self.alarm.settle();
    }
}

/// theta -= sum_j g_j s_j of one parameter.
#[inline(always)]
pub(super) fn descend<T: Real>(theta: &mut T, g: &[T; NEURONS], s: &[T; NEURONS]) {
    for j in 0..NEURONS {
        *theta -= g[j] * s[j];
    }
}
