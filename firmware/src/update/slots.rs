//! The two slots, their records, and which of them is started.
//!
//! A slot's last [`RECORD_LEN`] bytes are its record, in units of 64 bytes, each written once:
//!
//! | offset | length | content |
//! |---|---|---|
//! | 0 | 128 | the [`header`](super::header) of the image at the slot's beginning |
//! | 128 | 4 | number: the greater one (modulo 2^32) is the newer |
//! | 132 | 4 | faults of the device before the update |
//! | 136 | 4 | CRC-32 (zlib's) of bytes 0..136 |
//! | 192 | 64 | written when the loader starts the image for the first time |
//! | 256 | 64 | written when the image has proved itself |
//!
//! A mark is there as soon as a byte of it is written or cannot be read. So one that was torn by a
//! power cut counts, and is not written a second time.

use super::header::{Digest, HEADER_LEN, Header};
use crate::wire::checksum::crc32_zlib;
use crate::wire::field::{head, put, take};
use embedded_storage::nor_flash::NorFlash;

/// Bytes of a slot that its record takes.
pub const RECORD_LEN: u32 = 512;
/// Flash is read and written in pieces of this size, good for all units up to it.
pub(super) const PIECE: usize = 64;
const HEAD_LEN: usize = 192;
const SUMMED: usize = HEADER_LEN + 8;

/// A mark in a record, by its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mark {
    Tried = 192,
    Confirmed = 256,
}

/// The record of a slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Record {
    /// The header of the image.
    pub header: Header,
    /// The greater one, modulo 2^32, is the newer.
    pub number: u32,
    /// Faults of the device before the update.
    pub faults: u32,
    /// The image was started.
    pub tried: bool,
    /// It has proved itself.
    pub confirmed: bool,
}

impl Record {
    fn is_after(&self, other: &Record) -> bool {
        self.number.wrapping_sub(other.number) as i32 > 0
    }
}

/// Addresses and length of the slots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Places {
    /// Address of the flash.
    pub base: u32,
    /// Offsets of the slots in the flash.
    pub slots: [u32; 2],
    /// Length of a slot, bytes.
    pub len: u32,
}

impl Places {
    /// Address of a slot.
    #[must_use]
    pub fn address(&self, slot: usize) -> u32 {
        self.base.wrapping_add(self.offset(slot))
    }

    /// The slot in which an address is.
    #[must_use]
    pub fn slot_of(&self, address: u32) -> Option<usize> {
        (0..2).find(|slot| address.wrapping_sub(self.address(*slot)) < self.len)
    }

    /// The longest image.
    #[must_use]
    pub fn room(&self) -> u32 {
        self.len.saturating_sub(RECORD_LEN)
    }

    pub(super) fn offset(&self, slot: usize) -> u32 {
        let [first, second] = self.slots;
        if slot == 0 { first } else { second }
    }
}

/// The slots of a flash.
#[derive(Debug)]
pub struct Slots<F> {
    pub(super) flash: F,
    pub(super) places: Places,
}

impl<F: NorFlash> Slots<F> {
    /// Of this flash. `None`: they do not fit it.
    #[must_use]
    pub fn new(flash: F, places: Places) -> Option<Slots<F>> {
        let erase = F::ERASE_SIZE.max(1) as u32;
        let whole = |at: &u32| at.is_multiple_of(erase);
        let [first, second] = places.slots;
        let units = [F::WRITE_SIZE, F::READ_SIZE];
        let fits = places.slots.iter().chain([&places.len]).all(whole)
            && places.len > RECORD_LEN
            && first
                .checked_add(places.len)
                .is_some_and(|end| end <= second)
            && second as usize + places.len as usize <= flash.capacity()
            && units.iter().all(|&unit| PIECE.is_multiple_of(unit));
        fits.then_some(Slots { flash, places })
    }

    /// The flash.
    pub fn into_inner(self) -> F {
        self.flash
    }

