//! Finds frames in a stream of bytes, and resynchronises after damage.
//!
//! The finder looks at the head of the buffer: is this a frame ([`Scan`])? If not, it skips exactly
//! one byte and looks again. So a false start costs no frame: whatever garbage precedes it, every
//! undamaged frame is found, and a damaged one takes no other with it. Every byte that goes in
//! comes out once, in order, in exactly one [`Event`]. So what is sent on is what came in, frame by
//! frame, except for the values changed in between.
//!
//! A frame is reported only if its checksum is right.
//!
//! Bytes are delayed no longer than needed to decide. A false start delays what follows it by at
//! most the length it claims. When a line falls silent, [`Framer::flush`] returns what is left.
//!
//! The buffer is a straight piece of memory and not a ring, so that a frame is one slice. When its
//! end is reached, the unread bytes move to the front.

use super::checked::USUAL;
use super::field::head;
use super::receiver::epoch::{Head, Values};
use super::{Checked, Framing, ImuFormat, ReceiverFormat, Scan};

/// The longest message that the framer waits for. Longer ones (other logs of a receiver) pass
/// unread: [`Kind::Long`].
pub const LONGEST: usize = 256;

/// Bytes a framer holds.
pub const CAPACITY: usize = 2 * LONGEST;

/// A run of garbage of this length, bytes, without even a damaged frame, is not damage but another
/// format (or another bit rate): some seventy frames, 0.15 s of a STIM300 at 1 kHz.
pub const UNKNOWN_AFTER: u32 = 4096;

/// Kind of the bytes of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A frame with a right checksum. It holds a sample, or a receiver's fix.
    Frame,
    /// Another good message, to be passed on.
    Other,
    /// The first byte of a damaged frame: a start mark with a wrong checksum. The rest comes as
    /// garbage.
    BadChecksum,
    /// Bytes of a message longer than [`LONGEST`], by the length that its header states. Its
    /// checksum is not looked at. A good frame among its bytes ends it, because then the header
    /// was damaged.
    Long,
    /// Bytes that belong to no message.
    Garbage,
    /// Garbage for so long that this is hardly the format: see [`UNKNOWN_AFTER`].
    Unknown,
}

/// The next bytes of the stream and what they are.
#[derive(Debug, PartialEq, Eq)]
pub struct Event<'a, F> {
    kind: Kind,
    format: &'a F,
    bytes: &'a mut [u8],
}

impl<F> Event<'_, F> {
    /// Kind of the bytes.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// The bytes.
    pub fn bytes(&self) -> &[u8] {
        self.bytes
    }
}

impl<'a> Event<'a, ImuFormat> {
    /// The frame, if it is of the kind of which most come: [`Checked::of_usual`] makes one of it.
    #[inline(always)]
    pub(crate) fn usual(&mut self) -> Option<&mut [u8; USUAL]> {
        let is_one = self.kind == Kind::Frame && matches!(self.format, ImuFormat::Stim300);
        let is_one = is_one && self.bytes.len() == USUAL;
        self.bytes.first_chunk_mut().filter(|_| is_one)
    }

    /// The frame, to be read and changed without another check; `None` for anything else.
    pub fn frame(self) -> Option<Checked<'a>> {
        (self.kind == Kind::Frame).then(|| Checked::good(*self.format, self.bytes))
    }
}

impl Event<'_, ReceiverFormat> {
    /// Fix values of a message, read without another check; `None` for anything else.
    pub fn values(&self) -> Option<(Head, Values)> {
        if self.kind != Kind::Frame {
            return None;
        }
        let mut values = Values::NONE;
        let head = self.format.head(self.bytes)?;
        self.format.read(self.bytes, &mut values);
        Some((head, values))
    }
}

/// Finds the frames of one format in a stream.
#[derive(Debug)]
pub struct Framer<F = ImuFormat> {
    bytes: Unread,
    finder: Finder<F>,
}

/// Bytes that were received and have not left in an event yet.
#[derive(Debug)]
pub(super) struct Unread {
    buffer: [u8; CAPACITY],
    /// `start..end`, `start <= end <= CAPACITY`.
    start: usize,
    end: usize,
    /// Check of both: a bit that flips would have bytes leave twice, or never.
    sum: usize,
}

/// Position of the finder of one format in a stream.
#[derive(Debug)]
pub(super) struct Finder<F = ImuFormat> {
    format: F,
    /// A copy of the format: a bit that flips would have frames read as another format's.
    again: F,
    /// Unread bytes without which the head cannot be decided. It saves a scan at every byte of a
    /// slow line.
    needed: usize,
    /// The last thing found was a good message, so the next byte should start one.
    aligned: bool,
    /// Length of the last frame.
    usual: usize,
    /// Bytes of garbage since the last message, good or damaged.
    garbage: u32,
    /// Bytes to come of a message longer than [`LONGEST`].
    long: usize,
    /// Check of the three lengths: a bit that flips would have frames wait for bytes to come.
    sum: usize,
}

impl Unread {
    pub(super) const fn new() -> Unread {
        Unread {
            buffer: [0; CAPACITY],
            start: 0,
            end: 0,
            sum: 0,
        }
    }

