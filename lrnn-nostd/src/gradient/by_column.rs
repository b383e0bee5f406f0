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

/// l > m: s_j = sum_i r_ji s_i(k-1) + sum_i w_ji below_i(k) for the M parameters of the lower
/// layers.
#[inline(always)]
pub(super) fn lower_parameters<F: Feedback, T: Real, const N: usize, const M: usize>(
    s: &mut Columns<T, N>,
    below: &Columns<T, M>,
    m: &Recursion<T>,
    each: &mut impl ForEachParameter<T>,
) {
    for block in 0..M / BLOCK {
        lower_block::<F, T, N, M>(BLOCK * block, s, below, m, each);
    }
}

/// [`lower_parameter`] for three parameters from `first` on. Written out: some levels of
/// optimisation would keep a loop.
#[inline(always)]
pub(super) fn lower_block<F: Feedback, T: Real, const N: usize, const M: usize>(
    first: usize,
    s: &mut Columns<T, N>,
    below: &Columns<T, M>,
    m: &Recursion<T>,
    each: &mut impl ForEachParameter<T>,
) {
    lower_parameter::<F, T, N, M>(first, s, below, m, 0, each);
    lower_parameter::<F, T, N, M>(first + 1, s, below, m, 1, each);
    lower_parameter::<F, T, N, M>(first + 2, s, below, m, 2, each);
    each.end_block();
}

#[inline(always)]
fn lower_parameter<F: Feedback, T: Real, const N: usize, const M: usize>(
    theta: usize,
    s: &mut Columns<T, N>,
    below: &Columns<T, M>,
    m: &Recursion<T>,
    k: usize,
    each: &mut impl ForEachParameter<T>,
) {
    let (under, before) = (below.at(theta), s.at(theta));
    let after = m.lower_terms(m.feedback_terms::<F>(before), under);
    s.put(theta, after);
    each.parameter(k, &after);
    in_order();
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
    let (w, r) = (NEURONS * P, R + NEURONS * P);
    let Recursion { below, last, .. } = m;
    let slope = m.slope[P];
    own_parameter::<F, T, N, P>(w, s, m, Some(slope * below[0]), each);
    own_parameter::<F, T, N, P>(w + 1, s, m, Some(slope * below[1]), each);
    own_parameter::<F, T, N, P>(w + 2, s, m, Some(slope * below[2]), each);
    own_parameter::<F, T, N, P>(r, s, m, direct(F::FULL || P == 0, slope * last[0]), each);
    own_parameter::<F, T, N, P>(
        r + 1,
        s,
        m,
        direct(F::FULL || P == 1, slope * last[1]),
        each,
    );
    own_parameter::<F, T, N, P>(
        r + 2,
        s,
        m,
        direct(F::FULL || P == 2, slope * last[2]),
        each,
    );
    own_parameter::<F, T, N, P>(B + P, s, m, Some(slope), each);
    each.end_block();
}

/// A direct term where the parameter exists.
#[inline(always)]
fn direct<T>(exists: bool, term: T) -> Option<T> {
    if exists { Some(term) } else { None }
}

#[inline(always)]
fn own_parameter<F: Feedback, T: Real, const N: usize, const P: usize>(
    k: usize,
    s: &mut Columns<T, N>,
    m: &Recursion<T>,
    direct: Option<T>,
    each: &mut impl ForEachParameter<T>,
) {
    let theta = N - PARAMS_PER_LAYER + k;
    let mut after = m.feedback_terms::<F>(s.at(theta));
    if let Some(direct) = direct {
        after[P] += direct;
    }
    s.put(theta, after);
    each.parameter(k, &after);
    in_order();
}

/// Use of the s_j, j = 0..3, of parameter `k` as soon as they are known.
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

/// theta -= sum_j g_j s_j for a block of a layer's parameters. Each new theta depends on all three
/// s_j, so the overflow check watches theta.
pub(super) struct DescendBlock<'a, T> {
    pub(super) theta: &'a mut [T; BLOCK],
    pub(super) g: [T; NEURONS],
    pub(super) check: &'a mut OverflowCheck<T>,
}

/// [`DescendBlock`] for a layer's 21 parameters.
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

    /// Adds a value that has no partner yet. No value is carried from one block to the next, so
    /// that loops over blocks stay loops.
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

impl<T: Real> ForEachParameter<T> for DescendBlock<'_, T> {
    #[inline(always)]
    fn parameter(&mut self, k: usize, s: &[T; NEURONS]) {
        // The remainder shows the compiler that it is one of them.
        let theta = &mut self.theta[k % BLOCK];
        descend(theta, &self.g, s);
        self.check.watch(*theta);
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
        // `k` is known at compile time; a remainder shows the compiler that it is in range.
        let (p, q) = (k / NEURONS % NEURONS, k % NEURONS);
        let theta = match k {
            0..R => &mut w[p][q],
            R..B => &mut r[p][q],
            _ => &mut b[q],
        };
        descend(theta, &self.g, s);
        self.check.watch(*theta);
    }
    #[inline(always)]
    fn end_block(&mut self) {
        self.check.flush();
    }
}

/// theta -= sum_j g_j s_j of one parameter.
#[inline(always)]
pub(super) fn descend<T: Real>(theta: &mut T, g: &[T; NEURONS], s: &[T; NEURONS]) {
    *theta = *theta - g[0] * s[0] - g[1] * s[1] - g[2] * s[2];
}
