//! One step of the network (eq. 1, 2).

use core::fmt;
use core::marker::PhantomData;

use crate::activation::{Activation, Identity, Rational};
use crate::normalisation::Normalisation;
use crate::real::{Real, three_finite};
use crate::shape::{Feedback, Full, LAYERS, NEURONS};
use crate::state::State;
use crate::weights::{Layer, Weights};

/// The network: hidden activation `H`, output activation `O`, feedback `F`, number type `T`.
///
/// It holds the configuration and nothing that changes: a [`State`] belongs to a run, and weights
/// may be exchanged between two steps.
///
/// ```
/// use lrnn_nostd::{Net, Normalisation, State, Tanh, Weights};
///
/// // The default: hidden layers with `Rational`, an output layer with `Identity`, full feedback.
/// let net: Net = Net::new(Weights::from_fn(|_| 0.1), Normalisation::identity());
/// // The same weights with the hidden activation of `libm`.
/// let other: Net<Tanh> = Net::new(net.weights, net.normalisation);
///
/// let [mut state, mut same] = [State::new(); 2];
/// let a = net.step(&mut state, [0.3, 0.0, -0.2]).output;
/// let b = other.step(&mut same, [0.3, 0.0, -0.2]).output;
/// assert!((a[0] - b[0]).abs() < 1e-6);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)] // the kernel reads it
pub struct Net<H = Rational, O = Identity, F = Full, T = f32> {
    /// The parameters theta.
    pub weights: Weights<T>,
    /// Scales of input and output.
    pub normalisation: Normalisation<T>,
    kind: PhantomData<(H, O, F)>,
}

/// The result of one step.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct Step<T = f32> {
    /// y_3, in network units.
    pub output: [T; NEURONS],
    /// The estimated sensor error y_3 * output_scale, in the units of the scale: corrected =
    /// measured - error.
    pub error: [T; NEURONS],
    /// What went wrong. After an input that is not finite, or an overflow of the step, output and
    /// error are the last ones; otherwise they are new (see [`Fault`]).
    pub fault: Option<Fault>,
}

/// Faults of a step. State, sensitivities and results stay finite in any case.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// An input, or the target or rate of [`Net::step_descend`], is infinite or NaN. The step is
    /// not made; the last output is repeated.
    NonFiniteInput,
    /// Some x_l or the error is infinite or NaN, because weights or scales are huge or not finite.
    /// The step is not made; the last output is repeated. From [`Net::step_descend`] also with a
    /// good step, when the weights would overflow: they stay as they are.
    Overflow,
    /// Only with a gradient: the step is good but its sensitivities overflowed, because
    /// the feedback is too strong. They are reset; from here on they are derivatives with respect
    /// to a change of the weights after this step.
    SensitivityOverflow,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NonFiniteInput => {
                "an input is infinite or NaN, or target or rate; the last output is repeated"
            }
            Self::Overflow => {
                "the step or the descent overflowed, since weights or scales are huge or not \
                 finite; what overflowed was not taken"
            }
            Self::SensitivityOverflow => {
                "the sensitivities overflowed, since the feedback is too strong; they begin again"
            }
        })
    }
}

impl core::error::Error for Fault {}

/// Everything that one step computes.
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
    /// A network from its weights and scales. Nothing is checked here; a step that overflows
    /// reports it.
    pub const fn new(weights: Weights<T>, normalisation: Normalisation<T>) -> Self {
        Self {
            weights,
            normalisation,
            kind: PhantomData,
        }
    }

    /// One step from `input` in physical units (rad/s or m/s^2) to the estimated error. See
    /// [`Fault`] for the effect of a bad input.
    ///
    /// ```
    /// use lrnn_nostd::{Fault, Net, Normalisation, State, Weights};
    ///
    /// let mut weights = Weights::zero();
    /// weights.layers[2].b = [1.0, 0.0, -0.5]; // a bias and nothing else
    /// let normalisation = Normalisation {
    ///     output_scale: [1e-5; 3], // rad/s
    ///     ..Normalisation::identity()
    /// };
    /// let net: Net = Net::new(weights, normalisation);
    /// let mut state = State::new();
    ///
    /// let measured = [0.2, 0.0, 0.1]; // rad/s
    /// let step = net.step(&mut state, measured);
    /// let corrected = [0, 1, 2].map(|axis| measured[axis] - step.error[axis]);
    /// assert_eq!(step.error, [1e-5, 0.0, -5e-6]);
    /// assert_eq!(corrected[0], 0.2 - 1e-5);
    ///
    /// // A bad input changes nothing: the last output is repeated, and the step says so.
    /// let bad = net.step(&mut state, [f32::NAN, 0.0, 0.0]);
    /// assert_eq!(bad.fault, Some(Fault::NonFiniteInput));
    /// assert_eq!(bad.error, step.error);
    /// ```
    #[inline]
    pub fn step(&self, state: &mut State<T>, input: [T; NEURONS]) -> Step<T> {
        match self.forward(state, input) {
            Ok(forward) => self.accept(state, &forward),
            Err(fault) => self.hold(state, fault),
        }
    }

    /// The computation of a step, without changing the state.
    #[inline(always)]
    pub(crate) fn forward(
        &self,
        state: &State<T>,
        input: [T; NEURONS],
    ) -> Result<Forward<T>, Fault> {
        let u = self.normalisation.input(input);
        // A non-finite input makes every x_1 non-finite, so a good step need not check its input.
        match self.layers(state, &u) {
            Some(forward) => Ok(forward),
            None if three_finite(input) => Err(Fault::Overflow),
            None => Err(Fault::NonFiniteInput),
        }
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
        if three_finite(error) {
            Some(Forward {
                input: *u,
                y: [one, two, three],
                error,
            })
        } else {
            None
        }
    }

    /// The output at power-on, before the first input: that of the output layer alone. 0 where it
    /// is not finite.
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

    /// Repeats the last output. Only a non-finite scale can make the error of a finite output
    /// non-finite; it is 0 then.
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
pub(crate) fn activity<F: Feedback, T: Real>(
    layer: &Layer<T>,
    below: &[T; NEURONS],
    last: &[T; NEURONS],
) -> [T; NEURONS] {
    [
        unit::<F, T, 0>(layer, below, last),
        unit::<F, T, 1>(layer, below, last),
        unit::<F, T, 2>(layer, below, last),
    ]
}

/// x_P. No loop: some levels of optimisation would keep it.
#[inline(always)]
fn unit<F: Feedback, T: Real, const P: usize>(
    layer: &Layer<T>,
    below: &[T; NEURONS],
    last: &[T; NEURONS],
) -> T {
    let (w, r) = (&layer.w[P], &layer.r[P]);
    let x = layer.b[P] + w[0] * below[0] + w[1] * below[1] + w[2] * below[2];
    if F::FULL {
        x + r[0] * last[0] + r[1] * last[1] + r[2] * last[2]
    } else {
        x + r[P] * last[P]
    }
}
