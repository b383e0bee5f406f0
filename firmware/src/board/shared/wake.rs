//! When the main loop sleeps, and what wakes it.

use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::interrupt;
use cortex_m::peripheral::SYST;

/// Since the last sleep something happened that the main loop must handle.
static AWAKE: AtomicBool = AtomicBool::new(true);

/// For interrupts: wakes the main loop.
#[inline(always)]
pub fn wake() {
    AWAKE.store(true, Ordering::Relaxed);
}

/// For the main loop: sleeps until [`wake`]. Interrupts that do not call it only cost their own
/// time.
///
/// The test of the flag and the sleep are one step: an interrupt in between stays pending, ends the
/// sleep and is served after it. Returns the ticks of SysTick asleep, interrupts not counted.
pub fn sleep() -> u32 {
    let mut ticks = 0u32;
    loop {
        let awake = interrupt::free(|_| {
            let awake = AWAKE.load(Ordering::Relaxed);
            if !awake {
                ticks = ticks.saturating_add(ticks_of(cortex_m::asm::wfi));
            }
            awake
        });
        if awake {
            break;
        }
    }
    AWAKE.store(false, Ordering::Relaxed);
    ticks
}

/// Ticks that `asleep` takes, less than the millisecond after which SysTick ends every sleep.
/// Interrupts wait meanwhile.
fn ticks_of(asleep: impl FnOnce()) -> u32 {
    let before = SYST::get_current();
    asleep();
    let after = SYST::get_current();
    match before.checked_sub(after) {
        Some(ticks) => ticks,
        None => before + SYST::get_reload() + 1 - after, // it ran out, which woke us
    }
}
