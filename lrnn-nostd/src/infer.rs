//! One step of the network (eq. 1, 2).

use core::marker::PhantomData;

use crate::activation::{Activation, Identity, Rational};
use crate::normalisation::Normalisation;
use crate::real::{Real, all_finite};
use crate::shape::{Feedback, Full, LAYERS, NEURONS};
use crate::state::State;
use crate::weights::{Layer, Weights};

/// The network: hidden activation `H`, output activation `O`, feedback `F`, number type `T`.
///
/// It holds what is configured and nothing that changes: a [`State`] belongs to a run, and weights may be exchanged
/// between two steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Net<H = Rational, O = Identity, F = Full, T = f32> {
    /// theta.
    pub weights: Weights<T>,
    /// Scales of input and output.
    pub normalisation: Normalisation<T>,
    kind: PhantomData<(H, O, F)>,
}

/// What one step gives.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct Step<T = f32> {
    /// y_3, in network units.
    pub output: [T; NEURONS],
    /// The estimated sensor error y_3 * output_scale, in the units of the scale: corrected = measured - error.
    pub error: [T; NEURONS],
    /// Why output and error are not new, if they are not (see [`Fault`]).
    pub fault: Option<Fault>,
}

/// What can go wrong in a step. State, sensitivities and results are finite in any case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// An input is infinite or NaN. The step was not made; the last output is repeated.
    NonFiniteInput,
    /// Some x_l or the error is infinite or NaN (huge or non-finite weights or scales). As above.
    Overflow,
    /// Only from [`Net::step_gradient`]: the step is good but its sensitivities overflowed (feedback too strong). They were
    /// reset, so that from here on they are derivatives with respect to a change of the weights after this step.
    SensitivityOverflow,
}

/// All that one step computes; the gradient needs the parts.
pub(crate) struct Forward<T> {
    /// y_0 = u.
    pub(crate) input: [T; NEURONS],
    /// y_l(k).
    pub(crate) y: [[T; NEURONS]; LAYERS],
    /// f'(x_l(k)).
    pub(crate) slope: [[T; NEURONS]; LAYERS],
    /// y_3 * output_scale.
    error: [T; NEURONS],
}

/// x, y and f'(x) of one layer.
struct Activity<T> {
    x: [T; NEURONS],
    y: [T; NEURONS],
    slope: [T; NEURONS],
}

impl<H: Activation, O: Activation, F: Feedback, T: Real> Net<H, O, F, T> {
    /// A network from its weights and scales. Nothing is checked: a step that overflows says so.
    pub const fn new(weights: Weights<T>, normalisation: Normalisation<T>) -> Self {
        Self {
            weights,
            normalisation,
            kind: PhantomData,
        }
    }

    /// One step: `input` in physical units (rad/s or m/s^2) to the estimated error; see [`Fault`] for what a bad input does.
    #[inline]
    pub fn step(&self, state: &mut State<T>, input: [T; NEURONS]) -> Step<T> {
        match self.forward(state, input) {
            Ok(forward) => self.accept(state, &forward),
            Err(fault) => self.hold(state, fault),
        }
    }

    /// The computation of a step, without its effect. Unused parts (the slopes, in [`Net::step`]) vanish by inlining, so that
    /// `step` and `step_gradient` give the same bits.
    #[inline(always)]
    pub(crate) fn forward(
        &self,
        state: &State<T>,
        input: [T; NEURONS],
    ) -> Result<Forward<T>, Fault> {
        if !all_finite(&input) {
            return Err(Fault::NonFiniteInput);
        }
        let input = self.normalisation.input(input);
        let [layer1, layer2, layer3] = &self.weights.layers;
        let [last1, last2, last3] = &state.y;
        let one = activity::<H, F, T>(layer1, &input, last1);
        let two = activity::<H, F, T>(layer2, &one.y, last2);
        let three = activity::<O, F, T>(layer3, &two.y, last3);
        let error = self.normalisation.error(three.y);
        let [[a, b, c], [d, e, f], [g, h, i]] = [one.x, two.x, three.x];
        let [j, k, l] = error;
        if !all_finite(&[a, b, c, d, e, f, g, h, i, j, k, l]) {
            return Err(Fault::Overflow);
        }
        let y = [one.y, two.y, three.y];
        Ok(Forward {
            input,
            y,
            slope: [one.slope, two.slope, three.slope],
            error,
        })
    }

    /// What the network says at power-on, before its first input: the output layer alone. 0 where that is no number.
    pub fn rest(&self) -> [T; NEURONS] {
        let [_, _, output] = &self.weights.layers;
        let zero = [T::ZERO; NEURONS];
        let error = self
            .normalisation
            .error(activity::<O, F, T>(output, &zero, &zero).y);
        error.map(|error| if error.is_finite() { error } else { T::ZERO })
    }

    #[inline(always)]
    pub(crate) fn accept(&self, state: &mut State<T>, forward: &Forward<T>) -> Step<T> {
        state.y = forward.y;
        Step {
            output: state.output(),
            error: forward.error,
            fault: None,
        }
    }

    /// The last output again. Only a non-finite scale can spoil the error of a finite output; it is 0 then.
    #[cold]
    pub(crate) fn hold(&self, state: &State<T>, fault: Fault) -> Step<T> {
        let output = state.output();
        let error = self.normalisation.error(output);
        let error = error.map(|error| if error.is_finite() { error } else { T::ZERO });
        Step {
            output,
            error,
            fault: Some(fault),
        }
    }
}

/// x_l(k) = W_l y_{l-1}(k) + R_l y_l(k-1) + b_l (eq. 1),   y_l(k) = f(x_l(k)) (eq. 2),   and f'(x_l(k)).
#[inline(always)]
fn activity<A: Activation, F: Feedback, T: Real>(
    layer: &Layer<T>,
    below: &[T; NEURONS],
    last: &[T; NEURONS],
) -> Activity<T> {
    let mut x = layer.b;
    for p in 0..NEURONS {
        for q in 0..NEURONS {
            x[p] += layer.w[p][q] * below[q];
        }
        for q in 0..NEURONS {
            if F::FULL || p == q {
                x[p] += layer.r[p][q] * last[q];
            }
        }
    }
    // Written out: `map` is not always inlined, and then the slopes are computed for nothing.
    let [(y0, slope0), (y1, slope1), (y2, slope2)] = [
        A::apply_with_slope(x[0]),
        A::apply_with_slope(x[1]),
        A::apply_with_slope(x[2]),
    ];
    Activity {
        x,
        y: [y0, y1, y2],
        slope: [slope0, slope1, slope2],
    }
}
