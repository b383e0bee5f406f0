//! One run of a campaign: every scheme, with one group of errors, with all six kinds, and with all
//! ten single causes. `cargo bench -p host-lab --bench campaign`.

use criterion::{Criterion, criterion_group, criterion_main};
use host_core::simulator::imu::ErrorModelName;
use host_lab::campaign::{Campaign, Tuning};
use host_unit::scenario::Scenario;
use std::hint::black_box;

fn one_run(c: &mut Criterion) {
    let mut group = c.benchmark_group("campaign");
    group.sample_size(10);
    for (name, models) in [
        ("run-all", vec![ErrorModelName::All]),
        ("run-six-groups", ErrorModelName::ALL.to_vec()),
        ("run-every-cause", ErrorModelName::CAUSES.to_vec()),
    ] {
        let Ok(scenario) = Scenario::load("medium") else {
            continue;
        };
        let campaign = Campaign::single(scenario, &models);
        group.bench_function(name, |b| {
            b.iter(|| {
                black_box(&campaign)
                    .run(&Tuning::default(), 0)
                    .map(|rows| rows.len())
            });
        });
    }
    group.finish();
}

criterion_group!(benches, one_run);
criterion_main!(benches);
