//! Cycles of the measured pieces of work on a board with an STM32F405, at the clock of the board image: `cargo xtask flash --bench`.
//!
//! The works are those whose instructions `cargo xtask bench` counts in QEMU. Here the core's cycle counter (DWT, ARM DDI 0403, C1.8) counts, so flash wait states,
//! branches and divisions are in it. QEMU has no such counter: there the works are done, and said not to have been counted.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../../../firmware/src/board/stm32f405/clock.rs"]
#[allow(unsafe_code, reason = "the board's; each block says why it is sound")]
mod clock;
#[cfg(target_os = "none")]
#[path = "../../../firmware/src/board/stm32f405/log.rs"]
#[allow(unsafe_code, reason = "the board's; each block says why it is sound")]
mod log;

/// Bytes of log that are kept: all lines, since nobody may be reading yet.
#[cfg(target_os = "none")]
const LOG_SIZE: usize = 4096;

#[cfg(target_os = "none")]
mod target {
    use core::hint::black_box;

    use cortex_m::peripheral::{DCB, DWT};
    use cortex_m_semihosting::debug;
    use stm32f4::stm32f405::Peripherals;
    use vectors::list::{self, Measure};
    use vectors::work::plausible;

    use crate::clock;

    /// Repetitions of a work of some thousand cycles, and of a million.
    const MANY: u32 = 1000;
    const FEW: u32 = 25;
    /// Turns of a loop of two instructions, to see what the counter counts.
    const TURNS: u32 = 1_000_000;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        if let (Some(mut core), Some(peripherals)) =
            (cortex_m::Peripherals::take(), Peripherals::take())
        {
            let clocks = clock::start(&peripherals.RCC, &peripherals.FLASH);
            core.DCB.enable_trace();
            core.DWT.enable_cycle_counter();
            let version = env!("CARGO_PKG_VERSION");
            defmt::println!("lrnn bench {=str}, {}", version, clocks);
            let good = measure();
            defmt::println!("{=str}", if good { "done" } else { "a work went wrong" });
            if DCB::is_debugger_attached() {
                debug::exit(if good {
                    debug::EXIT_SUCCESS
                } else {
                    debug::EXIT_FAILURE
                });
            }
        }
        loop {
            cortex_m::asm::wfi();
        }
    }

    fn measure() -> bool {
        let start = DWT::cycle_count();
        cortex_m::asm::delay(TURNS);
        let turns = DWT::cycle_count().wrapping_sub(start);
        // no core makes a turn in less than a cycle
        let there = turns >= TURNS;
        if there {
            defmt::println!("loop of {=u32} turns: {=u32} cycles", TURNS, turns);
        } else {
            defmt::println!("no cycle counter (QEMU): nothing is counted");
        }
        list::all(&mut Cycles { there, empty: 0 }).is_ok()
    }

    struct Cycles {
        /// There is a counter.
        there: bool,
        /// Cycles of [`MANY`] repetitions of nothing.
        empty: u32,
    }

    impl Measure for Cycles {
        fn measure(
            &mut self,
            name: &'static str,
            long: bool,
            mut work: impl FnMut([f32; 3]) -> ([f32; 3], bool),
        ) -> core::fmt::Result {
            let repetitions = if long { FEW } else { MANY };
            let mut good = true;
            let start = DWT::cycle_count();
            for repetition in 0..repetitions {
                let (_, fine) = black_box(work(black_box(plausible(repetition as usize))));
                good &= fine;
            }
            let cycles = DWT::cycle_count().wrapping_sub(start); // 25 s at 168 MHz until it wraps
            if !good {
                defmt::println!("{=str} went wrong", name);
                return Err(core::fmt::Error);
            }
            if name == "empty" {
                self.empty = cycles;
            } else if self.there {
                let empty = self.empty / (MANY / repetitions);
                let each = (cycles.saturating_sub(empty) + repetitions / 2) / repetitions;
                defmt::println!("{=str} {=u32} cycles", name, each);
            } else {
                defmt::println!("{=str} done, not counted", name);
            }
            Ok(())
        }
    }

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo) -> ! {
        defmt::println!("panic");
        loop {
            cortex_m::asm::wfi();
        }
    }
}

#[cfg(target_os = "none")]
#[allow(unsafe_code, reason = "the interrupt table")]
mod interrupts {
    unsafe extern "C" {
        /// Of `cortex-m-rt`: stays in a loop.
        fn DefaultHandler();
    }

    // SAFETY: `cortex-m-rt` puts this section behind the exceptions and expects this name with its feature `device`; no interrupt is let
    // through.
    #[unsafe(link_section = ".vector_table.interrupts")]
    #[unsafe(no_mangle)]
    static __INTERRUPTS: [unsafe extern "C" fn(); 1] = [DefaultHandler];
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!("stm32f405-bench is a board binary: `cargo xtask flash --bench`");
}
