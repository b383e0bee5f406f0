//! Memory of the black box. Nothing initialises it, so that a reset leaves what it holds.
#![allow(
    unsafe_code,
    reason = "memory that no code initialises; each block says why it is sound"
)]

use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, Ordering};

use firmware::app::blackbox::Memory;

// SAFETY: `cortex-m-rt` places this section in RAM, and neither loads nor zeroes it, which suits
// `MaybeUninit`. Nor does it that of a Cortex-M7 (`memory.x`): a reset forgets what is in the data
// cache alone, and memory beside the core has no cache.
#[cfg_attr(not(feature = "m7"), unsafe(link_section = ".uninit.blackbox"))]
#[cfg_attr(feature = "m7", unsafe(link_section = ".uncached.blackbox"))]
static mut MEMORY: MaybeUninit<Memory> = MaybeUninit::uninit();
static TAKEN: AtomicBool = AtomicBool::new(false);

/// The memory, with what it held before a reset or with any bytes; `None` when it has been handed
/// out.
pub fn memory() -> Option<&'static mut Memory> {
    if TAKEN.swap(true, Ordering::Relaxed) {
        return None;
    }
    // The compiler must not conclude from the missing initial value what the memory holds.
    let place = core::hint::black_box(&raw mut MEMORY).cast::<Memory>();
    // SAFETY: only here, and only once, as `TAKEN` says. It consists of bytes alone, so that any
    // content is valid, and RAM always has one.
    unsafe { place.as_mut() }
}
