//! The update rules: the paper's as printed, the guarded one, Gauss-Newton; and the window learner.

use lrnn_nostd::learn::{GaussNewton, Guarded, Learner, Paper, Pass, Rule, StepSizes};
use lrnn_nostd::{
    Full, Identity, Kind, Net, Normalisation, PARAMS, Rational, Sensitivities, State, Tanh, Weights,
};

type Exact = Net<Tanh, Identity, Full, f64>;

/// Small random weights within +-0.3.
fn small_weights() -> Weights<f64> {
    let mut seed = 11_u64;
    Weights::from_fn(|_| {
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        0.3 * ((seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0)
    })
}

fn rate(k: usize) -> [f64; 3] {
    let t = 0.1 * k as f64;
    [
        0.8 * t.sin(),
        0.7 * (0.61 * t).cos(),
        0.5 * (0.23 * t).sin(),
    ]
}

/// Bias and scale error of each axis, with units: output_scale is 1e-5.
fn sensor_error(k: usize) -> [f64; 3] {
    let u = rate(k);
    [
        1e-5 * (0.5 + 0.3 * u[0]),
        1e-5 * (-0.4 + 0.2 * u[1]),
        1e-5 * (0.2 - 0.4 * u[2]),
    ]
}

fn exact_net() -> Exact {
    Net::new(
        small_weights(),
        Normalisation {
            output_scale: [1e-5; 3],
            ..Normalisation::identity()
        },
    )
}

/// One pass of 200 steps with a target for each.
fn pass<U: Rule<f64>>(learner: &mut Learner<U, Tanh, Identity, Full, f64>) -> Pass<f64> {
    learner.begin_pass();
    for k in 0..200 {
        let _ = learner.step(rate(k), 1.0);
        learner.reference(sensor_error(k), 1.0);
    }
    learner.end_pass()
}

/// An axis that is switched off: the others learn, by each rule, whatever its reference is.
#[test]
fn an_axis_that_is_switched_off_does_not_disturb_the_others() {
    let start = exact_net();
    let mut off = start;
    off.normalisation.output_scale[1] = 0.0;
    fn costs<U: Rule<f64> + Clone>(net: &Exact, rule: &U, of_axis: f64) -> [f64; 2] {
        let mut learner = Learner::new(net, rule.clone());
        let mut costs = [0.0; 40].map(|_: f64| {
            learner.begin_pass();
            for k in 0..200 {
                let _ = learner.step(rate(k), 1.0);
                let [x, _, z] = sensor_error(k);
                learner.reference([x, of_axis, z], 1.0);
            }
            learner.end_pass().cost
        });
        assert!(learner.proposal().is_finite());
        costs.reverse();
        [costs[39], costs[0]]
    }
    let gauss_newton = GaussNewton::new(&start.weights, 1e-3);
    let [first, last] = costs(&off, &gauss_newton, 1e-5);
    assert!(last < 0.01 * first, "{first} {last}");
    assert_eq!(costs(&off, &gauss_newton, 7.0), [first, last]);
    assert_eq!(costs(&off, &gauss_newton, 0.0), [first, last]);
    let guarded = Guarded::new(StepSizes::uniform(1e-4));
    let [first, last] = costs(&off, &guarded, 1e-5);
    assert!(last < first, "{first} {last}");
    assert_eq!(costs(&off, &guarded, 0.0), [first, last]);
}

/// Equations (7)-(13) by hand. With r = (g, 0, 0) and Psi's first row all 1, every parameter's
/// gradient is g.
#[test]
fn paper_steps_as_printed() {
    let start = Weights::from_fn(|_| 1.0);
    let eta = StepSizes {
        feedback: 0.1,
        feed_forward: 0.01,
        bias: 0.001,
    };
    let eps = StepSizes {
        feedback: 0.5,
        feed_forward: 0.25,
        bias: 0.125,
    };
    let mut rule = Paper::new(eta, eps);
    rule.start(&start);
    let mut weights = start;
    let mut run = |g: f64| {
        rule.begin();
        rule.residual(
            &[[1.0; PARAMS], [0.0; PARAMS], [0.0; PARAMS]],
            &[g, 0.0, 0.0],
            1.0,
        );
        let (cost, accepted) = rule.end::<Full>(&mut weights, true);
        assert!(accepted);
        assert_eq!(cost, 0.5 * g * g);
        // One parameter of each kind: R, W, b of the first layer.
        (
            weights.layers[0].r[0][0],
            weights.layers[0].w[0][0],
            weights.layers[0].b[0],
            *rule.steps(),
        )
    };
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-15, "{a} for {b}");

    // s = 0: no earlier gradient, lambda = 0, eta stays; theta = 1 - eta g.
    let (r, w, b, _) = run(2.0);
    near(r, 1.0 - 0.1 * 2.0);
    near(w, 1.0 - 0.01 * 2.0);
    near(b, 1.0 - 0.001 * 2.0);
    // s = 1: the same sign, lambda = 1: eta = 0.1 (1 + 0.5) = 0.15; 0.0125; 0.001125.
    let (r, w, b, _) = run(1.0);
    near(r, 0.8 - 0.15);
    near(w, 0.98 - 0.0125);
    near(b, 0.998 - 0.001_125);
    // s = 2: the sign changes, lambda = -1: eta = 0.15 (1 - 0.5) = 0.075; 0.009375; 0.000984375.
    let (r, w, b, steps) = run(-4.0);
    near(r, 0.65 + 0.075 * 4.0);
    near(w, 0.9675 + 0.009_375 * 4.0);
    near(b, 0.996_875 + 0.000_984_375 * 4.0);
    for (index, step) in steps.into_iter().enumerate() {
        near(
            step,
            match Kind::of(index) {
                Kind::Feedback => 0.075,
                Kind::FeedForward => 0.009_375,
                Kind::Bias => 0.000_984_375,
            },
        );
    }
    // s = 3: gradient 0, lambda = 0: nothing moves.
    let before = r;
    assert_eq!(run(0.0).0, before);
}

