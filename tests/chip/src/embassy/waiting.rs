//! An executor of one task, which sleeps until an interrupt wakes it. With
//! `embassy_futures::block_on`, which polls without a pause, each read of the ring would return one
//! byte.

#![allow(unsafe_code)]

use core::pin::pin;
use core::ptr::null;
use core::sync::atomic::{AtomicBool, Ordering};
use core::task::{Context, Poll, RawWaker, RawWakerVTable, Waker};

static WOKEN: AtomicBool = AtomicBool::new(false);

static TABLE: RawWakerVTable = RawWakerVTable::new(
    |_| RawWaker::new(null(), &TABLE),
    |_| WOKEN.store(true, Ordering::Release),
    |_| WOKEN.store(true, Ordering::Release),
    |_| {},
);

/// Runs a future and returns its result.
pub fn wait_for<T>(future: impl Future<Output = T>) -> T {
    let mut future = pin!(future);
    // SAFETY: the functions of the table use no data.
    let waker = unsafe { Waker::from_raw(RawWaker::new(null(), &TABLE)) };
    let mut context = Context::from_waker(&waker);
    loop {
        if let Poll::Ready(done) = future.as_mut().poll(&mut context) {
            return done;
        }
        // a masked interrupt ends the sleep, so none is missed
        cortex_m::interrupt::free(|_| {
            while !WOKEN.swap(false, Ordering::Acquire) {
                cortex_m::asm::wfi();
                // SAFETY: unmasked while the pending interrupts are served.
                unsafe { cortex_m::interrupt::enable() };
                cortex_m::asm::isb();
                cortex_m::interrupt::disable();
            }
        });
    }
}
