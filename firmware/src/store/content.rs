//! Content of a record, and its bytes, a piece at a time.

use super::life::{LIFE_LEN, Life};
use super::{CRC_LEN, HEADER_LEN, PIECE};
use crate::configuration::Configuration;
use crate::configuration::record::Record;
use crate::learn::{Learner, MEMORY_LEN};
use crate::model::{IMAGES_LEN, Nets};
use crate::wire::checksum::Zlib;
use crate::wire::command::key::{KEY_LEN, Key};
use crate::wire::field::{put, take};

/// Bytes of [`Notes`].
pub const NOTES_LEN: usize = 20;
/// Most bytes of a memory: notes, and what the learner took down.
pub const MEMORY_MAX: usize = NOTES_LEN + MEMORY_LEN;

/// Content to be stored.
#[derive(Clone, Copy)]
pub struct Content<'c> {
    /// The networks for the next power-on.
    pub nets: &'c Nets,
    /// The configuration record; may be empty.
    pub record: &'c Record,
    /// Memory of the learner.
    pub memory: Memory<'c>,
    /// The unit that networks and configuration are of: [`unit()`]; 0: not stated.
    pub unit: u32,
    /// Time since power-on, minutes.
    pub minutes: u32,
    /// The device's key.
    pub key: Key,
}

/// Memory of the unit in a record.
#[derive(Clone, Copy)]
pub enum Memory<'c> {
    /// No memory.
    None,
    /// The memory of the newest record.
    Same,
    /// The memory that the learner recorded last ([`Learner::remember`]): notes, learner, number of
    /// bytes.
    New(Notes, &'c dyn Learner, usize),
}

impl<'c> Content<'c> {
    /// A content without a memory, of an unstated unit.
    #[must_use]
    pub fn new(nets: &'c Nets, record: &'c Record) -> Content<'c> {
        Content {
            nets,
            record,
            memory: Memory::None,
            unit: 0,
            minutes: 0,
            key: Key::Unprovisioned,
        }
    }
}

/// Notes that go with the learner's bytes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Notes {
    /// The unit that it was learnt of: [`unit()`].
    pub unit: u32,
    /// Drives that it was learnt on; saturates.
    pub drives: u16,
    /// Time that it was learnt in, minutes; saturates.
    pub minutes: u32,
    /// Temperatures of the sensor in that time, least and most, degrees C; `None`: not known.
    pub temperatures: Option<[i16; 2]>,
}

/// Stands for a temperature that is not known.
const UNKNOWN: i16 = i16::MIN;

impl Notes {
    /// As stored, little-endian: unit u32, minutes u32, drives u16, least and most temperature i16,
    /// 6 bytes that are 0.
    #[must_use]
    pub fn bytes(&self) -> [u8; NOTES_LEN] {
        let mut bytes = [0; NOTES_LEN];
        let [least, most] = self.temperatures.unwrap_or([UNKNOWN; 2]);
        put(&mut bytes, 0, self.unit.to_le_bytes());
        put(&mut bytes, 4, self.minutes.to_le_bytes());
        put(&mut bytes, 8, self.drives.to_le_bytes());
        put(&mut bytes, 10, least.to_le_bytes());
        put(&mut bytes, 12, most.to_le_bytes());
        bytes
    }

    /// The notes and the learner's bytes of a memory; `None` where it is too short.
    #[must_use]
    pub fn of(memory: &[u8]) -> Option<(Notes, &[u8])> {
        let (bytes, learnt) = memory.split_first_chunk::<NOTES_LEN>()?;
        let word = |at| u32::from_le_bytes(take(bytes, at));
        let half = |at| i16::from_le_bytes(take(bytes, at));
        let temperatures = [half(10), half(12)];
        let notes = Notes {
            unit: word(0),
            minutes: word(4),
            drives: u16::from_le_bytes(take(bytes, 8)),
            temperatures: Some(temperatures)
                .filter(|configuration| !configuration.contains(&UNKNOWN)),
        };
        Some((notes, learnt))
    }

    /// Takes a temperature into the range, degrees C.
    pub fn see(&mut self, celsius: f32) {
        let rounded = libm::roundf(celsius) as i16; // saturates
        let [least, most] = self.temperatures.unwrap_or([rounded; 2]);
        self.temperatures = Some([least.min(rounded), most.max(rounded)]);
    }
}

