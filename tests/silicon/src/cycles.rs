//! Counts cycles: each piece of work many times, minus the loop without work.

use core::hint::black_box;

use cortex_m::peripheral::DWT;
use silicon::chip::Core;
use vectors::list::{self, Measure};
use vectors::work::plausible;

/// Repetitions of work of some thousand cycles, and of work of a million cycles.
const MANY: u32 = 1000;
const FEW: u32 = 25;
/// Turns of a loop of two instructions, which shows what the counter counts: 3 cycles each on a
/// Cortex-M4, 1 on an M7.
const TURNS: u32 = 1_000_000;

/// Runs and reports every piece of work; returns whether all succeeded.
pub fn measure(core: Core) -> bool {
    let start = DWT::cycle_count();
    cortex_m::asm::delay(TURNS);
    let turns = DWT::cycle_count().wrapping_sub(start);
    // No core makes a turn in less than a cycle.
    let there = turns >= TURNS;
    if there {
        defmt::println!("loop of {=u32} turns: {=u32} cycles", TURNS, turns);
    } else {
        defmt::println!("no cycle counter (QEMU): nothing is counted");
    }
    let mut cycles = Cycles {
        core,
        there,
        empty: 0,
    };
    list::all(&mut cycles).is_ok()
}

struct Cycles {
    core: Core,
    /// Whether there is a counter.
    there: bool,
    /// Cycles of [`MANY`] repetitions of the empty loop.
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
        // The counter wraps after 2^32 cycles, a hundred times the longest work.
        let cycles = DWT::cycle_count().wrapping_sub(start);
        if !good {
            defmt::println!("{=str} went wrong", name);
            return Err(core::fmt::Error);
        }
        let own = if self.core.own_form(name) {
            ", the kernel for this core"
        } else {
            ""
        };
        if name == "empty" {
            self.empty = cycles;
        } else if self.there {
            let empty = self.empty / (MANY / repetitions);
            let each = (cycles.saturating_sub(empty) + repetitions / 2) / repetitions;
            defmt::println!("{=str} {=u32} cycles{=str}", name, each, own);
        } else {
            defmt::println!("{=str} done, not counted{=str}", name, own);
        }
        Ok(())
    }
}
