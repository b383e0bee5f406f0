//! The store: two slots in flash, of which one always holds the last good record of weights and
//! configuration.
//!
//! A new record goes into the slot that is not in use. So power may fail at any moment: afterwards
//! either the old record or the new one is found. Without a good slot the device has the built-in
//! networks and no configuration.
//!
//! A slot is one erase unit or several. Its record is little-endian, padded with FF to a multiple
//! of 64 bytes:
//!
//! | offset | length | content |
//! |---|---|---|
//! | 0 | 4 | magic `LRNS` |
//! | 4 | 4 | version of this format, 2 |
//! | 8 | 4 | generation: the greater one (modulo 2^32) is the newer |
//! | 12 | 2 | length a of the images, 608 |
//! | 14 | 2 | length b of the configuration record; 0: none |
//! | 16 | a | the gyro network's image, then the accelerometer network's |
//! | 16 + a | b | the configuration record ([`crate::configuration::record`]) |
//! | 16 + a + b | 4 | CRC-32 (zlib's) of bytes 0..16 + a + b |
//!
//! Version 1 has no configuration: its b is 0, and all else is the same. Every later version keeps
//! this frame of magic, version, generation, two lengths and CRC, so that an older firmware tells a
//! newer record from a damaged one. It reports [`Newer`] and overwrites nothing.
//!
//! Weights and configuration are in one record, so weights are always found with the configuration,
//! and so the sensor, that they were in use with.
//!
//! Erasing halts most processors while it lasts (STM32F405: 1 to 2 s for a sector of 128 KiB). So a
//! board saves only in bypass and on command. The frames lost meanwhile show as a gap in the
//! sensor's counter.

use crate::configuration::record::{MAX_LEN, Record};
use crate::model::{IMAGES_LEN, Nets};
use crate::wire::checksum::{Zlib, crc32_zlib};
use crate::wire::field::{head, put, take};
use embedded_storage::nor_flash::NorFlash;

/// Bytes of the longest record before padding.
pub const RECORD_LEN: usize = HEADER_LEN + IMAGES_LEN + MAX_LEN + CRC_LEN;

const MAGIC: [u8; 4] = *b"LRNS";
const VERSION: u32 = 2;
/// Versions that are read.
const OLDEST: u32 = 1;
const HEADER_LEN: usize = 16;
const CRC_LEN: usize = 4;
/// A record is padded to a multiple of this: good for all units of writing up to it. Flash is read
/// in pieces of this size.
const PIECE: usize = 64;
/// The longest record padded.
const PADDED_LEN: usize = RECORD_LEN.next_multiple_of(PIECE);

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
    slot: usize,
}

/// The frame of a record.
#[derive(Debug, Clone, Copy)]
struct Header {
    version: u32,
    generation: u32,
    /// Lengths of images and configuration.
    parts: [usize; 2],
}

impl Header {
    fn of(bytes: &[u8]) -> Option<Header> {
        let word = |at| u32::from_le_bytes(take(bytes, at));
        let length = |at| usize::from(u16::from_le_bytes(take(bytes, at)));
        let header = Header {
            version: word(4),
            generation: word(8),
            parts: [length(12), length(14)],
        };
        (take(bytes, 0) == MAGIC && header.version >= OLDEST).then_some(header)
    }

    /// Where the checksum is.
    fn end(&self) -> usize {
        let [images, record] = self.parts;
        HEADER_LEN + images + record
    }
}

