//! Memory of one value in a [`spsc`](super::spsc) queue.
#![allow(
    unsafe_code,
    reason = "memory that two priorities share; each block says why it is sound"
)]

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

/// Memory for a value. [`super::spsc`] says when it holds one, and who may touch it.
#[derive(Debug)]
pub(super) struct Slot<T>(UnsafeCell<MaybeUninit<T>>);

// SAFETY: the ends of the queue never use a slot at once, and values pass from one to the other.
unsafe impl<T: Send> Sync for Slot<T> {}

impl<T> Slot<T> {
    /// A slot without a value.
    pub const fn new() -> Slot<T> {
        Slot(UnsafeCell::new(MaybeUninit::uninit()))
    }

    /// Called by the producer, while the queue counts no value here.
    pub fn write(&self, value: T) {
        // SAFETY: the other end reads only what is counted.
        unsafe { (*self.0.get()).write(value) };
    }

    /// Called by the consumer, once for each value counted here.
    pub fn read(&self) -> T {
        // SAFETY: it was written before it was counted, and the other end writes again only when it
        // is counted as taken.
        unsafe { (*self.0.get()).assume_init_read() }
    }
}
