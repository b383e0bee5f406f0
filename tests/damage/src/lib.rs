//! Damaged streams for every byte protocol, and a judge of what is read from them.
//!
//! A stream is made of good frames and damage ([`stream`]). It notes the position of each undamaged
//! frame. That is the oracle, independent of the reader under test. The judge ([`judge`]) reads the
//! stream in pieces and checks these rules:
//!
//! - every byte comes out once, in order;
//! - a message is accepted only if it was sent as it is, or if its checksum is right by the
//!   definition ([`checksum`]); a 32-bit checksum has no such accidents;
//! - every undamaged frame is accepted, unless such an accident or, on the command link, the damage
//!   in front of it reaches into it.
//!
//! A chunk is a million bytes. Its number is its seed, so each chunk can be made again alone.

pub mod checksum;
pub mod figures;
pub mod judge;
pub mod kind;
pub mod protocol;
pub mod stream;

/// Bytes of one chunk.
pub const CHUNK: usize = 1_000_000;