/// With one eps for growing and shrinking, the printed rule first learns and then diverges; the
/// guarded one does not.
#[test]
fn paper_diverges_where_guarded_converges() {
    for eps in [0.1, 0.2] {
        let rule = Paper::new(StepSizes::uniform(1e-3), StepSizes::uniform(eps));
        let mut learner = Learner::new(&exact_net(), rule);
        let first = pass(&mut learner).cost;
        let mut best = first;
        let mut blown = None;
        for s in 1..400 {
            let pass = pass(&mut learner);
            best = best.min(pass.cost);
            if !(pass.accepted && pass.cost < first) {
                blown = Some(s);
                break;
            }
        }
        println!(
            "paper, eps {eps}: cost {first:.3} to {best:.5}, worse than the start in pass {blown:?}"
        );
        assert!(
            best < 0.2 * first,
            "eps {eps}: it does learn at first: {first} to {best}"
        );
        assert!(blown.is_some(), "eps {eps}: no divergence");
        assert!(learner.proposal().is_finite());
    }
}

#[test]
fn guarded_converges_and_never_rises() {
    for first_step in [1e-5, 1e-3, 1.0] {
        let mut learner = Learner::new(&exact_net(), Guarded::new(StepSizes::uniform(first_step)));
        let first = pass(&mut learner);
        assert!(first.accepted && first.windows == 200 && first.faults == 0);
        let mut last = first.cost;
        let mut accepted_passes = 0;
        for _ in 0..600 {
            let tried = *learner.candidate();
            let pass = pass(&mut learner);
            if pass.accepted {
                assert!(pass.cost <= last);
                assert_eq!(learner.proposal(), tried);
                last = pass.cost;
                accepted_passes += 1;
            } else {
                assert_ne!(learner.proposal(), tried, "a rejected pass is undone");
            }
        }
        println!(
            "guarded, first step {first_step:e}: cost {:.4} to {last:.3e}, {accepted_passes} of 600 accepted",
            first.cost
        );
        assert!(last < 1e-2 * first.cost, "{last} of {}", first.cost);
    }
}

