//! One protocol that may be on the line.

use super::ReceiverFormat;
use super::epoch::{Arrival, Head, Time, Values};
use crate::wire::framer::{Finder, Kind};

/// After so many epochs of the others, a protocol that has sent nothing since has left the line: 3
/// s beside one of 10 Hz.
const GONE: u8 = 30;

/// Finds the messages of one protocol, and knows what they gave.
#[derive(Debug)]
pub(super) struct Voice {
    finder: Finder<ReceiverFormat>,
    /// Bytes that it has read of the unread ones.
    read: usize,
    /// Of these behind its head, those that came before the last ones.
    before: usize,
    /// Arrival of the byte at its head.
    arrival: Arrival,
    /// What it has found next.
    next: Option<Piece>,
    /// Its newest epoch.
    time: Option<Time>,
    /// Values of a fix that it gave, a bit each.
    given: u8,
    /// Epochs of the others since its last good message.
    missed: u8,
}

/// A message, or bytes that are none.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub(super) format: ReceiverFormat,
    pub(super) kind: Kind,
    /// Place among the unread bytes, and length.
    pub(super) at: usize,
    pub(super) len: usize,
    /// Arrival of its first byte.
    pub(super) arrival: Arrival,
}

impl Voice {
    pub(super) const fn new(format: ReceiverFormat) -> Voice {
        Voice {
            finder: Finder::new(format),
            read: 0,
            before: 0,
            arrival: Arrival { us: 0, sample: 0 },
            next: None,
            time: None,
            given: 0,
            missed: GONE,
        }
    }

    pub(super) fn format(&self) -> ReceiverFormat {
        self.finder.format()
    }

    /// Bytes come behind the `unread` ones.
    pub(super) fn comes(&mut self, unread: usize, now: Arrival) {
        self.read = self.read.min(unread);
        self.before = unread - self.read;
        if self.before == 0 {
            self.arrival = now;
        }
    }

    /// Where the next piece ends; `None` when more bytes are needed. `last`: arrival of the last
    /// ones.
    pub(super) fn look(&mut self, unread: &[u8], last: Arrival) -> Option<usize> {
        if self.next.is_none() {
            let at = self.read;
            let (kind, len) = self.finder.find(unread.get(at..)?)?;
            self.next = Some(Piece {
                format: self.format(),
                kind,
                at,
                len,
                arrival: self.arrival,
            });
            self.read += len;
            if self.before <= len {
                self.arrival = last;
            }
            self.before = self.before.saturating_sub(len);
        }
        self.next.map(|piece| piece.at + piece.len)
    }

    pub(super) fn take(&mut self) -> Option<Piece> {
        self.next.take()
    }

    pub(super) fn read(&self) -> usize {
        self.read
    }

    /// So many bytes have left the front.
    pub(super) fn left(&mut self, len: usize) {
        self.read = self.read.saturating_sub(len);
    }

    /// A message of its own with these values, each alone. Whether it begins an epoch.
    pub(super) fn gives(&mut self, head: Option<Head>, values: &Values) -> bool {
        if self.is_gone() {
            self.given = 0;
        }
        (self.given, self.missed) = (self.given | values.given(), 0);
        let new = head
            .map(|head| head.time)
            .filter(|time| *time != Time::Same);
        let begins = new.is_some() && new != self.time;
        self.time = new.or(self.time);
        begins
    }

    /// An epoch of another one has begun.
    pub(super) fn misses(&mut self) {
        self.missed = self.missed.saturating_add(1);
    }

    fn is_gone(&self) -> bool {
        self.missed >= GONE
    }

    /// Whether it gives more values of a fix than the one in use.
    pub(super) fn is_better_than(&self, used: &Voice) -> bool {
        used.is_gone() || self.given.count_ones() > used.given.count_ones()
    }
}
