//! Parameters that a filter estimates: biases, the learnt weights of two networks, and two maps.

use super::parameters::{ParameterSet, Zeroed};
use crate::activation::{Activation, Identity, Rational};
use crate::infer::{Fault, Net};
use crate::learn::kalman::{OUTPUTS, PROPORTIONAL, Rows, TRIADS};
use crate::normalisation::Normalisation;
use crate::real::Real;
use crate::shape::{Full, NEURONS, PARAMS_PER_LAYER};
use crate::state::State;
use crate::weights::Weights;

/// Matrix of each triad, axis by cause: scale factors on the diagonal, misalignments beside it.
pub type Maps<T> = [[[T; NEURONS]; NEURONS]; TRIADS];

/// Biases b, networks y and maps M of two triads. The parameters of a triad are stored together:
/// three biases, then its learnt weights: the map's, row by row, then the network's.
///
/// ```text
/// e = b + y(input; weights) + M u,   J = de / d(b, weights)
/// ```
///
/// `u` is what the triad feels at rest ([`ErrorModel::set_rest`]). What it feels beyond that is not
/// constant over a block: see [`super::Transition::proportional`].
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorModel<L: ParameterSet, const N: usize, H = Rational, T: Real = f32> {
    nets: [Net<H, Identity, Full, T>; TRIADS],
    states: [State<T>; TRIADS],
    memories: [L::Memory<T>; TRIADS],
    bias: [[T; NEURONS]; TRIADS],
    maps: Maps<T>,
    rest: [[T; NEURONS]; TRIADS],
    estimate: [T; OUTPUTS],
    /// J without its zeros: only the derivatives by the triad's own parameters.
    jacobian: [L::Own<T>; TRIADS],
    healthy: bool,
}

/// Rows of both maps.
pub(super) const GROUPS: usize = PROPORTIONAL / NEURONS;

/// M u.
fn mapped<T: Real>(map: &[[T; NEURONS]; NEURONS], u: &[T; NEURONS]) -> [T; NEURONS] {
    map.map(|row| {
        let products = row.into_iter().zip(u);
        products.fold(T::ZERO, |sum, (m, &u)| sum + m * u)
    })
}

