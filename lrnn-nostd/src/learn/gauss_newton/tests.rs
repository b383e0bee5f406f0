//! The damped step against its closed form, and the damping's own rules.

use super::*;
use crate::Full;

/// Inverse variances that differ by many orders of magnitude.
fn ridges() -> [f64; PARAMS] {
    core::array::from_fn(|i| {
        if i == 5 {
            0.0
        } else {
            10.0_f64.powi((i % 7) as i32 - 3)
        }
    })
}

/// With N = diag(n) each weight has a problem of its own. In units of the prior, z = theta / sigma,
/// it is (n sigma^2 + 1 + lambda) z = -sigma g with lambda the damping times the mean n sigma^2.
#[test]
fn each_ridge_belongs_to_its_own_weight() {
    let mut rule = GaussNewton::with_ridges(&Weights::zero(), ridges());
    let n = |i: usize| 1.0 + 0.1 * i as f64;
    let mut i = 0;
    for_each_row(&mut rule.normal, |row| {
        row[i] = n(i);
        i += 1;
    });
    rule.gradient = core::array::from_fn(|i| 0.305 - 0.01 * i as f64);
    rule.damping = 0.5;
    let square = |i: usize| if i == 5 { 1.0 } else { 1.0 / ridges()[i] };
    let mean = (0..PARAMS).map(|i| n(i) * square(i)).sum::<f64>() / PARAMS as f64;
    let step = rule.solve();
    let mut predicted = 0.0;
    for i in 0..PARAMS {
        let known = if i == 5 { 0.0 } else { 1.0 };
        let left = n(i) * square(i) + known + 0.5 * mean;
        let expected = -square(i) * rule.gradient[i] / left;
        assert!((step[i] - expected).abs() < 1e-12 * expected.abs(), "{i}");
        // decrease of g theta + theta (n + ridge) theta / 2
        let curvature = n(i) + ridges()[i];
        predicted -= rule.gradient[i] * expected + 0.5 * curvature * expected * expected;
    }
    assert!((rule.predicted - predicted).abs() < 1e-10 * predicted);
}

/// The prior's part of objective and gradient: ridge (theta - prior)^2 / 2 of each weight.
#[test]
fn weights_off_the_prior_cost_by_their_ridge() {
    let prior = Weights::from_fn(|i| 0.1 * i as f64);
    let mut rule = GaussNewton::with_ridges(&prior, ridges());
    rule.batch.cost = 2.0;
    rule.batch.gradient = [0.25; PARAMS];
    let off = |i: usize| 0.5 - 0.02 * i as f64;
    let weights = Weights::from_fn(|i| 0.1 * i as f64 + off(i));
    let objective = rule.add_prior::<Full>(&weights);
    let cost: f64 = (0..PARAMS)
        .map(|i| 0.5 * ridges()[i] * off(i) * off(i))
        .sum();
    assert!((objective - 2.0 - cost).abs() < 1e-10 * cost, "{objective}");
    for (i, g) in rule.batch.gradient.iter().enumerate() {
        let expected = 0.25 + ridges()[i] * off(i);
        assert!((g - expected).abs() < 1e-9 * (1.0 + expected.abs()), "{i}");
    }
}

/// Nielsen's rule: a decrease as predicted divides the damping by 3, a poor one doubles it at most,
/// and whatever the decrease is, it stays positive. Rejections double, then quadruple, and so on,
/// up to a limit.
#[test]
fn damping_follows_how_good_the_prediction_was() {
    let eased = |ratio: f64| {
        let mut rule = GaussNewton::new(&Weights::zero(), 1.0);
        (rule.damping, rule.predicted) = (1.0, 4.0);
        rule.ease(4.0 * ratio);
        rule.damping
    };
    let third = 1.0 / 3.0;
    for (ratio, factor) in [
        (1.0, third),
        (3.0, third),
        (0.8, 1.0 - 0.6 * 0.6 * 0.6),
        (0.5, 1.0),
        (0.25, 1.125),
        (0.0, 2.0),
        (-1.0, 2.0),
        (f64::NAN, third),
        (f64::INFINITY, third),
    ] {
        assert!((eased(ratio) - factor).abs() < 1e-12, "{ratio}");
    }
    // a pass that lowered the objective from 7 to 5, where a decrease of 4 was predicted
    let mut rule = GaussNewton::<f64>::new(&Weights::zero(), 1.0);
    (rule.best_objective, rule.predicted, rule.damping) = (Some(7.0), 4.0, 1.0);
    rule.batch.cost = 5.0;
    assert!(rule.end::<Full>(&mut Weights::zero(), true).1);
    assert!((rule.damping - 1.0).abs() < 1e-12, "{}", rule.damping);

    let mut rule = GaussNewton::new(&Weights::zero(), 1.0);
    rule.damping = 3e-16;
    rule.predicted = 1.0;
    rule.ease(1.0);
    assert_eq!(rule.damping, f64::EPSILON);

    rule.damping = 1.0;
    for factor in [2.0, 8.0, 64.0] {
        rule.stiffen();
        assert_eq!(rule.damping, factor);
    }
    (0..1000).for_each(|_| rule.stiffen());
    assert_eq!([rule.damping, rule.growth], [1.0 / f64::EPSILON; 2]);
    rule.predicted = 1.0;
    rule.ease(1.0);
    rule.stiffen();
    assert!((rule.damping * f64::EPSILON - 2.0 * third).abs() < 1e-12);
}

/// A direction that the data do not show at all is nearly frozen: the step stays finite and goes
/// down.
#[test]
fn a_singular_matrix_gives_a_step_of_descent() {
    let mut rule = GaussNewton::new(&Weights::<f64>::zero(), 0.0);
    // all weights act alike: one direction is known, 62 are not
    rule.normal = [4.0; PACKED];
    rule.gradient = [2.0; PARAMS];
    rule.damping = 0.0;
    let step = rule.solve();
    assert!((step[0] + 0.5).abs() < 1e-6, "{}", step[0]);
    assert!(step[1..].iter().all(|z| z.abs() < 1e-6), "{step:?}");
    // what is left of a pivot is rounding: as if it were nothing
    let mut i = 0;
    for_each_row(&mut rule.normal, |row| {
        row[i] += 8.0 * f64::EPSILON * f64::from(u8::from(i == 1));
        i += 1;
    });
    rule.gradient[1] = 2.5;
    let step = rule.solve();
    assert!(step.iter().all(|z| z.abs() < 1.0), "{step:?}");
}
