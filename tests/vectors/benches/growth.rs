//! Nanoseconds of the pieces of work of growing size whose instructions are counted on the target;
//! `cargo xtask growth` draws both.

mod processor;

use criterion::{Criterion, criterion_group, criterion_main};
use processor::{Processor, Timed};

fn all(criterion: &mut Criterion<Processor>) {
    vectors::growth::all(&mut Timed(criterion))
        .expect("a repetition was faulty or rejected, so its time is meaningless");
}

criterion_group! {
    name = benches;
    config = Criterion::default().with_measurement(Processor);
    targets = all
}
criterion_main!(benches);
