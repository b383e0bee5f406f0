//! The exact forward gradient ("dynamic gradient", real-time recurrent learning; eq. 4-6 with their
//! errata corrected).
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
//! The print is wrong in four places. For each of them `tests/errata.rs` shows that the printed
//! formula disagrees with finite differences of the output:
//!
//! - f instead of f' in (5) and (6);
//! - the direct term of (6), which belongs to unit p only and to the source unit q;
//! - the sum of (6) for a bias, which runs over all units of the layer and not n_l - 1;
//! - the recursion through the own feedback of *every* higher layer, of which (5) has only the
//!   last.

mod by_column;
mod by_row;
mod columns;
mod recursion;
#[cfg(test)]
mod tests;

use crate::activation::Activation;
use crate::infer::{Fault, Forward, Net, Step};
use crate::real::{Real, three_finite};
use crate::shape::{Feedback, LAYERS, NEURONS, PARAMS, PARAMS_PER_LAYER};
use crate::state::State;
use crate::weights::{Layer, Weights};
use by_column::{
    DescendBlock, DescendLayer, Ignore, OverflowCheck, descend, in_order, lower_block,
};
use columns::{BY_COLUMN, Columns};
use recursion::Recursion;

/// Number of parameters of the first two layers.
const PARAMS_2: usize = 2 * PARAMS_PER_LAYER;
/// Their blocks of three.
const BLOCKS: usize = PARAMS_2 / NEURONS;

/// dy_l/dtheta: 3x21 + 3x42 + 3x63 = 378 values, 1512 bytes in `f32`. Entries that are always 0 are
/// not stored. [`Net::step_gradient`] advances them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)] // the kernel writes it
pub struct Sensitivities<T = f32> {
    s1: Columns<T, PARAMS_PER_LAYER>,
    s2: Columns<T, PARAMS_2>,
    s3: Columns<T, PARAMS>,
}

