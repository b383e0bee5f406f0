//! One navigator step: the inner loop of campaigns. `cargo bench -p host-lab --bench sins`.

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use host_core::inertial::earth::Geodetic;
use host_core::inertial::sins::{Samples, Sins};
use host_core::simulator::truth::{DriveConfig, Truth, random_drive};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::hint::black_box;

fn steps(c: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let segments = random_drive(60.0, &mut rng);
    let truth = Truth::new(
        &DriveConfig {
            segments: &segments,
            start: Geodetic {
                lat: 0.84,
                lon: 0.2,
                h: 300.0,
            },
            heading: 0.7,
            dt: 0.01,
            vibration: 1.0,
        },
        &mut rng,
    );
    let mut group = c.benchmark_group("sins");
    group.throughput(Throughput::Elements(truth.increments.len() as u64));
    for samples in [Samples::One, Samples::Two, Samples::Three] {
        group.bench_function(format!("{samples:?}"), |b| {
            b.iter_batched_ref(
                || Sins::new(truth.epochs[0]).with_samples(black_box(samples)),
                |sins| {
                    for increment in &truth.increments {
                        sins.step(increment, truth.dt);
                    }
                    sins.nav
                },
                BatchSize::SmallInput,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, steps);
criterion_main!(benches);
