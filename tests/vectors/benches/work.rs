//! Nanoseconds of the pieces of work that the target counts instructions of; `cargo xtask bench` shows both side by side.

mod processor;

use std::hint::black_box;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use lrnn_nostd::{Activation, Cubic, Rational, Tanh, kernel};
use processor::Processor;
use vectors::learning::{LearnerFixWork, LearnerSecondWork, LearnerStepWork};
use vectors::navigation::{NavPieceWork, NavSecondWork, NavWordWork};
use vectors::work::{
    ActivationWork, DRIVE, DescentWork, GradientWork, KernelWork, LearnWork, StepWork, plausible,
};

fn measure(
    criterion: &mut Criterion<Processor>,
    name: &str,
    mut work: impl FnMut([f32; 3]) -> ([f32; 3], bool),
) {
    let (mut repetition, mut good) = (0, true);
    criterion.bench_function(name, |bencher| {
        bencher.iter(|| {
            repetition += 1;
            let (error, fine) = work(black_box(plausible(repetition)));
            good &= fine;
            error
        });
    });
    assert!(
        good,
        "{name}: a repetition was faulty or rejected, so its time says nothing"
    );
}

fn all<H: Activation>(criterion: &mut Criterion<Processor>, name: &str) {
    let mut step = StepWork::<H>::new();
    let mut gradient = GradientWork::<H>::new();
    let mut descent = DescentWork::<H>::new();
    let mut learn = LearnWork::<H>::new();
    let mut activation = ActivationWork::<H>::default();
    measure(criterion, &format!("activation_{name}"), |input| {
        activation.run(input)
    });
    measure(criterion, &format!("step_{name}"), |input| step.run(input));
    measure(criterion, &format!("gradient_{name}"), |input| {
        gradient.run(input)
    });
    measure(criterion, &format!("descent_{name}"), |input| {
        descent.run(input)
    });
    measure(criterion, &format!("learn_{name}"), |input| {
        learn.run(input)
    });
}

/// Repetitions after which a work begins anew, as many as the target does: nobody navigates for hours without a fix.
const FRESH: u32 = 1000;

fn anew<W: Clone>(
    fresh: &W,
    run: fn(&mut W, [f32; 3]) -> ([f32; 3], bool),
) -> impl FnMut([f32; 3]) -> ([f32; 3], bool) {
    let (mut work, mut repetition) = (fresh.clone(), 0);
    move |input| {
        repetition += 1;
        if repetition == FRESH {
            work = fresh.clone();
            repetition = 0;
        }
        run(&mut work, input)
    }
}

fn navigator(criterion: &mut Criterion<Processor>) {
    let good = "the configuration is good";
    let word = NavWordWork::new().expect(good);
    let piece = NavPieceWork::new().expect(good);
    let second = NavSecondWork::new().expect(good);
    measure(criterion, "nav_word", anew(&word, NavWordWork::run));
    measure(criterion, "nav_piece", anew(&piece, NavPieceWork::run));
    measure(criterion, "nav_second", anew(&second, NavSecondWork::run));
}

fn learner(criterion: &mut Criterion<Processor>) {
    let mut step = Box::new(LearnerStepWork::ZEROED);
    let mut fix = Box::new(LearnerFixWork::ZEROED);
    let mut second = Box::new(LearnerSecondWork::ZEROED);
    step.begin();
    fix.begin();
    second.begin();
    measure(criterion, "learner_step", |input| step.run(input));
    measure(criterion, "learner_fix", |input| fix.run(input));
    measure(criterion, "learner_second", |input| second.run(input));
}

/// The portable network, here; twice, since both forms are in the table.
fn kernels(criterion: &mut Criterion<Processor>) {
    use kernel::{m4, m7};
    let mut work = KernelWork::new();
    measure(criterion, "step_m4", |input| work.step(m4::step, input));
    measure(criterion, "step_m7", |input| work.step(m7::step, input));
    measure(criterion, "gradient_m4", |input| {
        work.gradient(m4::step_gradient, input)
    });
    measure(criterion, "gradient_m7", |input| {
        work.gradient(m7::step_gradient, input)
    });
    measure(criterion, "descent_m4", |input| {
        work.descent(m4::step_descend, input)
    });
    measure(criterion, "descent_m7", |input| {
        work.descent(m7::step_descend, input)
    });
}

/// Network, exact gradient and update over a whole drive, from power-on.
fn drive(criterion: &mut Criterion<Processor>) {
    let mut good = true;
    let mut group = criterion.benchmark_group("drive");
    group
        .sample_size(10)
        .throughput(Throughput::Elements(DRIVE as u64));
    group.bench_function("descent_rational", |bencher| {
        bencher.iter_batched_ref(
            DescentWork::<Rational>::new,
            |work| {
                for sample in 0..DRIVE {
                    let (error, fine) = work.run(black_box(plausible(sample)));
                    good &= fine;
                    black_box(error);
                }
            },
            BatchSize::LargeInput,
        );
    });
    group.finish();
    assert!(good, "a step was faulty, so its time says nothing");
}

fn both(criterion: &mut Criterion<Processor>) {
    all::<Rational>(criterion, "rational");
    all::<Tanh>(criterion, "tanh");
    all::<Cubic>(criterion, "cubic");
    kernels(criterion);
    navigator(criterion);
    learner(criterion);
    drive(criterion);
}

criterion_group! {
    name = benches;
    config = Criterion::default().with_measurement(Processor);
    targets = both
}
criterion_main!(benches);
