//! Finds and reads records.

use super::content::{COUNT_LEN, FIXED_LEN, KEY_AT, UNIT_LEN};
use super::{
    CRC_LEN, HEAD_LEN, HEADER_LEN, LIFE_LEN, Life, MAGIC, MEMORY_MAX, Newer, OLDEST, PIECE, Store,
    Stored, VERSION, WITH_LIFE, WITH_MAPS, WITH_MEMORY,
};
use crate::configuration::record::{MAX_LEN, Record};
use crate::model::{IMAGES_LEN, NETS_LEN, Nets};
use crate::wire::checksum::Zlib;
use crate::wire::command::key::{KEY_LEN, Key};
use crate::wire::field::{head, put, take};
use embedded_storage::nor_flash::NorFlash;

/// The frame of a record.
#[derive(Debug, Clone, Copy)]
pub(super) struct Header {
    pub version: u32,
    pub generation: u32,
    /// Lengths of the images and of the rest.
    pub parts: [usize; 2],
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

    /// Length of what stands between images and configuration record.
    fn fixed(&self) -> usize {
        match self.version {
            ..WITH_MEMORY => 0,
            WITH_MEMORY..WITH_LIFE => COUNT_LEN,
            _ => FIXED_LEN,
        }
    }

    /// Whether the images are as long as those of its version.
    fn has_images(&self) -> bool {
        let length = if self.version < WITH_MAPS {
            NETS_LEN
        } else {
            IMAGES_LEN
        };
        self.parts[0] == length
    }

    /// Address of the checksum.
    fn end(&self) -> usize {
        let [images, rest] = self.parts;
        HEADER_LEN + images + rest
    }

    /// The whole length, with padding.
    pub(super) fn padded(&self) -> usize {
        (self.end() + CRC_LEN).next_multiple_of(PIECE)
    }

    pub(super) fn bytes(&self) -> [u8; HEADER_LEN] {
        let mut bytes = [0; HEADER_LEN];
        let [images, rest] = self.parts.map(|len| (len as u16).to_le_bytes());
        put(&mut bytes, 0, MAGIC);
        put(&mut bytes, 4, self.version.to_le_bytes());
        put(&mut bytes, 8, self.generation.to_le_bytes());
        put(&mut bytes, 12, images);
        put(&mut bytes, 14, rest);
        bytes
    }
}

/// Records other than a given one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beside {
    /// The frame of a newer one whose checksum is wrong.
    pub damaged: bool,
    /// A good one that is not newer and has another key.
    pub other_key: bool,
    /// The greatest generation of all frames up to [`NEAR`] ahead, damaged ones included.
    pub last: u32,
}

/// A damaged frame that is farther ahead has a damaged generation.
const NEAR: u32 = 64;

/// Newer by less than half the counter's range.
fn newer(a: u32, b: u32) -> bool {
    (a.wrapping_sub(b) as i32) > 0
}

impl<F: NorFlash> Store<F> {
    /// Reads the newest record's memory, `Notes` and what the learner took down, and gives its
    /// length; 0 without one. To be called after [`Store::load`].
    pub fn memory(&mut self, into: &mut [u8; MEMORY_MAX]) -> usize {
        let Some((at, len)) = self.memory_place() else {
            return 0;
        };
        let mut place = 0;
        let pieces = into.chunks_mut(PIECE);
        for bytes in pieces.take(len.div_ceil(PIECE)) {
            if self.read_bytes(at + place, bytes).is_none() {
                return 0;
            }
            place += PIECE as u32;
        }
        len
    }

    /// Address and length of the newest record's memory.
    pub(super) fn memory_place(&mut self) -> Option<(u32, usize)> {
        let (at, header) = self.newest?;
        let [images, rest] = header.parts;
        if header.version < WITH_MEMORY || !header.has_images() {
            return None;
        }
        let mut count = [0; COUNT_LEN];
        self.read_bytes(at + (HEADER_LEN + images) as u32, &mut count)?;
        let before = header.fixed() + usize::from(u16::from_le_bytes(count));
        let len = rest.checked_sub(before).filter(|len| *len <= MEMORY_MAX)?;
        Some((at + (HEADER_LEN + images + before) as u32, len))
    }

    /// The good record with the greatest generation, of those older than `before`; of two that have
    /// it, the one that stands behind.
    #[inline(never)]
    pub(super) fn newest_before(&mut self, before: Option<u32>) -> Option<(u32, Header)> {
        let mut newest: Option<(u32, Header)> = None;
        for slot in 0..2 {
            let start = self.start(slot);
            for at in (start..start + self.slot_len).step_by(PIECE) {
                let Some(header) = self.header(at) else {
                    continue;
                };
                let old = before.is_none_or(|before| newer(before, header.generation));
                let best =
                    newest.is_none_or(|(_, best)| !newer(best.generation, header.generation));
                if old && best {
                    newest = Some((at, header));
                }
            }
        }
        newest
    }