#[test]
fn gauss_newton_needs_few_passes() {
    let mut learner = Learner::new(&exact_net(), GaussNewton::new(&small_weights(), 1e-6));
    let first = pass(&mut learner).cost;
    let costs: Vec<f64> = (0..10)
        .map(|_| pass(&mut learner))
        .filter(|pass| pass.accepted)
        .map(|pass| pass.cost)
        .collect();
    println!("gauss-newton: cost {first:.4}, then {costs:.9?}");
    assert!(costs.last().expect("accepted") < &(1e-4 * first));
    assert!(costs.is_sorted_by(|a, b| a >= b), "{costs:?}");

    // The proposed weights achieve the stated cost, in units of the output scale.
    let net = Exact::new(learner.proposal(), exact_net().normalisation);
    let mut state = State::new();
    let squares = (0..200).map(|k| {
        let (estimate, truth) = (net.step(&mut state, rate(k)).error, sensor_error(k));
        (0..3)
            .map(|j| ((estimate[j] - truth[j]) * 1e5).powi(2))
            .sum::<f64>()
    });
    let cost = 0.5 * squares.sum::<f64>();
    let best = costs.last().expect("accepted");
    assert!((cost - best).abs() < 1e-9 * first, "{cost} for {best}");
}

/// A linear problem has a known solution: with zero weights only the biases of the output layer
/// have an effect.
#[test]
fn gauss_newton_step_is_the_posterior_mean() {
    let prior = Weights::<f64>::zero();
    let net = Net::<Tanh, Identity, Full, f64>::new(prior, Normalisation::identity());
    let (weight, ridge, n, target) = (4.0, 100.0, 50, 0.3);
    let mut learner = Learner::new(&net, GaussNewton::new(&prior, ridge));
    for _ in 0..8 {
        learner.begin_pass();
        for _ in 0..n {
            let _ = learner.step([0.0; 3], 1.0);
            learner.reference([target, 0.0, 0.0], weight);
        }
        let _ = learner.end_pass();
    }
    let mut plain = Learner::new(&net, GaussNewton::new(&prior, ridge));
    for _ in 0..2 {
        plain.begin_pass();
        let _ = plain.step([0.0; 3], 1.0);
        plain.reference([target, 0.0, 0.0], weight);
        let _ = plain.end_pass();
    }
    // One sample: b = w target / (w + ridge), less the first damping, 1e-2 of the mean diagonal w *
    // 3 / 63.
    let lambda = 1e-2 * weight * 3.0 / 63.0;
    let expected = weight * target / (weight + ridge + lambda);
    assert!((plain.proposal().layers[2].b[0] - expected).abs() < 1e-12);
    // Many samples: the data win over the prior.
    let output = Exact::new(learner.proposal(), Normalisation::identity())
        .step(&mut State::new(), [0.0; 3])
        .output;
    assert!(output[0] > 0.15 && output[0] < target, "{output:?}");
}

/// In `f32`, with few windows for 63 parameters, so that the normal matrix is singular: still every
/// accepted pass is better.
#[test]
fn gauss_newton_in_f32_with_a_singular_matrix() {
    let net = Net::<Rational>::new(small_weights().cast(), Normalisation::identity());
    let mut learner = Learner::new(&net, GaussNewton::new(&net.weights, 0.0));
    let mut best = f32::INFINITY;
    for _ in 0..20 {
        learner.begin_pass();
        for k in 0..40 {
            let _ = learner.step(rate(k).map(|u| u as f32), 0.1);
            if k % 10 == 9 {
                learner.reference(sensor_error(k).map(|e| (e * 1e5) as f32), 1.0);
            }
        }
        let pass = learner.end_pass();
        assert_eq!((pass.windows, pass.faults), (4, 0));
        if pass.accepted {
            assert!(pass.cost <= best);
            best = pass.cost;
        }
        assert!(learner.candidate().is_finite());
    }
    println!("singular, f32: cost {best:e}");
    assert!(best < 1e-6, "{best:e}");
}

