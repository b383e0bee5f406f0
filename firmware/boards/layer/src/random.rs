//! Random bytes from an STM32's generator (RM0090 section 24, RM0410 section 20, RM0433 section
//! 34), as on the board `stm32f405`. The driver of others waits for a word without an end.

use embassy_stm32::pac::RNG;
use embassy_stm32::{Peri, peripherals, rcc};

/// Looks for a word, which takes 40 periods of 48 MHz: more than 1000 cycles at 400 MHz.
const PATIENCE: u32 = 10_000;

/// 32 random bytes; `None`: the generator's clock is missing, or it does not vary.
#[must_use]
pub fn bytes(_: Peri<'_, peripherals::RNG>) -> Option<[u8; 32]> {
    rcc::enable_and_reset::<peripherals::RNG>();
    RNG.cr().modify(|w| w.set_rngen(true));
    let taken = words();
    RNG.cr().modify(|w| w.set_rngen(false));
    taken
}

/// The first word is not used, and one that is equal to the one before it is a fault (RM0090
/// 24.3.1).
fn words() -> Option<[u8; 32]> {
    let mut before = word()?;
    let mut bytes = [0; 32];
    for place in bytes.as_chunks_mut::<4>().0 {
        let word = word()?;
        if word == before {
            return None;
        }
        *place = word.to_le_bytes();
        before = word;
    }
    Some(bytes)
}

fn word() -> Option<u32> {
    let ready = (0..PATIENCE).any(|_| RNG.sr().read().drdy());
    let status = RNG.sr().read();
    (ready && !status.cecs() && !status.secs()).then(|| RNG.dr().read())
}