    /// After every change of the places.
    #[inline(always)]
    fn seal(&mut self) {
        self.sum = self.places();
    }

    #[inline(always)]
    fn places(&self) -> usize {
        self.start ^ self.end.rotate_left(16)
    }

    /// Any number but 0 where an upset of memory has put the start behind the end.
    pub(super) fn len(&self) -> usize {
        self.end.wrapping_sub(self.start)
    }

    pub(super) fn clear(&mut self) {
        (self.start, self.end, self.sum) = (0, 0, 0);
    }

    /// Bytes from the `skipped`th on.
    #[inline(always)]
    pub(super) fn from(&self, skipped: usize) -> &[u8] {
        let from = self.start + skipped;
        self.buffer.get(from..self.end).unwrap_or_default()
    }

    /// See [`Framer::push`].
    #[inline(never)] // not on the way of a sample
    pub(super) fn push(&mut self, bytes: &[u8]) -> usize {
        let taken = self.fill(bytes.len(), |room| {
            for (place, byte) in room.iter_mut().zip(bytes) {
                *place = *byte;
            }
            Ok::<_, core::convert::Infallible>(room.len().min(bytes.len()))
        });
        taken.unwrap_or_default()
    }

    /// See [`Framer::fill`].
    #[inline(always)]
    pub(super) fn fill<E>(
        &mut self,
        wanted: usize,
        read: impl FnOnce(&mut [u8]) -> Result<usize, E>,
    ) -> Result<usize, E> {
        // the two comparisons always hold; they show the compiler that `copy_within` cannot fail
        if wanted > CAPACITY - self.end && self.start <= self.end && self.end <= CAPACITY {
            self.buffer.copy_within(self.start..self.end, 0);
            self.end -= self.start;
            self.start = 0;
            self.seal();
        }
        let room = self.buffer.get_mut(self.end..).unwrap_or_default();
        let len = room.len();
        let taken = read(room)?.min(len);
        self.end += taken;
        self.seal();
        Ok(taken)
    }

    /// The first `len`, which are then read.
    #[inline(always)]
    pub(super) fn take(&mut self, len: usize) -> &mut [u8] {
        let start = self.start;
        self.start = (start + len).min(self.end);
        self.seal();
        self.buffer.get_mut(start..self.start).unwrap_or_default()
    }
}

impl<F: Framing> Finder<F> {
    pub(super) const fn new(format: F) -> Finder<F> {
        Finder {
            format,
            again: format,
            needed: 0,
            aligned: false,
            usual: 0,
            garbage: 0,
            long: 0,
            sum: 0,
        }
    }

    /// After every change of the lengths.
    #[inline(always)]
    fn seal(&mut self) {
        self.sum = self.lengths();
    }

    /// Each is shorter than 2^17.
    #[inline(always)]
    fn lengths(&self) -> usize {
        self.needed ^ self.usual.rotate_left(16) ^ self.long.rotate_left(8)
    }

    pub(super) fn format(&self) -> F {
        self.format
    }

    /// Kind and length of the bytes with which `unread` begins. `None` when more are needed.
    #[inline(never)] // three callers
    pub(super) fn find(&mut self, unread: &[u8]) -> Option<(Kind, usize)> {
        if unread.is_empty() || unread.len() < self.needed {
            return None; // one byte may show that this is no message
        }
        let bytes = head(unread, LONGEST);
        let usual = self.format.usual(bytes).map(Scan::Frame);
        let first = usual.unwrap_or_else(|| self.format.scan(bytes));
        if let Scan::Frame(len) = first
            && self.long == 0
        {
            // as in `found`
            (self.needed, self.aligned, self.usual, self.garbage) = (0, true, len, 0);
            self.seal();
            return Some((Kind::Frame, len));
        }
        let found = self.look(unread, first);
        self.seal();
        found
    }

    /// `first`: what its first byte begins.
    #[inline(never)]
    fn look(&mut self, unread: &[u8], first: Scan) -> Option<(Kind, usize)> {
        let mut first = Some(first);
        let mut skipped = 0;
        let (kind, len) = loop {
            if skipped > 0 && skipped == self.long {
                break (Kind::Garbage, skipped); // what is behind a long message is not its own
            }
            let rest = unread.get(skipped..)?;
            let rest = head(rest, LONGEST); // the answer must not depend on how much has come
            let inside = self.long > 0;
            let expected = self.format.has_start_mark() || (self.aligned && skipped == 0);
            let scan = first.take().unwrap_or_else(|| self.format.scan(rest));
            match scan {
                Scan::Partial(needed) if needed <= LONGEST => {
                    if skipped == 0 {
                        self.needed = needed;
                        return None;
                    }
                    break (Kind::Garbage, skipped);
                }
                Scan::Partial(_) if skipped > 0 && !inside => break (Kind::Garbage, skipped),
                Scan::Partial(len) => {
                    self.long = self.long.max(skipped + len); // both counted from the head
                    skipped += 1;
                }
                Scan::Garbage => skipped += 1,
                // only a byte that looks like a start mark
                Scan::BadChecksum if !expected || inside => skipped += 1,
                // garbage first, the message with the next call
                _ if skipped > 0 => break (Kind::Garbage, skipped),
                Scan::BadChecksum => break (Kind::BadChecksum, 1),
                Scan::Frame(len) => break (Kind::Frame, len),
                Scan::Other(len) => break (Kind::Other, len),
            }
        };
        let known = UNKNOWN_AFTER.saturating_sub(self.garbage) as usize;
        let turns = kind == Kind::Garbage && self.long == 0 && known > 0;
        Some(self.found(kind, if turns { len.min(known) } else { len }))
    }