impl<T: Real> Sensitivities<T> {
    /// All 0: the state does not depend on the weights, as before the first step.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            s1: Columns::ZERO,
            s2: Columns::ZERO,
            s3: Columns::ZERO,
        }
    }

    /// Resets to [`Sensitivities::new`].
    pub fn reset(&mut self) {
        // Constants: at opt-level "z" a call of `new` would make them on the stack and copy
        // them.
        self.s1 = Columns::ZERO;
        self.s2 = Columns::ZERO;
        self.s3 = Columns::ZERO;
    }

    /// dy_3,j/dtheta of the last step: one row for each output j, in parameter order. It is a copy,
    /// because the order in memory depends on the machine.
    pub fn output(&self) -> [[T; PARAMS]; NEURONS] {
        let mut rows = [[T::ZERO; PARAMS]; NEURONS];
        for theta in 0..PARAMS {
            let column = self.s3.at(theta);
            for j in 0..NEURONS {
                rows[j][theta] = column[j];
            }
        }
        rows
    }

    /// Offset of s_3 in bytes.
    #[cfg(target_arch = "arm")]
    #[allow(dead_code, reason = "for the kernel in assembly")]
    pub(crate) const OUTPUT: usize = core::mem::offset_of!(Self, s3);

    /// Whether every value is finite. The values of the lower layers enter the sums of the top
    /// layer, so checking the top layer is enough.
    pub(crate) fn is_finite(&self) -> bool {
        self.s3.is_finite()
    }

    /// dy_3/dtheta of the parameter with this index, below 63.
    #[inline(always)]
    pub(crate) fn of(&self, theta: usize) -> [T; NEURONS] {
        self.s3.at(theta)
    }

    /// One step of gradient descent on 1/2 |r|^2 for the last step alone: theta -= rate * sum_j r_j
    /// dy_3,j/dtheta (eq. 4 and 7). This is for learning sample by sample, which
    /// [`Net::step_descend`] does in one call. Learning from late sums or from whole passes is in
    /// [`crate::learn`].
    ///
    /// If a weight would not be finite, it changes none and returns false.
    #[inline]
    pub fn descend(&self, weights: &mut Weights<T>, residual: &[T; NEURONS], rate: T) -> bool {
        let old = *weights;
        let g = residual.map(|r| r * rate);
        // Slices of known length need no bounds checks and no iterator over layers.
        let (mut first, mut finite) = (0, true);
        for layer in &mut weights.layers {
            let parts = [
                layer.w.as_flattened_mut(),
                layer.r.as_flattened_mut(),
                &mut layer.b,
            ];
            for part in parts {
                for (k, theta) in part.iter_mut().enumerate() {
                    if first + k < PARAMS {
                        descend(theta, &g, &self.s3.at(first + k));
                    }
                    finite &= theta.has_finite_bits();
                }
                first += part.len();
            }
        }
        if !finite {
            *weights = old;
        }
        finite
    }

    /// Advances s(k-1) to s(k); `last` is y(k-1). Returns false when a value overflowed.
    #[inline(always)]
    fn advance<H: Activation, O: Activation, F: Feedback>(
        &mut self,
        weights: &Weights<T>,
        forward: &Forward<T>,
        last: &[[T; NEURONS]; LAYERS],
    ) -> bool {
        // Every value of a lower layer enters the sums of the next one, and 0 times a non-finite
        // value is NaN, so checking the top layer is enough.
        if BY_COLUMN {
            self.by_column::<H, O, F>(weights, forward, last).passed() || self.is_finite()
        } else {
            self.by_row::<H, O, F>(weights, forward, last);
            self.is_finite()
        }
    }

    #[inline(never)]
    fn by_row<H: Activation, O: Activation, F: Feedback>(
        &mut self,
        weights: &Weights<T>,
        forward: &Forward<T>,
        last: &[[T; NEURONS]; LAYERS],
    ) {
        let [layer1, layer2, layer3] = &weights.layers;
        let [y1, y2, y3] = &forward.y;
        let [last1, last2, last3] = last;
        let m = Recursion::new::<H>(layer1, y1, &forward.input, last1);
        by_row::own_parameters::<F, T, PARAMS_PER_LAYER>(&mut self.s1, &m);

        let m = Recursion::new::<H>(layer2, y2, y1, last2);
        by_row::own_parameters::<F, T, PARAMS_2>(&mut self.s2, &m);
        by_row::lower_parameters(&mut self.s2, &self.s1, &m);

        let m = Recursion::new::<O>(layer3, y3, y2, last3);
        by_row::own_parameters::<F, T, PARAMS>(&mut self.s3, &m);
        by_row::lower_parameters(&mut self.s3, &self.s2, &m);
    }

    /// Not inlined: one copy of this code takes 5 kB.
    #[inline(never)]
    fn by_column<H: Activation, O: Activation, F: Feedback>(
        &mut self,
        weights: &Weights<T>,
        forward: &Forward<T>,
        last: &[[T; NEURONS]; LAYERS],
    ) -> OverflowCheck<T> {
        let m = self.hidden_by_column::<H, O, F>(weights, forward, last);
        let mut check = OverflowCheck::NEW;
        let (s, below) = (&mut self.s3, &self.s2);
        by_column::lower_parameters::<F, T, PARAMS, PARAMS_2>(s, below, &m, &mut check);
        by_column::own_parameters::<F, T, PARAMS>(s, &m, &mut check);
        check
    }

    /// Advances s_1 and s_2; returns the coefficients for s_3.
    #[inline(always)]
    fn hidden_by_column<H: Activation, O: Activation, F: Feedback>(
        &mut self,
        weights: &Weights<T>,
        forward: &Forward<T>,
        last: &[[T; NEURONS]; LAYERS],
    ) -> Recursion<T> {
        let [layer1, layer2, layer3] = &weights.layers;
        let [y1, y2, y3] = &forward.y;
        let [last1, last2, last3] = last;
        let m = Recursion::new::<H>(layer1, y1, &forward.input, last1);
        by_column::own_parameters::<F, T, PARAMS_PER_LAYER>(&mut self.s1, &m, &mut Ignore);
        in_order();

        let m = Recursion::new::<H>(layer2, y2, y1, last2);
        let (s, below) = (&mut self.s2, &self.s1);
        by_column::lower_parameters::<F, T, PARAMS_2, PARAMS_PER_LAYER>(s, below, &m, &mut Ignore);
        by_column::own_parameters::<F, T, PARAMS_2>(s, &m, &mut Ignore);
        in_order();
        Recursion::new::<O>(layer3, y3, y2, last3)
    }

    /// [`Sensitivities::by_column`] and theta -= sum_j g_j s_3,j with the new s_3. After an
    /// overflow of sensitivities or weights the weights are restored.
    #[inline(never)]
    fn descend_by_column<H: Activation, O: Activation, F: Feedback>(
        &mut self,
        weights: &mut Weights<T>,
        forward: &Forward<T>,
        last: &[[T; NEURONS]; LAYERS],
        g: [T; NEURONS],
    ) -> Option<Fault> {
        let [layer1, layer2, layer3] = &weights.layers;
        // Copied in pieces small enough that the compiler needs no call.
        let old_w = (layer1.w, layer2.w, layer3.w);
        let old_r = (layer1.r, layer2.r, layer3.r);
        let old_b = (layer1.b, layer2.b, layer3.b);
        let m = self.hidden_by_column::<H, O, F>(weights, forward, last);

        let [layer1, layer2, layer] = &mut weights.layers;
        let (s, below) = (&mut self.s3, &self.s2);
        let mut sum = OverflowCheck::NEW;
        let check = &mut sum;
        // One loop over both lower layers: its index alone shows that no access is out of bounds.
        let blocks = lower_blocks(layer1, layer2);
        for block in 0..BLOCKS {
            let theta = &mut *blocks[block];
            let each = &mut DescendBlock { theta, g, check };
            lower_block::<F, T, PARAMS, PARAMS_2>(NEURONS * block, s, below, &m, each);
        }
        by_column::own_parameters::<F, T, PARAMS>(s, &m, &mut DescendLayer { layer, g, check });
        if sum.passed() {
            return None;
        }
        let fault = match self.is_finite() {
            false => Fault::SensitivityOverflow,
            true if weights.is_finite() => return None,
            true => Fault::Overflow,
        };
        let [layer1, layer2, layer3] = &mut weights.layers;
        (layer1.w, layer2.w, layer3.w) = old_w;
        (layer1.r, layer2.r, layer3.r) = old_r;
        (layer1.b, layer2.b, layer3.b) = old_b;
        Some(fault)
    }
}

