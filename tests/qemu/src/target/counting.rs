//! Counts the instructions of repeated pieces of work; `count` on the desktop reads the output.

use core::fmt::{Error, Result as Printed, Write};
use core::hint::black_box;

use cortex_m_semihosting::hio::HostStream;
use vectors::list::Measure;
use vectors::work::plausible;

use super::{exit, output, start_counter, ticks as counter};

const REPETITIONS: usize = 1000;
/// Work that is too long for the counter is done in only one of this many repetitions.
const RARE: usize = 40;

/// Prints the counts of all works of `list` and leaves QEMU.
pub fn print(list: impl FnOnce(&mut Lines) -> Printed) -> ! {
    exit(start_counter() && counts(list).is_ok())
}

fn counts(list: impl FnOnce(&mut Lines) -> Printed) -> Printed {
    let mut out = output();
    for cycles in [100_000, 1_100_000] {
        // cortex_m::asm::delay(n) is `subs; bne`, n + 1 times.
        let ticks = ticks(|| cortex_m::asm::delay(black_box(cycles)));
        writeln!(out, "loop {} {ticks}", 2 * (cycles + 1))?;
    }
    writeln!(out, "repetitions {REPETITIONS}")?;
    list(&mut Lines(out))
}

/// Prints a line for each piece of work: name and ticks.
pub struct Lines(HostStream);

impl Measure for Lines {
    #[inline(always)]
    fn measure(
        &mut self,
        name: &'static str,
        long: bool,
        work: impl FnMut([f32; 3]) -> ([f32; 3], bool),
    ) -> Printed {
        let ticks = if long { rarely(work)? } else { repeat(work)? };
        writeln!(self.0, "{name} {ticks}")
    }
}

/// Ticks of `work`; less than 2^24, that is 10^8 instructions.
#[inline(always)]
fn ticks(work: impl FnOnce()) -> u32 {
    let start = counter();
    work();
    counter().wrapping_sub(start) & 0x00ff_ffff
}

/// Ticks of all repetitions of `work`. Input and result pass through memory as in the board's loop,
/// also in the empty loop. A failed repetition ends the image with an error, because its count
/// would be wrong.
#[inline(always)]
fn repeat(mut work: impl FnMut([f32; 3]) -> ([f32; 3], bool)) -> Result<u32, Error> {
    let mut good = true;
    let ticks = ticks(|| {
        for repetition in 0..REPETITIONS {
            let (_, fine) = black_box(work(black_box(plausible(repetition))));
            good &= fine;
        }
    });
    if good { Ok(ticks) } else { Err(Error) }
}

/// Ticks as if `work` were done in all repetitions.
#[inline(always)]
fn rarely(mut work: impl FnMut([f32; 3]) -> ([f32; 3], bool)) -> Result<u32, Error> {
    let mut repetition = 0;
    let ticks = repeat(|input| {
        repetition += 1;
        if repetition % RARE == 0 {
            work(input)
        } else {
            (input, true)
        }
    })?;
    Ok(ticks * RARE as u32)
}
