//! Reading the bytes of a black box.
//!
//! A page (little-endian): number u32, bytes in use u16, their complement u16, length p of its
//! first frame u16, 0 u16, the [`Key`], p bytes of the frame as it left, then entries. An entry is
//! kind u8, length n u8, microseconds since the entry before (or the key) u16, and n bytes:
//!
//! | kind | content |
//! |---|---|
//! | 1 | a piece of the sensor's bytes: hash of all that had left u16, then the bytes |
//! | 2 | a burst of an ADIS, likewise |
//! | 3 | more of the piece before, likewise |
//! | 4 | more time: microseconds u32 |
//! | 5 | the correction from here on: bytes that had left since the last piece u16, 6 f32 |
//! | 6 | the fault bits: bytes that had left since the last piece u16, bits u32 |
//! | 7 | the page ends: what follows had no room, or does not follow from the key |

use super::key::{KEY_LEN, estimate_of};
pub use super::memory::{EVENT_LEN, EVENTS, HEAD_LEN, Head, PAGE_LEN};
use super::{Event, Key, LEN, PAGES};
use crate::wire::field::take;

pub(super) const PIECE: u8 = 1;
pub(super) const BURST: u8 = 2;
pub(super) const MORE: u8 = 3;
pub(super) const TIME: u8 = 4;
pub(super) const ESTIMATE: u8 = 5;
pub(super) const FAULTS: u8 = 6;
pub(super) const BREAK: u8 = 7;

/// Bytes of an entry before its own.
pub(super) const ENTRY_LEN: usize = 4;
/// Offset of a page's first frame.
pub(super) const PRIMER_AT: usize = 12 + KEY_LEN;

/// A page.
#[derive(Debug, Clone, Copy)]
pub struct Page<'b> {
    /// Number of the page: pages begun since the memory was blank.
    pub number: u32,
    /// The state after its first frame.
    pub key: Key,
    /// The page's first frame as it left.
    pub frame: &'b [u8],
    entries: &'b [u8],
}

/// Content of an entry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Content<'b> {
    /// Bytes of the sensor, and the lower half of the hash of all that had left before.
    Piece(u16, &'b [u8]),
    /// A piece of a burst.
    Burst(u16, &'b [u8]),
    /// More of the same piece.
    More(&'b [u8]),
    /// The correction, when so many bytes had left since the last piece came.
    Estimate(u16, [[f32; 3]; 2]),
    /// The fault bits, likewise.
    Faults(u16, u32),
    /// The page ends: what follows had no room, or does not follow from the key.
    Break,
}

/// An entry of a page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry<'b> {
    /// Microseconds since the device's start.
    pub at_us: u64,
    /// Content of the entry.
    pub content: Content<'b>,
}

/// The events, the oldest first.
pub fn events(bytes: &[u8]) -> impl Iterator<Item = Event> {
    let head = bytes.get(..HEAD_LEN).and_then(Head::parse);
    let last = head.map_or(0, |head| head.events);
    (1..=EVENTS as u32).rev().filter_map(move |ago| {
        let number = last.checked_sub(ago)?;
        let at = HEAD_LEN + number as usize % EVENTS * EVENT_LEN;
        Event::parse(bytes.get(at..)?).filter(|event| event.number == number)
    })
}

/// The page at this position of the ring; `None` where there is none.
#[must_use]
pub fn page(bytes: &[u8], place: usize) -> Option<Page<'_>> {
    let at = LEN - PAGES * PAGE_LEN + place.min(PAGES) * PAGE_LEN;
    let page = bytes.get(at..)?.get(..PAGE_LEN)?;
    let half = |at| u16::from_le_bytes(take(page, at));
    let (number, used) = (u32::from_le_bytes(take(page, 0)), half(4));
    if number == 0 || half(6) != !used {
        return None;
    }
    let key = Key::parse(page.get(12..)?)?;
    let entries_at = PRIMER_AT + usize::from(half(8));
    Some(Page {
        number,
        key,
        frame: page.get(PRIMER_AT..entries_at)?,
        entries: page.get(entries_at..used.into())?,
    })
}

impl<'b> Page<'b> {
    /// Entries of the page.
    pub fn entries(&self) -> impl Iterator<Item = Entry<'b>> {
        let mut rest = self.entries;
        let mut at_us = self.key.at_us;
        core::iter::from_fn(move || {
            loop {
                let [kind, len, low, high] = *rest.first_chunk()?;
                let bytes = rest.get(ENTRY_LEN..)?.get(..len.into())?;
                rest = rest.get(ENTRY_LEN + usize::from(len)..)?;
                at_us = at_us.wrapping_add(u16::from_le_bytes([low, high]).into());
                let half = u16::from_le_bytes(take(bytes, 0));
                let own = bytes.get(2..).unwrap_or_default();
                let content = match kind {
                    TIME => {
                        let more = u32::from_le_bytes(take(bytes, 0));
                        at_us = at_us.wrapping_add(more.into());
                        continue;
                    }
                    PIECE => Content::Piece(half, own),
                    BURST => Content::Burst(half, own),
                    MORE => Content::More(own),
                    ESTIMATE => Content::Estimate(half, estimate_of(&take(own, 0))),
                    FAULTS => Content::Faults(half, u32::from_le_bytes(take(own, 0))),
                    BREAK => Content::Break,
                    _ => return None, // of a later version, or damaged
                };
                return Some(Entry { at_us, content });
            }
        })
    }
}