    /// Notes so many bytes of this kind. Separates garbage from a long message and from an unknown
    /// format, and gives the bytes that are of this kind.
    fn found(&mut self, kind: Kind, len: usize) -> (Kind, usize) {
        self.needed = 0;
        if self.long > 0 {
            if kind == Kind::Garbage {
                let len = len.min(self.long);
                self.long -= len;
                return (Kind::Long, len);
            }
            self.long = 0;
        }
        self.aligned = matches!(kind, Kind::Frame | Kind::Other);
        if kind == Kind::Frame {
            self.usual = len;
        }
        self.garbage = match kind {
            Kind::Garbage => self.garbage.saturating_add(len as u32),
            _ => 0,
        };
        if self.garbage > UNKNOWN_AFTER {
            (Kind::Unknown, len)
        } else {
            (kind, len)
        }
    }
}

impl<F: Framing> Framer<F> {
    /// An empty one.
    pub const fn new(format: F) -> Framer<F> {
        Framer {
            bytes: Unread::new(),
            finder: Finder::new(format),
        }
    }

    /// Restarts with this format, in place: a new framer would be built on the stack first. Pending
    /// bytes are dropped.
    pub fn restart(&mut self, format: F) {
        self.bytes.clear();
        self.finder = Finder::new(format);
    }

    /// The format that it looks for.
    pub fn format(&self) -> F {
        self.finder.format
    }

    /// The format, if both copies agree: after an upset they may not.
    pub fn certain_format(&self) -> Option<F> {
        Some(self.finder.format).filter(|format| *format == self.finder.again)
    }

    /// Whether what it knows of its bytes can be: after an upset of memory it may not.
    #[inline(always)]
    pub fn is_intact(&self) -> bool {
        self.bytes.sum == self.bytes.places()
            && self.finder.sum == self.finder.lengths()
            && self.finder.format == self.finder.again
    }

    /// Bytes that were received and have not left in an event yet.
    pub fn pending(&self) -> usize {
        self.bytes.len()
    }

    /// Bytes that must come before there can be another event, at least 1. Between two messages it
    /// is the length of the last frame. So a frame like the last one waits for nothing, and a
    /// shorter message waits for the next look.
    pub fn needs(&self) -> usize {
        match self.pending() {
            0 if self.finder.aligned => self.finder.usual.max(1),
            pending => self.finder.needed.saturating_sub(pending).max(1),
        }
    }

    /// Receives bytes and returns how many found room. All of them do if at most [`LONGEST`] are
    /// pushed at a time and all events are taken in between.
    pub fn push(&mut self, bytes: &[u8]) -> usize {
        self.bytes.push(bytes)
    }

    /// Pushes bytes that `read` puts into the room it is given, which has at least `wanted` bytes
    /// if so many may be pushed. It returns how many it has put there.
    ///
    /// # Errors
    /// The error of `read`; nothing is received then.
    #[inline(always)]
    pub fn fill<E>(
        &mut self,
        wanted: usize,
        read: impl FnOnce(&mut [u8]) -> Result<usize, E>,
    ) -> Result<usize, E> {
        self.bytes.fill(wanted, read)
    }

    /// The next event; `None` when more bytes are needed.
    pub fn next_event(&mut self) -> Option<Event<'_, F>> {
        let Unread { start, end, .. } = self.bytes;
        if start == end {
            return None; // after most frames
        }
        let (kind, len) = self.finder.find(self.bytes.buffer.get(start..end)?)?;
        let next = (start + len).min(end);
        self.bytes.start = next;
        self.bytes.seal();
        Some(Event {
            kind,
            format: &self.finder.format,
            bytes: self.bytes.buffer.get_mut(start..next)?,
        })
    }

    /// Whether the last bytes were a good message, so that the next byte should start one.
    pub fn is_aligned(&self) -> bool {
        self.finder.aligned
    }

    /// Returns what is left as garbage: for a line that has fallen silent.
    pub fn flush(&mut self) -> Option<Event<'_, F>> {
        self.finder.long = 0;
        let left = match self.pending() {
            0 => None,
            len => Some(self.finder.found(Kind::Garbage, len)),
        };
        self.finder.seal();
        left.map(|(kind, len)| self.give_out(kind, len))
    }

    fn give_out(&mut self, kind: Kind, len: usize) -> Event<'_, F> {
        Event {
            kind,
            format: &self.finder.format,
            bytes: self.bytes.take(len),
        }
    }
}

#[cfg(test)]
pub(super) mod tests;
