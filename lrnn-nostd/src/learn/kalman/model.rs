//! What a filter estimates: biases, and the learnt weights of two networks.

use crate::activation::{Activation, Identity, Rational};
use crate::gradient::Sensitivities;
use crate::infer::{Fault, Net, Step};
use crate::learn::kalman::{OUTPUTS, Row, TRIADS};
use crate::normalisation::Normalisation;
use crate::real::Real;
use crate::shape::{Diagonal, Feedback, Full, NEURONS, PARAMS, PARAMS_PER_LAYER};
use crate::state::State;
use crate::weights::Weights;
use core::fmt::Debug;

/// Memory that starts with all zeros, so that a static variable takes no room in flash.
pub trait Zeroed: Clone + Debug + PartialEq {
    /// All zeros.
    const ZEROED: Self;
}

impl Zeroed for () {
    const ZEROED: Self = ();
}

impl<T: Real> Zeroed for Sensitivities<T> {
    const ZEROED: Self = Sensitivities::new();
}

impl<T: Real, const M: usize> Zeroed for [T; M] {
    const ZEROED: Self = [T::ZERO; M];
}

/// Which parameters are learnt. It is a type, so that a filter occupies only the memory it needs.
pub trait ParameterSet: Copy + Debug + Default + PartialEq + 'static {
    /// Whether each axis has a bias beside the network.
    const BIASES: bool;
    /// Number of learnt weights of each network.
    const WEIGHTS: usize;
    /// State that the derivatives need from step to step.
    type Memory<T: Real>: Zeroed;
    /// One value for each parameter of a triad.
    type Own<T: Real>: Zeroed + AsRef<[T]> + AsMut<[T]>;

    /// Whether the weight with this index is learnt.
    fn is_learnt(index: usize) -> bool;

    /// Steps the network and the state of its derivatives.
    fn step<H: Activation, T: Real>(
        net: &Net<H, Identity, Full, T>,
        state: &mut State<T>,
        memory: &mut Self::Memory<T>,
        input: [T; NEURONS],
    ) -> Step<T>;

    /// Writes the derivatives of output `j` (0, 1, 2) with respect to the learnt weights, times
    /// `scale`, in index order.
    fn derivatives<T: Real>(
        state: &State<T>,
        memory: &Self::Memory<T>,
        j: usize,
        scale: T,
        row: &mut [T],
    );
}

/// No parameters: the sensors are trusted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoParameters;

/// Networks that are as they are: nothing is learnt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FixedWeights;

/// Six biases: the classical filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Biases;

/// Biases, and the weights W of the output layer (9 of each network). The output layer mixes anew
/// what the lower layers make of power-on time and input, and the filter stays exactly linear. This
/// needs an output layer without feedback (R = 0), which [`ErrorModel::new`] ensures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutputWeights;

/// Biases and the 45 weights that exist in each network with diagonal feedback.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DiagonalWeights;

/// Biases and all 63 weights of each network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AllWeights;

/// Index of the first weight W of the output layer.
const TOP: usize = 2 * PARAMS_PER_LAYER;

/// Parameter sets without a network: its output is 0.
macro_rules! without_network {
    ($name:ty, $biases:expr, $own:expr) => {
        impl ParameterSet for $name {
            const BIASES: bool = $biases;
            const WEIGHTS: usize = 0;
            type Memory<T: Real> = ();
            type Own<T: Real> = [T; $own];

            fn is_learnt(_: usize) -> bool {
                false
            }

            fn step<H: Activation, T: Real>(
                _: &Net<H, Identity, Full, T>,
                _: &mut State<T>,
                (): &mut (),
                _: [T; NEURONS],
            ) -> Step<T> {
                Step {
                    output: [T::ZERO; NEURONS],
                    error: [T::ZERO; NEURONS],
                    fault: None,
                }
            }

            fn derivatives<T: Real>(_: &State<T>, (): &(), _: usize, _: T, _: &mut [T]) {}
        }
    };
}
without_network!(NoParameters, false, 0);
without_network!(Biases, true, NEURONS);

impl ParameterSet for FixedWeights {
    const BIASES: bool = false;
    const WEIGHTS: usize = 0;
    type Memory<T: Real> = ();
    type Own<T: Real> = [T; 0];

    fn is_learnt(_: usize) -> bool {
        false
    }

    fn step<H: Activation, T: Real>(
        net: &Net<H, Identity, Full, T>,
        state: &mut State<T>,
        (): &mut (),
        input: [T; NEURONS],
    ) -> Step<T> {
        net.step(state, input)
    }

    fn derivatives<T: Real>(_: &State<T>, (): &(), _: usize, _: T, _: &mut [T]) {}
}

impl ParameterSet for OutputWeights {
    const BIASES: bool = true;
    const WEIGHTS: usize = NEURONS * NEURONS;
    type Memory<T: Real> = ();
    type Own<T: Real> = [T; NEURONS + NEURONS * NEURONS];

