//! The store: two slots in flash, of which one always holds the last good record of weights and
//! configuration.
//!
//! A new record goes into the slot that is not in use. So power may fail at any moment: afterwards
//! either the old record or the new one is found. Without a good slot the device has the built-in
//! networks and no configuration.
//!
//! A slot is one erase unit or several. In a large one there is room for more records behind the
//! first, and the one with the greatest generation counts. A record begins at a multiple of 64
//! bytes of its slot. It is little-endian, padded with FF to a multiple of 64 bytes:
//!
//! | offset | length | content |
//! |---|---|---|
//! | 0 | 4 | magic `LRNS` |
//! | 4 | 4 | version of this format, 3 |
//! | 8 | 4 | generation: the greater one (modulo 2^32) is the newer |
//! | 12 | 2 | length a of the images, 608 |
//! | 14 | 2 | length b of the rest, 2 + c + d |
//! | 16 | a | the gyro network's image, then the accelerometer network's |
//! | 16 + a | 2 | length c of the configuration record; 0: none |
//! | 18 + a | c | the configuration record ([`crate::configuration::record`]) |
//! | 18 + a + c | d | the memory: [`Notes`], then what the learner took down; or nothing |
//! | 16 + a + b | 4 | CRC-32 (zlib's) of bytes 0..16 + a + b |
//!
//! In version 2 the rest is the configuration record alone. Version 1 has no rest. Every later
//! version keeps this frame of magic, version, generation, two lengths and CRC, so that an older
//! firmware tells a newer record from a damaged one. It reports [`Newer`] and overwrites nothing.
//!
//! Weights, configuration and memory are in one record, so weights are always found with the
//! configuration, and so the sensor, that they were in use with.
//!
//! Erasing halts most processors while it lasts (STM32F405: 1 to 2 s for a sector of 128 KiB). So
//! [`Store::save`], which erases, is for bypass and on command only. The frames lost meanwhile show
//! as a gap in the sensor's counter. [`Store::begin`] and [`Store::go_on`] write behind the newest
//! record and erase nothing. They write 64 bytes at a time (STM32F405: 16 words of 16 us) and are
//! for what is learnt while samples are corrected. The checksum comes last: a record that was cut
//! off is none. When a slot is full, [`Store::make_room`] erases at the next power-on.

mod content;
mod find;
mod write;

pub use content::{Content, MEMORY_MAX, Memory, NOTES_LEN, Notes, unit};

use crate::configuration::record::{MAX_LEN, Record};
use crate::model::{IMAGES_LEN, Nets};
use content::COUNT_LEN;
use embedded_storage::nor_flash::NorFlash;
use find::Header;
use write::Written;

/// Bytes of the longest record before padding.
pub const RECORD_LEN: usize = HEADER_LEN + IMAGES_LEN + COUNT_LEN + MAX_LEN + MEMORY_MAX + CRC_LEN;

const MAGIC: [u8; 4] = *b"LRNS";
const VERSION: u32 = 3;
/// The rest of older ones is the configuration record alone.
const WITH_MEMORY: u32 = 3;
/// Versions that are read.
const OLDEST: u32 = 1;
const HEADER_LEN: usize = 16;
const CRC_LEN: usize = 4;
/// A record is padded to a multiple of this and begins at one: good for all units of writing up to
/// it. Flash is read and written in pieces of this size.
const PIECE: usize = 64;
/// The longest record padded.
const PADDED_LEN: usize = RECORD_LEN.next_multiple_of(PIECE);
/// The longest record without its memory, padded.
const HEAD_LEN: usize =
    (HEADER_LEN + IMAGES_LEN + COUNT_LEN + MAX_LEN + CRC_LEN).next_multiple_of(PIECE);

/// Why nothing was stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Error<E> {
    /// The flash is too small for two slots, or its units do not fit the record.
    Geometry,
    /// The flash reports an error.
    Flash(E),
    /// The record does not read back as written.
    Verify,
    /// The store holds a record of a newer firmware, which stays.
    Newer(Newer),
    /// There is no room behind the newest record, or there is no record.
    Full,
    /// Nothing was begun, or what is to be stored is not what was begun.
    NotBegun,
}

/// How far a record is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// Stored.
    Done,
    /// Not stored; the newest good record is still the previous one.
    Failed,
    /// More is to be written.
    GoesOn,
}

impl From<bool> for Progress {
    fn from(done: bool) -> Progress {
        if done {
            Progress::Done
        } else {
            Progress::Failed
        }
    }
}

/// How something is to be stored now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// As a whole. The processor may halt for long.
    Save,
    /// Behind the newest record: the first piece.
    Begin,
    /// The next piece of the same.
    GoOn,
}

/// The newest record is of a newer firmware, whose version of the format this is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Newer(pub u32);

/// The record found.
#[derive(Debug, Clone, PartialEq)]
pub struct Stored {
    /// Both networks.
    pub nets: Nets,
    /// The configuration record; empty without one. Its own frame is not checked here.
    pub record: Record,
    /// Counts the records stored.
    pub generation: u32,
    /// Where it begins.
    at: u32,
}

/// A store.
#[derive(Debug)]
pub struct Store<F> {
    flash: F,
    slot_len: u32,
    /// The newest good record, once it has been looked for: where it begins, and its header.
    newest: Option<(u32, Header)>,
    /// The record in progress.
    written: Option<Written>,
}

impl<F: NorFlash> Store<F> {
    /// Over a region of flash that only the store uses.
    ///
    /// # Errors
    /// [`Error::Geometry`]
    pub fn new(flash: F) -> Result<Store<F>, Error<F::Error>> {
        let erase = F::ERASE_SIZE.max(1);
        let slot_len = PADDED_LEN.next_multiple_of(erase);
        let units = [F::WRITE_SIZE, F::READ_SIZE];
        let fits = units
            .iter()
            .all(|&unit| unit > 0 && PIECE.is_multiple_of(unit));
        match u32::try_from(slot_len) {
            Ok(len) if fits && flash.capacity() / 2 >= slot_len => Ok(Store {
                flash,
                slot_len: len,
                newest: None,
                written: None,
            }),
            _ => Err(Error::Geometry),
        }
    }

    /// The newest good record; `None` when there is none.
    ///
    /// # Errors
    /// [`Newer`]
    pub fn load(&mut self) -> Result<Option<Stored>, Newer> {
        let mut before = None;
        while let Some((at, header)) = self.newest_before(before) {
            if let Some(stored) = self.read(at)? {
                self.newest = Some((at, header));
                return Ok(Some(stored));
            }
            before = Some(header.generation);
        }
        self.newest = None;
        Ok(None)
    }

    /// The flash.
    pub fn into_inner(self) -> F {
        self.flash
    }

    fn start(&self, slot: usize) -> u32 {
        if slot == 0 { 0 } else { self.slot_len }
    }
}

#[cfg(test)]
mod tests;