/// Derivatives of M u by the elements of M, row by row.
fn at_rest<T: Real>(u: &[T; NEURONS]) -> [[T; NEURONS]; NEURONS * NEURONS] {
    core::array::from_fn(|element| {
        let mut outputs = [T::ZERO; NEURONS];
        outputs[element / NEURONS] = u[element % NEURONS];
        outputs
    })
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
            maps: [[[T::ZERO; NEURONS]; NEURONS]; TRIADS],
            rest: [[T::ZERO; NEURONS]; TRIADS],
            estimate: [T::ZERO; OUTPUTS],
            jacobian: [const { L::Own::<T>::ZEROED }; TRIADS],
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

    /// As [`ErrorModel::new`], but in place, and what the triads feel at rest stays as it was set
    /// ([`Self::set_rest`]): zeros, in a model that is new.
    pub fn init(&mut self, nets: &[Net<H, Identity, Full, T>; TRIADS]) {
        self.nets = *nets;
        for net in &mut self.nets {
            L::prepare(&mut net.weights);
        }
        self.bias = [[T::ZERO; NEURONS]; TRIADS];
        self.maps = [[[T::ZERO; NEURONS]; NEURONS]; TRIADS];
        self.healthy = true;
        self.reset();
    }

    /// Resets the networks to their power-on state. Learnt parameters stay.
    pub fn reset(&mut self) {
        self.states = [State::new(); TRIADS];
        self.memories = [const { L::Memory::<T>::ZEROED }; TRIADS];
        self.jacobian = [const { L::Own::<T>::ZEROED }; TRIADS];
        for (k, (own, net)) in self.jacobian.iter_mut().zip(&self.nets).enumerate() {
            let scale = net.normalisation.output_scale;
            let first = net.initial_output();
            let felt = mapped(&self.maps[k], &self.rest[k]);
            if let Some(by_map) = own.as_mut().get_mut(NEURONS..NEURONS + L::MAP) {
                by_map.copy_from_slice(&at_rest(&self.rest[k])[..L::MAP]);
            }
            for j in 0..NEURONS {
                let estimate = &mut self.estimate[NEURONS * k + j];
                *estimate = self.bias[k][j] + felt[j];
                if L::BIASES
                    && let Some(by_bias) = own.as_mut().get_mut(j)
                {
                    by_bias[j] = T::ONE;
                }
                if let Some(at) = L::OUTPUT_BIAS {
                    *estimate += first[j];
                    if let Some(by_output) = own.as_mut().get_mut(NEURONS + at + j) {
                        by_output[j] = scale[j];
                    }
                }
            }
        }
    }

    /// What the triads feel at rest, rad/s and m/s^2: estimate and J are those of this constant
    /// input of the maps.
    pub fn set_rest(&mut self, rest: [[T; NEURONS]; TRIADS]) {
        for k in 0..TRIADS {
            let [before, after] = [&self.rest[k], &rest[k]].map(|u| mapped(&self.maps[k], u));
            for j in 0..NEURONS {
                self.estimate[NEURONS * k + j] += after[j] - before[j];
            }
            if let Some(by_map) = self.jacobian[k].as_mut().get_mut(NEURONS..NEURONS + L::MAP) {
                by_map.copy_from_slice(&at_rest(&rest[k])[..L::MAP]);
            }
        }
        self.rest = rest;
    }

    /// The estimate without the maps' part.
    pub fn output(&self) -> [T; OUTPUTS] {
        let mut output = self.estimate;
        for k in 0..TRIADS {
            let felt = mapped(&self.maps[k], &self.rest[k]);
            for j in 0..NEURONS {
                output[NEURONS * k + j] -= felt[j];
            }
        }
        output
    }

    /// The maps of both triads.
    pub fn maps(&self) -> &Maps<T> {
        &self.maps
    }

    /// Maps that are as they are, of a set that learns none. The networks begin again, as with
    /// [`Self::reset`].
    pub fn set_maps(&mut self, maps: &Maps<T>) {
        self.maps = *maps;
        self.reset();
    }

    /// The networks begin in the steady state of these inputs ([`Net::settle`]), before the first
    /// step.
    pub fn settle(&mut self, inputs: [[T; NEURONS]; TRIADS]) {
        if L::NETWORK {
            let nets = self.nets.iter().zip(&mut self.states);
            for ((net, state), input) in nets.zip(inputs) {
                net.settle(state, input);
            }
        }
    }

    /// The learnt weights of both networks, in parameter order.
    pub fn weights(&self) -> impl Iterator<Item = T> + '_ {
        self.maps.iter().zip(&self.nets).flat_map(|(map, net)| {
            let of_map = map.as_flattened().iter().take(L::MAP).copied();
            let all = net.weights.iter().enumerate();
            let learnt = all.filter(|(i, _)| L::is_learnt(*i));
            of_map.chain(learnt.map(|(_, weight)| weight))
        })
    }

    /// Sets the learnt weights of both networks, in parameter order, until there is no value left.
    pub fn set_weights(&mut self, values: &mut impl Iterator<Item = T>) {
        for (map, net) in self.maps.iter_mut().zip(&mut self.nets) {
            let of_map = map.as_flattened_mut().iter_mut().take(L::MAP);
            let all = net.weights.iter_mut().enumerate();
            let learnt = all.filter(|(i, _)| L::is_learnt(*i));
            for weight in of_map.chain(learnt.map(|(_, weight)| weight)) {
                if let Some(value) = values.next() {
                    *weight = value;
                }
            }
        }
    }

    /// Whether parameter `i` is one of the learnt weights, and not a bias of this turn-on.
    pub(super) fn is_weight(i: usize) -> bool {
        let biases = if L::BIASES { NEURONS } else { 0 };
        let within = i.checked_rem(Self::PER_TRIAD);
        within.is_some_and(|within| within >= biases)
    }

    /// The explicit biases of each triad.
    pub fn biases(&self) -> &[[T; NEURONS]; TRIADS] {
        &self.bias
    }

    /// Output scale of one of the six outputs.
    pub(super) fn output_scale(&self, output: usize) -> T {
        let net = self.nets.get(output / NEURONS);
        let scale = net.and_then(|net| net.normalisation.output_scale.get(output % NEURONS));
        scale.copied().unwrap_or(T::ZERO)
    }

    /// The networks without the biases of this turn-on: what belongs to the unit.
    pub fn unit_nets(&self) -> [Net<H, Identity, Full, T>; TRIADS] {
        self.nets
    }

    /// Standard deviations in parameter order, from those of the biases, of the maps and of the
    /// weights of both networks.
    pub fn sigmas(
        bias: [[T; NEURONS]; TRIADS],
        maps: &Maps<T>,
        weights: &[Weights<T>; TRIADS],
    ) -> [T; N] {
        let mut all = [T::ZERO; N];
        if Self::PER_TRIAD == 0 {
            return all;
        }
        let triads = all.chunks_exact_mut(Self::PER_TRIAD);
        for (((own, bias), map), weights) in triads.zip(bias).zip(maps).zip(weights) {
            let of_map = map.as_flattened().iter().take(L::MAP).copied();
            let learnt = weights.iter().enumerate().filter(|(i, _)| L::is_learnt(*i));
            let values = bias.into_iter().chain(of_map);
            let values = values.chain(learnt.map(|(_, sigma)| sigma));
            for (entry, value) in own.iter_mut().zip(values) {
                *entry = value;
            }
        }
        all
    }

    /// Steps with one block: takes its mean rate (rad/s) and specific force (m/s^2) and returns the
    /// estimate for the next block.
    pub fn step(&mut self, inputs: [[T; NEURONS]; TRIADS]) -> [T; OUTPUTS] {
        let memories = self.states.iter_mut().zip(&mut self.memories);
        let results = self.estimate.as_chunks_mut().0.iter_mut();
        let results = results.zip(&mut self.jacobian).zip(memories);
        let maps = self.maps.iter().zip(&self.rest).zip(&self.bias);
        let each = self.nets.iter().zip(inputs).zip(maps).zip(results);
        for (((net, input), ((map, rest), bias)), ((estimate, own), (state, memory))) in each {
            let step = L::step(net, state, memory, input);
            self.healthy &= matches!(step.fault, None | Some(Fault::NonFiniteInput));
            if let Some(own) = own.as_mut().get_mut(NEURONS + L::MAP..) {
                L::derivatives(state, memory, &net.normalisation.output_scale, own);
            }
            let felt = mapped(map, rest);
            let estimate: &mut [T; NEURONS] = estimate;
            let parts = bias.iter().zip(step.error).zip(felt);
            for (estimate, ((&bias, error), felt)) in estimate.iter_mut().zip(parts) {
                *estimate = bias + error + felt;
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

    /// J: the rows of each triad.
    #[inline]
    pub fn jacobian(&self) -> [Rows<'_, T>; TRIADS] {
        let starts = [0, Self::PER_TRIAD];
        core::array::from_fn(|k| Rows {
            start: starts[k],
            values: self.jacobian[k].as_ref(),
        })
    }

    /// theta <- theta - error. The estimate follows at once to first order, and exactly in the next
    /// step.
    pub fn subtract(&mut self, error: &[T; N]) {
        for k in 0..TRIADS {
            let change = self.jacobian()[k].times(error);
            for (j, change) in change.into_iter().enumerate() {
                self.estimate[NEURONS * k + j] -= change;
            }
        }
        if Self::PER_TRIAD == 0 {
            return;
        }
        for (k, own) in error.chunks_exact(Self::PER_TRIAD).enumerate().take(TRIADS) {
            for (bias, &value) in self.bias[k].iter_mut().zip(own) {
                *bias -= value;
            }
            let of_map = self.maps[k].as_flattened_mut().iter_mut().take(L::MAP);
            for (element, &value) in of_map.zip(own.iter().skip(NEURONS)) {
                *element -= value;
            }
            let mut at = NEURONS + L::MAP;
            for (l, layer) in self.nets[k].weights.layers.iter_mut().enumerate() {
                let mut index = l * PARAMS_PER_LAYER;
                let (w, r) = (layer.w.as_flattened_mut(), layer.r.as_flattened_mut());
                for part in [w, r, &mut layer.b] {
                    for weight in part {
                        if L::is_learnt(index)
                            && let Some(&value) = own.get(at)
                        {
                            *weight -= value;
                            at += 1;
                        }
                        index += 1;
                    }
                }
            }
        }
    }

    /// J of the elements of the maps, three at a time: the outputs that each adds are the elements
    /// themselves, in the order of [`super::Transition::proportional`].
    pub(super) fn of_maps<'a>(unit: &'a [[T; NEURONS]; NEURONS]) -> [Rows<'a, T>; GROUPS] {
        core::array::from_fn(|group| {
            let (k, row) = (group / NEURONS, group % NEURONS);
            Rows {
                start: k * Self::PER_TRIAD + NEURONS * (1 + row),
                values: unit,
            }
        })
    }

    /// The networks with the biases folded into their output layers, as a compensator runs them.
    /// b_3 takes bias / output scale; an axis with an output scale of 0 cannot carry its bias. An
    /// output layer with feedback ([`super::AllWeights`], [`super::DiagonalWeights`]) feeds the
    /// bias back, too, so that its output is not the estimate.
    pub fn nets(&self) -> [Net<H, Identity, Full, T>; TRIADS] {
        let mut nets = self.nets;
        for (net, bias) in nets.iter_mut().zip(&self.bias) {
            if !L::NETWORK {
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
