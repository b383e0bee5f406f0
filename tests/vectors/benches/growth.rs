//! Nanoseconds of the work of growing size that the target counts instructions of; `cargo xtask growth` draws both.

mod processor;

use std::fmt;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use processor::Processor;
use vectors::list::Measure;
use vectors::work::plausible;

struct Timed<'a>(&'a mut Criterion<Processor>);

impl Measure for Timed<'_> {
    fn measure(
        &mut self,
        name: &'static str,
        _long: bool,
        mut work: impl FnMut([f32; 3]) -> ([f32; 3], bool),
    ) -> fmt::Result {
        let Some((group, size)) = name.split_once('/') else {
            return Ok(()); // the empty loop
        };
        let (mut repetition, mut good) = (0, true);
        let mut group = self.0.benchmark_group(group);
        group.bench_function(size, |bencher| {
            bencher.iter(|| {
                repetition += 1;
                let (found, fine) = work(black_box(plausible(repetition)));
                good &= fine;
                found
            });
        });
        group.finish();
        if good { Ok(()) } else { Err(fmt::Error) }
    }
}

fn all(criterion: &mut Criterion<Processor>) {
    vectors::growth::all(&mut Timed(criterion))
        .expect("a repetition was faulty or rejected, so its time says nothing");
}

criterion_group! {
    name = benches;
    config = Criterion::default().with_measurement(Processor);
    targets = all
}
criterion_main!(benches);
