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
        let r = &self.r;
        let row = |j: usize| {
            if F::FULL {
                r[j][0] * s[0] + r[j][1] * s[1] + r[j][2] * s[2]
            } else {
                r[j][j] * s[j]
            }
        };
        [row(0), row(1), row(2)]
    }

    /// `sum`_j + sum_i w_ji below_i for one parameter, j = 0..3.
    #[inline(always)]
    pub(super) fn lower_terms(&self, mut sum: [T; NEURONS], below: [T; NEURONS]) -> [T; NEURONS] {
        for j in 0..NEURONS {
            for i in 0..NEURONS {
                sum[j] += self.w[j][i] * below[i];
            }
        }
        sum
    }
}

/// f'(x_j) M_ji.
#[inline(always)]
fn scaled<T: Real>(slope: &[T; NEURONS], matrix: &Square<T>) -> Square<T> {
    let mut scaled = *matrix;
    for j in 0..NEURONS {
        for i in 0..NEURONS {
            scaled[j][i] *= slope[j];
        }
    }
    scaled
}
