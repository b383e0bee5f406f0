//! Coefficients of the recursion that advances the sensitivities of one layer by one step.

use crate::activation::Activation;
use crate::real::Real;
use crate::shape::{Feedback, NEURONS};
use crate::weights::Layer;

/// A 3x3 matrix.
pub(super) type Square<T> = [[T; NEURONS]; NEURONS];

/// Coefficients of s_l(k) = r s_l(k-1) + w s_l-1(k), and the direct terms of the layer's own
/// parameters.
pub(super) struct Recursion<T> {
    /// f'(x_j) R_ji.
    pub(super) r: Square<T>,
    /// f'(x_j) W_ji.
    pub(super) w: Square<T>,
    /// f'(x_p).
    pub(super) slope: [T; NEURONS],
    /// y_l-1,q(k).
    pub(super) below: [T; NEURONS],
    /// y_l,q(k-1).
    pub(super) last: [T; NEURONS],
}

impl<T: Real> Recursion<T> {
    /// `y` = y_l(k) is the layer's new output.
    #[inline(always)]
    pub(super) fn new<A: Activation>(
        layer: &Layer<T>,
        [a, b, c]: &[T; NEURONS],
        below: &[T; NEURONS],
        last: &[T; NEURONS],
    ) -> Self {
        let slope = [A::slope(*a), A::slope(*b), A::slope(*c)];
        Self {
            r: scaled(&slope, &layer.r),
            w: scaled(&slope, &layer.w),
            slope,
            below: *below,
            last: *last,
        }
    }

    /// sum_i r_ji s_i for one parameter, j = 0..3.
    #[inline(always)]
    pub(super) fn feedback_terms<F: Feedback>(&self, s: [T; NEURONS]) -> [T; NEURONS] {
        let [a, b, c] = &self.r;
        if F::FULL {
            [product(a, &s), product(b, &s), product(c, &s)]
        } else {
            [a[0] * s[0], b[1] * s[1], c[2] * s[2]]
        }
    }

    /// `sum`_j + sum_i w_ji below_i for one parameter, j = 0..3.
    #[inline(always)]
    pub(super) fn lower_terms(&self, sum: [T; NEURONS], below: [T; NEURONS]) -> [T; NEURONS] {
        let [a, b, c] = &self.w;
        [
            added(sum[0], a, &below),
            added(sum[1], b, &below),
            added(sum[2], c, &below),
        ]
    }
}

// This file has no loops and closures: some levels of optimisation keep them as they are.

/// sum_i row_i s_i.
#[inline(always)]
fn product<T: Real>(row: &[T; NEURONS], s: &[T; NEURONS]) -> T {
    row[0] * s[0] + row[1] * s[1] + row[2] * s[2]
}

/// `sum` + sum_i row_i s_i, added one by one.
#[inline(always)]
fn added<T: Real>(sum: T, row: &[T; NEURONS], s: &[T; NEURONS]) -> T {
    sum + row[0] * s[0] + row[1] * s[1] + row[2] * s[2]
}

/// f'(x_j) M_ji.
#[inline(always)]
fn scaled<T: Real>(slope: &[T; NEURONS], matrix: &Square<T>) -> Square<T> {
    let [a, b, c] = matrix;
    [times(a, slope[0]), times(b, slope[1]), times(c, slope[2])]
}

/// Each element times `factor`.
#[inline(always)]
fn times<T: Real>([a, b, c]: &[T; NEURONS], factor: T) -> [T; NEURONS] {
    [*a * factor, *b * factor, *c * factor]
}
