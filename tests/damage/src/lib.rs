//! Damaged streams for every protocol that comes as bytes, and a judge of what is read from them.
//!
//! A stream is made of good frames and damage ([`stream`]). It notes where each undamaged frame
//! stands. That is the oracle: the reader under test has no part in it. The judge ([`judge`]) reads
//! the stream in pieces and holds the reader to these promises:
//!
//! - every byte comes out once, in its place;
//! - a message is accepted only if it was sent so, or if its checksum is right, computed here from
//!   its definition ([`checksum`]); a 32-bit checksum has no such accidents;
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
