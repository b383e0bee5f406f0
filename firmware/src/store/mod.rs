//! The store: two slots in flash, of which one always holds the last good record of weights and
//! configuration.
//!
//! A new record goes into the slot that is not in use. So power may fail at any moment: afterwards
//! either the old record or the new one is found. Without a good slot the device has the built-in
//! networks and no configuration.
//!
//! A slot is one erase unit or several. In a large one there is room for more records behind the
//! first, one every 1152 bytes, and the one with the greatest generation counts. A record is
//! little-endian, padded with FF to a multiple of 64 bytes:
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
//! Erasing halts most processors while it lasts (STM32F405: 1 to 2 s for a sector of 128 KiB). So
//! [`Store::save`], which erases, is for bypass and on command only. The frames lost meanwhile show
//! as a gap in the sensor's counter. [`Store::append`] writes behind the newest record and erases
//! nothing. It takes 5 ms (STM32F405: 288 words of 16 us) and is for what is learnt while samples
//! are corrected. When a slot is full, [`Store::make_room`] erases at the next power-on.

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
    /// There is no room behind the newest record, or there is no record.
    Full,
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
    /// The newest good record, once it has been looked for: where it begins, and its generation.
    newest: Option<(u32, u32)>,
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
                self.newest = Some((at, stored.generation));
                return Ok(Some(stored));
            }
            before = Some(header.generation);
        }
        self.newest = None;
        Ok(None)
    }

    /// Stores networks and configuration record beside the newest good record, which stays until
    /// this is complete. Erases.
    ///
    /// # Errors
    /// [`Error::Flash`], [`Error::Verify`] or [`Error::Newer`]; the newest good record is then
    /// still the previous one.
    pub fn save(&mut self, nets: &Nets, record: &Record) -> Result<Stored, Error<F::Error>> {
        let (from, generation) = self.next().map_err(Error::Newer)?;
        self.flash
            .erase(from, from + self.slot_len)
            .map_err(Error::Flash)?;
        self.write(from, nets, record, generation)
    }

    /// The same behind the newest good record, without erasing.
    ///
    /// # Errors
    /// As [`Store::save`], and [`Error::Full`].
    pub fn append(&mut self, nets: &Nets, record: &Record) -> Result<Stored, Error<F::Error>> {
        if self.newest.is_none() {
            self.load().map_err(Error::Newer)?;
        }
        let (newest, generation) = self.newest.ok_or(Error::Full)?;
        let at = self.room_behind(newest).ok_or(Error::Full)?;
        self.write(at, nets, record, generation.wrapping_add(1))
    }

    /// Sees to it that there is room for [`Store::append`]: if there is none, the newest record is
    /// saved once more, which erases.
    ///
    /// # Errors
    /// As [`Store::save`].
    pub fn make_room(&mut self) -> Result<(), Error<F::Error>> {
        let Some(stored) = self.load().map_err(Error::Newer)? else {
            return Ok(());
        };
        if self.room_behind(stored.at).is_none() && self.places() > 1 {
            self.save(&stored.nets, &stored.record)?;
        }
        Ok(())
    }

    /// Slot and number of the next record.
    #[inline(never)]
    fn next(&mut self) -> Result<(u32, u32), Newer> {
        let (slot, generation) = self.load()?.map_or((0, 1), |newest| {
            let of = usize::from(newest.at >= self.slot_len);
            (1 - of, newest.generation.wrapping_add(1))
        });
        let start = self.start(slot);
        for place in 0..self.places() {
            match self.header(start + place * PADDED_LEN as u32) {
                Some(header) if header.version > VERSION => return Err(Newer(header.version)),
                _ => {}
            }
        }
        Ok((start, generation))
    }

    /// Writes a record where nothing is written, and reads it back.
    #[inline(never)]
    fn write(
        &mut self,
        at: u32,
        nets: &Nets,
        record: &Record,
        generation: u32,
    ) -> Result<Stored, Error<F::Error>> {
        self.program(at, nets, record, generation)
            .map_err(Error::Flash)?;
        let stored = self
            .read(at)
            .map_err(Error::Newer)?
            .filter(|stored| stored.generation == generation)
            .filter(|stored| stored.nets.same_images(nets) && stored.record == *record)
            .ok_or(Error::Verify)?;
        self.newest = Some((at, generation));
        Ok(stored)
    }

    #[inline(never)]
    fn program(
        &mut self,
        at: u32,
        nets: &Nets,
        record: &Record,
        generation: u32,
    ) -> Result<(), F::Error> {
        let (bytes, end) = framed(nets, record, generation);
        let padded = end.next_multiple_of(PIECE);
        self.flash.write(at, head(&bytes, padded))
    }

    /// Records that a slot has room for, at least 1.
    fn places(&self) -> u32 {
        self.slot_len / PADDED_LEN as u32
    }

    /// The next place in the slot behind a record at which nothing is written.
    #[inline(never)]
    fn room_behind(&mut self, at: u32) -> Option<u32> {
        let end = self.start(usize::from(at >= self.slot_len)) + self.slot_len;
        let mut next = at + PADDED_LEN as u32;
        while next + PADDED_LEN as u32 <= end {
            if self.is_blank(next) {
                return Some(next);
            }
            next += PADDED_LEN as u32;
        }
        None
    }

    fn is_blank(&mut self, at: u32) -> bool {
        let mut piece = [0; PIECE];
        (at..at + PADDED_LEN as u32).step_by(PIECE).all(|at| {
            self.flash.read(at, &mut piece).is_ok() && piece.iter().all(|&byte| byte == 0xFF)
        })
    }

    /// The good record with the greatest generation, of those older than `before`.
    #[inline(never)]
    fn newest_before(&mut self, before: Option<u32>) -> Option<(u32, Header)> {
        // newer by less than half the counter's range
        let newer = |a: u32, b: u32| (a.wrapping_sub(b) as i32) > 0;
        let mut newest: Option<(u32, Header)> = None;
        for slot in 0..2 {
            for place in 0..self.places() {
                let at = self.start(slot) + place * PADDED_LEN as u32;
                let Some(header) = self.header(at) else {
                    continue;
                };
                let old = before.is_none_or(|before| newer(before, header.generation));
                let best = newest.is_none_or(|(_, best)| newer(header.generation, best.generation));
                if old && best {
                    newest = Some((at, header));
                }
            }
        }
        newest
    }

    /// The flash.
    pub fn into_inner(self) -> F {
        self.flash
    }

    fn start(&self, slot: usize) -> u32 {
        if slot == 0 { 0 } else { self.slot_len }
    }

    /// The frame of the record at a place, if its checksum is right. It is read in pieces: a newer
    /// version may be longer than ours.
    #[inline(never)]
    fn header(&mut self, start: u32) -> Option<Header> {
        let mut piece = [0; PIECE];
        self.flash.read(start, &mut piece).ok()?;
        let header = Header::of(&piece)?;
        let end = header.end();
        let room = self.slot_len - start.checked_rem(self.slot_len)?;
        if end + CRC_LEN > usize::try_from(room).ok()? {
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
    fn read(&mut self, at: u32) -> Result<Option<Stored>, Newer> {
        match self.header(at) {
            Some(header) if header.version > VERSION => Err(Newer(header.version)),
            Some(header) => Ok(self.contents(at, &header)),
            None => Ok(None),
        }
    }

    #[inline(never)]
    fn contents(&mut self, at: u32, header: &Header) -> Option<Stored> {
        let [images, record] = header.parts;
        if images != IMAGES_LEN || record > MAX_LEN {
            return None;
        }
        let mut bytes = [0; PADDED_LEN];
        self.flash.read(at, &mut bytes).ok()?;
        let images = bytes.get(HEADER_LEN..HEADER_LEN + IMAGES_LEN)?;
        let record = bytes.get(HEADER_LEN + IMAGES_LEN..header.end())?;
        Some(Stored {
            nets: Nets::from_images(images).ok()?,
            record: Record::from_slice(record).ok()?,
            generation: header.generation,
            at,
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
