//! Files of the machine that runs QEMU, by semihosting.

use core::ffi::CStr;

use cortex_m_semihosting::{nr, syscall};

/// An open file. It is never closed: the program ends after its last file.
pub struct File(usize);

impl File {
    /// Opens for reading.
    pub fn open(name: &CStr) -> Option<Self> {
        Self::with_mode(name, nr::open::R_BINARY)
    }

    /// Creates a file for writing.
    pub fn create(name: &CStr) -> Option<Self> {
        Self::with_mode(name, nr::open::W_TRUNC_BINARY)
    }

    fn with_mode(name: &CStr, mode: usize) -> Option<Self> {
        let text = name.to_bytes();
        // SAFETY: the address of a text that ends with 0, and its length without it, as SYS_OPEN
        // wants.
        let handle = unsafe { syscall!(OPEN, name.as_ptr(), mode, text.len()) };
        (handle != usize::MAX).then_some(Self(handle))
    }

    /// Fills `buffer` as far as the file goes; returns how many bytes were read.
    pub fn read(&mut self, buffer: &mut [u8]) -> usize {
        // SAFETY: address and length of memory that is ours alone during the call, as SYS_READ
        // wants.
        let left = unsafe { syscall!(READ, self.0, buffer.as_mut_ptr(), buffer.len()) };
        buffer.len().saturating_sub(left)
    }

    /// Writes everything; returns whether that was possible.
    #[must_use]
    pub fn write(&mut self, bytes: &[u8]) -> bool {
        // SAFETY: address and length of memory that nobody writes during the call, as SYS_WRITE
        // wants.
        let left = unsafe { syscall!(WRITE, self.0, bytes.as_ptr(), bytes.len()) };
        left == 0
    }
}
