//! For any input, state, sensitivities and results stay finite, and the step reports what happened.

use lrnn_nostd::{
    Activation, Diagonal, Fault, Feedback, Full, Identity, Net, Normalisation, Rational,
    Sensitivities, State, Step, Tanh, Weights,
};
use proptest::prelude::*;

fn weights(scale: f32) -> Weights {
    Weights::from_fn(|index| scale * ((index * 37 % 64) as f32 / 32.0 - 0.97))
}

fn any_f32() -> impl Strategy<Value = f32> + Clone {
    any::<u32>().prop_map(f32::from_bits)
}

fn triple(value: impl Strategy<Value = f32> + Clone) -> impl Strategy<Value = [f32; 3]> {
    [value.clone(), value.clone(), value]
}

/// Any 63 weights: ordinary, huge, or any bits at all.
fn any_weights() -> impl Strategy<Value = Weights> {
    let ordinary = || -2.0_f32..2.0;
    let huge = || prop_oneof![-1e38_f32..1e38, -2.0_f32..2.0, -1e20_f32..1e20];
    let value = prop_oneof![
        prop::collection::vec(ordinary(), 63),
        prop::collection::vec(huge(), 63),
        prop::collection::vec(any_f32(), 63),
    ];
    value.prop_map(|values| Weights::from_fn(|index| values[index]))
}

fn any_normalisation() -> impl Strategy<Value = Normalisation> {
    let any = (triple(any_f32()), triple(any_f32()), triple(any_f32()));
    let any = any.prop_map(|(input_offset, input_scale, output_scale)| Normalisation {
        input_offset,
        input_scale,
        output_scale,
    });
    prop_oneof![Just(Normalisation::identity()), any]
}

fn finite(values: &[[f32; 3]]) -> bool {
    values.as_flattened().iter().all(|value| value.is_finite())
}

