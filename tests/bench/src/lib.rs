//! Helpers that tests share.

pub mod recordings;
