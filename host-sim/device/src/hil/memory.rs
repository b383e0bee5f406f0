//! Lines, a clock and flash in memory, for the application on the desktop.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use firmware::link::{Clock, Full, Line, Lost};
use std::collections::VecDeque;

/// A line in memory.
#[derive(Debug, Default)]
pub struct MemoryLine {
    /// Bytes that the application has not received yet.
    pub received: VecDeque<u8>,
    /// Bytes that it has sent.
    pub sent: Vec<u8>,
}

impl Line for MemoryLine {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        let len = buffer.len().min(self.received.len());
        let (first, second) = self.received.as_slices();
        let first = &first[..len.min(first.len())];
        buffer[..first.len()].copy_from_slice(first);
        buffer[first.len()..len].copy_from_slice(&second[..len - first.len()]);
        self.received.drain(..len);
        Ok(len)
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        self.sent.extend_from_slice(message);
        Ok(())
    }
}

/// A clock that its owner sets, microseconds.
#[derive(Debug, Default)]
pub struct SetClock(pub u64);

impl Clock for SetClock {
    fn now_us(&self) -> u64 {
        self.0
    }
}

/// Flash in memory, of two slots of a store: the two sectors of an STM32F405's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MemoryFlash(pub Vec<u8>);

/// Bytes of a [`MemoryFlash`].
const FLASH_LEN: usize = 2 * MemoryFlash::ERASE_SIZE;

impl Default for MemoryFlash {
    /// Erased.
    fn default() -> Self {
        Self(vec![0xFF; FLASH_LEN])
    }
}

/// An access outside of the flash.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outside;

impl NorFlashError for Outside {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::OutOfBounds
    }
}

impl ErrorType for MemoryFlash {
    type Error = Outside;
}

impl ReadNorFlash for MemoryFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Outside> {
        let from = offset as usize;
        let held = self.0.get(from..from + bytes.len()).ok_or(Outside)?;
        bytes.copy_from_slice(held);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for MemoryFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 128 << 10;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Outside> {
        let held = self.0.get_mut(from as usize..to as usize).ok_or(Outside)?;
        held.fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Outside> {
        let from = offset as usize;
        let held = self.0.get_mut(from..from + bytes.len()).ok_or(Outside)?;
        for (held, byte) in held.iter_mut().zip(bytes) {
            *held &= byte; // only an erase sets bits
        }
        Ok(())
    }
}
