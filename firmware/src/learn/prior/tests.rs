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
        let Shapes { driven, curved, .. } = Shapes::new(&SHEET.nets(1.0), &SHEET, &inputs);
        let sources = Sources::of([0.02, -0.05, 0.1], [0.3, -0.6, -9.6]);
        let curved = curved
            .iter()
            .zip(&inputs)
            .take(if inputs == OWN { 2 } else { 0 });
        for (net, which) in driven.iter().zip(&inputs).chain(curved) {
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
    let [net, _] = Shapes::new(&SHEET.nets(1.0), &SHEET, &CURVED).driven;
    let of = |celsius: f32| {
        let mut state = State::new();
        for _ in 0..4 {
            let _ = net.step(&mut state, [celsius, 0.0, celsius]);
        }
        let [_, [first, _, third], _] = *state.layers();
        [first, third].map(f64::from)
    };
    let at = [-5.0, 25.0, 55.0].map(of);
    let parts = |k: usize| {
        let [low, middle, high] = at.map(|units| units[k]);
        [0.5 * (high - low), 0.5 * (high + low) - middle]
    };
    let ([straight, no_curve], [slope, curve]) = (parts(0), parts(1));
    assert!(no_curve.abs() < 1e-3 * straight, "{no_curve} {straight}");
    assert!(slope.abs() < 0.05 * curve.abs(), "{slope} {curve}");
    assert!(at[1][1].abs() < 1e-5 && curve.abs() > 0.25, "{at:?}");
}

/// A third time it gives an odd function that is not straight.
#[test]
fn an_input_given_three_times_has_its_cube() {
    let inputs = [[Source::Temperature; 3]; 2];
    let [net, _] = Shapes::new(&SHEET.nets(1.0), &SHEET, &inputs).driven;
    let of = |celsius: f32| {
        let mut state = State::new();
        net.settle(&mut state, [celsius; 3]);
        let [_, [_, _, cube], _] = *state.layers();
        cube
    };
    let [low, half, high] = [-5.0, 40.0, 55.0].map(of);
    assert!((low + high).abs() < 1e-5 && high > 0.25, "{low} {high}");
    assert!(half < 0.2 * high, "{half} {high}");
}

/// In place of the vibration, which is not of the thermometer, there is the square of the
/// temperature; the other units are as they were. Inputs without a temperature have no curve.
#[test]
fn the_curved_shape_gives_up_another_input_for_a_square() {
    let Shapes { driven, curved, .. } = Shapes::new(&SHEET.nets(1.0), &SHEET, &DRIVEN);
    for (driven, curved) in driven.iter().zip(&curved) {
        let at = |celsius: f32, slope: f32, vibration: f32| {
            [driven, curved].map(|net| {
                let mut state = State::new();
                net.settle(&mut state, [celsius, slope, vibration]);
                state.layers()[1]
            })
        };
        let [one, bent] = at(55.0, 0.01, 0.0);
        assert_eq!(one[..2], bent[..2]);
        let [low, high] = [at(-5.0, 0.0, 0.0)[1][2], at(55.0, 0.0, 0.0)[1][2]];
        assert!(
            low.signum() == high.signum() && high.abs() > 0.2,
            "{low} {high}"
        );
        let [[_, _, shaken], [_, _, deaf]] = at(25.0, 0.0, 1.0);
        assert!(shaken > 0.3 && deaf.abs() < 1e-6, "{shaken} {deaf}");
    }
    let own = Shapes::new(&SHEET.nets(1.0), &SHEET, &OWN);
    assert_eq!(own.driven, own.curved);
}

/// The start of the hypothesis that knows the time only passes nothing on; that is why there is
/// another one. Weights that were learnt keep their shape, whatever their output layer is.
#[test]
fn a_shape_is_taken_only_if_it_is_alive() {
    let dead = SHEET.nets(1.0);
    assert!(dead.iter().all(|net| !is_alive(&net.weights)));
    let Shapes { driven, curved, .. } = Shapes::new(&dead, &SHEET, &DRIVEN);
    assert!(
        driven
            .iter()
            .chain(&curved)
            .all(|net| is_alive(&net.weights))
    );
    let mut learnt = driven;
    learnt[0].weights.layers[0].w[1][2] = 0.3;
    learnt[0].weights.layers[2].b[0] = 0.7;
    let given = Shapes::new(&learnt, &SHEET, &DRIVEN);
    assert_eq!(given.driven, learnt);
    assert_eq!(given.curved, [learnt[0], curved[1]]);
    learnt[0].weights.layers[1].r[0][0] = f32::NAN;
    assert_eq!(Shapes::new(&learnt, &SHEET, &DRIVEN).driven[0], driven[0]);
}

/// Networks that were learnt with one of the built-in shapes do not replace the other's.
#[test]
fn what_was_learnt_with_one_shape_leaves_the_other() {
    let built_in = Shapes::new(&SHEET.nets(1.0), &SHEET, &DRIVEN);
    let with = |nets: &[LearnerNet<f32>; 2]| {
        let mut learnt = *nets;
        for net in &mut learnt {
            net.weights.layers[2].w[1] = [0.3, -0.2, 0.1];
            net.normalisation.output_scale = [3.0; 3]; // of an older datasheet
        }
        (learnt, Shapes::new(&learnt, &SHEET, &DRIVEN))
    };
    let (learnt, shapes) = with(&built_in.curved);
    assert_eq!(shapes.curved, learnt);
    assert!(same_hidden(&shapes.driven[0], &built_in.driven[0]));
    assert_eq!(shapes.driven[0].normalisation, learnt[0].normalisation);
    let (learnt, shapes) = with(&built_in.driven);
    assert_eq!(shapes.driven, learnt);
    assert!(same_hidden(&shapes.curved[1], &built_in.curved[1]));
}

/// At the inputs' own scale the prior of the output layer adds what was asked for; also by a slow
/// unit, which works at a small amplitude.
#[test]
fn the_prior_is_in_units_of_the_bias() {
    let sheet = SHEET.cast::<f64>();
    let [net, _] = Shapes::new(&sheet.nets(1.0), &sheet, &DRIVEN).driven;
    let (mut weights, scales) = (net.weights, net.normalisation);
    let [_, middle, _] = &mut weights.layers;
    middle.r[2][2] = 0.999;
    middle.w[2] = [1e-5, 0.0, 1e-5];
    let net: LearnerNet<f64> = Net::new(weights, scales);
    let sigma = spread(&net, &amplitudes(&net), 0.5, 0.9);
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
