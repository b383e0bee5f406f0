use super::*;
use crate::inputs::{OWN, Sources};
use lrnn_nostd::State;

const SHEET: Datasheet = Datasheet::land_vehicle(1.63e-6, 4e-3);
const CURVED: Inputs = [[
    Source::Temperature,
    Source::TemperatureRate,
    Source::Temperature,
]; 2];
const DRIVEN: Inputs = [[
    Source::Temperature,
    Source::TemperatureRate,
    Source::Vibration,
]; 2];

/// Derivatives of the second layer by the three inputs, by differences.
fn jacobian(net: &LearnerNet<f32>, at: [f32; 3]) -> [[f64; 3]; 3] {
    let hidden = |input: [f32; 3]| {
        let mut state = State::new();
        for _ in 0..4 {
            let _ = net.step(&mut state, input);
        }
        let [_, second, _] = *state.layers();
        second
    };
    core::array::from_fn(|q| {
        let step = 0.05 / net.normalisation.input_scale[q];
        let (mut below, mut above) = (at, at);
        below[q] -= step;
        above[q] += step;
        let (a, b) = (hidden(below), hidden(above));
        core::array::from_fn(|p| f64::from(b[p] - a[p]) / 0.1)
    })
}

fn determinant(m: &[[f64; 3]; 3]) -> f64 {
    let minor = |a: usize, b: usize| m[1][a] * m[2][b] - m[1][b] * m[2][a];
    m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
}

/// No dead start: three different inputs reach the second layer in three independent ways, from no
/// input to the largest usual one.
#[test]
fn the_jacobian_by_the_inputs_has_full_rank() {
    for inputs in [OWN, DRIVEN] {
        let nets = shaped(&SHEET.nets(1.0), &SHEET, &inputs);
        let sources = Sources::of([0.02, -0.05, 0.1], [0.3, -0.6, -9.6]);
        for (net, which) in nets.iter().zip(&inputs) {
            for at in [net.normalisation.input_offset, sources.select(which)] {
                let rank = determinant(&jacobian(net, at));
                assert!(rank.abs() > 0.02, "{rank} at {at:?}");
            }
        }
    }
}

/// Twice the same input gives two functions of it, which differ by a curve.
#[test]
fn an_input_given_twice_is_bent() {
    let [net, _] = shaped(&SHEET.nets(1.0), &SHEET, &CURVED);
    let of = |celsius: f32| {
        let mut state = State::new();
        for _ in 0..4 {
            let _ = net.step(&mut state, [celsius, 0.0, celsius]);
        }
        let [_, [first, _, third], _] = *state.layers();
        [first, third].map(f64::from)
    };
    let curve = |k: usize| {
        let [low, middle, high] = [-5.0, 25.0, 55.0].map(|celsius| of(celsius)[k]);
        (low + high - 2.0 * middle) / (high - low)
    };
    assert!(curve(0).abs() < 1e-3 && curve(1).abs() > 0.1);
}

/// The start of the hypothesis that knows the time only passes nothing on; that is why there is
/// another one. Weights that were learnt keep their shape, whatever their output layer is.
#[test]
fn a_shape_is_taken_only_if_it_is_alive() {
    let dead = SHEET.nets(1.0);
    assert!(dead.iter().all(|net| !is_alive(&net.weights)));
    let live = shaped(&dead, &SHEET, &DRIVEN);
    assert!(live.iter().all(|net| is_alive(&net.weights)));
    let mut learnt = live;
    learnt[0].weights.layers[0].w[1][2] = 0.3;
    learnt[0].weights.layers[2].b[0] = 0.7;
    assert_eq!(shaped(&learnt, &SHEET, &DRIVEN), learnt);
    learnt[0].weights.layers[1].r[0][0] = f32::NAN;
    assert_eq!(shaped(&learnt, &SHEET, &DRIVEN)[0], live[0]);
}

/// At the inputs' own scale the prior of the output layer adds what was asked for; also by a slow
/// unit, which works at a small amplitude.
#[test]
fn the_prior_is_in_units_of_the_bias() {
    let scales = SHEET.cast::<f64>().driven_normalisation(&DRIVEN)[0];
    let mut weights = driven::<f64>(&DRIVEN[0]);
    let [_, middle, _] = &mut weights.layers;
    middle.r[2][2] = 0.999;
    middle.w[2] = [1e-5, 0.0, 1e-5];
    let net: LearnerNet<f64> = Net::new(weights, scales);
    let sigma = spread(&net, 0.5, 0.9);
    let mut state = State::new();
    for _ in 0..50_000 {
        let _ = net.step(&mut state, [55.0, 1.0 / 60.0, 0.0]);
    }
    let [_, hidden, _] = *state.layers();
    for (y, sigma) in hidden.iter().zip(sigma.layers[2].w[0]) {
        assert!((y * sigma - 0.5).abs() < 1e-3, "{y} {sigma}");
    }
    assert_eq!(sigma.layers[2].b, [0.9; 3]);
}
