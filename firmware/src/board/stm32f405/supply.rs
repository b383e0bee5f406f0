//! The supply: flash is written 32 bits at a time, which needs 2.7 V (RM0090 table 7).
//!
//! The voltage detector (section 5.2.3) compares it with level 5: between 2.75 V and 2.99 V
//! (DS8626, table 19). Below it no writing begins. The brown-out reset of level 3 in the option
//! bytes keeps the core from running below 2.7 V at all. As delivered it is off;
//! `docs/firmware.md` says how it is set. The board does not set it: option bytes are the
//! production's.

use stm32f4::stm32f405::{FLASH, PWR, RCC};

/// Level 5 of the detector.
const LEVEL: u8 = 5;

/// Starts the detector.
pub fn watch(rcc: &RCC, pwr: &PWR) {
    rcc.apb1enr().modify(|_, w| w.pwren().set_bit());
    pwr.cr().modify(|_, w| {
        // SAFETY: three bits.
        unsafe { w.pls().bits(LEVEL) };
        w.pvde().set_bit()
    });
}

/// Whether the supply is too low for writing flash.
pub fn is_low() -> bool {
    // SAFETY: reading this register does nothing.
    unsafe { &*PWR::ptr() }.csr().read().pvdo().bit_is_set()
}

/// The brown-out level of the option bytes, 0 (off) to 3; `None`: no flash controller.
pub fn brown_out(flash: &FLASH) -> Option<u8> {
    if flash.cr().read().lock().bit_is_clear() {
        return None;
    }
    // RM0090 table 16: 00 is level 3, 11 is off
    let bits = flash.optcr().read().bor_lev().bits();
    3u8.checked_sub(bits)
}
