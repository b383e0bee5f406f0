//! What a filter estimates: biases, and those weights of two networks that it may teach.

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

/// Memory before anything is in it: all zeros, so that a static one takes no room in flash.
pub trait Blank: Clone + Debug + PartialEq {
    /// That memory.
    const BLANK: Self;
}

impl Blank for () {
    const BLANK: Self = ();
}

impl<T: Real> Blank for Sensitivities<T> {
    const BLANK: Self = Sensitivities::new();
}

impl<T: Real, const M: usize> Blank for [T; M] {
    const BLANK: Self = [T::ZERO; M];
}

/// Which parameters are learnt: a type, so that memory is what they need.
pub trait Learns: Copy + Debug + Default + PartialEq + 'static {
    /// Whether each axis has a bias of its own beside the network.
    const BIASES: bool;
    /// Learnt weights of each network.
    const WEIGHTS: usize;
    /// What the derivatives need to remember.
    type Memory<T: Real>: Blank;
    /// One value for each parameter of a triad.
    type Own<T: Real>: Blank + AsRef<[T]> + AsMut<[T]>;

    /// Whether the weight with this index is learnt.
    fn is_learnt(index: usize) -> bool;

    /// One step of the network and of what the derivatives need.
    fn step<H: Activation, T: Real>(
        net: &Net<H, Identity, Full, T>,
        state: &mut State<T>,
        memory: &mut Self::Memory<T>,
        input: [T; NEURONS],
    ) -> Step<T>;

    /// The derivatives of output `j` (0, 1, 2) by the learnt weights, times `scale`, in index order.
    fn derivatives<T: Real>(
        state: &State<T>,
        memory: &Self::Memory<T>,
        j: usize,
        scale: T,
        row: &mut [T],
    );
}

/// Nothing at all: the sensors are believed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Nothing;

/// Six biases: the classical filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Biases;

/// Biases, and the weights W of the output layer (9 of each network): what the layers below make of power-on time and input is mixed
/// anew, and the filter stays exactly linear. Needs an output layer without feedback (R = 0), as [`ErrorModel::new`] makes it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutputWeights;

/// Biases and all weights that a network with diagonal feedback has, 45 of each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DiagonalWeights;

/// Biases and all 63 weights of each network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AllWeights;

/// First weight W of the output layer.
const TOP: usize = 2 * PARAMS_PER_LAYER;

/// Networks that do not run: their output is 0.
macro_rules! without_network {
    ($name:ty, $biases:expr, $own:expr) => {
        impl Learns for $name {
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
without_network!(Nothing, false, 0);
without_network!(Biases, true, NEURONS);

impl Learns for OutputWeights {
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

/// All weights, or those that exist with the feedback `F`.
macro_rules! with_sensitivities {
    ($name:ty, $feedback:ty) => {
        impl Learns for $name {
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

/// Biases b and networks y of two triads. The parameters of a triad stand together: three biases, then its learnt weights.
///
/// ```text
/// e = b + y(input; weights),   J = de / d(b, weights)
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorModel<L: Learns, const N: usize, H = Rational, T: Real = f32> {
    nets: [Net<H, Identity, Full, T>; TRIADS],
    states: [State<T>; TRIADS],
    memories: [L::Memory<T>; TRIADS],
    bias: [[T; NEURONS]; TRIADS],
    estimate: [T; OUTPUTS],
    /// Rows of J, without the zeros: of the triad's own parameters.
    jacobian: [L::Own<T>; OUTPUTS],
    healthy: bool,
}

impl<L: Learns, const N: usize, H: Activation, T: Real> ErrorModel<L, N, H, T> {
    /// Parameters of one triad.
    const PER_TRIAD: usize = if L::BIASES { NEURONS + L::WEIGHTS } else { 0 };

    /// To be begun.
    pub const BLANK: Self = {
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
            memories: [const { L::Memory::<T>::BLANK }; TRIADS],
            bias: [[T::ZERO; NEURONS]; TRIADS],
            estimate: [T::ZERO; OUTPUTS],
            jacobian: [const { L::Own::<T>::BLANK }; OUTPUTS],
            healthy: false,
        }
    };

    /// Starts from two networks (units of the first are rad/s, of the second m/s^2) and biases of 0. An output layer's feedback is
    /// taken out unless it is learnt.
    pub fn new(nets: [Net<H, Identity, Full, T>; TRIADS]) -> Self {
        let mut model = Self::BLANK;
        model.begin(nets);
        model
    }

    /// [`ErrorModel::new`] where it stands.
    pub fn begin(&mut self, nets: [Net<H, Identity, Full, T>; TRIADS]) {
        let plain = |mut net: Net<H, Identity, Full, T>| {
            if L::WEIGHTS == NEURONS * NEURONS {
                let [_, _, top] = &mut net.weights.layers;
                top.r = [[T::ZERO; NEURONS]; NEURONS];
            }
            net
        };
        self.nets = nets.map(plain);
        self.bias = [[T::ZERO; NEURONS]; TRIADS];
        self.healthy = true;
        self.restart();
    }

    /// The networks as at power-on; what was learnt stays.
    pub fn restart(&mut self) {
        self.states = [State::new(); TRIADS];
        self.memories = [const { L::Memory::<T>::BLANK }; TRIADS];
        self.jacobian = [const { L::Own::<T>::BLANK }; OUTPUTS];
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

    /// Standard deviations in parameter order from those of the biases and of the weights.
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

    /// One block: its mean rate (rad/s) and specific force (m/s^2) in, the estimate for the next one out.
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

    /// e of the last block: errors of the gyros (rad/s) and of the accelerometers (m/s^2).
    #[inline]
    pub fn estimate(&self) -> &[T; OUTPUTS] {
        &self.estimate
    }

    /// Row of J: derivatives of error `output` (0..6).
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

    /// theta <- theta - error. The estimate follows to first order at once and exactly at the next step.
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

    /// The networks as they stand, the biases folded into their output layers: what a compensator runs.
    ///
    /// b_3 takes bias / output scale; an axis whose scale is 0 has no output to carry it.
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

    /// The networks' states, which belong to [`ErrorModel::nets`].
    pub fn states(&self) -> &[State<T>; TRIADS] {
        &self.states
    }

    /// No network has overflowed and all is finite.
    pub fn is_healthy(&self) -> bool {
        self.healthy && crate::real::all_finite(&self.estimate)
    }
}
