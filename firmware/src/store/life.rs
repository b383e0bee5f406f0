//! The device's life in a record.

use crate::wire::field::{put, take};

/// Bytes of [`Life`].
pub const LIFE_LEN: usize = 20;

/// Counters of the device's whole life, as of the last record stored: what has happened since then
/// is lost with the power. They saturate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Life {
    /// Times the device started.
    pub starts: u32,
    /// Number of these that followed a failure: a watchdog, a fault of the processor, a clock that
    /// stopped.
    pub failures: u32,
    /// Time it ran, minutes.
    pub minutes: u32,
    /// Times each slot was erased.
    pub erased: [u32; 2],
}

impl Life {
    /// The stored form: five u32, little-endian, in the order of the fields.
    #[must_use]
    pub fn bytes(&self) -> [u8; LIFE_LEN] {
        let [first, second] = self.erased;
        let mut bytes = [0; LIFE_LEN];
        let words = [self.starts, self.failures, self.minutes, first, second];
        for (number, word) in words.into_iter().enumerate() {
            put(&mut bytes, 4 * number, word.to_le_bytes());
        }
        bytes
    }

    /// The inverse of [`Life::bytes`].
    #[must_use]
    pub fn of(bytes: &[u8; LIFE_LEN]) -> Life {
        let word = |number: usize| u32::from_le_bytes(take(bytes, 4 * number));
        Life {
            starts: word(0),
            failures: word(1),
            minutes: word(2),
            erased: [word(3), word(4)],
        }
    }

    /// The sum with a later part of the life.
    #[must_use]
    pub(super) fn and(self, later: &Life) -> Life {
        let [first, second] = self.erased;
        let [third, fourth] = later.erased;
        Life {
            starts: self.starts.saturating_add(later.starts),
            failures: self.failures.saturating_add(later.failures),
            minutes: self.minutes.saturating_add(later.minutes),
            erased: [first.saturating_add(third), second.saturating_add(fourth)],
        }
    }
}
