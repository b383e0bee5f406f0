//! Counts instructions with SysTick under `-icount shift=0`; prints ticks, which `qemu::count` makes instructions of.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod target {
    use core::fmt::Write;
    use core::hint::black_box;

    use cortex_m_semihosting::hio::HostStream;
    use qemu::target::{start_counter, ticks as counter};
    use vectors::list::{self, Measure};
    use vectors::work::plausible;

    const REPETITIONS: usize = 1000;
    /// Work that takes too long for the counter is done in one of so many repetitions.
    const RARE: usize = 40;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let equal = start_counter() && print().is_ok();
        qemu::target::exit(equal)
    }

    /// Ticks of `work`; less than 2^24, that is 10^8 instructions.
    #[inline(always)]
    fn ticks(work: impl FnOnce()) -> u32 {
        let start = counter();
        work();
        counter().wrapping_sub(start) & 0x00ff_ffff
    }

    /// Ticks of all repetitions of `work`. Input and result pass through memory as in the board's loop; the empty loop has
    /// that too. A repetition that went wrong ends the image with an error: its count would be of something else.
    #[inline(always)]
    fn repeat(mut work: impl FnMut([f32; 3]) -> ([f32; 3], bool)) -> Result<u32, core::fmt::Error> {
        let mut good = true;
        let ticks = ticks(|| {
            for repetition in 0..REPETITIONS {
                let (_, fine) = black_box(work(black_box(plausible(repetition))));
                good &= fine;
            }
        });
        if good {
            Ok(ticks)
        } else {
            Err(core::fmt::Error)
        }
    }

    fn print() -> core::fmt::Result {
        let mut out = qemu::target::output();
        for cycles in [100_000, 1_100_000] {
            // cortex_m::asm::delay(n) is `subs; bne`, n + 1 times.
            let ticks = ticks(|| cortex_m::asm::delay(black_box(cycles)));
            writeln!(out, "loop {} {ticks}", 2 * (cycles + 1))?;
        }
        writeln!(out, "repetitions {REPETITIONS}")?;
        list::all(&mut Lines(out))
    }

    /// A line each: name and ticks.
    struct Lines(HostStream);

    impl Measure for Lines {
        #[inline(always)]
        fn measure(
            &mut self,
            name: &'static str,
            long: bool,
            work: impl FnMut([f32; 3]) -> ([f32; 3], bool),
        ) -> core::fmt::Result {
            let ticks = if long { rarely(work)? } else { repeat(work)? };
            writeln!(self.0, "{name} {ticks}")
        }
    }

    /// As if `work` were done in all repetitions.
    #[inline(always)]
    fn rarely(mut work: impl FnMut([f32; 3]) -> ([f32; 3], bool)) -> Result<u32, core::fmt::Error> {
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
}

#[cfg(not(target_os = "none"))]
fn main() {
    qemu::only_in_qemu();
}
