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
#[repr(C)] // the kernel reads it
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

/// What one step computes.
#[repr(C)] // the kernel writes it
pub(crate) struct Forward<T> {
    /// y_0 = u.
    pub(crate) input: [T; NEURONS],
    /// y_l(k).
    pub(crate) y: [[T; NEURONS]; LAYERS],
    /// y_3 * output_scale.
    pub(crate) error: [T; NEURONS],
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

    /// The computation of a step, without its effect.
    #[inline(always)]
    pub(crate) fn forward(
        &self,
        state: &State<T>,
        input: [T; NEURONS],
    ) -> Result<Forward<T>, Fault> {
        let u = self.normalisation.input(input);
        let found = self.layers(state, &u);
        // A non-finite input makes every x_1 non-finite, so that a good step need not look at it.
        found.ok_or_else(|| {
            if all_finite(&input) {
                Fault::Overflow
            } else {
                Fault::NonFiniteInput
            }
        })
    }

    /// `None` when some x_l or the error is infinite or NaN.
    #[inline(always)]
    fn layers(&self, state: &State<T>, u: &[T; NEURONS]) -> Option<Forward<T>> {
        let [layer1, layer2, layer3] = &self.weights.layers;
        let [last1, last2, last3] = &state.y;
        let one = H::layer(activity::<F, T>(layer1, u, last1))?;
        let two = H::layer(activity::<F, T>(layer2, &one, last2))?;
        let three = O::layer(activity::<F, T>(layer3, &two, last3))?;
        let error = self.normalisation.error(three);
        all_finite(&error).then_some(Forward {
            input: *u,
            y: [one, two, three],
            error,
        })
    }

    /// What the network says at power-on, before its first input: the output layer alone. 0 where that is no number.
    pub fn initial_output(&self) -> [T; NEURONS] {
        let [_, _, output] = &self.weights.layers;
        let zero = [T::ZERO; NEURONS];
        let [a, b, c] = activity::<F, T>(output, &zero, &zero);
        let error = self
            .normalisation
            .error([O::apply(a), O::apply(b), O::apply(c)]);
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

/// x_l(k) = W_l y_{l-1}(k) + R_l y_l(k-1) + b_l (eq. 1).
#[inline(always)]
fn activity<F: Feedback, T: Real>(
    layer: &Layer<T>,
    below: &[T; NEURONS],
    last: &[T; NEURONS],
) -> [T; NEURONS] {
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
    x
}