/// A store.
#[derive(Debug)]
pub struct Store<F> {
    flash: F,
    slot_len: u32,
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
            }),
            _ => Err(Error::Geometry),
        }
    }

    /// The newest good record; `None` when there is none.
    ///
    /// # Errors
    /// [`Newer`]
    pub fn load(&mut self) -> Result<Option<Stored>, Newer> {
        let newer = match [0, 1].map(|slot| self.header(slot).map(|header| header.generation)) {
            // newer by less than half the counter's range
            [Some(a), Some(b)] => usize::from((b.wrapping_sub(a) as i32) > 0),
            [a, _] => usize::from(a.is_none()),
        };
        match self.read(newer)? {
            Some(stored) => Ok(Some(stored)),
            None => self.read(1 - newer),
        }
    }

    /// Stores networks and configuration record beside the newest good record, which stays until
    /// this is complete.
    ///
    /// # Errors
    /// [`Error::Flash`], [`Error::Verify`] or [`Error::Newer`]; the newest good record is then
    /// still the previous one.
    pub fn save(&mut self, nets: &Nets, record: &Record) -> Result<Stored, Error<F::Error>> {
        let (slot, generation) = self.next().map_err(Error::Newer)?;
        self.write(slot, nets, record, generation)
            .map_err(Error::Flash)?;
        self.read(slot)
            .map_err(Error::Newer)?
            .filter(|stored| stored.generation == generation)
            .filter(|stored| stored.nets.same_images(nets) && stored.record == *record)
            .ok_or(Error::Verify)
    }

    /// Slot and number of the next record.
    #[inline(never)]
    fn next(&mut self) -> Result<(usize, u32), Newer> {
        let (slot, generation) = self.load()?.map_or((0, 1), |newest| {
            (1 - newest.slot, newest.generation.wrapping_add(1))
        });
        match self.header(slot) {
            Some(header) if header.version > VERSION => Err(Newer(header.version)),
            _ => Ok((slot, generation)),
        }
    }

    #[inline(never)]
    fn write(
        &mut self,
        slot: usize,
        nets: &Nets,
        record: &Record,
        generation: u32,
    ) -> Result<(), F::Error> {
        let (bytes, end) = framed(nets, record, generation);
        let from = self.start(slot);
        self.flash.erase(from, from + self.slot_len)?;
        let padded = end.next_multiple_of(PIECE);
        self.flash.write(from, head(&bytes, padded))
    }

    /// The flash.
    pub fn into_inner(self) -> F {
        self.flash
    }

    fn start(&self, slot: usize) -> u32 {
        if slot == 0 { 0 } else { self.slot_len }
    }

    /// The frame of a slot's record, if its checksum is right. It is read in pieces: a newer
    /// version may be longer than ours.
    #[inline(never)]
    fn header(&mut self, slot: usize) -> Option<Header> {
        let start = self.start(slot);
        let mut piece = [0; PIECE];
        self.flash.read(start, &mut piece).ok()?;
        let header = Header::of(&piece)?;
        let end = header.end();
        if end + CRC_LEN > usize::try_from(self.slot_len).ok()? {
            return None;
        }
        let (mut sum, mut stored) = (Zlib::new(), [0; CRC_LEN]);
        let mut at = 0;
        while at < end + CRC_LEN {
            self.flash.read(start + at as u32, &mut piece).ok()?;
            sum.add(head(&piece, end.saturating_sub(at)));
            for (byte, place) in stored.iter_mut().zip(end..) {
                if let Some(read) = place.checked_sub(at).and_then(|at| piece.get(at)) {
                    *byte = *read;
                }
            }
            at += PIECE;
        }
        (u32::from_le_bytes(stored) == sum.value()).then_some(header)
    }

    /// Not inlined, here and above, so that the stack never holds two records.
    #[inline(never)]
    fn read(&mut self, slot: usize) -> Result<Option<Stored>, Newer> {
        match self.header(slot) {
            Some(header) if header.version > VERSION => Err(Newer(header.version)),
            Some(header) => Ok(self.contents(slot, &header)),
            None => Ok(None),
        }
    }

    #[inline(never)]
    fn contents(&mut self, slot: usize, header: &Header) -> Option<Stored> {
        let [images, record] = header.parts;
        if images != IMAGES_LEN || record > MAX_LEN {
            return None;
        }
        let mut bytes = [0; PADDED_LEN];
        self.flash.read(self.start(slot), &mut bytes).ok()?;
        let images = bytes.get(HEADER_LEN..HEADER_LEN + IMAGES_LEN)?;
        let record = bytes.get(HEADER_LEN + IMAGES_LEN..header.end())?;
        Some(Stored {
            nets: Nets::from_images(images).ok()?,
            record: Record::from_slice(record).ok()?,
            generation: header.generation,
            slot,
        })
    }
}

/// A record in its frame, and where its padding begins.
#[inline(never)]
fn framed(nets: &Nets, record: &Record, generation: u32) -> ([u8; PADDED_LEN], usize) {
    let mut bytes = [0xFF; PADDED_LEN];
    put(&mut bytes, 0, MAGIC);
    put(&mut bytes, 4, VERSION.to_le_bytes());
    put(&mut bytes, 8, generation.to_le_bytes());
    put(&mut bytes, 12, (IMAGES_LEN as u16).to_le_bytes());
    put(&mut bytes, 14, (record.len() as u16).to_le_bytes());
    if let Some(images) = bytes.get_mut(HEADER_LEN..HEADER_LEN + IMAGES_LEN) {
        nets.write_images(0, images);
    }
    let places = bytes.iter_mut().skip(HEADER_LEN + IMAGES_LEN);
    for (place, byte) in places.zip(record) {
        *place = *byte;
    }
    let end = HEADER_LEN + IMAGES_LEN + record.len();
    let sum = crc32_zlib(head(&bytes, end));
    put(&mut bytes, end, sum.to_le_bytes());
    (bytes, end + CRC_LEN)
}

#[cfg(test)]
mod tests;
