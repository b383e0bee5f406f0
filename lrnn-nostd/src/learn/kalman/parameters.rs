//! Which parameters of the error model are learnt, as types.

use crate::activation::{Activation, Identity};
use crate::gradient::Sensitivities;
use crate::infer::{Net, Step};
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

impl<T: Real, const M: usize> Zeroed for [[T; NEURONS]; M] {
    const ZEROED: Self = [[T::ZERO; NEURONS]; M];
}

/// The parameters that are learnt. It is a type, so that a filter occupies only the memory it
/// needs.
pub trait ParameterSet: Copy + Debug + Default + PartialEq + 'static {
    /// Whether each axis has a bias beside the network.
    const BIASES: bool;
    /// Number of learnt weights of each network, with its map.
    const WEIGHTS: usize;
    /// Number of elements of each triad's map that are learnt, the first of its weights: 9 or 0.
    const MAP: usize = 0;
    /// Index of the first bias of the output layer among the learnt weights of a network, if they
    /// are learnt: it belongs to the unit, beside the explicit biases of this turn-on.
    const OUTPUT_BIAS: Option<usize> = None;
    /// Whether there are networks at all; without, their output is 0.
    const NETWORK: bool = true;
    /// State that the derivatives need from step to step.
    type Memory<T: Real>: Zeroed;
    /// The derivatives of a triad's three outputs by each of its parameters.
    type Own<T: Real>: Zeroed + AsRef<[[T; NEURONS]]> + AsMut<[[T; NEURONS]]>;

    /// Whether the weight with this index is learnt. By default none is.
    #[must_use]
    fn is_learnt(_: usize) -> bool {
        false
    }

    /// Makes of any weights those that this set can learn from.
    fn prepare<T: Real>(_: &mut Weights<T>) {}

    /// Steps the network, and the state of its derivatives if there is one.
    fn step<H: Activation, T: Real>(
        net: &Net<H, Identity, Full, T>,
        state: &mut State<T>,
        _: &mut Self::Memory<T>,
        input: [T; NEURONS],
    ) -> Step<T> {
        net.step(state, input)
    }

    /// Writes the derivatives of the three outputs with respect to the learnt weights, times
    /// `scale`, in index order.
    fn derivatives<T: Real>(
        _: &State<T>,
        _: &Self::Memory<T>,
        _scale: &[T; NEURONS],
        _rows: &mut [[T; NEURONS]],
    ) {
    }
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

/// Biases, and the weights W of the output layer (9 of each network). The output layer mixes the
/// lower layers' functions of power-on time and input, and the filter stays exactly linear. This
/// needs an output layer without feedback (R = 0), which [`super::ErrorModel::new`] ensures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutputWeights;

/// Biases of this turn-on, and those of the unit: the biases of the output layer of a network that
/// has nothing else.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UnitBiases;

/// Biases of this turn-on, and of the unit its biases and its map: scale factors and misalignments
/// of both triads ([`super::Transition::proportional`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UnitMap;

/// Biases of this turn-on, and the output layer of a network that belongs to the unit: its weights
/// W and its biases (12 of each network). As [`OutputWeights`] it is exactly linear.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UnitOutput;

/// Biases and the 45 weights that exist in each network with diagonal feedback.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DiagonalWeights;

/// Biases and all 63 weights of each network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AllWeights;

/// Index of the first weight W of the output layer.
const TOP: usize = 2 * PARAMS_PER_LAYER;
/// Index of the first bias of the output layer.
const TOP_BIAS: usize = TOP + 2 * NEURONS * NEURONS;

/// Parameter sets without a network: its output is 0.
macro_rules! without_network {
    ($name:ty, $biases:expr, $own:expr) => {
        impl ParameterSet for $name {
            const BIASES: bool = $biases;
            const WEIGHTS: usize = 0;
            const NETWORK: bool = false;
            type Memory<T: Real> = ();
            type Own<T: Real> = [[T; NEURONS]; $own];

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
        }
    };
}
without_network!(NoParameters, false, 0);
without_network!(Biases, true, NEURONS);

