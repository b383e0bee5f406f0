//! Counters since power-on.
//!
//! A counter that is full no longer changes. A check that watches for changes would take that for a
//! device that has stopped. So the counters have 64 bits, which nothing fills: bytes at 12 Mbit/s
//! take 400 000 years. Only the values for the command link saturate at 32 bits
//! ([`Count::saturated`]).

use crate::wire::command::Counters;

/// A counter that comes to no end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Count(u64);

/// All counters of the application.
pub(super) type Counts = Counters<Count>;

impl Count {
    /// A counter with this value.
    pub const fn of(counted: u64) -> Count {
        Count(counted)
    }

    #[inline(always)]
    pub fn add(&mut self, by: u32) {
        self.0 = self.0.wrapping_add(u64::from(by));
    }

    /// Whether nothing was counted.
    pub fn is_zero(self) -> bool {
        self.0 == 0
    }

    /// Number of events since `then`.
    pub fn since(self, then: Count) -> u64 {
        self.0.wrapping_sub(then.0)
    }

    /// Modulo 2^32, for who compares short differences.
    pub fn low(self) -> u32 {
        self.0 as u32
    }

    /// Value for the command link, which saturates.
    pub fn saturated(self) -> u32 {
        u32::try_from(self.0).unwrap_or(u32::MAX)
    }
}

impl Counts {
    /// Counters that all have this value.
    pub fn all(counted: u64) -> Counts {
        Counts::default().map(|_| Count::of(counted))
    }

    /// Values for the command link.
    #[inline(never)]
    pub fn saturated(&self) -> Counters {
        self.map(Count::saturated)
    }

    fn map<T>(&self, of: impl Fn(Count) -> T) -> Counters<T> {
        Counters {
            frames: of(self.frames),
            others: of(self.others),
            bad_checksums: of(self.bad_checksums),
            garbage: of(self.garbage),
            lost: of(self.lost),
            missed: of(self.missed),
            duplicates: of(self.duplicates),
            jumps: of(self.jumps),
            silences: of(self.silences),
            dropped: of(self.dropped),
            raw: of(self.raw),
            saturated: of(self.saturated),
            blocks: of(self.blocks),
            given_up: of(self.given_up),
            requests: of(self.requests),
            answered: of(self.answered),
            fixes: of(self.fixes),
            good_fixes: of(self.good_fixes),
            entered: self.entered.map(&of),
            restarts: of(self.restarts),
            mended: of(self.mended),
        }
    }
}
