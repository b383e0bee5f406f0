//! The weight store: two slots in flash, of which one always holds the last good image.
//!
//! A new image goes into the slot that is not in use. So power may fail at any moment: afterwards
//! either the old image or the new one is found. Without a good slot the built-in networks remain
//! in use.
//!
//! A slot is one erase unit or several. Its record is little-endian, padded with FF to the unit of
//! writing:
//!
//! | offset | length | content |
//! |---|---|---|
//! | 0 | 4 | magic `LRNS` |
//! | 4 | 4 | version of this format, 1 |
//! | 8 | 4 | generation: the greater one (modulo 2^32) is the newer |
//! | 12 | 4 | length of the images, 608 |
//! | 16 | 608 | the gyro network's image, then the accelerometer network's |
//! | 624 | 4 | CRC-32 (zlib's) of bytes 0..624 |
//!
//! Erasing halts most processors while it lasts (STM32F405: 1 to 2 s for a sector of 128 KiB). So a
//! board saves only in bypass and on command. The frames lost meanwhile show as a gap in the
//! sensor's counter.

use crate::model::{IMAGES_LEN, Nets};
use crate::wire::checksum::crc32_zlib;
use crate::wire::field::{head, put, take};
use embedded_storage::nor_flash::NorFlash;

/// Bytes of a record before padding.
pub const RECORD_LEN: usize = HEADER_LEN + IMAGES_LEN + 4;

const MAGIC: [u8; 4] = *b"LRNS";
const VERSION: u32 = 1;
const HEADER_LEN: usize = 16;
/// The record padded for all units of writing up to 64 bytes.
const PADDED_LEN: usize = RECORD_LEN.next_multiple_of(64);

/// Why the networks were not stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Error<E> {
    /// The flash is too small for two slots, or its units do not fit the record.
    Geometry,
    /// The flash reports an error.
    Flash(E),
    /// The record does not read back as written.
    Verify,
}

/// The image found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stored {
    /// Both networks.
    pub nets: Nets,
    /// Counts the images stored.
    pub generation: u32,
    slot: usize,
}

/// A weight store.
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
            .all(|&unit| unit > 0 && PADDED_LEN.is_multiple_of(unit));
        match u32::try_from(slot_len) {
            Ok(len) if fits && flash.capacity() / 2 >= slot_len => Ok(Store {
                flash,
                slot_len: len,
            }),
            _ => Err(Error::Geometry),
        }
    }

    /// The newest good image; `None` when there is none.
    pub fn load(&mut self) -> Option<Stored> {
        let newer = match [0, 1].map(|slot| self.record(slot).map(|record| generation(&record))) {
            // newer by less than half the counter's range
            [Some(a), Some(b)] => usize::from((b.wrapping_sub(a) as i32) > 0),
            [a, _] => usize::from(a.is_none()),
        };
        self.read(newer).or_else(|| self.read(1 - newer))
    }

    /// Stores networks beside the newest good image, which stays until this is complete.
    ///
    /// # Errors
    /// [`Error::Flash`] or [`Error::Verify`]; the newest good image is then still the previous one.
    pub fn save(&mut self, nets: &Nets) -> Result<Stored, Error<F::Error>> {
        let (slot, generation) = self.next();
        self.write(slot, nets, generation).map_err(Error::Flash)?;
        self.read(slot)
            .filter(|stored| stored.generation == generation && stored.nets.same_images(nets))
            .ok_or(Error::Verify)
    }

    /// Slot and number of the next image.
    #[inline(never)]
    fn next(&mut self) -> (usize, u32) {
        self.load().map_or((0, 1), |newest| {
            (1 - newest.slot, newest.generation.wrapping_add(1))
        })
    }

    #[inline(never)]
    fn write(&mut self, slot: usize, nets: &Nets, generation: u32) -> Result<(), F::Error> {
        let record = record(nets, generation);
        let from = self.start(slot);
        self.flash.erase(from, from + self.slot_len)?;
        self.flash.write(from, &record)
    }

    /// The flash.
    pub fn into_inner(self) -> F {
        self.flash
    }

    fn start(&self, slot: usize) -> u32 {
        if slot == 0 { 0 } else { self.slot_len }
    }

    /// The record of a slot, if its frame is good. Not inlined, here and below, so that the stack
    /// never holds two records.
    #[inline(never)]
    fn record(&mut self, slot: usize) -> Option<[u8; PADDED_LEN]> {
        let mut record = [0; PADDED_LEN];
        self.flash.read(self.start(slot), &mut record).ok()?;
        let sum = u32::from_le_bytes(take(&record, RECORD_LEN - 4));
        let word = |at| u32::from_le_bytes(take(&record, at));
        let good = take(&record, 0) == MAGIC
            && word(4) == VERSION
            && usize::try_from(word(12)) == Ok(IMAGES_LEN)
            && crc32_zlib(head(&record, RECORD_LEN - 4)) == sum;
        good.then_some(record)
    }

    #[inline(never)]
    fn read(&mut self, slot: usize) -> Option<Stored> {
        let record = self.record(slot)?;
        let images = record.get(HEADER_LEN..HEADER_LEN + IMAGES_LEN)?;
        let nets = Nets::from_images(images).ok()?;
        Some(Stored {
            nets,
            generation: generation(&record),
            slot,
        })
    }
}

fn generation(record: &[u8; PADDED_LEN]) -> u32 {
    u32::from_le_bytes(take(record, 8))
}

#[inline(never)]
fn record(nets: &Nets, generation: u32) -> [u8; PADDED_LEN] {
    let mut record = [0xFF; PADDED_LEN];
    put(&mut record, 0, MAGIC);
    put(&mut record, 4, VERSION.to_le_bytes());
    put(&mut record, 8, generation.to_le_bytes());
    put(&mut record, 12, (IMAGES_LEN as u32).to_le_bytes());
    if let Some(images) = record.get_mut(HEADER_LEN..HEADER_LEN + IMAGES_LEN) {
        nets.write_images(0, images);
    }
    let sum = crc32_zlib(head(&record, RECORD_LEN - 4));
    put(&mut record, RECORD_LEN - 4, sum.to_le_bytes());
    record
}

#[cfg(test)]
mod tests;
