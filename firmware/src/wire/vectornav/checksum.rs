//! The CRC-16 of VectorNav's binary messages: over all bytes behind the start mark, high byte
//! first.

use super::layout::TRAILER;
use crate::wire::checksum::{XMODEM, xmodem};
use crate::wire::field::{head, put, take};
use crc::Digest;

fn checksum(message: &[u8]) -> u16 {
    let crc = message.len().saturating_sub(TRAILER);
    xmodem(message.get(1..crc).unwrap_or_default())
}

/// Whether the CRC is right.
pub fn is_right(message: &[u8]) -> bool {
    let crc = message.len().saturating_sub(TRAILER);
    checksum(message) == u16::from_be_bytes(take(message, crc))
}

/// Recomputes the CRC.
pub fn seal(message: &mut [u8]) {
    let crc = message.len().saturating_sub(TRAILER);
    let sum = checksum(message);
    put(message, crc, sum.to_be_bytes());
}

/// Changes of a message, from front to back, and how its CRC changes with them: CRCs are linear.
pub struct Difference<'m> {
    message: &'m mut [u8],
    /// CRC from zero of the bits changed so far.
    digest: Digest<'static, u16>,
    /// End of the last change; 0: there is none yet.
    end: usize,
}

impl<'m> Difference<'m> {
    /// No change yet.
    pub fn of(message: &'m mut [u8]) -> Difference<'m> {
        Difference {
            message,
            digest: XMODEM.digest(), // from zero and without inversion
            end: 0,
        }
    }

    /// Bytes of the message.
    pub fn bytes<const N: usize>(&self, at: usize) -> [u8; N] {
        take(self.message, at)
    }

    /// Writes bytes at a position no less than the end of the last change.
    pub fn put<const N: usize>(&mut self, at: usize, bytes: [u8; N]) {
        let mut bits: [u8; N] = take(self.message, at);
        put(self.message, at, bytes);
        for (bit, byte) in bits.iter_mut().zip(bytes) {
            *bit ^= byte;
        }
        if self.end != 0 {
            self.skip(at);
        }
        self.digest.update(&bits);
        self.end = at + N;
    }

    /// Sets bits of a little-endian word.
    pub fn set(&mut self, at: usize, bits: u16) {
        let word = u16::from_le_bytes(self.bytes(at)) | bits;
        self.put(at, word.to_le_bytes());
    }

    /// Bytes that have not changed, up to `at`.
    fn skip(&mut self, at: usize) {
        const ZEROS: [u8; 64] = [0; 64];
        let mut left = at.saturating_sub(self.end);
        while left > 0 {
            let zeros = head(&ZEROS, left);
            self.digest.update(zeros);
            left -= zeros.len();
        }
    }

    /// Changes the CRC.
    pub fn finish(mut self) {
        if self.end == 0 {
            return;
        }
        let crc = self.message.len().saturating_sub(TRAILER);
        self.skip(crc);
        let sum = u16::from_be_bytes(take(self.message, crc)) ^ self.digest.finalize();
        put(self.message, crc, sum.to_be_bytes());
    }
}
