//! A flash of two sectors in RAM that can fail.

use core::cell::Cell;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

/// Bytes of a sector: room for one record.
const SECTOR: usize = 4352;
/// Bytes of both sectors.
pub const LEN: usize = 2 * SECTOR;

/// The flash.
#[derive(Debug)]
pub struct Flash {
    bytes: [u8; LEN],
}

impl Flash {
    /// An erased flash.
    pub const BLANK: Flash = Flash { bytes: [0xFF; LEN] };

    /// Erases both sectors.
    pub fn clear(&mut self) {
        self.bytes.fill(0xFF);
    }
}

/// The flash in use. While `fails` is set, erasing and writing fail.
#[derive(Debug)]
pub struct Failing<'f> {
    pub flash: &'f mut Flash,
    pub fails: &'f Cell<bool>,
}

/// Erasing or writing failed, or was out of range.
#[derive(Debug, Clone, Copy)]
pub struct Failed;

impl NorFlashError for Failed {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for Failing<'_> {
    type Error = Failed;
}

impl ReadNorFlash for Failing<'_> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failed> {
        let from = self.flash.bytes.get(offset as usize..).ok_or(Failed)?;
        bytes.copy_from_slice(from.get(..bytes.len()).ok_or(Failed)?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        LEN
    }
}

impl NorFlash for Failing<'_> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Failed> {
        if self.fails.get() {
            return Err(Failed);
        }
        let sector = self.flash.bytes.get_mut(from as usize..to as usize);
        sector.ok_or(Failed)?.fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failed> {
        if self.fails.get() {
            return Err(Failed);
        }
        let target = self.flash.bytes.get_mut(offset as usize..).ok_or(Failed)?;
        let target = target.get_mut(..bytes.len()).ok_or(Failed)?;
        for (cell, byte) in target.iter_mut().zip(bytes) {
            if *cell != 0xFF {
                return Err(Failed); // a word is written once
            }
            *cell = *byte;
        }
        Ok(())
    }
}
