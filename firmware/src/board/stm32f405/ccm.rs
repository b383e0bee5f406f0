//! The learner from fixes in core-coupled memory (RM0090, section 2.3.1). Only the core reaches
//! these 64 KiB, so its matrices and the DMA of the lines never wait for each other.
//!
//! The start-up code neither loads nor zeroes this memory: after power-on it holds anything, after
//! another reset what was there before. So it is declared as not initialised, and [`learner`]
//! writes all of it before anyone reads it. Nothing else lies there (`tests/qemu/tests/cost.rs`),
//! above all no buffer of the DMA.
//!
//! QEMU 7.2's machine has no such memory. Its image is the same code, linked with this section in
//! RAM (`link.args`, `memory.x`).
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

/// Its memory, blank; `None` when it has been handed out.
pub fn learner() -> Option<&'static mut FixMemory> {
    if TAKEN.swap(true, Ordering::Relaxed) {
        return None;
    }
    // SAFETY: no driver uses this register yet. The bit is set after a reset; a boot loader may
    // have cleared it. The register is read back, since a clock needs two cycles to take effect
    // (errata sheet ES0182, delay after an RCC peripheral clock enabling).
    let clocks = unsafe { &*RCC::ptr() }.ahb1enr();
    clocks.modify(|_, w| w.ccmdataramen().set_bit());
    let _ = clocks.read();
    // SAFETY: only here, and only once, as `TAKEN` says.
    let place = unsafe { (&raw mut LEARNER).as_mut() }?;
    Some(place.write(FixMemory::ZEROED))
}
