//! Measures with criterion, in processor time of the measuring thread: other load on the machine
//! has little effect.

use std::fmt;
use std::hint::black_box;
use std::time::Duration;

use criterion::measurement::{Measurement, ValueFormatter, WallTime};
use criterion::{Bencher, Criterion};
use rustix::time::{ClockId, clock_gettime};
use vectors::list::Measure;
use vectors::work::{WorkResult, plausible};

/// Processor time of the measuring thread.
pub struct Processor;

fn now() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

impl Measurement for Processor {
    type Intermediate = Duration;
    type Value = Duration;

    fn start(&self) -> Duration {
        now()
    }
    fn end(&self, start: Duration) -> Duration {
        now() - start
    }
    fn add(&self, a: &Duration, b: &Duration) -> Duration {
        *a + *b
    }
    fn zero(&self) -> Duration {
        Duration::ZERO
    }
    fn to_f64(&self, value: &Duration) -> f64 {
        WallTime.to_f64(value)
    }
    fn formatter(&self) -> &dyn ValueFormatter {
        WallTime.formatter()
    }
}

/// Repetitions after which work that cannot be repeated for ever restarts; the target uses the same
/// number.
const RESTART: u32 = 1000;

/// Measures each piece of work as a benchmark of its name; `group/size` is one of a group.
pub struct Timed<'a>(pub &'a mut Criterion<Processor>);

impl Measure for Timed<'_> {
    fn measure(
        &mut self,
        name: &'static str,
        _long: bool,
        mut work: impl FnMut([f32; 3]) -> WorkResult,
    ) -> fmt::Result {
        if name == "empty" {
            return Ok(()); // criterion subtracts its own loop
        }
        let (mut repetition, mut good) = (0, true);
        let mut run = |bencher: &mut Bencher<'_, Processor>| {
            bencher.iter(|| {
                repetition += 1;
                let (found, fine) = work(black_box(plausible(repetition)));
                good &= fine;
                found
            });
        };
        match name.split_once('/') {
            Some((group, size)) => {
                let mut group = self.0.benchmark_group(group);
                group.bench_function(size, &mut run);
                group.finish();
            }
            None => {
                self.0.bench_function(name, &mut run);
            }
        }
        if good { Ok(()) } else { Err(fmt::Error) }
    }

    fn measure_from<W: Clone>(
        &mut self,
        name: &'static str,
        long: bool,
        start: W,
        run: impl Fn(&mut W, [f32; 3]) -> WorkResult,
    ) -> fmt::Result {
        let (mut work, mut repetition) = (start.clone(), 0);
        self.measure(name, long, |input| {
            repetition += 1;
            if repetition == RESTART {
                work = start.clone();
                repetition = 0;
            }
            run(&mut work, input)
        })
    }
}