/// The parameters of the two lower layers in their order, three at a time.
#[inline(always)]
fn lower_blocks<'a, T>(
    Layer { w, r, b }: &'a mut Layer<T>,
    above: &'a mut Layer<T>,
) -> [&'a mut [T; NEURONS]; BLOCKS] {
    let ([w0, w1, w2], [r0, r1, r2]) = (w, r);
    let Layer { w, r, b: b_above } = above;
    let ([w3, w4, w5], [r3, r4, r5]) = (w, r);
    [w0, w1, w2, r0, r1, r2, b, w3, w4, w5, r3, r4, r5, b_above]
}

impl<T: Real> Default for Sensitivities<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<H: Activation, O: Activation, F: Feedback, T: Real> Net<H, O, F, T> {
    /// As [`Net::step`], with the same bits, and also computes the sensitivities of the step.
    ///
    /// After a fault of the step itself the sensitivities are unchanged and still belong to the
    /// repeated output.
    ///
    /// ```
    /// use lrnn_nostd::{Net, Normalisation, Sensitivities, State, Weights};
    ///
    /// let weights = Weights::from_fn(|i| 0.01 * i as f32);
    /// let mut net: Net = Net::new(weights, Normalisation::identity());
    /// let inputs = [[0.1, -0.2, 0.3], [0.0, 0.4, -0.1], [0.2, 0.1, 0.0]];
    ///
    /// let (mut state, mut sensitivities) = (State::new(), Sensitivities::new());
    /// for input in inputs {
    ///     let _ = net.step_gradient(&mut state, &mut sensitivities, input);
    /// }
    /// let slope = sensitivities.output()[0][5]; // dy_0 / dtheta_5, through all three steps
    ///
    /// // The same run with that weight changed a little.
    /// let before = state.output()[0];
    /// let theta = net.weights.get(5).unwrap_or_default();
    /// net.weights.set(5, theta + 1e-3);
    /// let mut state = State::new();
    /// for input in inputs {
    ///     let _ = net.step(&mut state, input);
    /// }
    /// let change = state.output()[0] - before;
    /// assert!((change - 1e-3 * slope).abs() < 1e-6);
    /// ```
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
        let finite = sens.advance::<H, O, F>(&self.weights, &forward, &state.y);
        let fault = (!finite).then_some(Fault::SensitivityOverflow);
        self.accept_gradient(state, sens, &forward, fault)
    }

    /// [`Net::step_gradient`] and [`Sensitivities::descend`] with the residual y_3 - `target` in
    /// one call, with the same bits. After a fault of any kind the weights are unchanged: a target
    /// or rate that is not finite is a [`Fault::NonFiniteInput`], and weights that would not be
    /// finite are a [`Fault::Overflow`] of a step that is made. A target that is finite and wrong
    /// is believed.
    ///
    /// `target` is in network units: an error in physical units divided by `output_scale`.
    ///
    /// ```
    /// use lrnn_nostd::{Net, Normalisation, Sensitivities, State, Weights};
    ///
    /// let weights = Weights::from_fn(|i| 0.02 * (i % 7) as f32 - 0.06);
    /// let mut net: Net = Net::new(weights, Normalisation::identity());
    /// let (mut state, mut sensitivities) = (State::new(), Sensitivities::new());
    /// let mut output = [0.0; 3];
    /// for _sample in 0..1000 {
    ///     let target = [0.5, -0.25, 0.0];
    ///     output = net
    ///         .step_descend(&mut state, &mut sensitivities, [0.1, 0.2, 0.3], &target, 0.05)
    ///         .output;
    /// }
    /// assert!((output[0] - 0.5).abs() < 0.01);
    /// ```
    #[inline]
    pub fn step_descend(
        &mut self,
        state: &mut State<T>,
        sens: &mut Sensitivities<T>,
        input: [T; NEURONS],
        target: &[T; NEURONS],
        rate: T,
    ) -> Step<T> {
        if !are_finite(target, rate) {
            return self.hold(state, Fault::NonFiniteInput);
        }
        let residual = |[a, b, c]: [T; NEURONS]| [a - target[0], b - target[1], c - target[2]];
        if !BY_COLUMN {
            let mut step = self.step_gradient(state, sens, input);
            if step.fault.is_none()
                && !sens.descend(&mut self.weights, &residual(step.output), rate)
            {
                step.fault = Some(Fault::Overflow);
            }
            return step;
        }
        let forward = match self.forward(state, input) {
            Ok(forward) => forward,
            Err(fault) => return self.hold(state, fault),
        };
        let [_, _, y3] = forward.y;
        let [a, b, c] = residual(y3);
        let g = [a * rate, b * rate, c * rate];
        let fault = sens.descend_by_column::<H, O, F>(&mut self.weights, &forward, &state.y, g);
        self.accept_gradient(state, sens, &forward, fault)
    }

    /// [`Net::accept`] with this fault; sensitivities that overflowed are reset.
    #[inline(always)]
    fn accept_gradient(
        &self,
        state: &mut State<T>,
        sens: &mut Sensitivities<T>,
        forward: &Forward<T>,
        fault: Option<Fault>,
    ) -> Step<T> {
        let mut step = self.accept(state, forward);
        if fault == Some(Fault::SensitivityOverflow) {
            sens.reset();
        }
        step.fault = fault;
        step
    }
}

/// Whether a descent can be made with them.
#[inline(always)]
pub(crate) fn are_finite<T: Real>(target: &[T; NEURONS], rate: T) -> bool {
    if BY_COLUMN {
        three_finite(*target) && rate.is_finite()
    } else {
        target.iter().all(|value| value.has_finite_bits()) && rate.has_finite_bits()
    }
}
