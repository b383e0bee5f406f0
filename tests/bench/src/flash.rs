//! Flash stricter than any chip: a byte is written once per erase, and power fails at any byte.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

/// Flash with power cuts, with units of erasing, writing and reading, bytes.
#[derive(Debug, Clone)]
pub struct Flash<const ERASE: usize = 4096, const WRITE: usize = 4, const READ: usize = 1> {
    /// The content.
    pub bytes: Vec<u8>,
    /// Bytes that must be erased before they are written.
    pub written: Vec<bool>,
    /// So many bytes may still be erased or written; the byte at which power fails holds
    /// anything.
    pub left: usize,
    /// Value of the byte at the cut.
    pub torn: u8,
    /// Bytes erased or written in all.
    pub work: usize,
    /// Bytes erased.
    pub erased: usize,
    /// Bytes that do not take what is written to them.
    pub stuck: Vec<usize>,
    /// Nothing changes any more, and nothing is reported.
    pub dead: bool,
}

/// Why flash was not changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// Power has failed.
    PowerCut,
    /// The chip would have been misused: never allowed.
    Misuse,
}

impl NorFlashError for Failure {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl<const ERASE: usize, const WRITE: usize, const READ: usize> Flash<ERASE, WRITE, READ> {
    /// Never erased.
    #[must_use]
    pub fn new(capacity: usize) -> Self {
        Self {
            bytes: vec![0xA5; capacity],
            written: vec![true; capacity],
            left: usize::MAX,
            torn: 0,
            work: 0,
            erased: 0,
            stuck: Vec::new(),
            dead: false,
        }
    }

    /// Erased.
    #[must_use]
    pub fn blank(capacity: usize) -> Self {
        Self {
            bytes: vec![0xFF; capacity],
            written: vec![false; capacity],
            ..Self::new(0)
        }
    }

    /// What another flash held; it must be erased before it is written.
    #[must_use]
    pub fn holding(bytes: Vec<u8>) -> Self {
        Self {
            written: vec![true; bytes.len()],
            bytes,
            ..Self::new(0)
        }
    }

    fn change(&mut self, at: usize, value: u8) -> Result<(), Failure> {
        if self.left == 0 {
            return Err(Failure::PowerCut);
        } else if self.dead {
            return Ok(());
        }
        self.left -= 1;
        self.work += 1;
        if self.left == 0 {
            self.bytes[at] = self.torn;
            // a byte that still reads as erased may be written: it has no check bits of its own
            self.written[at] = self.torn != 0xFF;
            return Err(Failure::PowerCut);
        }
        self.bytes[at] = value ^ u8::from(self.stuck.contains(&at));
        Ok(())
    }
}

impl<const ERASE: usize, const WRITE: usize, const READ: usize> ErrorType
    for Flash<ERASE, WRITE, READ>
{
    type Error = Failure;
}

impl<const ERASE: usize, const WRITE: usize, const READ: usize> ReadNorFlash
    for Flash<ERASE, WRITE, READ>
{
    const READ_SIZE: usize = READ;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failure> {
        let content = self.bytes.get(offset as usize..);
        let content = content.and_then(|content| content.get(..bytes.len()));
        bytes.copy_from_slice(content.ok_or(Failure::Misuse)?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const ERASE: usize, const WRITE: usize, const READ: usize> NorFlash
    for Flash<ERASE, WRITE, READ>
{
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Failure> {
        let (from, to) = (from as usize, to as usize);
        if !from.is_multiple_of(ERASE) || !to.is_multiple_of(ERASE) || to > self.bytes.len() {
            return Err(Failure::Misuse);
        }
        // from the middle, as no one should rely on an order
        for at in (from..to).map(|at| from + (at - from + ERASE / 2) % (to - from)) {
            self.change(at, 0xFF)?;
            self.written[at] = false;
            self.erased += 1;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failure> {
        let offset = offset as usize;
        if !offset.is_multiple_of(WRITE) || !bytes.len().is_multiple_of(WRITE) {
            return Err(Failure::Misuse);
        }
        for (at, &byte) in (offset..).zip(bytes) {
            if self.written.get(at).is_none_or(|written| *written) {
                return Err(Failure::Misuse);
            }
            self.change(at, byte)?;
            self.written[at] = true;
        }
        Ok(())
    }
}
