//! What the units of a network reach, and the standard deviations of its weights that follow.

use super::LearnerNet;
use lrnn_nostd::{Real, State, Weights};

/// Standard deviation of a hidden weight around the shape, as a share of the largest weight of its
/// unit, for the hypothesis that learns them.
const HIDDEN: f64 = 0.1;

/// Standard deviation of each weight of a network of any shape, when each unit of the second layer
/// may add `output` at an input of 1, in units of the output scale, and the output bias `bias`.
/// `amplitude`: what each unit of the second layer reaches ([`amplitudes`]).
#[must_use]
pub fn spread<T: Real>(
    net: &LearnerNet<T>,
    amplitude: &[f64; 3],
    output: f64,
    bias: f64,
) -> Weights<T> {
    let to = T::from_f64;
    let mut sigma = Weights::zero();
    let [input, middle, _] = &net.weights.layers;
    let [input_sigma, middle_sigma, top] = &mut sigma.layers;
    let size = |w: T| if w < T::ZERO { -w } else { w };
    let share = to(HIDDEN);
    for (of, sigma) in [(input, input_sigma), (middle, middle_sigma)] {
        for i in 0..3 {
            let largest = of.w[i].iter().fold(T::ZERO, |most, &w| {
                let w = size(w);
                if w > most { w } else { most }
            });
            let leak = T::ONE - size(of.r[i][i]);
            let leak = if leak > T::ZERO { leak } else { T::ZERO };
            sigma.w[i] = [share * largest; 3];
            sigma.r[i] = [share * leak; 3];
            sigma.b[i] = share * largest;
        }
    }
    let reads = amplitude.map(|size| to(if size > 0.0 { output / size } else { 0.0 }));
    top.w = [reads; 3];
    top.b = [to(bias); 3];
    sigma
}

/// Final movement of each unit of the second layer when one input goes from its mean to 1 in
/// network units: the most of the three.
#[must_use]
pub fn amplitudes<T: Real>(net: &LearnerNet<T>) -> [f64; 3] {
    let scales = &net.normalisation;
    let mut hidden = *net;
    let [_, _, top] = &mut hidden.weights.layers;
    *top = Weights::zero().layers[2]; // need not settle
    let settled = |input: [T; 3]| {
        let mut state = State::new();
        hidden.settle(&mut state, input);
        let [_, second, _] = *state.layers();
        second.map(Real::to_f64)
    };
    let mean = settled(scales.input_offset);
    let mut most = [0.0_f64; 3];
    for j in 0..3 {
        let mut input = scales.input_offset;
        if scales.input_scale[j] != T::ZERO {
            input[j] += T::ONE / scales.input_scale[j];
        }
        for ((most, now), mean) in most.iter_mut().zip(settled(input)).zip(mean) {
            *most = most.max((now - mean).abs());
        }
    }
    most
}

/// Whether hidden layers pass inputs on: each unit of the second layer follows at least one of
/// them.
#[must_use]
pub fn is_alive<T: Real>(weights: &Weights<T>) -> bool {
    let [input, middle, _] = &weights.layers;
    let follows = |m: usize| input.w[m].iter().any(|&w| w != T::ZERO);
    (0..3).all(|p| (0..3).any(|m| middle.w[p][m] != T::ZERO && follows(m)))
}