/// Windows of ten steps with a late sum: the gradient is that of the summed outputs, sample by
/// sample.
#[test]
fn window_is_the_exact_sum() {
    let net = exact_net();
    let (dt, weight) = (0.25, 3.0);
    let mut learner = Learner::new(
        &net,
        Paper::new(StepSizes::uniform(0.0), StepSizes::uniform(0.0)),
    );
    let (mut state, mut sens) = (State::new(), Sensitivities::new());
    let mut cost = 0.0;
    let mut gradient = [0.0; PARAMS];
    learner.begin_pass();
    for window in 0..20 {
        let mut outputs = Vec::new();
        let mut reference = [0.0; 3];
        for k in 10 * window..10 * window + 10 {
            let step = net.step_gradient(&mut state, &mut sens, rate(k));
            assert_eq!(learner.step(rate(k), dt), step);
            outputs.push((step.output, sens.output()));
            reference = [0, 1, 2].map(|j| reference[j] + dt * sensor_error(k)[j]);
        }
        learner.reference(reference, weight);
        for j in 0..3 {
            let r = outputs.iter().map(|(y, _)| y[j] * dt).sum::<f64>() - reference[j] / 1e-5;
            cost += 0.5 * weight * r * r;
            for (theta, gradient) in gradient.iter_mut().enumerate() {
                *gradient +=
                    weight * r * outputs.iter().map(|(_, s)| s[j][theta] * dt).sum::<f64>();
            }
        }
    }
    let pass = learner.end_pass();
    let batch = learner.rule().batch();
    assert!((pass.cost - cost).abs() < 1e-12 * cost);
    for (a, b) in batch.gradient.iter().zip(&gradient) {
        assert!((a - b).abs() < 1e-11 * (1.0 + b.abs()), "{a} for {b}");
    }
}

#[test]
fn the_live_net_is_not_edited() {
    let live = exact_net();
    let before = live;
    let mut learner = Learner::new(&live, GaussNewton::new(&live.weights, 1e-6));
    for _ in 0..4 {
        let _ = pass(&mut learner);
    }
    assert_eq!(live, before);
    assert_ne!(learner.proposal(), live.weights);
}

/// Weights that overflow make the pass void; a missing input does not. Nothing non-finite is
/// proposed.
#[test]
fn a_void_pass_is_rejected() {
    let mut weights = small_weights();
    weights.layers[2].r[0][0] = 1e200;
    let wild = Exact::new(weights, exact_net().normalisation);
    fn reject<U: Rule<f64>>(net: &Exact, rule: U) {
        let mut learner = Learner::new(net, rule);
        for _ in 0..3 {
            let pass = pass(&mut learner);
            assert!(!pass.accepted && pass.faults > 0, "{pass:?}");
            assert_eq!(learner.proposal(), net.weights);
            assert_eq!(learner.candidate(), &net.weights);
        }
    }
    reject(
        &wild,
        Paper::new(StepSizes::uniform(1e-3), StepSizes::uniform(0.1)),
    );
    reject(&wild, Guarded::new(StepSizes::uniform(1e-3)));
    reject(&wild, GaussNewton::new(&small_weights(), 1.0));

    let mut learner = Learner::new(&exact_net(), Guarded::new(StepSizes::uniform(1e-3)));
    learner.begin_pass();
    let _ = learner.step([f64::NAN; 3], 1.0);
    learner.skip();
    let _ = learner.step(rate(1), 1.0);
    learner.reference(sensor_error(1), 1.0);
    let pass = learner.end_pass();
    assert!(pass.accepted && pass.faults == 1 && pass.windows == 1);
    assert!(learner.candidate().is_finite());
    let _ = Net::<Rational>::new(learner.proposal().cast(), Normalisation::identity());
}

