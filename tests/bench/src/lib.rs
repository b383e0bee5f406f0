//! What tests share.

pub mod recordings;
