//! ns per step, per step with gradient, and per learning step (gradient, window and update by the
//! paper's rule).

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use lrnn_nostd::learn::{Learner, Paper, StepSizes};
use lrnn_nostd::{
    Activation, Full, Identity, Net, Normalisation, Rational, Sensitivities, State, Tanh, Weights,
};

const INPUT: [f32; 3] = [0.3, -0.4, 0.5];

fn network<H: Activation>(criterion: &mut Criterion, name: &str) {
    let weights = Weights::from_fn(|index| (index * 37 % 64) as f32 / 128.0 - 0.24);
    let net = Net::<H, Identity, Full>::new(weights, Normalisation::identity());
    let mut group = criterion.benchmark_group(name);

    let mut state = State::new();
    group.bench_function("step", |bencher| {
        bencher.iter(|| net.step(&mut state, black_box(INPUT)));
    });

    let mut sens = Sensitivities::new();
    group.bench_function("step_gradient", |bencher| {
        bencher.iter(|| net.step_gradient(&mut state, &mut sens, black_box(INPUT)));
    });

    // Steps of 0: the same work, but the weights stay through millions of updates and nothing
    // overflows.
    let rule = Paper::new(StepSizes::uniform(0.0), StepSizes::uniform(0.1));
    let mut learner = Learner::new(&net, rule);
    learner.begin_pass();
    group.bench_function("step_gradient, reference and paper update", |bencher| {
        bencher.iter(|| {
            let _ = learner.step(black_box(INPUT), 1.0);
            learner.reference([0.1; 3], 1.0);
            learner.end_pass()
        });
    });
    let pass = learner.end_pass();
    assert!(
        pass.accepted && pass.faults == 0,
        "not the path meant to be measured: {pass:?}"
    );
    group.finish();
}

fn both(criterion: &mut Criterion) {
    network::<Tanh>(criterion, "tanh");
    network::<Rational>(criterion, "rational");
}

criterion_group!(benches, both);
criterion_main!(benches);
