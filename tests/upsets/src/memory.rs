//! Memory as bytes.
#![allow(
    unsafe_code,
    reason = "this is what a particle does: bytes change under a running program"
)]

/// A named piece of memory with a fixed address until the program ends.
#[derive(Debug)]
pub struct Region {
    /// Name of its content.
    pub name: &'static str,
    start: *mut u8,
    len: usize,
}

impl Region {
    /// The memory of a value, which must not be moved and must own no heap memory: its bytes are
    /// copied and restored.
    pub fn of<T>(name: &'static str, value: *mut T) -> Region {
        Region {
            name,
            start: value.cast(),
            len: size_of::<T>(),
        }
    }

    /// Number of its bits.
    #[must_use]
    pub fn bits(&self) -> usize {
        8 * self.len
    }

    /// A copy of its bytes.
    #[must_use]
    pub fn copy(&self) -> Vec<u8> {
        let byte = |at| {
            // SAFETY: within the value, which lives for ever, and no other thread runs in it.
            // Volatile, since the compiler does not know that it changes this way.
            unsafe { self.start.add(at).read_volatile() }
        };
        (0..self.len).map(byte).collect()
    }

    /// Puts a copy back.
    pub fn put_back(&mut self, copy: &[u8]) {
        for (at, byte) in copy.iter().enumerate().take(self.len) {
            // SAFETY: as above.
            unsafe { self.start.add(at).write_volatile(*byte) };
        }
    }

    /// Flips a bit.
    pub fn flip(&mut self, bit: usize) {
        assert!(bit < self.bits(), "no such bit");
        // SAFETY: as above. The value may then be invalid for its type; that is the purpose.
        unsafe {
            let byte = self.start.add(bit / 8);
            byte.write_volatile(byte.read_volatile() ^ 1 << (bit % 8));
        }
    }
}

/// A value at an address from `Box::into_raw`, which is never freed.
pub(crate) fn lent<T>(value: *mut T) -> &'static mut T {
    // SAFETY: it lives for ever. The program is single-threaded, and nobody keeps another reference
    // while this one is used, except for the flips under test.
    unsafe { &mut *value }
}
