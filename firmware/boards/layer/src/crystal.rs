//! The crystal of an STM32, or its internal oscillator in the crystal's place.

use embassy_stm32::pac::RCC;
use embassy_stm32::rcc::{Hse, HseMode};

/// Looks at the flag until it is given up, of at least four cycles each: 25 ms at the 16 MHz of an
/// F4's internal oscillator. A crystal needs 2 ms (DS8626, table 39).
#[cfg(not(feature = "m7"))]
const PATIENCE: u32 = 100_000;
/// The same at the 64 MHz of an H7's, which has its clock from a probe that starts, too: 62 ms.
#[cfg(feature = "m7")]
const PATIENCE: u32 = 1_000_000;

/// Starts a crystal, or takes the clock that comes in its place. `None`: there is none.
///
/// Called before `embassy_stm32::init`, which waits for it without an end.
pub fn start(crystal: Hse) -> Option<Hse> {
    RCC.cr()
        .modify(|w| w.set_hsebyp(crystal.mode != HseMode::Oscillator));
    RCC.cr().modify(|w| w.set_hseon(true));
    if (0..PATIENCE).any(|_| RCC.cr().read().hserdy()) {
        return Some(crystal);
    }
    RCC.cr().modify(|w| w.set_hseon(false));
    defmt::println!("no crystal: the clock is the internal oscillator's");
    None
}