    /// Records other than that of this generation and key.
    #[inline(never)]
    pub(super) fn beside(&mut self, generation: u32, key: &Key) -> Beside {
        let mut beside = Beside {
            damaged: false,
            other_key: false,
            last: generation,
        };
        for slot in 0..2 {
            let start = self.start(slot);
            for at in (start..start + self.slot_len).step_by(PIECE) {
                let mut first = [0; PIECE];
                let read = self.flash.read(at, &mut first).is_ok();
                let Some(frame) = Header::of(&first).filter(|_| read) else {
                    continue;
                };
                let ahead = frame.generation.wrapping_sub(generation);
                if newer(frame.generation, generation) {
                    beside.damaged |= self.header(at).is_none();
                    if ahead <= NEAR && newer(frame.generation, beside.last) {
                        beside.last = frame.generation;
                    }
                } else if !beside.other_key && self.key(at, &frame).is_some_and(|of| of != *key) {
                    beside.other_key = self.header(at).is_some();
                }
            }
        }
        beside
    }

    /// The key of a record with this frame, which may be damaged; `None`: it has none that is used.
    fn key(&mut self, at: u32, frame: &Header) -> Option<Key> {
        match frame.version {
            ..WITH_LIFE => Some(Key::Unprovisioned),
            WITH_LIFE..=VERSION if self.fits(at, frame) => {
                let mut key = [0; KEY_LEN];
                let [images, _] = frame.parts;
                self.read_bytes(at + (HEADER_LEN + images + KEY_AT) as u32, &mut key)?;
                Key::from_bytes(&key)
            }
            _ => None,
        }
    }

    /// Reads bytes from any address, at most [`PIECE`].
    pub(super) fn read_bytes(&mut self, from: u32, into: &mut [u8]) -> Option<()> {
        let mut pieces = [0; 2 * PIECE];
        let (first, second) = pieces.split_at_mut(PIECE);
        let skipped = from.checked_rem(PIECE as u32)?;
        self.flash.read(from - skipped, first).ok()?;
        if skipped as usize + into.len() > PIECE {
            self.flash
                .read(from - skipped + PIECE as u32, second)
                .ok()?;
        }
        let bytes = pieces.iter().skip(skipped as usize);
        for (place, byte) in into.iter_mut().zip(bytes) {
            *place = *byte;
        }
        Some(())
    }

    /// The frame of the record at an address, if its checksum is right. It is read in pieces: a
    /// newer version may be longer than ours.
    #[inline(never)]
    pub(super) fn header(&mut self, start: u32) -> Option<Header> {
        // most places hold none: no more is read, and no more cleared, than shows it
        let mut first = [0; HEADER_LEN];
        if HEADER_LEN.is_multiple_of(F::READ_SIZE.max(1)) {
            self.flash.read(start, &mut first).ok()?;
            Header::of(&first)?;
        }
        let mut piece = [0; PIECE];
        self.flash.read(start, &mut piece).ok()?;
        let header = Header::of(&piece)?;
        let end = header.end();
        if !self.fits(start, &header) {
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

    /// Whether a record with this frame ends within its slot.
    fn fits(&self, at: u32, frame: &Header) -> bool {
        let before = at.checked_rem(self.slot_len).unwrap_or(0);
        frame.end() + CRC_LEN <= (self.slot_len - before) as usize
    }

    /// Not inlined, here and above, so that the stack never holds two records.
    #[inline(never)]
    pub(super) fn read(&mut self, at: u32) -> Result<Option<Stored>, Newer> {
        match self.header(at) {
            Some(header) if header.version > VERSION => Err(Newer(header.version)),
            Some(header) => Ok(self.contents(at, &header)),
            None => Ok(None),
        }
    }

    #[inline(never)]
    fn contents(&mut self, at: u32, header: &Header) -> Option<Stored> {
        let [images, rest] = header.parts;
        let fixed = header.fixed();
        if !header.has_images() || rest < fixed {
            return None;
        }
        let mut bytes = [0; HEAD_LEN];
        let read = bytes.get_mut(..header.padded().min(HEAD_LEN))?;
        self.flash.read(at, read).ok()?;
        let configuration = bytes.get(HEADER_LEN + images..)?;
        let images = bytes.get(HEADER_LEN..HEADER_LEN + images)?;
        let record = if fixed == 0 {
            rest
        } else {
            usize::from(u16::from_le_bytes(take(configuration, 0)))
        };
        if record > MAX_LEN || fixed + record > rest {
            return None;
        }
        let life: Option<&[u8; LIFE_LEN]> = configuration
            .get(COUNT_LEN + UNIT_LEN..)
            .and_then(|life| life.first_chunk())
            .filter(|_| fixed == FIXED_LEN);
        let key = match configuration
            .get(KEY_AT..)
            .and_then(|key| key.first_chunk())
        {
            Some(key) if fixed == FIXED_LEN => Key::from_bytes(key)?,
            _ => Key::Unprovisioned,
        };
        let unit = u32::from_le_bytes(take(configuration, COUNT_LEN));
        let record = configuration.get(fixed..fixed + record)?;
        Some(Stored {
            nets: Nets::from_images(images).ok()?,
            record: Record::from_slice(record).ok()?,
            generation: header.generation,
            unit: Some(unit).filter(|unit| life.is_some() && *unit != 0),
            life: life.map(Life::of).unwrap_or_default(),
            key,
            damaged: false,
            other_key: false,
            passed: 0,
            at,
        })
    }
}
