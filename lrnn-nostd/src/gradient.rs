//! The exact forward gradient ("dynamic gradient", real-time recurrent learning; eq. 4-6 with their errata corrected).
//!
//! s_l,j = dy_l,j / dtheta for every parameter theta of the layers up to l. With theta in layer m:
//!
//! ```text
//! l < m:  0
//! l = m:  s_m,j(k) = f'(x_m,j) [ delta_jp d(k) + sum_i R_m,ji s_m,i(k-1) ]
//!         d(k) = y_m-1,q(k) for W_pq,   y_m,q(k-1) for R_pq,   1 for b_p
//! l > m:  s_l,j(k) = f'(x_l,j) [ sum_i W_l,ji s_l-1,i(k) + sum_i R_l,ji s_l,i(k-1) ]
//! ```
//!
//! The print is wrong in four places, each of which `tests/errata.rs` shows to disagree with differences of the output:
//! f for f' in (5) and (6); the direct term of (6), which belongs to unit p only and to the source unit q; the sum of (6) for a
//! bias, which runs over all units of the layer and not n_l - 1; and the recursion through the own feedback of *every* higher
//! layer, of which (5) has the last one only.

use crate::activation::Activation;
use crate::infer::{Fault, Forward, Net, Step};
use crate::real::Real;
use crate::shape::{B, Feedback, LAYERS, NEURONS, PARAMS, PARAMS_PER_LAYER, R};
use crate::state::State;
use crate::weights::Weights;

/// Parameters of the first two layers.
const PARAMS_2: usize = 2 * PARAMS_PER_LAYER;

/// dy_l/dtheta: 3x21 + 3x42 + 3x63 = 378 values, 1512 bytes in `f32`; the entries that are always 0 are not stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensitivities<T = f32> {
    s1: [[T; PARAMS_PER_LAYER]; NEURONS],
    s2: [[T; PARAMS_2]; NEURONS],
    s3: [[T; PARAMS]; NEURONS],
}

impl<T: Real> Sensitivities<T> {
    /// All 0: the state does not depend on the weights, as before the first step.
    pub const fn new() -> Self {
        Self {
            s1: [[T::ZERO; PARAMS_PER_LAYER]; NEURONS],
            s2: [[T::ZERO; PARAMS_2]; NEURONS],
            s3: [[T::ZERO; PARAMS]; NEURONS],
        }
    }

    /// Back to [`Sensitivities::new`].
    pub fn reset(&mut self) {
        *self = Self::new();
    }

    /// dy_3,j/dtheta of the last step: one row for each output j, in parameter order.
    pub fn output(&self) -> &[[T; PARAMS]; NEURONS] {
        &self.s3
    }

    /// One step of gradient descent on 1/2 |r|^2 for the last step alone: theta -= rate * sum_j r_j dy_3,j/dtheta (eq. 4 and 7). For
    /// learning word by word; what learns from late sums or whole passes is in [`crate::learn`].
    #[inline]
    pub fn descend(&self, weights: &mut Weights<T>, residual: &[T; NEURONS], rate: T) {
        let [r0, r1, r2] = residual.map(|r| r * rate);
        let [s0, s1, s2] = &self.s3;
        // in parts of known length: no bounds checks, no iterator over layers
        let mut first = 0;
        for layer in &mut weights.layers {
            let parts = [
                layer.w.as_flattened_mut(),
                layer.r.as_flattened_mut(),
                &mut layer.b,
            ];
            for part in parts {
                let below = |row: &[T; PARAMS], k: usize| row.get(first + k).copied();
                for (k, theta) in part.iter_mut().enumerate() {
                    if let (Some(a), Some(b), Some(c)) = (below(s0, k), below(s1, k), below(s2, k))
                    {
                        *theta -= r0 * a + r1 * b + r2 * c;
                    }
                }
                first += part.len();
            }
        }
    }

    /// s(k-1) to s(k); `last` is y(k-1). Whether all is still finite. One copy of it, 6 kB, is enough.
    #[inline(never)]
    fn advance<F: Feedback>(
        &mut self,
        weights: &Weights<T>,
        forward: &Forward<T>,
        last: &[[T; NEURONS]; LAYERS],
    ) -> bool {
        let [layer1, layer2, layer3] = &weights.layers;
        let [y1, y2, _] = &forward.y;
        let [last1, last2, last3] = last;
        let [slope1, slope2, slope3] = &forward.slope;

        let fr1 = scaled(slope1, &layer1.r);
        own::<F, T, _>(&mut self.s1, &fr1, slope1, &forward.input, last1);

        let fr2 = scaled(slope2, &layer2.r);
        inherit::<F, T, _, _>(&mut self.s2, &self.s1, &scaled(slope2, &layer2.w), &fr2);
        own::<F, T, _>(&mut self.s2, &fr2, slope2, y1, last2);

        // Every value below a layer enters its sums, and 0 times a non-finite value is NaN: the top layer tells for all.
        let fr3 = scaled(slope3, &layer3.r);
        let fw3 = scaled(slope3, &layer3.w);
        let inherited = inherit::<F, T, _, _>(&mut self.s3, &self.s2, &fw3, &fr3);
        let own = own::<F, T, _>(&mut self.s3, &fr3, slope3, y2, last3);
        crate::real::all_finite(&inherited) && crate::real::all_finite(&own)
    }
}

