//! A queue between two priorities: one end puts, the other takes, and neither waits.
//!
//! It is `heapless::spsc` with the capacity in the type of both ends. There the remainder by a
//! length that is not known can panic, and the frame path must not.
//!
//! A value is written into its slot before `pushed` says so, and has left it before `taken` does.
//! So a slot is never used from both ends at once. `tests/orders` tries every order of the steps of
//! the two ends.
//!
//! Numbers that are further apart than there are slots are those of upset memory. Then all that
//! waits is dropped, since no slot may hold a value.

use super::atomics::{AtomicUsize, Ordering};
use super::slot::Slot;

/// Room for `N` values, a power of two. What is left in it when it ends is not dropped.
#[derive(Debug)]
pub struct Queue<T, const N: usize> {
    slots: [Slot<T>; N],
    /// Numbers of values that have been put and taken, modulo 2^32 or 2^64.
    pushed: AtomicUsize,
    taken: AtomicUsize,
}

impl<T, const N: usize> Queue<T, N> {
    /// Empty.
    #[expect(clippy::new_without_default, reason = "it is for statics")]
    pub const fn new() -> Queue<T, N> {
        Queue::after(0)
    }

    /// Empty, after so many values have passed.
    pub(super) const fn after(passed: usize) -> Queue<T, N> {
        const { assert!(N.is_power_of_two()) };
        Queue {
            slots: [const { Slot::new() }; N],
            pushed: AtomicUsize::new(passed),
            taken: AtomicUsize::new(passed),
        }
    }

    /// The number of values that have been put, or taken, in upset memory.
    #[cfg(test)]
    #[allow(
        dead_code,
        reason = "`tests/orders` compiles this file without the test"
    )]
    pub(super) fn upset(&mut self, put: bool, bit: u32) {
        let number = if put { &self.pushed } else { &self.taken };
        number.store(number.load(Ordering::Relaxed) ^ 1 << bit, Ordering::Relaxed);
    }

    /// The two ends of the queue.
    pub fn split(&mut self) -> (Producer<'_, T, N>, Consumer<'_, T, N>) {
        (Producer(self), Consumer(self))
    }

    fn slot(&self, count: usize) -> &Slot<T> {
        &self.slots[count % N] // a constant power of two: the compiler sees that it is within
    }
}

/// The end that puts.
#[derive(Debug)]
pub struct Producer<'q, T, const N: usize>(&'q Queue<T, N>);

impl<T, const N: usize> Producer<'_, T, N> {
    /// Whether there is room.
    pub fn has_room(&self) -> bool {
        let Queue { pushed, taken, .. } = self.0;
        let waiting = pushed.load(Ordering::Relaxed);
        waiting.wrapping_sub(taken.load(Ordering::Acquire)) < N
    }

    /// All that was put has been taken.
    pub fn is_empty(&self) -> bool {
        let Queue { pushed, taken, .. } = self.0;
        pushed.load(Ordering::Relaxed) == taken.load(Ordering::Acquire)
    }

    /// Puts a value at the end. False: there is no room.
    #[must_use]
    pub fn put(&mut self, value: T) -> bool {
        if !self.has_room() {
            return false;
        }
        let pushed = self.0.pushed.load(Ordering::Relaxed);
        self.0.slot(pushed).write(value);
        self.0
            .pushed
            .store(pushed.wrapping_add(1), Ordering::Release);
        true
    }
}

/// The end that takes.
#[derive(Debug)]
pub struct Consumer<'q, T, const N: usize>(&'q Queue<T, N>);

impl<T, const N: usize> Consumer<'_, T, N> {
    /// A value waits.
    pub fn waits(&self) -> bool {
        let Queue { pushed, taken, .. } = self.0;
        taken.load(Ordering::Relaxed) != pushed.load(Ordering::Acquire)
    }

    /// Takes the oldest value.
    pub fn take(&mut self) -> Option<T> {
        let taken = self.0.taken.load(Ordering::Relaxed);
        let pushed = self.0.pushed.load(Ordering::Acquire);
        match pushed.wrapping_sub(taken) {
            0 => return None,
            waiting if waiting > N => {
                self.0.taken.store(pushed, Ordering::Release);
                return None;
            }
            _ => {}
        }
        let value = self.0.slot(taken).read();
        self.0.taken.store(taken.wrapping_add(1), Ordering::Release);
        Some(value)
    }
}
