//! Bytes between an interrupt and the loop: lock-free, one side pushes, the other pops.
//!
//! As `firmware::link::ring`, over atomics instead of `heapless`: that queue divides by a length it only knows at run time, and
//! the division by zero that cannot happen is still a panic in the image, which `budgets.toml` does not allow.

use core::sync::atomic::{AtomicU8, AtomicU32, AtomicUsize, Ordering};

use firmware::link::Lost;

/// Storage of a ring for `N` bytes, `N` a power of two.
pub struct Ring<const N: usize> {
    bytes: [AtomicU8; N],
    counts: Counts,
}

/// Since start, modulo 2^32; each has one writer.
struct Counts {
    /// By the inlet.
    pushed: AtomicUsize,
    /// By the outlet.
    popped: AtomicUsize,
    /// By the inlet: times that bytes were lost.
    lost: AtomicU32,
}

impl<const N: usize> Ring<N> {
    /// An empty one.
    pub const fn new() -> Self {
        const { assert!(N.is_power_of_two(), "counts run freely and are masked") };
        Self {
            bytes: [const { AtomicU8::new(0) }; N],
            counts: Counts {
                pushed: AtomicUsize::new(0),
                popped: AtomicUsize::new(0),
                lost: AtomicU32::new(0),
            },
        }
    }

    /// Its two ends, of which each may be in another context.
    pub fn split(&'static mut self) -> (Inlet, Outlet) {
        let inlet = Inlet {
            bytes: &self.bytes,
            counts: &self.counts,
        };
        let outlet = Outlet {
            bytes: &self.bytes,
            counts: &self.counts,
            seen: 0,
        };
        (inlet, outlet)
    }
}

/// Where bytes go in.
pub struct Inlet {
    bytes: &'static [AtomicU8],
    counts: &'static Counts,
}

impl Inlet {
    /// Bytes that find room now.
    pub fn room(&self) -> usize {
        let popped = self.counts.popped.load(Ordering::Acquire);
        let used = self
            .counts
            .pushed
            .load(Ordering::Relaxed)
            .wrapping_sub(popped);
        self.bytes.len().saturating_sub(used)
    }

    /// Puts a byte in; one that finds no room is lost, and the outlet's reader is told.
    pub fn push(&mut self, byte: u8) {
        let pushed = self.counts.pushed.load(Ordering::Relaxed);
        match self.bytes.get(pushed & (self.bytes.len().wrapping_sub(1))) {
            Some(place) if self.room() > 0 => {
                place.store(byte, Ordering::Relaxed);
                self.counts
                    .pushed
                    .store(pushed.wrapping_add(1), Ordering::Release);
            }
            _ => self.mark_lost(),
        }
    }

    /// Tells the outlet's reader that bytes were lost before they came here: a UART's overrun or framing error.
    pub fn mark_lost(&mut self) {
        let lost = self.counts.lost.load(Ordering::Relaxed); // a single writer: no read-modify-write is needed
        self.counts
            .lost
            .store(lost.wrapping_add(1), Ordering::Relaxed);
    }
}

/// Where bytes come out.
pub struct Outlet {
    bytes: &'static [AtomicU8],
    counts: &'static Counts,
    /// Losses told already.
    seen: u32,
}

impl Outlet {
    /// The oldest byte.
    pub fn pop(&mut self) -> Option<u8> {
        let popped = self.counts.popped.load(Ordering::Relaxed);
        if self.counts.pushed.load(Ordering::Acquire) == popped {
            return None;
        }
        let place = self
            .bytes
            .get(popped & (self.bytes.len().wrapping_sub(1)))?;
        let byte = place.load(Ordering::Relaxed);
        self.counts
            .popped
            .store(popped.wrapping_add(1), Ordering::Release);
        Some(byte)
    }

    /// What is there, at most as much as `buffer` holds.
    ///
    /// # Errors
    /// [`Lost`], once, when bytes were lost since the last call.
    pub fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        let lost = self.counts.lost.load(Ordering::Relaxed);
        if core::mem::replace(&mut self.seen, lost) != lost {
            return Err(Lost);
        }
        let mut read = 0;
        for place in buffer {
            let Some(byte) = self.pop() else {
                break;
            };
            *place = byte;
            read += 1;
        }
        Ok(read)
    }
}
