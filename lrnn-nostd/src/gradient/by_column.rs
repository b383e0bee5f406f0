//! The recursion in the order that suits a Cortex-M: all work on one parameter while its three
//! values are in registers.

use super::columns::{BY_COLUMN, Columns};
use super::recursion::Recursion;
use crate::real::Real;
use crate::shape::{B, Feedback, NEURONS, PARAMS_PER_LAYER, R};
use crate::weights::Layer;

/// Columns per block of straight code; all lengths are multiples of it.
const BLOCK: usize = 3;

/// Keeps the compiler from interleaving columns. There are enough registers for one column; with
/// several the compiler spills. It emits no instruction.
#[inline(always)]
pub(super) fn in_order() {
    if BY_COLUMN {
        core::sync::atomic::compiler_fence(core::sync::atomic::Ordering::SeqCst);
    }
}

/// l > m: s_j = sum_i r_ji s_i(k-1) + sum_i w_ji below_i(k) for LEN parameters of the lower layers,
/// from `first` on.
#[inline(always)]
pub(super) fn lower_parameters<
    F: Feedback,
    T: Real,
    const N: usize,
    const M: usize,
    const LEN: usize,
>(
    first: usize,
    s: &mut Columns<T, N>,
    below: &Columns<T, M>,
    m: &Recursion<T>,
    each: &mut impl ForEachParameter<T>,
) {
    for block in 0..LEN / BLOCK {
        for k in 0..BLOCK {
            let k = BLOCK * block + k;
            let (under, before) = (below.at(first + k), s.at(first + k));
            let after = m.lower_terms(m.feedback_terms::<F>(before), under);
            s.put(first + k, after);
            each.parameter(k, &after);
            in_order();
        }
        each.end_block();
    }
}

/// l = m: s_j = sum_i r_ji s_i(k-1) for the layer's own parameters, the last 21 of N. Those of unit
/// p = j also get f'(x_p) d.
#[inline(always)]
pub(super) fn own_parameters<F: Feedback, T: Real, const N: usize>(
    s: &mut Columns<T, N>,
    m: &Recursion<T>,
    each: &mut impl ForEachParameter<T>,
) {
    unit::<F, T, N, 0>(s, m, each);
    unit::<F, T, N, 1>(s, m, each);
    unit::<F, T, N, 2>(s, m, each);
}

/// The seven parameters of unit P. P is known at compile time, so this is straight code.
#[inline(always)]
fn unit<F: Feedback, T: Real, const N: usize, const P: usize>(
    s: &mut Columns<T, N>,
    m: &Recursion<T>,
    each: &mut impl ForEachParameter<T>,
) {
    let first = N - PARAMS_PER_LAYER;
    let mut one = |k: usize, direct: Option<T>| {
        let mut after = m.feedback_terms::<F>(s.at(first + k));
        if let Some(direct) = direct {
            after[P] += direct;
        }
        s.put(first + k, after);
        each.parameter(k, &after);
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
    each.end_block();
}

/// What to do with the s_j, j = 0..3, of parameter `k` as soon as they are known.
pub(super) trait ForEachParameter<T> {
    fn parameter(&mut self, k: usize, s: &[T; NEURONS]);
    /// Called after each block of parameters.
    fn end_block(&mut self);
}

/// Does nothing with the values.
pub(super) struct Ignore;

/// Detects overflows with a sum of products of all values. It is finite only if every value is,
/// since no product and no sum with a non-finite value is finite. It may also overflow although all
/// values are finite; then each value has to be checked.
pub(super) struct OverflowCheck<T> {
    sum: T,
    held: Option<T>,
}

/// theta -= sum_j g_j s_j for a part of a layer's parameters. Each new theta depends on all three
/// s_j, so the overflow check watches theta.
pub(super) struct DescendPart<'a, T> {
    pub(super) theta: &'a mut [T],
    pub(super) g: [T; NEURONS],
    pub(super) check: &'a mut OverflowCheck<T>,
}

/// The same for a layer's 21 parameters.
pub(super) struct DescendLayer<'a, T> {
    pub(super) layer: &'a mut Layer<T>,
    pub(super) g: [T; NEURONS],
    pub(super) check: &'a mut OverflowCheck<T>,
}

impl<T> ForEachParameter<T> for Ignore {
    #[inline(always)]
    fn parameter(&mut self, _: usize, _: &[T; NEURONS]) {}
    #[inline(always)]
    fn end_block(&mut self) {}
}

impl<T: Real> OverflowCheck<T> {
    pub(super) const NEW: Self = Self {
        sum: T::ZERO,
        held: None,
    };

    #[inline(always)]
    pub(super) fn passed(&self) -> bool {
        self.sum.is_finite()
    }

    #[inline(always)]
    fn watch(&mut self, value: T) {
        match self.held.take() {
            Some(held) => self.sum += held * value,
            None => self.held = Some(value),
        }
    }

    /// Adds a value that has no partner yet. No value is kept from one block to the next, so that
    /// loops over blocks stay loops.
    #[inline(always)]
    fn flush(&mut self) {
        if let Some(held) = self.held.take() {
            self.sum += held;
        }
    }
}

impl<T: Real> ForEachParameter<T> for OverflowCheck<T> {
    #[inline(always)]
    fn parameter(&mut self, _: usize, [a, b, c]: &[T; NEURONS]) {
        self.sum += *a * *b;
        self.sum += *c;
    }
    #[inline(always)]
    fn end_block(&mut self) {}
}

impl<T: Real> ForEachParameter<T> for DescendPart<'_, T> {
    #[inline(always)]
    fn parameter(&mut self, k: usize, s: &[T; NEURONS]) {
        if let Some(theta) = self.theta.get_mut(k) {
            descend(theta, &self.g, s);
            self.check.watch(*theta);
        }
    }
    #[inline(always)]
    fn end_block(&mut self) {
        self.check.flush();
    }
}

impl<T: Real> ForEachParameter<T> for DescendLayer<'_, T> {
    #[inline(always)]
    fn parameter(&mut self, k: usize, s: &[T; NEURONS]) {
        let Layer { w, r, b } = self.layer;
        let theta = match k {
            0..R => w.as_flattened_mut().get_mut(k),
            R..B => r.as_flattened_mut().get_mut(k - R),
            _ => b.get_mut(k - B),
        };
        if let Some(theta) = theta {
            descend(theta, &self.g, s);
            self.check.watch(*theta);
        }
    }
    #[inline(always)]
    fn end_block(&mut self) {
        self.check.flush();
    }
}

/// theta -= sum_j g_j s_j of one parameter.
#[inline(always)]
pub(super) fn descend<T: Real>(theta: &mut T, g: &[T; NEURONS], s: &[T; NEURONS]) {
    for j in 0..NEURONS {
        *theta -= g[j] * s[j];
    }
}
