//! The learner from fixes in core-coupled memory (RM0090, section 2.3.1). Only the core reaches
//! these 64 KiB, so its matrices and the DMA of the lines never wait for each other.
//!
//! QEMU 7.2's machine has no such memory. Its enable bit reads 0 there.
#![allow(
    unsafe_code,
    reason = "memory of its own; each block says why it is sound"
)]

use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, Ordering};

use firmware::learn::FixMemory;
use stm32f4::stm32f405::RCC;

// SAFETY: `memory.x` places this section in core-coupled memory. Nothing is loaded into it and
// nothing zeroes it, which suits `MaybeUninit`.
#[unsafe(link_section = ".ccm")]
static mut LEARNER: MaybeUninit<FixMemory> = MaybeUninit::uninit();
static TAKEN: AtomicBool = AtomicBool::new(false);

/// Its memory, blank; `None` where there is no such memory, or when it has been handed out.
pub fn learner() -> Option<&'static mut FixMemory> {
    // SAFETY: a register that may be read at any time, and reading it does nothing.
    let clocks = unsafe { &*RCC::ptr() }.ahb1enr().read();
    // set at reset, and nobody clears it
    if !clocks.ccmdataramen().bit_is_set() || TAKEN.swap(true, Ordering::Relaxed) {
        return None;
    }
    // SAFETY: only here, and only once, as `TAKEN` says.
    let place = unsafe { (&raw mut LEARNER).as_mut() }?;
    Some(place.write(FixMemory::ZEROED))
}
