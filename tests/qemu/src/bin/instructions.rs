//! Counts instructions with SysTick under `-icount shift=0`; prints ticks, which `qemu::count` makes instructions of.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod target {
    use core::fmt::Write;
    use core::hint::black_box;

    use cortex_m::peripheral::SYST;
    use cortex_m::peripheral::syst::SystClkSource;
    use lrnn_nostd::learn::{Learner, Paper, StepSizes};
    use lrnn_nostd::{Activation, Rational, Sensitivities, State, Tanh};
    use vectors::{input, net};

    const REPETITIONS: usize = 1000;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let equal = start_counter() && print().is_ok();
        qemu::target::exit(equal)
    }

    fn start_counter() -> bool {
        let Some(mut peripherals) = cortex_m::Peripherals::take() else {
            return false;
        };
        peripherals.SYST.set_clock_source(SystClkSource::Core);
        peripherals.SYST.set_reload(0x00ff_ffff);
        peripherals.SYST.clear_current();
        peripherals.SYST.enable_counter();
        true
    }

    /// Ticks of `work`; less than 2^24, that is 10^8 instructions.
    #[inline(always)]
    fn ticks(work: impl FnOnce()) -> u32 {
        let start = SYST::get_current();
        work();
        start.wrapping_sub(SYST::get_current()) & 0x00ff_ffff
    }

    /// Ticks of all repetitions of `work` with the inputs in turn. Input and result pass through memory as in the board's
    /// loop; the empty loop has that too.
    #[inline(always)]
    fn repeat(mut work: impl FnMut([f32; 3]) -> [f32; 3]) -> u32 {
        ticks(|| {
            for index in 0..REPETITIONS {
                black_box(work(black_box(input(PLAUSIBLE + index % 40))));
            }
        })
    }

    /// The first of 40 vectors without a non-finite one: those are not stepped, which is cheaper.
    const PLAUSIBLE: usize = 10;

    fn print() -> core::fmt::Result {
        let mut out = qemu::target::output();
        for cycles in [100_000, 1_100_000] {
            // cortex_m::asm::delay(n) is `subs; bne`, n + 1 times.
            writeln!(
                out,
                "loop {} {}",
                2 * (cycles + 1),
                ticks(|| cortex_m::asm::delay(black_box(cycles)))
            )?;
        }
        writeln!(out, "repetitions {REPETITIONS}")?;
        writeln!(out, "empty {}", repeat(|input| input))?;
        writeln!(out, "step_rational {}", step::<Rational>())?;
        writeln!(out, "step_tanh {}", step::<Tanh>())?;
        writeln!(out, "gradient_rational {}", gradient::<Rational>())?;
        writeln!(out, "gradient_tanh {}", gradient::<Tanh>())?;
        writeln!(out, "learn_rational {}", learn::<Rational>())?;
        writeln!(out, "learn_tanh {}", learn::<Tanh>())
    }

    #[inline(never)]
    fn step<H: Activation>() -> u32 {
        let (net, mut state) = (net::<H>(), State::new());
        repeat(|input| net.step(&mut state, input).error)
    }

    #[inline(never)]
    fn gradient<H: Activation>() -> u32 {
        let (net, mut state, mut sensitivities) = (net::<H>(), State::new(), Sensitivities::new());
        repeat(|input| {
            net.step_gradient(&mut state, &mut sensitivities, input)
                .error
        })
    }

    /// The most that learning can cost a step: a pass of one step by the paper's rule. Everything is cleared, one step with its
    /// exact gradient is made, compared with a reference, and all 63 weights move.
    #[inline(never)]
    fn learn<H: Activation>() -> u32 {
        let (steps, eps) = (
            StepSizes::uniform(1.0 / 4096.0),
            StepSizes::uniform(1.0 / 1024.0),
        );
        let mut learner = Learner::new(&net::<H>(), Paper::new(steps, eps));
        repeat(|input| {
            learner.begin_pass();
            let step = learner.step(input, 1.0);
            learner.reference(input, 1.0);
            let _ = black_box(learner.end_pass());
            step.error
        })
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    qemu::only_in_qemu();
}