    fn is_learnt(index: usize) -> bool {
        (TOP..TOP + NEURONS * NEURONS).contains(&index)
    }

    fn step<H: Activation, T: Real>(
        net: &Net<H, Identity, Full, T>,
        state: &mut State<T>,
        (): &mut (),
        input: [T; NEURONS],
    ) -> Step<T> {
        net.step(state, input)
    }

    /// y_3,j = sum_q W_jq y_2,q + b_j
    fn derivatives<T: Real>(state: &State<T>, (): &(), j: usize, scale: T, row: &mut [T]) {
        let [_, below, _] = state.layers();
        if let Some(own) = row.get_mut(NEURONS * j..) {
            for (entry, &y) in own.iter_mut().zip(below) {
                *entry = scale * y;
            }
        }
    }
}

/// Parameter sets with all weights that exist for the given feedback.
macro_rules! with_sensitivities {
    ($name:ty, $feedback:ty) => {
        impl ParameterSet for $name {
            const BIASES: bool = true;
            const WEIGHTS: usize = <$feedback>::ACTIVE;
            type Memory<T: Real> = Sensitivities<T>;
            type Own<T: Real> = [T; NEURONS + <$feedback>::ACTIVE];

            fn is_learnt(index: usize) -> bool {
                <$feedback>::is_active(index)
            }

            fn step<H: Activation, T: Real>(
                net: &Net<H, Identity, Full, T>,
                state: &mut State<T>,
                memory: &mut Sensitivities<T>,
                input: [T; NEURONS],
            ) -> Step<T> {
                net.step_gradient(state, memory, input)
            }

            fn derivatives<T: Real>(
                _: &State<T>,
                memory: &Sensitivities<T>,
                j: usize,
                scale: T,
                row: &mut [T],
            ) {
                let learnt = (0..PARAMS).filter(|&index| Self::is_learnt(index));
                for (entry, index) in row.iter_mut().zip(learnt) {
                    let [a, b, c] = memory.of(index);
                    *entry = scale
                        * match j {
                            0 => a,
                            1 => b,
                            _ => c,
                        };
                }
            }
        }
    };
}
with_sensitivities!(AllWeights, Full);
with_sensitivities!(DiagonalWeights, Diagonal);

/// Biases b and networks y of two triads. The parameters of a triad are stored together: three
/// biases, then its learnt weights.
///
/// ```text
/// e = b + y(input; weights),   J = de / d(b, weights)
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorModel<L: ParameterSet, const N: usize, H = Rational, T: Real = f32> {
    nets: [Net<H, Identity, Full, T>; TRIADS],
    states: [State<T>; TRIADS],
    memories: [L::Memory<T>; TRIADS],
    bias: [[T; NEURONS]; TRIADS],
    estimate: [T; OUTPUTS],
    /// Rows of J without their zeros: only the derivatives by the triad's own parameters.
    jacobian: [L::Own<T>; OUTPUTS],
    healthy: bool,
}

impl<L: ParameterSet, const N: usize, H: Activation, T: Real> ErrorModel<L, N, H, T> {
    /// Number of parameters of one triad.
    const PER_TRIAD: usize = if L::BIASES { NEURONS + L::WEIGHTS } else { 0 };

    /// All zeros. Call [`ErrorModel::init`] before use.
    pub const ZEROED: Self = {
        assert!(N == TRIADS * Self::PER_TRIAD);
        Self {
            nets: [Net::new(
                Weights::zero(),
                Normalisation {
                    input_offset: [T::ZERO; NEURONS],
                    input_scale: [T::ZERO; NEURONS],
                    output_scale: [T::ZERO; NEURONS],
                },
            ); TRIADS],
            states: [State::new(); TRIADS],
            memories: [const { L::Memory::<T>::ZEROED }; TRIADS],
            bias: [[T::ZERO; NEURONS]; TRIADS],
            estimate: [T::ZERO; OUTPUTS],
            jacobian: [const { L::Own::<T>::ZEROED }; OUTPUTS],
            healthy: false,
        }
    };

    /// Starts from two networks (in rad/s and in m/s^2) and biases of 0. If only the output weights
    /// are learnt, the feedback of the output layer is set to 0.
    pub fn new(nets: [Net<H, Identity, Full, T>; TRIADS]) -> Self {
        let mut model = Self::ZEROED;
        model.init(&nets);
        model
    }

    /// As [`ErrorModel::new`], but in place.
    pub fn init(&mut self, nets: &[Net<H, Identity, Full, T>; TRIADS]) {
        self.nets = *nets;
        if L::WEIGHTS == NEURONS * NEURONS {
            for net in &mut self.nets {
                let [_, _, top] = &mut net.weights.layers;
                top.r = [[T::ZERO; NEURONS]; NEURONS];
            }
        }
        self.bias = [[T::ZERO; NEURONS]; TRIADS];
        self.healthy = true;
        self.reset();
    }