/// A number for what a memory belongs to: the sensor's serial number and what drives the networks.
/// What was learnt of one unit says nothing of another one, and weights mean something else behind
/// other inputs.
#[must_use]
pub fn unit(configuration: &Configuration) -> u32 {
    let mut sum = Zlib::new();
    sum.add(configuration.identity.serial.as_bytes());
    sum.add(&[0]);
    for source in configuration.inputs.as_flattened() {
        sum.add(&[*source as u8]);
    }
    sum.value()
}

/// Offsets of the parts of a record.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    /// Bytes of the configuration record.
    record: usize,
    /// Bytes of the memory.
    pub memory: usize,
}

/// The length of the configuration record stands before it.
pub(super) const COUNT_LEN: usize = 2;
/// Behind it, from version 4 on: the unit, the life of the device, and its key.
pub(super) const UNIT_LEN: usize = 4;
/// All that stands between images and configuration record.
pub(super) const FIXED_LEN: usize = COUNT_LEN + UNIT_LEN + LIFE_LEN + KEY_LEN;
/// Offset of the key among these.
pub(super) const KEY_AT: usize = COUNT_LEN + UNIT_LEN + LIFE_LEN;
const COUNT_AT: usize = HEADER_LEN + IMAGES_LEN;
const RECORD_AT: usize = COUNT_AT + FIXED_LEN;

impl Layout {
    /// Layout of a content whose [`Memory::Same`] has `same` bytes.
    pub fn of(content: &Content, same: usize) -> Layout {
        let memory = match content.memory {
            Memory::None => 0,
            Memory::Same => same,
            Memory::New(_, _, learnt) => NOTES_LEN + learnt.min(MEMORY_LEN),
        };
        Layout {
            record: content.record.len(),
            memory,
        }
    }

    /// Length of what follows the images.
    pub fn rest(&self) -> usize {
        FIXED_LEN + self.record + self.memory
    }

    /// Offset of the memory.
    pub fn memory_at(&self) -> usize {
        RECORD_AT + self.record
    }

    /// Offset of the checksum.
    pub fn end(&self) -> usize {
        self.memory_at() + self.memory
    }

    /// The whole length, with padding.
    pub fn padded(&self) -> usize {
        (self.end() + CRC_LEN).next_multiple_of(PIECE)
    }
}

/// Fills in what a piece that begins at byte `at` of a record has of the images, the unit, the life
/// of the device, its key, the configuration and a new memory. All else stays as it is.
pub(super) fn fill(
    content: &Content,
    life: &Life,
    layout: &Layout,
    at: usize,
    piece: &mut [u8; PIECE],
) {
    part(piece, at, HEADER_LEN, IMAGES_LEN, |start, place| {
        content.nets.write_images(start, place);
    });
    let mut fixed = [0; FIXED_LEN];
    put(&mut fixed, 0, (layout.record as u16).to_le_bytes()); // at most MAX_LEN
    put(&mut fixed, COUNT_LEN, content.unit.to_le_bytes());
    put(&mut fixed, COUNT_LEN + UNIT_LEN, life.bytes());
    put(&mut fixed, KEY_AT, content.key.to_bytes());
    part(piece, at, COUNT_AT, FIXED_LEN, |start, place| {
        copy(&fixed, start, place);
    });
    part(piece, at, RECORD_AT, layout.record, |start, place| {
        copy(content.record, start, place);
    });
    if let Memory::New(notes, learner, _) = content.memory {
        let memory_at = layout.memory_at();
        let notes = notes.bytes();
        part(piece, at, memory_at, NOTES_LEN, |start, place| {
            copy(&notes, start, place);
        });
        let learnt = layout.memory.saturating_sub(NOTES_LEN);
        part(piece, at, memory_at + NOTES_LEN, learnt, |start, place| {
            learner.write_memory(start, place);
        });
    }
}

/// Calls `write` with what a piece has of a part, and where in the part that begins.
pub(super) fn part(
    piece: &mut [u8; PIECE],
    at: usize,
    part_at: usize,
    len: usize,
    write: impl FnOnce(usize, &mut [u8]),
) {
    let (from, to) = (part_at.max(at), (part_at + len).min(at + PIECE));
    if from < to
        && let Some(place) = piece.get_mut(from - at..to - at)
    {
        write(from - part_at, place);
    }
}

/// Copies bytes from `start` on.
fn copy(from: &[u8], start: usize, place: &mut [u8]) {
    for (place, byte) in place.iter_mut().zip(from.iter().skip(start)) {
        *place = *byte;
    }
}