impl ParameterSet for FixedWeights {
    const BIASES: bool = false;
    const WEIGHTS: usize = 0;
    type Memory<T: Real> = ();
    type Own<T: Real> = [[T; NEURONS]; 0];
}

/// Parameter sets of which the networks' output is a linear function: y_3,j = sum_q W_jq y_2,q +
/// b_j. `$weights`: of W, `$biases`: of b, 9 and 3 or none. `$map`: of the map, 9 or none.
macro_rules! of_output_layer {
    ($name:ty, $map:expr, $weights:expr, $biases:expr) => {
        impl ParameterSet for $name {
            const BIASES: bool = true;
            const WEIGHTS: usize = $map + $weights + $biases;
            const MAP: usize = $map;
            const OUTPUT_BIAS: Option<usize> = if $biases > 0 {
                Some($map + $weights)
            } else {
                None
            };
            type Memory<T: Real> = ();
            type Own<T: Real> = [[T; NEURONS]; NEURONS + $map + $weights + $biases];

            // a call for each weight costs a desktop more
            #[cfg_attr(not(target_os = "none"), inline)]
            fn is_learnt(index: usize) -> bool {
                (TOP..TOP + $weights).contains(&index)
                    || (TOP_BIAS..TOP_BIAS + $biases).contains(&index)
            }

            fn prepare<T: Real>(weights: &mut Weights<T>) {
                let [_, _, top] = &mut weights.layers;
                top.r = [[T::ZERO; NEURONS]; NEURONS];
                if $weights == 0 {
                    top.w = [[T::ZERO; NEURONS]; NEURONS];
                }
            }

            fn derivatives<T: Real>(
                state: &State<T>,
                (): &(),
                scale: &[T; NEURONS],
                rows: &mut [[T; NEURONS]],
            ) {
                let [_, below, _] = state.layers();
                let (weights, biases) = rows.split_at_mut($weights);
                let weights = weights.chunks_exact_mut(NEURONS);
                for (j, (own, &scale)) in weights.zip(scale).enumerate() {
                    for (entry, &y) in own.iter_mut().zip(below) {
                        if let Some(entry) = entry.get_mut(j) {
                            *entry = scale * y;
                        }
                    }
                }
                for (j, (own, &scale)) in biases.iter_mut().zip(scale).enumerate() {
                    if let Some(own) = own.get_mut(j) {
                        *own = scale;
                    }
                }
            }
        }
    };
}
of_output_layer!(OutputWeights, 0, NEURONS * NEURONS, 0);
of_output_layer!(UnitBiases, 0, 0, NEURONS);
of_output_layer!(UnitMap, NEURONS * NEURONS, 0, NEURONS);
of_output_layer!(UnitOutput, 0, NEURONS * NEURONS, NEURONS);

/// Parameter sets with all weights that exist for the given feedback.
macro_rules! with_sensitivities {
    ($name:ty, $feedback:ty) => {
        impl ParameterSet for $name {
            const BIASES: bool = true;
            const WEIGHTS: usize = <$feedback>::ACTIVE;
            type Memory<T: Real> = Sensitivities<T>;
            type Own<T: Real> = [[T; NEURONS]; NEURONS + <$feedback>::ACTIVE];

            // a call for each weight costs a desktop more
            #[cfg_attr(not(target_os = "none"), inline)]
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
                scale: &[T; NEURONS],
                rows: &mut [[T; NEURONS]],
            ) {
                let learnt = (0..PARAMS).filter(|&index| Self::is_learnt(index));
                for (entry, index) in rows.iter_mut().zip(learnt) {
                    let of = memory.of(index);
                    *entry = core::array::from_fn(|j| scale[j] * of[j]);
                }
            }
        }
    };
}
with_sensitivities!(AllWeights, Full);
with_sensitivities!(DiagonalWeights, Diagonal);
