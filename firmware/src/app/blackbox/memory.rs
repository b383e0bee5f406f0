//! The memory of the black box.

use super::{Cause, State};
use crate::wire::checksum::crc32_zlib;
use crate::wire::field::{put, take};

/// Pages of the ring.
pub const PAGES: usize = 4;
/// Bytes of a page: its key, and at least eight frames of the longest format.
pub const PAGE_LEN: usize = 704;
/// Number of events that are stored.
pub const EVENTS: usize = 30;
/// Bytes of an event.
pub const EVENT_LEN: usize = 16;
/// Bytes of the head.
pub const HEAD_LEN: usize = 32;
/// Bytes of all.
pub const LEN: usize = HEAD_LEN + EVENTS * EVENT_LEN + PAGES * PAGE_LEN;
const _: () = assert!(LEN == 3328);

const MAGIC: [u8; 4] = *b"LRBB";
/// Version of the layout.
pub const VERSION: u16 = 2;
const CRC_AT: usize = HEAD_LEN - 4;

/// The memory of a black box. Any bytes are valid: those that are none of a black box are
/// overwritten.
#[derive(Debug)]
#[repr(C, align(4))]
pub struct Memory {
    pub(super) head: [u8; HEAD_LEN],
    pub(super) events: [[u8; EVENT_LEN]; EVENTS],
    pub(super) pages: [[u8; PAGE_LEN]; PAGES],
}

/// Head of the memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Head {
    /// State of the black box.
    pub state: State,
    /// Why it holds.
    pub cause: Cause,
    /// Fault bits at the cause.
    pub faults: u32,
    /// Its time, microseconds after the device's start.
    pub at_us: u64,
    /// Events so far.
    pub events: u32,
    /// Pages begun so far.
    pub pages: u32,
}

impl Memory {
    /// All zeros: blank.
    pub const ZEROED: Memory = Memory {
        head: [0; HEAD_LEN],
        events: [[0; EVENT_LEN]; EVENTS],
        pages: [[0; PAGE_LEN]; PAGES],
    };

    /// All bytes are this, as in RAM after power-on.
    pub fn fill(&mut self, byte: u8) {
        self.head.fill(byte);
        self.events.as_flattened_mut().fill(byte);
        self.pages.as_flattened_mut().fill(byte);
    }

    /// Copies the bytes from `start` on into `piece` and gives their number.
    pub fn read(&self, start: usize, piece: &mut [u8]) -> usize {
        let parts = (self.head.iter())
            .chain(self.events.as_flattened())
            .chain(self.pages.as_flattened());
        let mut len = 0;
        for (place, byte) in piece.iter_mut().zip(parts.skip(start)) {
            *place = *byte;
            len += 1;
        }
        len
    }
}

impl Head {
    /// Decodes a head; `None` where the bytes are none, or of another version.
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Head> {
        let whole = bytes.get(..HEAD_LEN)?;
        let crc = u32::from_le_bytes(take(whole, CRC_AT));
        let version = u16::from_le_bytes(take(whole, 4));
        if take(whole, 0) != MAGIC || version != VERSION || crc != crc32_zlib(whole.get(..CRC_AT)?)
        {
            return None;
        }
        let [state, cause] = take(whole, 6);
        Some(Head {
            state: match state {
                0 => State::Records,
                1 => State::Follows,
                _ => State::Holds,
            },
            cause: match cause {
                0 => Cause::None,
                1 => Cause::Fault,
                2 => Cause::Request,
                _ => Cause::Reset,
            },
            faults: u32::from_le_bytes(take(whole, 8)),
            at_us: u64::from_le_bytes(take(whole, 12)),
            events: u32::from_le_bytes(take(whole, 20)),
            pages: u32::from_le_bytes(take(whole, 24)),
        })
    }

    /// Encodes the head.
    #[must_use]
    pub fn bytes(&self) -> [u8; HEAD_LEN] {
        let mut bytes = [0; HEAD_LEN];
        put(&mut bytes, 0, MAGIC);
        put(&mut bytes, 4, VERSION.to_le_bytes());
        put(&mut bytes, 6, [self.state as u8, self.cause as u8]);
        put(&mut bytes, 8, self.faults.to_le_bytes());
        put(&mut bytes, 12, self.at_us.to_le_bytes());
        put(&mut bytes, 20, self.events.to_le_bytes());
        put(&mut bytes, 24, self.pages.to_le_bytes());
        let crc = crc32_zlib(bytes.get(..CRC_AT).unwrap_or_default());
        put(&mut bytes, CRC_AT, crc.to_le_bytes());
        bytes
    }
}