    /// For the loader: the slot to start. One that is started for the first time is marked.
    /// `None`: there is no image.
    ///
    /// An update is compared with its digest before its first start, so that no slot whose erasure
    /// was cut off is taken for one.
    pub fn to_start(&mut self) -> Option<usize> {
        let records = [self.record(0), self.record(1)];
        let newer = match &records {
            [Some(first), Some(second)] => usize::from(second.is_after(first)),
            [None, Some(_)] => 1,
            _ => 0,
        };
        let slots = [newer, 1 - newer];
        for slot in slots {
            let good = match &records[slot] {
                Some(record) if record.confirmed => true,
                Some(record) if record.tried => false,
                Some(record) => {
                    let whole = self.holds(slot, &record.header);
                    whole && self.mark(slot, Mark::Tried).is_ok()
                }
                None => self.is_flashed(slot),
            };
            if good {
                return Some(slot);
            }
        }
        // one that was tried before is better than none
        slots.into_iter().find(|slot| self.is_flashed(*slot))
    }

    /// The record of a slot; `None`: a probe has flashed it, or an update of it was cut off.
    pub fn record(&mut self, slot: usize) -> Option<Record> {
        let at = self.record_at(slot);
        let mut bytes = [0; HEAD_LEN];
        for (piece, at) in bytes.chunks_exact_mut(PIECE).zip((at..).step_by(PIECE)) {
            self.flash.read(at, piece).ok()?;
        }
        let sum = u32::from_le_bytes(take(&bytes, SUMMED));
        let header = Header::parse(bytes.first_chunk()?)?;
        (crc32_zlib(head(&bytes, SUMMED)) == sum).then(|| Record {
            header,
            number: u32::from_le_bytes(take(&bytes, HEADER_LEN)),
            faults: u32::from_le_bytes(take(&bytes, HEADER_LEN + 4)),
            tried: self.is_marked(slot, Mark::Tried),
            confirmed: self.is_marked(slot, Mark::Confirmed),
        })
    }

    /// Writes the record of a slot, whose last part is erased.
    pub(super) fn write_record(
        &mut self,
        slot: usize,
        header: &[u8; HEADER_LEN],
        [number, faults]: [u32; 2],
    ) -> Result<(), F::Error> {
        let mut bytes = [0xFF; HEAD_LEN];
        put(&mut bytes, 0, *header);
        put(&mut bytes, HEADER_LEN, number.to_le_bytes());
        put(&mut bytes, HEADER_LEN + 4, faults.to_le_bytes());
        let sum = crc32_zlib(head(&bytes, SUMMED));
        put(&mut bytes, SUMMED, sum.to_le_bytes());
        self.flash.write(self.record_at(slot), &bytes)
    }

    /// Writes a mark, unless it is there.
    pub(super) fn mark(&mut self, slot: usize, mark: Mark) -> Result<(), F::Error> {
        if self.is_marked(slot, mark) {
            return Ok(());
        }
        let at = self.record_at(slot) + mark as u32;
        self.flash.write(at, &[0; PIECE])
    }

    fn is_marked(&mut self, slot: usize, mark: Mark) -> bool {
        let mut bytes = [0; PIECE];
        let at = self.record_at(slot) + mark as u32;
        self.flash.read(at, &mut bytes).is_err() || bytes.iter().any(|byte| *byte != 0xFF)
    }

    /// Whether a slot holds the image of a header.
    pub(super) fn holds(&mut self, slot: usize, header: &Header) -> bool {
        if header.address != self.places.address(slot) || header.length > self.places.room() {
            return false;
        }
        let (from, mut digest) = (self.places.offset(slot), Digest::new());
        for at in (0..header.length).step_by(PIECE) {
            let mut piece = [0; PIECE];
            if self.flash.read(from + at, &mut piece).is_err() {
                return false;
            }
            digest.add(head(&piece, (header.length - at) as usize));
        }
        digest.value() == header.digest
    }

    /// Whether a slot begins with a stack in RAM and code within itself.
    fn is_flashed(&mut self, slot: usize) -> bool {
        const RAM: core::ops::Range<u32> = 0x1000_0000..0x4000_0000;
        let mut bytes = [0; PIECE];
        let read = self.flash.read(self.places.offset(slot), &mut bytes);
        let word = |at| u32::from_le_bytes(take(&bytes, at));
        let (stack, code) = (word(0), word(4));
        read.is_ok() && RAM.contains(&stack) && self.places.slot_of(code) == Some(slot)
    }

    fn record_at(&self, slot: usize) -> u32 {
        self.places.offset(slot) + self.places.len - RECORD_LEN
    }
}
