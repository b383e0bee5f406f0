//! The pieces of work whose instructions are counted, under the names of `vectors::list`.

use core::fmt::{Result, Write};
use core::hint::black_box;

use lrnn_nostd::{Activation, Cubic, Rational, Tanh};
use vectors::work::{LearnWork, NetworkWork, Portable, WorkResult, plausible};

use crate::machine::{MASK, Out, start_counter, ticks, turn};

/// Repetitions of each piece of work.
const REPETITIONS: usize = 200;

/// Prints a loop of known length, the empty loop and every piece of work, one line each.
///
/// # Errors
/// A piece of work failed, so its count would be wrong; or a line cannot be printed.
pub fn print() -> Result {
    start_counter();
    for turns in [100_000, 1_100_000] {
        let ticks = timed(|| turn(black_box(turns)));
        writeln!(Out, "loop {} {ticks}", 2 * turns)?;
    }
    writeln!(Out, "repetitions {REPETITIONS}")?;
    measure("empty", |input| (input, true))?;
    network::<Rational>([
        "step_rational",
        "gradient_rational",
        "descent_rational",
        "learn_rational",
    ])?;
    network::<Tanh>(["step_tanh", "gradient_tanh", "descent_tanh", "learn_tanh"])?;
    network::<Cubic>([
        "step_cubic",
        "gradient_cubic",
        "descent_cubic",
        "learn_cubic",
    ])
}

fn network<H: Activation>([step, gradient, descent, learn]: [&str; 4]) -> Result {
    let mut work = NetworkWork::<Portable<H>>::new();
    measure(step, |input| work.step(input))?;
    let mut work = NetworkWork::<Portable<H>>::new();
    measure(gradient, |input| work.gradient(input))?;
    let mut work = NetworkWork::<Portable<H>>::new();
    measure(descent, |input| work.descent(input))?;
    let mut work = LearnWork::<H>::new();
    measure(learn, |input| work.run(input))
}

/// Prints the ticks of all repetitions. A failed repetition is an error, because its count would be
/// wrong.
#[inline(never)]
fn measure(name: &str, mut work: impl FnMut([f32; 3]) -> WorkResult) -> Result {
    let mut good = true;
    let ticks = timed(|| {
        for repetition in 0..REPETITIONS {
            let (_, fine) = black_box(work(black_box(plausible(repetition))));
            good &= fine;
        }
    });
    if good {
        writeln!(Out, "{name} {ticks}")
    } else {
        Err(core::fmt::Error)
    }
}

#[inline(always)]
fn timed(work: impl FnOnce()) -> u32 {
    let start = ticks();
    work();
    ticks().wrapping_sub(start) & MASK
}