    /// Resets the networks to their power-on state. Learnt parameters stay.
    pub fn reset(&mut self) {
        self.states = [State::new(); TRIADS];
        self.memories = [const { L::Memory::<T>::ZEROED }; TRIADS];
        self.jacobian = [const { L::Own::<T>::ZEROED }; OUTPUTS];
        for (j, row) in self.jacobian.iter_mut().enumerate() {
            let [k, j] = [j / NEURONS, j % NEURONS];
            if L::BIASES
                && let Some(own) = row.as_mut().get_mut(j)
            {
                *own = T::ONE;
            }
            self.estimate[NEURONS * k + j] = self.bias[k][j];
        }
    }

    /// Standard deviations in parameter order, from those of the biases and those of the weights.
    pub fn sigmas(bias: [[T; NEURONS]; TRIADS], weights: &Weights<T>) -> [T; N] {
        let mut all = [T::ZERO; N];
        if Self::PER_TRIAD == 0 {
            return all;
        }
        for (own, bias) in all.chunks_exact_mut(Self::PER_TRIAD).zip(bias) {
            let learnt = weights.iter().enumerate().filter(|(i, _)| L::is_learnt(*i));
            let values = bias.into_iter().chain(learnt.map(|(_, sigma)| sigma));
            for (entry, value) in own.iter_mut().zip(values) {
                *entry = value;
            }
        }
        all
    }

    /// Steps with one block: takes its mean rate (rad/s) and specific force (m/s^2) and returns the
    /// estimate for the next block.
    pub fn step(&mut self, inputs: [[T; NEURONS]; TRIADS]) -> [T; OUTPUTS] {
        for k in 0..TRIADS {
            let net = &self.nets[k];
            let (state, memory) = (&mut self.states[k], &mut self.memories[k]);
            let step = L::step(net, state, memory, inputs[k]);
            self.healthy &= matches!(step.fault, None | Some(Fault::NonFiniteInput));
            for j in 0..NEURONS {
                let row = &mut self.jacobian[NEURONS * k + j];
                if let Some(own) = row.as_mut().get_mut(NEURONS..) {
                    let scale = net.normalisation.output_scale[j];
                    L::derivatives(state, memory, j, scale, own);
                }
                self.estimate[NEURONS * k + j] = self.bias[k][j] + step.error[j];
            }
        }
        self.estimate
    }

    /// e: the errors of the gyros (rad/s) and of the accelerometers (m/s^2), estimated in the last
    /// step.
    #[inline]
    pub fn estimate(&self) -> &[T; OUTPUTS] {
        &self.estimate
    }

    /// The row of J with the derivatives of error `output` (0..6).
    #[inline]
    pub fn jacobian(&self, output: usize) -> Row<'_, T> {
        let own = self.jacobian.get(output);
        Row {
            start: if output < NEURONS { 0 } else { Self::PER_TRIAD },
            values: own.map_or(&[], AsRef::as_ref),
        }
    }

    /// All rows of J.
    #[inline]
    pub fn rows(&self) -> [Row<'_, T>; OUTPUTS] {
        core::array::from_fn(|output| self.jacobian(output))
    }

    /// theta <- theta - error. The estimate follows at once to first order, and exactly in the next
    /// step.
    pub fn subtract(&mut self, error: &[T; N]) {
        for output in 0..OUTPUTS {
            self.estimate[output] -= self.jacobian(output).dot(error);
        }
        if Self::PER_TRIAD == 0 {
            return;
        }
        for (k, own) in error.chunks_exact(Self::PER_TRIAD).enumerate().take(TRIADS) {
            let mut values = own.iter();
            for (bias, &value) in self.bias[k].iter_mut().zip(values.by_ref()) {
                *bias -= value;
            }
            let mut weights = self.nets[k].weights.to_array();
            let all = weights.iter_mut().enumerate();
            let learnt = all.filter(|(i, _)| L::is_learnt(*i));
            for ((_, weight), &value) in learnt.zip(values) {
                *weight -= value;
            }
            self.nets[k].weights.set_all(&weights);
        }
    }

    /// The networks with the biases folded into their output layers, as a compensator runs them.
    /// b_3 takes bias / output scale; an axis with an output scale of 0 cannot carry its bias.
    pub fn nets(&self) -> [Net<H, Identity, Full, T>; TRIADS] {
        let mut nets = self.nets;
        for (net, bias) in nets.iter_mut().zip(&self.bias) {
            if !L::BIASES || L::WEIGHTS == 0 {
                net.weights = Weights::zero();
            }
            let scale = net.normalisation.output_scale;
            let [_, _, top] = &mut net.weights.layers;
            for j in 0..NEURONS {
                if scale[j] != T::ZERO {
                    top.b[j] += bias[j] / scale[j];
                }
            }
        }
        nets
    }

    /// The networks' states, to be used with [`ErrorModel::nets`].
    pub fn states(&self) -> &[State<T>; TRIADS] {
        &self.states
    }

    /// Whether no network has overflowed and every estimate is finite.
    pub fn is_healthy(&self) -> bool {
        self.healthy && crate::real::all_finite(&self.estimate)
    }
}