impl<T: Real> Default for Sensitivities<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<H: Activation, O: Activation, F: Feedback, T: Real> Net<H, O, F, T> {
    /// [`Net::step`], the same bits, and the sensitivities of the step beside it.
    ///
    /// After a fault of the step itself the sensitivities are untouched and still belong to the repeated output.
    #[inline]
    pub fn step_gradient(
        &self,
        state: &mut State<T>,
        sens: &mut Sensitivities<T>,
        input: [T; NEURONS],
    ) -> Step<T> {
        let forward = match self.forward(state, input) {
            Ok(forward) => forward,
            Err(fault) => return self.hold(state, fault),
        };
        let last = state.y;
        let mut step = self.accept(state, &forward);
        if !sens.advance::<F>(&self.weights, &forward, &last) {
            sens.reset();
            step.fault = Some(Fault::SensitivityOverflow);
        }
        step
    }
}

/// f'(x_j) M_ji.
#[inline(always)]
fn scaled<T: Real>(
    slope: &[T; NEURONS],
    matrix: &[[T; NEURONS]; NEURONS],
) -> [[T; NEURONS]; NEURONS] {
    let mut scaled = *matrix;
    for j in 0..NEURONS {
        for i in 0..NEURONS {
            scaled[j][i] *= slope[j];
        }
    }
    scaled
}

/// sum_i f' R_ji s_i of one parameter.
#[inline(always)]
fn feedback<F: Feedback, T: Real>(fr: &[[T; NEURONS]; NEURONS], s: &[T; NEURONS], j: usize) -> T {
    if F::FULL {
        fr[j][0] * s[0] + fr[j][1] * s[1] + fr[j][2] * s[2]
    } else {
        fr[j][j] * s[j]
    }
}

/// l = m: s_j = sum_i f' R_ji s_i(k-1) for the layer's own parameters, the last 21 of N, and f'(x_p) d more for the parameters W_pq,
/// R_pq, b_p of unit p = j. Gives the sum of the values of each j.
#[inline(always)]
fn own<F: Feedback, T: Real, const N: usize>(
    s: &mut [[T; N]; NEURONS],
    fr: &[[T; NEURONS]; NEURONS],
    slope: &[T; NEURONS],
    below: &[T; NEURONS],
    last: &[T; NEURONS],
) -> [T; NEURONS] {
    let mut sum = [T::ZERO; NEURONS];
    unit::<F, T, N, 0>(s, fr, slope, below, last, &mut sum);
    unit::<F, T, N, 1>(s, fr, slope, below, last, &mut sum);
    unit::<F, T, N, 2>(s, fr, slope, below, last, &mut sum);
    sum
}

/// The seven parameters of unit P: straight code, since P is known when it is compiled.
#[inline(always)]
fn unit<F: Feedback, T: Real, const N: usize, const P: usize>(
    s: &mut [[T; N]; NEURONS],
    fr: &[[T; NEURONS]; NEURONS],
    slope: &[T; NEURONS],
    below: &[T; NEURONS],
    last: &[T; NEURONS],
    sum: &mut [T; NEURONS],
) {
    let first = N - PARAMS_PER_LAYER;
    let mut one = |theta: usize, direct: Option<T>| {
        let before = [s[0][theta], s[1][theta], s[2][theta]];
        for j in 0..NEURONS {
            let mut value = feedback::<F, T>(fr, &before, j);
            if j == P
                && let Some(direct) = direct
            {
                value += direct;
            }
            s[j][theta] = value;
            sum[j] += value;
        }
    };
    for q in 0..NEURONS {
        one(first + NEURONS * P + q, Some(slope[P] * below[q]));
    }
    for q in 0..NEURONS {
        let fed_back = F::FULL || P == q;
        one(
            first + R + NEURONS * P + q,
            fed_back.then(|| slope[P] * last[q]),
        );
    }
    one(first + B + P, Some(slope[P]));
}

/// l > m: s_j = sum_i f' W_ji below_i(k) + sum_i f' R_ji s_i(k-1) for the M parameters of the layers below. Gives the sum of the values of
/// each j.
#[inline(always)]
fn inherit<F: Feedback, T: Real, const N: usize, const M: usize>(
    s: &mut [[T; N]; NEURONS],
    below: &[[T; M]; NEURONS],
    fw: &[[T; NEURONS]; NEURONS],
    fr: &[[T; NEURONS]; NEURONS],
) -> [T; NEURONS] {
    let mut sums = [T::ZERO; NEURONS];
    for theta in 0..M {
        let under = [below[0][theta], below[1][theta], below[2][theta]];
        let last = [s[0][theta], s[1][theta], s[2][theta]];
        for j in 0..NEURONS {
            let mut sum = feedback::<F, T>(fr, &last, j);
            for i in 0..NEURONS {
                sum += fw[j][i] * under[i];
            }
            s[j][theta] = sum;
            sums[j] += sum;
        }
    }
    sums
}
