//! The orders of work agree, bit by bit.

use super::*;
use crate::{Diagonal, Full, Identity, Normalisation, Rational};
use proptest::prelude::*;
use std::vec::Vec;

fn net<F: Feedback>(values: &[f32]) -> Net<Rational, Identity, F> {
    Net::new(Weights::from_fn(|i| values[i]), Normalisation::identity())
}

fn bits<F>(net: &Net<Rational, Identity, F>, sens: &Sensitivities) -> ([u32; PARAMS], Vec<u32>)
where
    F: Feedback,
{
    let rows = sens.output();
    let rows = rows.as_flattened().iter().map(|s| s.to_bits()).collect();
    (net.weights.to_array().map(f32::to_bits), rows)
}

/// The order of work on the desktop, that on the target, and that on the target with the
/// descent included give the same bits.
fn check<F: Feedback>(values: &[f32], inputs: &[[f32; 3]], rate: f32) {
    let mut plain = net::<F>(values);
    let (mut state, mut rows) = (State::new(), Sensitivities::new());
    let (mut columns, mut fused) = (Sensitivities::new(), Sensitivities::new());
    for &input in inputs {
        let Ok(forward) = plain.forward(&state, input) else {
            return;
        };
        let last = state.y;
        state.y = forward.y;
        rows.by_row::<Rational, Identity, F>(&plain.weights, &forward, &last);
        let check = columns.by_column::<Rational, Identity, F>(&plain.weights, &forward, &last);
        let finite = rows.s3.is_finite();
        assert!(finite || !check.passed(), "an overflow was not noticed");

        let g = forward.y[2].map(|y| y * rate);
        let mut moved = plain;
        let went = fused.descend_by_column::<Rational, Identity, F>(
            &mut moved.weights,
            &forward,
            &last,
            g,
        );
        let mut apart = plain.weights;
        let descends = finite && rows.descend(&mut apart, &forward.y[2], rate);
        let fault = match (finite, descends) {
            (false, _) => Some(Fault::SensitivityOverflow),
            (true, false) => Some(Fault::Overflow),
            (true, true) => None,
        };
        assert_eq!(went, fault);
        if finite {
            assert_eq!(bits(&plain, &rows), bits(&plain, &columns));
            plain.weights = apart;
            assert_eq!(bits(&plain, &rows), bits(&moved, &fused));
        } else {
            assert_eq!(
                bits(&plain, &rows).0,
                bits(&moved, &rows).0,
                "moved after an overflow"
            );
            (rows, columns, fused) = Default::default();
        }
    }
}

fn weight() -> impl Strategy<Value = f32> {
    prop_oneof![8 => -1.0_f32..1.0, 1 => -1e19_f32..1e19, 1 => -1e30_f32..1e30]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn orders_of_work_agree(
        ordinary in prop::collection::vec(-1.0_f32..1.0, PARAMS),
        wild in prop::collection::vec(weight(), PARAMS),
        inputs in prop::collection::vec([-3.0_f32..3.0, -3.0_f32..3.0, -3.0_f32..3.0], 1..30),
        rate in -0.01_f32..0.1,
    ) {
        check::<Full>(&ordinary, &inputs, rate);
        check::<Diagonal>(&ordinary, &inputs, rate);
        check::<Full>(&wild, &inputs, rate);
    }
}

/// A single sensitivity that overflows is noticed, and the weights stay what they were.
#[test]
fn every_sensitivity_that_overflows_is_noticed() {
    overflows::<Full>();
    overflows::<Diagonal>();
}

/// A change of the weights that is not finite is noticed by either order of work, and the weights
/// stay what they were.
#[test]
fn weights_that_overflow_are_restored() {
    let mut weights = Weights::zero();
    weights.layers[2].b = [3e38, 0.1, 0.1];
    let net: Net = Net::new(weights, Normalisation::identity());
    let last = State::new().y;
    let forward = net.forward(&State::new(), [0.1; 3]).expect("finite");
    for g in [
        [-3e38, 0.0, 0.0],
        [0.0, f32::NAN, 0.0],
        [0.0, 0.0, f32::INFINITY],
    ] {
        let (mut fused, mut rows) = (Sensitivities::new(), Sensitivities::new());
        let mut moved = weights;
        let fault =
            fused.descend_by_column::<Rational, Identity, Full>(&mut moved, &forward, &last, g);
        assert_eq!((fault, moved), (Some(Fault::Overflow), weights), "{g:?}");
        rows.by_row::<Rational, Identity, Full>(&weights, &forward, &last);
        assert!(!rows.descend(&mut moved, &g, 1.0));
        assert_eq!(moved, weights, "{g:?}");
    }
    // large and finite weights pass, although the sum that watches them overflows
    weights.layers[0].b = [3e38; 3];
    let mut fused = Sensitivities::new();
    let small = [1e-6; NEURONS];
    let fault =
        fused.descend_by_column::<Rational, Identity, Full>(&mut weights, &forward, &last, small);
    assert_eq!(fault, None);
}

fn overflows<F: Feedback>() {
    let mut weights = Weights::zero();
    weights.layers[2].r = [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]];
    let net: Net<Rational, Identity, F> = Net::new(weights, Normalisation::identity());
    let last = State::new().y;
    let forward = net.forward(&State::new(), [0.1; 3]).expect("finite");
    for parameter in 0..PARAMS {
        for (axis, value) in [(0, 3e38), (1, -3e38), (2, 3e38)] {
            if !F::is_active(parameter) {
                continue;
            }
            let mut large = [0.0; NEURONS];
            large[axis] = value;
            let mut sens = Sensitivities::new();
            sens.s3.put(parameter, large);
            let mut columns = sens;
            let check = columns.by_column::<Rational, Identity, F>(&net.weights, &forward, &last);
            assert!(!check.passed(), "parameter {parameter}, axis {axis}");

            let mut moved = net.weights;
            let g = [0.1; NEURONS];
            let fault =
                sens.descend_by_column::<Rational, Identity, F>(&mut moved, &forward, &last, g);
            assert_eq!(fault, Some(Fault::SensitivityOverflow));
            assert_eq!(moved, net.weights, "parameter {parameter}, axis {axis}");
        }
    }
}
