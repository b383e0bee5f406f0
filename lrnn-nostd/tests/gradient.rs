//! The exact gradient compared with finite differences of the output, for every parameter and every
//! kind of network.

use lrnn_nostd::{
    Activation, Diagonal, Feedback, Full, Identity, Net, Normalisation, PARAMS, Rational,
    Sensitivities, State, Tanh, Weights,
};

const STEPS: usize = 300;

/// Uniform in [-1, 1[ from a 64-bit linear congruence; enough for test weights.
struct Uniform(u64);

impl Uniform {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// W within 0.8; R within 0.3, so that every row sum is below 1 and also the linear network is
/// stable.
fn random_weights(seed: u64) -> Weights<f64> {
    let mut random = Uniform(seed);
    Weights::from_fn(|index| match index % 21 {
        9..18 => 0.3 * random.next(),
        _ => 0.8 * random.next(),
    })
}

fn input(k: usize) -> [f64; 3] {
    let t = 0.1 * k as f64;
    [t.sin(), (1.3 * t + 0.4).cos(), 0.5 - 0.01 * t]
}

fn output<H: Activation, O: Activation, F: Feedback>(weights: Weights<f64>) -> [f64; 3] {
    let net = Net::<H, O, F, f64>::new(weights, Normalisation::identity());
    let mut state = State::new();
    for k in 0..STEPS {
        assert_eq!(net.step(&mut state, input(k)).fault, None);
    }
    state.output()
}

/// dy_3/dtheta by central differences at h, 2h and 4h, extrapolated twice: the error falls as h^6.
fn difference<H: Activation, O: Activation, F: Feedback>(
    weights: Weights<f64>,
    index: usize,
) -> [f64; 3] {
    let central = |h: f64| {
        let at = |offset: f64| {
            let mut moved = weights;
            assert!(moved.set(index, weights.get(index).expect("index") + offset));
            output::<H, O, F>(moved)
        };
        let (up, down) = (at(h), at(-h));
        [0, 1, 2].map(|j| (up[j] - down[j]) / (2.0 * h))
    };
    let h = 2e-3;
    let (one, two, four) = (central(h), central(2.0 * h), central(4.0 * h));
    [0, 1, 2].map(|j| {
        let fine = (4.0 * one[j] - two[j]) / 3.0;
        let coarse = (4.0 * two[j] - four[j]) / 3.0;
        (16.0 * fine - coarse) / 15.0
    })
}

/// Largest |s - difference| over max(|s|, 1e-2). It is relative, except for entries so small that
/// the rounding of the differences shows.
fn worst_error<H: Activation, O: Activation, F: Feedback>(seed: u64) -> f64 {
    let weights = random_weights(seed);
    let net = Net::<H, O, F, f64>::new(weights, Normalisation::identity());
    let (mut state, mut sens) = (State::new(), Sensitivities::new());
    for k in 0..STEPS {
        assert_eq!(
            net.step_gradient(&mut state, &mut sens, input(k)).fault,
            None
        );
    }
    let mut worst = 0.0_f64;
    let mut largest = 0.0_f64;
    for index in 0..PARAMS {
        let differences = difference::<H, O, F>(weights, index);
        for (row, difference) in sens.output().iter().zip(differences) {
            let s = row[index];
            if !F::is_active(index) {
                assert_eq!(
                    (s, difference),
                    (0.0, 0.0),
                    "unused parameter {index} has an effect"
                );
            }
            worst = worst.max((s - difference).abs() / s.abs().max(1e-2));
            largest = largest.max(s.abs());
        }
    }
    assert!(
        largest > 0.5,
        "nothing to compare: largest sensitivity {largest}"
    );
    worst
}

/// 1e-8; with [`Rational`], whose slope is that of tanh itself, 1e-7: less than the rounding of
/// `f32`.
fn tolerance<H: Activation, O: Activation>() -> f64 {
    let rational = [H::CODE, O::CODE].contains(&Rational::CODE);
    if rational { 1e-7 } else { 1e-8 }
}

fn check<H: Activation, O: Activation, F: Feedback>() {
    for seed in [1, 2, 3] {
        let worst = worst_error::<H, O, F>(seed);
        println!(
            "{:?} {:?} {:?} seed {seed}: {worst:.1e}",
            H::default(),
            O::default(),
            F::default()
        );
        assert!(
            worst < tolerance::<H, O>(),
            "{:?} {:?} {:?} seed {seed}: {worst:e}",
            H::default(),
            O::default(),
            F::default()
        );
    }
}

fn check_outputs_and_feedbacks<H: Activation>() {
    check::<H, Identity, Full>();
    check::<H, Tanh, Full>();
    check::<H, Rational, Full>();
    check::<H, Identity, Diagonal>();
    check::<H, Tanh, Diagonal>();
    check::<H, Rational, Diagonal>();
}

#[test]
fn tanh_agrees_with_differences() {
    check_outputs_and_feedbacks::<Tanh>();
}

#[test]
fn rational_agrees_with_differences() {
    check_outputs_and_feedbacks::<Rational>();
}

#[test]
fn identity_agrees_with_differences() {
    check_outputs_and_feedbacks::<Identity>();
}

/// Rounding only: 5e-6 of the largest sensitivity after 300 steps.
#[test]
fn f32_follows_f64() {
    for seed in 1..20 {
        let exact_net = Net::<Rational, Identity, Full, f64>::new(
            random_weights(seed).cast::<f32>().cast(),
            Normalisation::identity(),
        );
        let net = Net::<Rational, Identity, Full, f32>::new(
            exact_net.weights.cast(),
            Normalisation::identity(),
        );
        let (mut exact_state, mut exact) = (State::new(), Sensitivities::new());
        let (mut state, mut sens) = (State::new(), Sensitivities::new());
        for k in 0..STEPS {
            let _ = exact_net.step_gradient(&mut exact_state, &mut exact, input(k));
            let _ = net.step_gradient(&mut state, &mut sens, input(k).map(|u| u as f32));
        }
        let (exact, sens) = (exact.output(), sens.output());
        let pairs = || exact.iter().flatten().zip(sens.iter().flatten());
        let largest = pairs().fold(0.0_f64, |most, (exact, _)| most.max(exact.abs()));
        let worst = pairs().fold(0.0_f64, |most, (exact, &s)| {
            most.max((exact - f64::from(s)).abs())
        });
        assert!(
            worst < 5e-6 * largest,
            "seed {seed}: {worst:e} of {largest}"
        );
    }
}

/// A step that learns moves each weight by -rate dE/dtheta, with E = |y_3 - target|^2 / 2 and the
/// gradient of finite differences.
#[test]
fn descent_is_against_the_gradient() {
    let (weights, target, rate) = (random_weights(7), [0.4, -0.7, 0.2], 0.03);
    let start = Net::<Tanh, Identity, Full, f64>::new(weights, Normalisation::identity());
    let (mut state, mut sens) = (State::new(), Sensitivities::new());
    for k in 0..STEPS - 1 {
        let _ = start.step_gradient(&mut state, &mut sens, input(k));
    }
    let mut fused = start;
    let last = input(STEPS - 1);
    let step = fused.step_descend(&mut state, &mut sens, last, &target, rate);
    let residual: [f64; 3] = core::array::from_fn(|j| step.output[j] - target[j]);
    let mut apart = weights;
    assert!(sens.descend(&mut apart, &residual, rate));
    for index in 0..PARAMS {
        let slope = difference::<Tanh, Identity, Full>(weights, index);
        let gradient: f64 = residual.iter().zip(slope).map(|(r, s)| r * s).sum();
        for moved in [&fused.weights, &apart] {
            let moved = moved.get(index).expect("index") - weights.get(index).expect("index");
            assert!((moved + rate * gradient).abs() < 1e-10, "{index}: {moved}");
        }
    }
}

#[test]
fn number_of_active_parameters() {
    let count = |active: fn(usize) -> bool| (0..100).filter(|&index| active(index)).count();
    assert_eq!(count(Full::is_active), Full::ACTIVE);
    assert_eq!(count(Diagonal::is_active), Diagonal::ACTIVE);
    assert_eq!((Full::ACTIVE, Diagonal::ACTIVE), (63, 45));
}
