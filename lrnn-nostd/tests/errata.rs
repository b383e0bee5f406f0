//! The paper's gradient (eq. 5, 6) as printed is not the gradient: each erratum is compared with
//! finite differences of the output.
//!
//! The recursion is written here a second time, plainly and with switches, so it also checks the
//! crate's own.

use lrnn_nostd::{Full, Identity, Net, Normalisation, PARAMS, Sensitivities, State, Tanh, Weights};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Variant {
    Correct,
    /// (5), (6): f[x] where the derivative f'[x] is meant.
    ValueForSlope,
    /// (6): the feed-forward direct term of the unit the weight leads to, y_{l-1,p}, for that of
    /// its source, y_{l-1,q}.
    WrongSource,
    /// (6): the direct term without delta, for every unit of the layer.
    DirectToAll,
    /// (6), third line: the sum over n_l - 1 units.
    OneUnitMissing,
    /// No recursion through the own feedback of the layers above the parameter's.
    NoHigherFeedback,
    /// (5) has the last layer's own feedback, and nothing has the middle layer's for a parameter of
    /// the first.
    NoMiddleFeedback,
}

const STEPS: usize = 200;
type Rows = [[[f64; PARAMS]; 3]; 3];

fn weights() -> Weights<f64> {
    let mut seed = 5_u64;
    Weights::from_fn(|_| {
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        0.6 * ((seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0)
    })
}

fn input(k: usize) -> [f64; 3] {
    let t = 0.2 * k as f64;
    [t.sin(), (1.7 * t).cos(), 0.8 * (0.3 * t).sin()]
}

fn target(k: usize) -> [f64; 3] {
    let t = 0.2 * k as f64;
    [0.5 * (0.9 * t).cos(), 0.3, 0.4 * t.sin()]
}

/// Direct term of parameter `own` of a layer for unit j.
fn direct(variant: Variant, own: usize, j: usize, below: &[f64; 3], last: &[f64; 3]) -> f64 {
    let (p, q) = ((own % 9) / 3, own % 3);
    let (unit, d) = match own {
        0..9 if variant == Variant::WrongSource => (p, below[p]),
        0..9 => (p, below[q]),
        9..18 => (p, last[q]),
        _ => (own - 18, 1.0),
    };
    if unit == j || variant == Variant::DirectToAll {
        d
    } else {
        0.0
    }
}

/// dE/dtheta of the sequence by one of the recursions, with tanh, tanh and identity layers.
fn gradient(variant: Variant) -> [f64; PARAMS] {
    let weights = weights();
    let mut y = [[0.0; 3]; 3];
    let mut s: Rows = [[[0.0; PARAMS]; 3]; 3];
    let mut total = [0.0; PARAMS];
    for k in 0..STEPS {
        let (last_y, last_s) = (y, s);
        for l in 0..3 {
            let layer = &weights.layers[l];
            let below = if l == 0 { input(k) } else { y[l - 1] };
            for j in 0..3 {
                let x = layer.b[j]
                    + (0..3)
                        .map(|i| layer.w[j][i] * below[i] + layer.r[j][i] * last_y[l][i])
                        .sum::<f64>();
                let hidden = l < 2;
                y[l][j] = if hidden { x.tanh() } else { x };
                let slope = match variant {
                    Variant::ValueForSlope => y[l][j],
                    _ if hidden => 1.0 - x.tanh().powi(2),
                    _ => 1.0,
                };
                for theta in 0..PARAMS {
                    let m = theta / 21;
                    if m > l {
                        continue;
                    }
                    let units = if variant == Variant::OneUnitMissing && m == l && theta % 21 >= 18
                    {
                        2
                    } else {
                        3
                    };
                    let mut sum: f64 = (0..units)
                        .map(|i| layer.r[j][i] * last_s[l][i][theta])
                        .sum();
                    if m < l {
                        let dropped = variant == Variant::NoHigherFeedback
                            || (variant == Variant::NoMiddleFeedback && l == 1);
                        sum = if dropped { 0.0 } else { sum };
                        sum += (0..3)
                            .map(|i| layer.w[j][i] * s[l - 1][i][theta])
                            .sum::<f64>();
                    } else {
                        sum += direct(variant, theta % 21, j, &below, &last_y[l]);
                    }
                    s[l][j][theta] = slope * sum;
                }
            }
        }
        for (theta, total) in total.iter_mut().enumerate() {
            *total += (0..3)
                .map(|j| (y[2][j] - target(k)[j]) * s[2][j][theta])
                .sum::<f64>();
        }
    }
    total
}

fn cost(weights: Weights<f64>) -> f64 {
    let net = Net::<Tanh, Identity, Full, f64>::new(weights, Normalisation::identity());
    let mut state = State::new();
    let squares = (0..STEPS).map(|k| {
        let y = net.step(&mut state, input(k)).output;
        (0..3).map(|j| (y[j] - target(k)[j]).powi(2)).sum::<f64>()
    });
    0.5 * squares.sum::<f64>()
}

/// dE/dtheta by central differences of fourth order.
fn differences() -> [f64; PARAMS] {
    let h = 1e-3;
    core::array::from_fn(|theta| {
        let at = |offset: f64| {
            let mut moved = weights();
            assert!(moved.set(theta, weights().get(theta).expect("index") + offset));
            cost(moved)
        };
        (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h)
    })
}

/// |a - b| / |b|, and the share of parameters whose signs agree.
fn compare(a: &[f64; PARAMS], b: &[f64; PARAMS]) -> (f64, f64) {
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>().sqrt();
    let off = norm(&mut a.iter().zip(b).map(|(a, b)| a - b)) / norm(&mut b.iter().copied());
    let agree = a
        .iter()
        .zip(b)
        .filter(|(a, b)| a.signum() == b.signum())
        .count();
    (off, agree as f64 / PARAMS as f64)
}

#[test]
fn the_corrected_recursion_is_the_gradient() {
    let (off, agree) = compare(&gradient(Variant::Correct), &differences());
    assert!(off < 1e-9, "{off:e}");
    assert_eq!(agree, 1.0);
}

#[test]
fn the_crate_has_the_corrected_recursion() {
    let net = Net::<Tanh, Identity, Full, f64>::new(weights(), Normalisation::identity());
    let (mut state, mut sens) = (State::new(), Sensitivities::new());
    let mut total = [0.0; PARAMS];
    for k in 0..STEPS {
        let y = net.step_gradient(&mut state, &mut sens, input(k)).output;
        for (theta, total) in total.iter_mut().enumerate() {
            *total += (0..3)
                .map(|j| (y[j] - target(k)[j]) * sens.output()[j][theta])
                .sum::<f64>();
        }
    }
    let (off, _) = compare(&total, &gradient(Variant::Correct));
    assert!(off < 1e-13, "{off:e}");
}

#[test]
fn each_erratum_is_wrong() {
    let truth = differences();
    // The smallest deviation that each must show: well below the measured one, and a million times
    // above that of the correct recursion.
    let errata = [
        (Variant::ValueForSlope, 0.5),
        (Variant::WrongSource, 0.1),
        (Variant::DirectToAll, 0.1),
        (Variant::OneUnitMissing, 0.01),
        (Variant::NoHigherFeedback, 0.05),
        (Variant::NoMiddleFeedback, 0.01),
    ];
    for (variant, least) in errata {
        let (off, agree) = compare(&gradient(variant), &truth);
        println!(
            "{variant:?}: off by {off:.3} of the gradient, {:.0} % of the signs agree",
            100.0 * agree
        );
        assert!(off > least, "{variant:?}: {off}");
        assert!(agree < 1.0, "{variant:?}: every sign agrees");
    }
}
