//! The learner from fixes in core-coupled memory (RM0090, section 2.3.1). Only the core reaches
//! these 64 KiB, so its matrices and the DMA of the lines never wait for each other.
//!
//! The start-up code neither loads nor zeroes this memory: after power-on it holds anything, after
//! another reset what was there before. So it is declared as not initialised, and [`learner`]
//! writes all of it before anyone reads it. Nothing else lies there (`tests/qemu/tests/cost.rs`),
//! above all no buffer of the DMA.
//!
//! QEMU 7.2's machine has no such memory, but 64 KiB more of SRAM behind that of the chip, where
//! nothing of the image lies. The learner is put there if the memory neither has a clock that can
//! be switched on, as on the chip, nor can be read. QEMU 8 has the memory, and no clocks.
#![allow(
    unsafe_code,
    reason = "memory of its own; each block says why it is sound"
)]

use core::mem::MaybeUninit;
use core::ptr;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::peripheral::SCB;
use firmware::learn::FixMemory;
use stm32f4::stm32f405::RCC;

// SAFETY: `memory.x` places this section in core-coupled memory. Nothing is loaded into it and
// nothing zeroes it, which suits `MaybeUninit`.
#[unsafe(link_section = ".ccm")]
static mut LEARNER: MaybeUninit<FixMemory> = MaybeUninit::uninit();
static TAKEN: AtomicBool = AtomicBool::new(false);

/// What QEMU 7.2 has more than the chip.
const BEYOND: *mut MaybeUninit<FixMemory> = ptr::without_provenance_mut(0x2002_0000);
const _: () = assert!(size_of::<FixMemory>() <= 0x1_0000);

/// Its memory, blank; `None` when it has been handed out. Called before any interrupt is let
/// through.
pub fn learner() -> Option<&'static mut FixMemory> {
    if TAKEN.swap(true, Ordering::Relaxed) {
        return None;
    }
    let coupled = &raw mut LEARNER;
    let place = if has_clock() || can_read(coupled.cast()) {
        coupled
    } else {
        BEYOND
    };
    // SAFETY: only here, and only once, as `TAKEN` says. Behind the chip's SRAM nothing else lies.
    let place = unsafe { place.as_mut() }?;
    Some(place.write(FixMemory::ZEROED))
}

/// Switches the memory's clock on. Whether there is one.
fn has_clock() -> bool {
    // SAFETY: no driver uses this register yet. The bit is set after a reset; a boot loader may
    // have cleared it. The register is read back, since a clock needs two cycles to take effect
    // (errata sheet ES0182, delay after an RCC peripheral clock enabling).
    let clocks = unsafe { &*RCC::ptr() }.ahb1enr();
    clocks.modify(|_, w| w.ccmdataramen().set_bit());
    clocks.read().ccmdataramen().bit_is_set()
}

/// Whether there is memory at this address. Where there is none, reading it is a fault of the bus,
/// which is let through for this one reading and otherwise is a fault like any other.
fn can_read(address: *const u32) -> bool {
    const BUS_FAULTS: u32 = 1 << 17; // SHCSR (Armv7-M B3.2.13)
    const FLAGS: u32 = 0xFF00; // of CFSR: those of the bus, cleared by ones (B3.2.15)
    // SAFETY: no interrupt is let through yet, so nobody else uses these registers.
    unsafe {
        let scb = &*SCB::PTR;
        scb.shcsr.modify(|bits| bits | BUS_FAULTS);
        let read = reads(address) != 0;
        scb.shcsr.modify(|bits| bits & !BUS_FAULTS);
        scb.cfsr.write(FLAGS);
        read
    }
}

/// Reads a word: 1, or 0 if that is a fault of the bus.
#[unsafe(naked)]
unsafe extern "C" fn reads(_: *const u32) -> u32 {
    core::arch::naked_asm!("ldr r1, [r0]", "movs r0, #1", "bx lr")
}

/// The reading in [`reads`] was a fault: it goes on with the last of its three instructions, each
/// of two bytes, and 0 in r0. The core has stacked r0 first and the address of the instruction at
/// 24 (Armv7-M B1.5.6).
// SAFETY: `cortex-m-rt` expects this name, and nothing else in the image has it.
#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn BusFault() {
    core::arch::naked_asm!(
        "mrs r0, msp",
        "ldr r1, [r0, #24]",
        "adds r1, #4",
        "str r1, [r0, #24]",
        "movs r1, #0",
        "str r1, [r0]",
        "bx lr",
    )
}
