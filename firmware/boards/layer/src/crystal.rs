//! The crystal of an STM32, or its internal oscillator in the crystal's place.

use core::sync::atomic::{AtomicU8, Ordering};

use embassy_stm32::pac::RCC;
use embassy_stm32::rcc::{Hse, HseMode};
use firmware::wire::command::{ClockSource, Crystal};

/// Looks at the flag until it is given up, of at least four cycles each: 25 ms at the 16 MHz of an
/// F4's internal oscillator. A crystal needs 2 ms (DS8626, table 39).
#[cfg(not(feature = "m7"))]
const PATIENCE: u32 = 100_000;
/// Looks at the flag at the 64 MHz of an H7's internal oscillator: 62 ms, since its clock comes
/// from a probe that is starting, too.
#[cfg(feature = "m7")]
const PATIENCE: u32 = 1_000_000;

/// Frequency of the crystal that the board has, and of the one in use, MHz.
static BUILT: AtomicU8 = AtomicU8::new(0);
static USED: AtomicU8 = AtomicU8::new(0);

/// For the application: not measured.
pub(crate) fn found() -> (ClockSource, Crystal) {
    let crystal = Crystal {
        built_mhz: BUILT.load(Ordering::Relaxed),
        used_mhz: USED.load(Ordering::Relaxed),
        measured_khz: 0,
    };
    let source = match crystal.used_mhz {
        0 => ClockSource::Internal,
        _ => ClockSource::Crystal,
    };
    (source, crystal)
}

/// Starts a crystal, or takes the clock that comes in its place. `None`: there is none.
///
/// Called before `embassy_stm32::init`, which waits for it without an end.
pub fn start(crystal: Hse) -> Option<Hse> {
    let mhz = (crystal.freq.0 / 1_000_000) as u8;
    BUILT.store(mhz, Ordering::Relaxed);
    RCC.cr()
        .modify(|w| w.set_hsebyp(crystal.mode != HseMode::Oscillator));
    RCC.cr().modify(|w| w.set_hseon(true));
    if (0..PATIENCE).any(|_| RCC.cr().read().hserdy()) {
        USED.store(mhz, Ordering::Relaxed);
        return Some(crystal);
    }
    RCC.cr().modify(|w| w.set_hseon(false));
    defmt::println!("no crystal: the clock is the internal oscillator's");
    None
}
