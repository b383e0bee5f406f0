//! Random bytes from the chip's generator (RM0090 section 24).
//!
//! It samples the noise of ring oscillators and needs the 48 MHz of the PLL. The first word is not
//! used, and a word that is equal to the one before it is a fault (section 24.3.1).

use stm32f4::stm32f405::{RCC, RNG};

/// Rounds of waiting for a word, which takes 40 periods of 48 MHz: 140 cycles.
const PATIENCE: u32 = 10_000;

/// 32 random bytes; `None`: there is no generator, its clock is missing, or it does not vary.
#[inline(never)]
pub fn bytes(rcc: &RCC, rng: &RNG) -> Option<[u8; 32]> {
    rcc.ahb2enr().modify(|_, w| w.rngen().set_bit());
    rng.cr().modify(|_, w| w.rngen().set_bit());
    let taken = words(rng);
    rng.cr().modify(|_, w| w.rngen().clear_bit());
    rcc.ahb2enr().modify(|_, w| w.rngen().clear_bit());
    taken
}

fn words(rng: &RNG) -> Option<[u8; 32]> {
    let mut before = word(rng)?;
    let mut bytes = [0; 32];
    let (words, _) = bytes.as_chunks_mut::<4>();
    for place in words {
        let word = word(rng)?;
        if word == before {
            return None;
        }
        *place = word.to_le_bytes();
        before = word;
    }
    Some(bytes)
}

fn word(rng: &RNG) -> Option<u32> {
    let ready = (0..PATIENCE).any(|_| rng.sr().read().drdy().bit_is_set());
    let status = rng.sr().read();
    let bad = status.cecs().bit_is_set() || status.secs().bit_is_set();
    (ready && !bad).then(|| rng.dr().read().rndata().bits())
}
