//! What cuts frames through, for the sensor's interrupt and the frame path.
#![allow(
    unsafe_code,
    reason = "what interrupt and loop share; each block says why it is sound"
)]

use core::cell::UnsafeCell;

use cortex_m::interrupt;
use firmware::link::cut::Cut;

struct Shared(UnsafeCell<Cut>);

// SAFETY: there is one core, and `masked_cut` alone touches it, with interrupts masked.
unsafe impl Sync for Shared {}

static CUT: Shared = Shared(UnsafeCell::new(Cut::new()));

/// Lets `work` have it. It does not call this again.
#[inline(always)]
pub fn masked_cut<R>(work: impl FnOnce(&mut Cut) -> R) -> R {
    // SAFETY: no interrupt comes in between, and `work` has no other way to it: no closure in the
    // images calls this function.
    interrupt::free(|_| work(unsafe { &mut *CUT.0.get() }))
}

/// [`masked_cut`] in the form that a port of the frame path takes.
pub fn masked(work: &mut dyn FnMut(&mut Cut)) {
    masked_cut(work);
}
