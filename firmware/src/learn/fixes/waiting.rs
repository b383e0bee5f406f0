//! Samples that wait while an alignment computes a fix, or the navigator starts.

use crate::sample::Counts;

/// So many samples at most: 8 ms at 2000 Hz, the time of a million instructions.
const ROOM: usize = 16;

/// A queue of samples.
#[derive(Debug, Clone)]
pub struct Waiting {
    samples: [Counts; ROOM],
    first: usize,
    len: usize,
    /// The last one that was taken has filled a piece, which must end next.
    pub ends: bool,
}

impl Default for Waiting {
    fn default() -> Waiting {
        Waiting {
            samples: [Counts::default(); ROOM],
            first: 0,
            len: 0,
            ends: false,
        }
    }
}

impl Waiting {
    /// No sample waits, nor the end of a piece.
    pub fn is_empty(&self) -> bool {
        self.len == 0 && !self.ends
    }

    /// There is no room for another one.
    pub fn is_full(&self) -> bool {
        self.len == ROOM
    }

    /// Puts a sample at the end. False: there is no room.
    pub fn push(&mut self, counts: &Counts) -> bool {
        let place = self.samples.get_mut((self.first + self.len) % ROOM);
        match place {
            Some(place) if self.len < ROOM => {
                *place = *counts;
                self.len += 1;
                true
            }
            _ => false,
        }
    }

    /// Takes the first sample.
    pub fn pop(&mut self) -> Option<Counts> {
        if self.len == 0 {
            return None;
        }
        let counts = self.samples.get(self.first).copied();
        self.first = (self.first + 1) % ROOM;
        self.len -= 1;
        counts
    }
}
