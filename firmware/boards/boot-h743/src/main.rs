//! Loader of the Nucleo-H743ZI2: starts the newer image, or the one before it where that has not
//! proved itself (`firmware::update::slots`). It runs on the oscillator that the chip starts with,
//! has no interrupts and leaves every peripheral as it was. Ran on no chip yet.
#![no_std]
#![no_main]

#[allow(dead_code, reason = "the loader neither erases nor reports errors")]
#[path = "../../layer/src/flash.rs"]
mod flash;

use cortex_m::peripheral::SCB;
use embassy_stm32::flash::Flash;
use embassy_stm32::peripherals;
use firmware::update::Slots;
use firmware::update::slots::Places;
use flash::Region;

/// As in `h743`.
const PLACES: Places = Places {
    base: 0x0800_0000,
    slots: [0x2_0000, 0x10_0000],
    len: 0xC_0000,
};

#[cortex_m_rt::entry]
fn main() -> ! {
    if let Some(slot) = to_start() {
        start(PLACES.address(slot));
    }
    loop {
        cortex_m::asm::wfi(); // no image: a probe can write one
    }
}

/// By itself, so that nothing of the flash is in use when the image starts.
#[inline(never)]
fn to_start() -> Option<usize> {
    // SAFETY: nobody else uses it.
    #[allow(unsafe_code, reason = "the drivers need no other start")]
    let flash = unsafe { peripherals::FLASH::steal() };
    let region = Region::<_, 0, 0x20_0000, 0x2_0000>::new(Flash::new_blocking(flash));
    Slots::new(region, PLACES)?.to_start()
}

#[allow(unsafe_code, reason = "another program begins")]
fn start(at: u32) -> ! {
    // SAFETY: the loader is over, and no interrupt is on. The slot begins with a table of vectors:
    // its digest was good, or a probe has written it.
    unsafe {
        (*SCB::PTR).vtor.write(at);
        cortex_m::asm::bootload(at as *const u32)
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    SCB::sys_reset()
}
