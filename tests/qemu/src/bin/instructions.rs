//! Counts instructions with SysTick under `-icount shift=0`; prints ticks, which `qemu::count` makes instructions of.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod target {
    use core::fmt::Write;
    use core::hint::black_box;

    use lrnn_nostd::{Activation, Rational, Tanh};
    use qemu::target::{start_counter, ticks as counter};
    use vectors::learning::{LearnerFixWork, LearnerSecondWork, LearnerStepWork};
    use vectors::navigation::{NavPieceWork, NavSecondWork, NavWordWork};
    use vectors::work::{DescentWork, GradientWork, LearnWork, StepWork, plausible};

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
        writeln!(out, "empty {}", repeat(|input| (input, true))?)?;
        writeln!(out, "step_rational {}", step::<Rational>()?)?;
        writeln!(out, "step_tanh {}", step::<Tanh>()?)?;
        writeln!(out, "gradient_rational {}", gradient::<Rational>()?)?;
        writeln!(out, "gradient_tanh {}", gradient::<Tanh>()?)?;
        writeln!(out, "descent_rational {}", descent::<Rational>()?)?;
        writeln!(out, "descent_tanh {}", descent::<Tanh>()?)?;
        writeln!(out, "learn_rational {}", learn::<Rational>()?)?;
        writeln!(out, "learn_tanh {}", learn::<Tanh>()?)?;
        writeln!(out, "nav_word {}", nav_word()?)?;
        writeln!(out, "nav_piece {}", nav_piece()?)?;
        writeln!(out, "nav_second {}", nav_second()?)?;
        writeln!(out, "learner_step {}", learner_step()?)?;
        writeln!(out, "learner_fix {}", learner_fix()?)?;
        writeln!(out, "learner_second {}", learner_second()?)
    }

    #[inline(never)]
    fn nav_word() -> Result<u32, core::fmt::Error> {
        let mut work = NavWordWork::new().ok_or(core::fmt::Error)?;
        repeat(|input| work.run(input))
    }

    #[inline(never)]
    fn nav_piece() -> Result<u32, core::fmt::Error> {
        let mut work = NavPieceWork::new().ok_or(core::fmt::Error)?;
        repeat(|input| work.run(input))
    }

    #[inline(never)]
    fn nav_second() -> Result<u32, core::fmt::Error> {
        let mut work = NavSecondWork::new().ok_or(core::fmt::Error)?;
        rarely(|input| work.run(input))
    }

    #[inline(never)]
    fn learner_step() -> Result<u32, core::fmt::Error> {
        let mut work = LearnerStepWork::BLANK;
        work.begin();
        repeat(|input| work.run(input))
    }

    #[inline(never)]
    fn learner_fix() -> Result<u32, core::fmt::Error> {
        let mut work = LearnerFixWork::BLANK;
        work.begin();
        rarely(|input| work.run(input))
    }

    #[inline(never)]
    fn learner_second() -> Result<u32, core::fmt::Error> {
        let mut work = LearnerSecondWork::BLANK;
        work.begin();
        rarely(|input| work.run(input))
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

    #[inline(never)]
    fn step<H: Activation>() -> Result<u32, core::fmt::Error> {
        let mut work = StepWork::<H>::new();
        repeat(|input| work.run(input))
    }

    #[inline(never)]
    fn gradient<H: Activation>() -> Result<u32, core::fmt::Error> {
        let mut work = GradientWork::<H>::new();
        repeat(|input| work.run(input))
    }

    #[inline(never)]
    fn descent<H: Activation>() -> Result<u32, core::fmt::Error> {
        let mut work = DescentWork::<H>::new();
        repeat(|input| work.run(input))
    }

    #[inline(never)]
    fn learn<H: Activation>() -> Result<u32, core::fmt::Error> {
        let mut work = LearnWork::<H>::new();
        repeat(|input| work.run(input))
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    qemu::only_in_qemu();
}