/// Runs `step` and `step_gradient` side by side.
fn check<H: Activation, O: Activation, F: Feedback>(
    weights: Weights,
    normalisation: Normalisation,
    inputs: &[[f32; 3]],
) {
    let net = Net::<H, O, F>::new(weights, normalisation);
    let (mut plain, mut state, mut sens) = (State::new(), State::new(), Sensitivities::new());
    for &input in inputs {
        let (before, sens_before) = (state, sens);
        let Step {
            output,
            error,
            fault,
        } = net.step(&mut plain, input);
        let twin = net.step_gradient(&mut state, &mut sens, input);

        assert_eq!(
            (twin.output.map(f32::to_bits), twin.error.map(f32::to_bits)),
            (output.map(f32::to_bits), error.map(f32::to_bits))
        );
        assert_eq!(
            plain.layers().map(|y| y.map(f32::to_bits)),
            state.layers().map(|y| y.map(f32::to_bits))
        );
        assert!(finite(&[output, error]) && finite(state.layers()));
        assert!(sens.output().as_flattened().iter().all(|s| s.is_finite()));
        assert_eq!(output, state.output());

        assert_eq!(fault == Some(Fault::NonFiniteInput), !finite(&[input]));
        match twin.fault {
            None => assert_eq!(fault, None),
            Some(Fault::SensitivityOverflow) => {
                assert_eq!(fault, None);
                assert_eq!(sens, Sensitivities::new());
            }
            Some(_) => {
                assert_eq!(twin.fault, fault);
                assert_eq!(
                    (state, sens),
                    (before, sens_before),
                    "a step not made has no effect"
                );
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn nothing_poisons(
        weights in any_weights(),
        normalisation in any_normalisation(),
        inputs in prop::collection::vec(prop_oneof![triple(any_f32()), triple(-3.0_f32..3.0)], 1..40),
    ) {
        check::<Rational, Identity, Full>(weights, normalisation, &inputs);
        check::<Tanh, Tanh, Full>(weights, normalisation, &inputs);
        check::<Rational, Rational, Diagonal>(weights, normalisation, &inputs);
        check::<Identity, Identity, Full>(weights, normalisation, &inputs);
        check::<Identity, Tanh, Diagonal>(weights, normalisation, &inputs);
    }
}

/// A bad target teaches nothing, and the next good one is learnt from as if it had not been there.
#[test]
fn a_bad_target_leaves_the_network_as_it_was() {
    let mut net: Net = Net::new(weights(0.5), Normalisation::identity());
    let (mut state, mut sens) = (State::new(), Sensitivities::new());
    let input = [0.1, -0.2, 0.3];
    let good = net.step_descend(&mut state, &mut sens, input, &[0.1; 3], 0.01);
    assert_eq!(good.fault, None);
    let before = (net, state, sens);
    for axis in 0..3 {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut target = [0.1; 3];
            target[axis] = bad;
            let step = net.step_descend(&mut state, &mut sens, input, &target, 0.01);
            assert_eq!(step.fault, Some(Fault::NonFiniteInput));
            assert_eq!(step.output, good.output);
            assert_eq!((net, state, sens), before, "{axis} {bad}");
        }
    }
    let step = net.step_descend(&mut state, &mut sens, input, &[0.1; 3], f32::NAN);
    assert_eq!(step.fault, Some(Fault::NonFiniteInput));
    assert_eq!((net, state, sens), before);
    // what is finite and overflows: the step is made, the weights stay
    let step = net.step_descend(&mut state, &mut sens, input, &[1e38; 3], 1e3);
    assert_eq!((step.fault, net), (Some(Fault::Overflow), before.0));
    assert_eq!(step.output, state.output());
    let step = net.step_descend(&mut state, &mut sens, input, &[0.1; 3], 0.01);
    assert_eq!(step.fault, None);
    assert!(net.weights.is_finite() && net != before.0);
}

#[test]
fn a_bad_input_holds_the_last_output() {
    let normalisation = Normalisation {
        output_scale: [0.5, 2.0, 4.0],
        ..Normalisation::identity()
    };
    let net: Net = Net::new(weights(0.5), normalisation);
    let mut state = State::new();
    let good = net.step(&mut state, [0.1, -0.2, 0.3]);
    assert_eq!(good.fault, None);
    assert!(good.output.iter().all(|y| y.abs() > 1e-3));
    let before = state;
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let held = net.step(&mut state, [0.0, bad, 0.0]);
        assert_eq!(
            held,
            Step {
                fault: Some(Fault::NonFiniteInput),
                ..good
            }
        );
        assert_eq!(state, before);
    }
    assert_eq!(net.step(&mut state, [0.0; 3]).fault, None);
}

/// An output layer that doubles at every step: first the sensitivities overflow, then the output.
/// Both are reported.
#[test]
fn unstable_feedback_is_reported_and_stays_finite() {
    let mut weights = weights(0.5);
    weights.layers[2].r = [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]];
    let net: Net = Net::new(weights, Normalisation::identity());
    let (mut state, mut sens) = (State::new(), Sensitivities::new());
    let mut first = None;
    for k in 0..200 {
        let fault = net.step_gradient(&mut state, &mut sens, [0.3; 3]).fault;
        first = first.or(fault.map(|fault| (k, fault)));
        assert!(finite(state.layers()));
        assert!(sens.output().as_flattened().iter().all(|s| s.is_finite()));
    }
    let (step, fault) = first.expect("2^200 is more than f32 can hold");
    assert!((100..135).contains(&step), "{step}");
    assert_eq!(fault, Fault::SensitivityOverflow);
    assert_eq!(net.step(&mut state, [0.3; 3]).fault, Some(Fault::Overflow));
}

#[test]
fn diagonal_ignores_the_other_entries() {
    let with = |off: f32| {
        let mut weights = weights(0.5);
        for layer in &mut weights.layers {
            for (p, row) in layer.r.iter_mut().enumerate() {
                for (q, r) in row.iter_mut().enumerate() {
                    *r = if p == q { 0.4 } else { off };
                }
            }
        }
        Net::<Rational, Identity, Diagonal>::new(weights, Normalisation::identity())
    };
    let (mut a, mut b) = (State::new(), State::new());
    for k in 0..20 {
        let input = [k as f32 * 0.1, 0.2, -0.3];
        assert_eq!(
            with(0.0).step(&mut a, input),
            with(f32::NAN).step(&mut b, input)
        );
    }
}
