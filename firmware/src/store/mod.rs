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
//! | 4 | 4 | version of this format, 5 |
//! | 8 | 4 | generation: the greater one (modulo 2^32) is the newer |
//! | 12 | 2 | length a of the images, 684 |
//! | 14 | 2 | length b of the rest, 59 + c + d |
//! | 16 | a | the gyro network's image, the accelerometer network's, and the maps |
//! | 16 + a | 2 | length c of the configuration record; 0: none |
//! | 18 + a | 4 | the unit that all this is of: [`unit()`]; 0: not stated |
//! | 22 + a | 20 | the device's [`Life`] |
//! | 42 + a | 33 | the device's key ([`Key::to_bytes`]) |
//! | 75 + a | c | the configuration record ([`crate::configuration::record`]) |
//! | 75 + a + c | d | the memory: [`Notes`], then what the learner took down; or nothing |
//! | 16 + a + b | 4 | CRC-32 (zlib's) of bytes 0..16 + a + b |
//!
//! Up to version 4 there are no maps, and a is 608. Version 3 has neither unit nor life nor key. In
//! version 2 the rest is the configuration record alone. Version 1 has no rest. Every later version
//! keeps this frame of magic, version, generation, two lengths and CRC, so that an older firmware
//! distinguishes a newer record from a damaged one. It reports [`Newer`] and overwrites nothing.
//!
//! Weights, configuration and memory are in one record, so weights are always found with the
//! configuration, and so the sensor, that they were in use with.
//!
//! Flash wears out and forgets. A record that does not read back as written is not used: it goes to
//! the next position of the slot that retains it, and when the slot retains nothing any more,
//! behind the newest record in the other one. A record that no longer has its checksum is none; the
//! one before is used, and [`Stored::damaged`] reports it. A device that fails again and again with
//! the newest record can ask for the one before ([`Store::load_older`]), which is the last that it
//! ran with.
//!
//! Erasing halts most processors while it lasts (STM32F405: 1 to 2 s for a sector of 128 KiB). So
//! [`Store::save`], which erases, is for bypass and on command only. The frames lost meanwhile show
//! as a gap in the sensor's counter. [`Store::begin`] and [`Store::go_on`] write behind the newest
//! record and erase nothing. They write 64 bytes at a time (STM32F405: 16 words of 16 us) and are
//! for what is learnt while samples are corrected. The checksum comes last: a record that was cut
//! off is none. When a slot is full, [`Store::make_room`] erases at the next power-on.

mod content;
mod find;
mod life;
mod write;

pub use content::{Content, MEMORY_MAX, Memory, NOTES_LEN, Notes, unit};
pub use life::{LIFE_LEN, Life};

use crate::configuration::record::{MAX_LEN, Record};
use crate::model::{IMAGES_LEN, Nets};
use crate::wire::command::key::Key;
use content::FIXED_LEN;
use embedded_storage::nor_flash::NorFlash;
use find::Header;
use write::Written;

/// Bytes of the longest record before padding.
pub const RECORD_LEN: usize = HEADER_LEN + IMAGES_LEN + FIXED_LEN + MAX_LEN + MEMORY_MAX + CRC_LEN;

const MAGIC: [u8; 4] = *b"LRNS";
/// Version of this format.
pub const VERSION: u32 = 5;
/// The rest of older ones is the configuration record alone.
const WITH_MEMORY: u32 = 3;
/// Older ones have neither unit nor life.
const WITH_LIFE: u32 = 4;
/// The images of older ones have no maps.
const WITH_MAPS: u32 = 5;
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
    (HEADER_LEN + IMAGES_LEN + FIXED_LEN + MAX_LEN + CRC_LEN).next_multiple_of(PIECE);

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
    /// Nothing was begun, or the content is not the one that was begun.
    NotBegun,
}

/// Progress of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// Stored.
    Done,
    /// Not stored; the newest good record is the previous one.
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

/// Next step of storing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// As a whole. The processor may halt for long: where there is no room behind the newest
    /// record, the other slot is erased.
    Save,
    /// A changed key. The other slot is erased in any case: twice, and nothing older is left.
    /// [`Progress::GoesOn`]: it is stored, and a record with another key is still there.
    Renew,
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
    /// Counts the records stored, and those that failed.
    pub generation: u32,
    /// The unit that all this is of; `None`: the record does not state it.
    pub unit: Option<u32>,
    /// The device's life until then.
    pub life: Life,
    /// The device's key.
    pub key: Key,
    /// A record stored after this one cannot be read: it was damaged, or the power failed while it
    /// was written.
    pub damaged: bool,
    /// An older record can still be read, and it has another key.
    pub other_key: bool,
    /// Newer good records that were passed over: see [`Store::load_older`].
    pub passed: u8,
    /// Address of the record.
    at: u32,
}

/// A store.
#[derive(Debug)]
pub struct Store<F> {
    flash: F,
    slot_len: u32,
    /// The newest good record, once it has been looked for: where it begins, and its header.
    newest: Option<(u32, Header)>,
    /// Generation of the next record. No other has it, not even one that failed: it might read as a
    /// good one later.
    next: u32,
    /// The record in progress.
    written: Option<Written>,
    /// The device's life by the newest record found at start, and since then.
    before: Option<Life>,
    since: Life,
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
        let fits = units.iter().all(|&unit| PIECE.is_multiple_of(unit));
        match u32::try_from(slot_len) {
            Ok(len) if fits && flash.capacity() / 2 >= slot_len => Ok(Store {
                flash,
                slot_len: len,
                newest: None,
                next: 1,
                written: None,
                before: None,
                since: Life::default(),
            }),
            _ => Err(Error::Geometry),
        }
    }

    /// The newest good record; `None` when there is none.
    ///
    /// # Errors
    /// [`Newer`]
    pub fn load(&mut self) -> Result<Option<Stored>, Newer> {
        self.load_older(0)
    }

    /// The good record that `passed` newer good ones are passed over for. The next record still
    /// goes behind the newest.
    ///
    /// # Errors
    /// [`Newer`]
    pub fn load_older(&mut self, passed: u8) -> Result<Option<Stored>, Newer> {
        let (mut before, mut left) = (None, passed);
        self.newest = None;
        while let Some((at, header)) = self.newest_before(before) {
            if let Some(stored) = self.read(at)? {
                if self.newest.is_none() {
                    self.newest = Some((at, header));
                    self.next = header.generation.wrapping_add(1);
                    self.before.get_or_insert(stored.life);
                }
                if left == 0 {
                    let beside = self.beside(header.generation, &stored.key);
                    self.next = beside.last.wrapping_add(1);
                    return Ok(Some(Stored {
                        damaged: beside.damaged,
                        other_key: beside.other_key,
                        passed,
                        ..stored
                    }));
                }
                left -= 1;
            }
            before = Some(header.generation);
        }
        if self.newest.is_none() {
            self.before.get_or_insert_default();
        }
        Ok(None)
    }

    /// The device has started; `failed`: after a failure, not after power-on. The next record
    /// counts it.
    pub fn started(&mut self, failed: bool) {
        let life = &mut self.since;
        life.starts = life.starts.saturating_add(1);
        life.failures = life.failures.saturating_add(failed.into());
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
