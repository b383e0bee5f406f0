//! Nanoseconds of the pieces of work whose instructions are counted on the target; `cargo xtask
//! bench` shows both side by side. On a desktop the kernel is the portable network, so its two
//! forms take the same time.

mod processor;

use std::hint::black_box;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use lrnn_nostd::Rational;
use processor::{Processor, Timed};
use vectors::work::{DRIVE, NetworkWork, Portable, plausible};

fn all(criterion: &mut Criterion<Processor>) {
    vectors::list::all(&mut Timed(criterion))
        .expect("a repetition was faulty or rejected, so its time is meaningless");
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
            NetworkWork::<Portable<Rational>>::new,
            |work| {
                for sample in 0..DRIVE {
                    let (error, fine) = work.descent(black_box(plausible(sample)));
                    good &= fine;
                    black_box(error);
                }
            },
            BatchSize::LargeInput,
        );
    });
    group.finish();
    assert!(good, "a step was faulty, so its time is meaningless");
}

criterion_group! {
    name = benches;
    config = Criterion::default().with_measurement(Processor);
    targets = all, drive
}
criterion_main!(benches);
