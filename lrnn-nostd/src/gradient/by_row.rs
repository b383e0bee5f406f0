//! The recursion as a desktop likes it: each sum over many parameters at once.

use super::columns::Columns;
use super::motion::Motion;
use crate::real::Real;
use crate::shape::{B, Feedback, NEURONS, PARAMS_PER_LAYER, R};

/// s_j = sum_i r_ji s_i(k-1) of every parameter, and for the layer's own, the last 21 of N, f'(x_p) d more for those of unit p = j.
#[inline(always)]
pub(super) fn own<F: Feedback, T: Real, const N: usize>(s: &mut Columns<T, N>, m: &Motion<T>) {
    for theta in 0..N {
        s.put(theta, m.fed_back::<F>(s.at(theta)));
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

/// s_j += sum_i w_ji below_i of the parameters of the layers below.
#[inline(always)]
pub(super) fn inherit<T: Real, const N: usize, const M: usize>(
    s: &mut Columns<T, N>,
    below: &Columns<T, M>,
    m: &Motion<T>,
) {
    for theta in 0..M {
        s.put(theta, m.inherited(s.at(theta), below.at(theta)));
    }
}