/// A pass in which the network overflowed is not accepted. One in which the sensor gave no number
/// is: that is not the network's fault.
#[test]
fn a_pass_with_an_overflow_is_not_accepted() {
    fn check<U: Rule<f64> + Clone>(rule: &U) {
        let scales = Normalisation {
            input_scale: [1e10; 3],
            ..Normalisation::identity()
        };
        let net = Exact::new(small_weights(), scales);
        for (input, accepted) in [(1e-10, true), (f64::NAN, true), (1e300, false)] {
            let mut learner = Learner::new(&net, rule.clone());
            let tried = *learner.candidate();
            learner.begin_pass();
            for input in [1e-10, input, 1e-10] {
                let _ = learner.step([input; 3], 1.0);
                learner.reference([0.1, -0.2, 0.3], 1.0);
            }
            let pass = learner.end_pass();
            assert_eq!(pass.accepted, accepted, "{input}");
            assert_eq!(pass.faults, u32::from(input != 1e-10));
            if !accepted {
                assert_eq!(*learner.candidate(), tried, "{input}: no step");
            }
        }
    }
    let steps = StepSizes::uniform(1e-3);
    check(&Paper::new(steps, steps));
    check(&Guarded::new(steps));
    check(&GaussNewton::new(&small_weights(), 1.0));
}

/// Nor is one whose sums are not finite, even if it is the first.
#[test]
fn a_pass_beyond_all_numbers_is_not_accepted() {
    fn check<U: Rule<f64> + Clone>(rule: &U) {
        for sum in [1e200, f64::INFINITY, f64::NAN] {
            let mut learner = Learner::new(&exact_net(), rule.clone());
            learner.begin_pass();
            let _ = learner.step(rate(1), 1.0);
            learner.reference([sum, 0.0, 0.0], 1.0);
            assert!(!learner.end_pass().accepted, "{sum}");
            assert!(learner.candidate().is_finite());
            assert!(pass(&mut learner).accepted, "{sum}: it goes on");
        }
    }
    let steps = StepSizes::uniform(1e-3);
    check(&Guarded::new(steps));
    check(&Paper::new(steps, steps));
    check(&GaussNewton::new(&small_weights(), 1.0));
}

/// With zero weights nothing below the output layer has an effect: its gradient is exactly 0, and
/// its step sizes stay what they are.
#[test]
fn a_step_size_without_gradient_stays() {
    let net = Exact::new(Weights::zero(), Normalisation::identity());
    let mut learner = Learner::new(&net, Guarded::new(StepSizes::uniform(1e-3)));
    for _ in 0..5 {
        learner.begin_pass();
        let _ = learner.step([0.0; 3], 1.0);
        learner.reference([0.3, 0.0, 0.0], 1.0);
        assert!(learner.end_pass().accepted);
    }
    let steps = learner.rule().steps();
    assert_eq!(steps[..42], [1e-3; 42]);
    // the bias that learns: four times the same sign as before
    assert!((steps[60] - 1e-3 * 1.05_f64.powi(4)).abs() < 1e-12);
}

/// A skipped window leaves no trace.
#[test]
fn a_skipped_window_is_as_if_it_had_not_been() {
    let learnt = |skipped: bool| {
        let mut learner = Learner::new(&exact_net(), GaussNewton::new(&small_weights(), 1.0));
        learner.begin_pass();
        for k in 0..6 {
            let dt = if skipped && k % 2 == 0 { 5.0 } else { 0.0 };
            let _ = learner.step(rate(k), if k % 2 == 0 { dt } else { 1.0 });
            if skipped && k % 2 == 0 {
                learner.skip();
            }
            if k % 2 == 1 {
                learner.reference(sensor_error(k), 1.0);
            }
        }
        let _ = learner.end_pass();
        *learner.candidate()
    };
    assert_eq!(learnt(true), learnt(false));
}
