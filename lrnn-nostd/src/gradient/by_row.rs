//! The recursion in the order that suits a desktop: each sum over many parameters at once.

use super::columns::Columns;
use super::recursion::Recursion;
use crate::real::Real;
use crate::shape::{B, Feedback, NEURONS, PARAMS_PER_LAYER, R};

/// s_j = sum_i r_ji s_i(k-1) for every parameter. The layer's own parameters, the last 21 of N,
/// also get f'(x_p) d for unit p = j.
#[inline(always)]
pub(super) fn own_parameters<F: Feedback, T: Real, const N: usize>(
    s: &mut Columns<T, N>,
    m: &Recursion<T>,
) {
    for theta in 0..N {
        s.put(theta, m.feedback_terms::<F>(s.at(theta)));
    }
    let first = N - PARAMS_PER_LAYER;
    for p in 0..NEURONS {
        for q in 0..NEURONS {
            s.add(first + NEURONS * p + q, p, m.slope[p] * m.below[q]);
            if F::FULL || p == q {
                s.add(first + R + NEURONS * p + q, p, m.slope[p] * m.last[q]);
            }
        }
        s.add(first + B + p, p, m.slope[p]);
    }
}

/// s_j += sum_i w_ji below_i for the parameters of the lower layers.
#[inline(always)]
pub(super) fn lower_parameters<T: Real, const N: usize, const M: usize>(
    s: &mut Columns<T, N>,
    below: &Columns<T, M>,
    m: &Recursion<T>,
) {
    for theta in 0..M {
        s.put(theta, m.lower_terms(s.at(theta), below.at(theta)));
    }
}
