//! What stands before an image of an update: which board, version and place it is for, its digest,
//! and the signature over all of this.
//!
//! | offset | length | content |
//! |---|---|---|
//! | 0 | 4 | magic `LRNU` |
//! | 4 | 2 | version of this format, 1 |
//! | 6 | 6 | major, minor, patch of the firmware |
//! | 12 | 4 | address at which the image runs |
//! | 16 | 4 | its length, bytes |
//! | 20 | 12 | name of the board, padded with zeros |
//! | 32 | 32 | BLAKE2s of the image |
//! | 64 | 64 | ed25519 signature of bytes 0..64 |
//!
//! All numbers are little-endian. A file of an update is one header and image after the other, for
//! each slot of the board.

use crate::wire::field::{head, put, take};
use blake2::{Blake2s256, Digest as _};
use salty::{PublicKey, Signature};

/// Bytes of a header.
pub const HEADER_LEN: usize = 128;
/// Bytes of it that are signed.
pub const SIGNED_LEN: usize = 64;
/// The longest name of a board, bytes.
pub const BOARD_LEN: usize = 12;
/// Version of this format.
pub const VERSION: u16 = 1;
const MAGIC: [u8; 4] = *b"LRNU";

/// Fields of an image's header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Major, minor, patch of the firmware.
    pub version: [u16; 3],
    /// Address at which the image runs.
    pub address: u32,
    /// Length of the image, bytes.
    pub length: u32,
    /// Name of the board, padded with zeros.
    pub board: [u8; BOARD_LEN],
    /// BLAKE2s of the image.
    pub digest: [u8; 32],
}

impl Header {
    /// Decodes a header. The signature is not looked at. `None`: it is none of this format.
    #[must_use]
    pub fn parse(bytes: &[u8; HEADER_LEN]) -> Option<Header> {
        let number = |at| u16::from_le_bytes(take(bytes, at));
        (take(bytes, 0) == MAGIC && number(4) == VERSION).then(|| Header {
            version: [number(6), number(8), number(10)],
            address: u32::from_le_bytes(take(bytes, 12)),
            length: u32::from_le_bytes(take(bytes, 16)),
            board: take(bytes, 20),
            digest: take(bytes, 32),
        })
    }

    /// The bytes that are signed.
    #[must_use]
    pub fn signed(&self) -> [u8; SIGNED_LEN] {
        let mut bytes = [0; SIGNED_LEN];
        put(&mut bytes, 0, MAGIC);
        put(&mut bytes, 4, VERSION.to_le_bytes());
        for (at, number) in [6, 8, 10].into_iter().zip(self.version) {
            put(&mut bytes, at, number.to_le_bytes());
        }
        put(&mut bytes, 12, self.address.to_le_bytes());
        put(&mut bytes, 16, self.length.to_le_bytes());
        put(&mut bytes, 20, self.board);
        put(&mut bytes, 32, self.digest);
        bytes
    }
}

/// The name of a board as headers have it. `None`: it is too long.
#[must_use]
pub fn board(name: &str) -> Option<[u8; BOARD_LEN]> {
    let mut bytes = [0; BOARD_LEN];
    bytes
        .get_mut(..name.len())?
        .copy_from_slice(name.as_bytes());
    Some(bytes)
}

/// Digest of an image that comes in pieces.
pub fn digest<'b>(pieces: impl IntoIterator<Item = &'b [u8]>) -> [u8; 32] {
    let mut digest = Digest::new();
    pieces.into_iter().for_each(|piece| digest.add(piece));
    digest.value()
}

/// A digest in progress.
pub(super) struct Digest(Blake2s256);

impl Digest {
    pub fn new() -> Digest {
        Digest(Blake2s256::new())
    }

    pub fn add(&mut self, piece: &[u8]) {
        self.0.update(piece);
    }

    pub fn value(self) -> [u8; 32] {
        self.0.finalize().into()
    }
}

/// Whether a header is signed for this public key.
#[must_use]
#[inline(never)] // its stack is free again afterwards
pub fn is_signed(bytes: &[u8; HEADER_LEN], signer: &[u8; 32]) -> bool {
    let signed = head(bytes, SIGNED_LEN);
    let signature = Signature::from(&take::<64>(bytes, SIGNED_LEN));
    PublicKey::try_from(signer).is_ok_and(|key| key.verify(signed, &signature).is_ok())
}
