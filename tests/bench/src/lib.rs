//! Helpers that tests share: a line and flash in memory, and with feature `recordings` sessions.
//!
//! Two things are kept apart on purpose: the flash of the fuzz target `store` is an independent
//! model of the same chip, and what runs on the target has lines without a heap. A clock that a
//! test sets is a `Cell<u64>`.

pub mod flash;
pub mod line;
#[cfg(feature = "recordings")]
pub mod recordings;
