//! The device's key, and what is computed with it: keyed BLAKE2s (RFC 7693) with 32 bytes of key.
//!
//! Each message begins with a byte that states its purpose, so that a value of one purpose never
//! serves another. What follows has a fixed length but for the last part.
//!
//! Measured on the Cortex-M4F, BLAKE2s takes 6.0 kB of flash and 6400 instructions for the longest
//! packet; HMAC-SHA-256 takes 11.1 kB and 15 600.

use super::field::{put, take};
use blake2::Blake2sMac;
use blake2::digest::consts::U32;
use blake2::digest::{KeyInit, Mac};
use core::fmt;
use serde::{Deserialize, Serialize};
use subtle::ConstantTimeEq;

/// Bytes of a secret.
pub const SECRET_LEN: usize = 32;
/// Bytes of a [`Key`] as it is stored.
pub const KEY_LEN: usize = 1 + SECRET_LEN;

/// A secret that device and host share.
#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Secret(pub [u8; SECRET_LEN]);

impl fmt::Debug for Secret {
    /// Never the secret itself: requests are printed in errors.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret(..)")
    }
}

/// Key of the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Key {
    /// No choice was made yet: as delivered.
    #[default]
    Unprovisioned,
    /// Somebody chose to do without.
    OpenByChoice,
    /// Requests that change something need this.
    Secret(Secret),
}

/// The first byte of a stored key. Any two differ in four bits or more.
const UNPROVISIONED: u8 = 0x5A;
const OPEN_BY_CHOICE: u8 = 0xC3;
const WITH_SECRET: u8 = 0x3C;

impl Key {
    /// The stored form: the kind, then the secret or zeros.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; KEY_LEN] {
        let mut bytes = [0; KEY_LEN];
        let (first, rest) = match self {
            Key::Unprovisioned => (UNPROVISIONED, [0; SECRET_LEN]),
            Key::OpenByChoice => (OPEN_BY_CHOICE, [0; SECRET_LEN]),
            Key::Secret(Secret(secret)) => (WITH_SECRET, *secret),
        };
        put(&mut bytes, 0, [first]);
        put(&mut bytes, 1, rest);
        bytes
    }

    /// Decodes the stored form; `None`: it is none of this firmware's.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; KEY_LEN]) -> Option<Key> {
        let [first, secret @ ..] = bytes;
        match *first {
            UNPROVISIONED => Some(Key::Unprovisioned),
            OPEN_BY_CHOICE => Some(Key::OpenByChoice),
            WITH_SECRET => Some(Key::Secret(Secret(*secret))),
            _ => None,
        }
    }
}

/// A random number that the device makes for one session. A session is known by its first four
/// bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Challenge(pub [u8; 16]);

impl Challenge {
    /// Number by which packets name the session.
    #[must_use]
    pub fn session(&self) -> [u8; 4] {
        let [a, b, c, d, ..] = self.0;
        [a, b, c, d]
    }
}

/// Sender of the message that an authentication code covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// A request to the device.
    Request,
    /// Answer of the device.
    Answer,
}

impl Secret {
    /// All codes come from here, so that the image has the function once.
    #[inline(never)]
    fn code(&self, purpose: u8, parts: [&[u8]; 3]) -> [u8; 32] {
        let mut mac = Blake2sMac::<U32>::new(&self.0.into());
        mac.update(&[purpose]);
        for part in parts {
            mac.update(part);
        }
        mac.finalize().into_bytes().into()
    }

    /// A challenge from what is random, the number of challenges made, and the time. Without the
    /// secret nobody can foretell it.
    #[must_use]
    pub fn challenge(&self, random: &[u8; 32], made: u32, now_us: u64) -> Challenge {
        let parts = [&random[..], &made.to_le_bytes(), &now_us.to_le_bytes()];
        Challenge(take(&self.code(0, parts), 0))
    }

    /// The word by which the device knows at once, without any computing, that a packet with this
    /// counter comes from somebody who has the secret.
    #[must_use]
    pub fn door(&self, challenge: &Challenge, counter: u32) -> [u8; 4] {
        take(
            &self.code(1, [&challenge.0, &counter.to_le_bytes(), &[]]),
            0,
        )
    }

    /// The authentication code of a message: number and message as encoded.
    #[must_use]
    pub fn tag(
        &self,
        direction: Direction,
        challenge: &Challenge,
        counter: u32,
        message: &[u8],
    ) -> [u8; 16] {
        let purpose = match direction {
            Direction::Request => 2,
            Direction::Answer => 3,
        };
        let parts = [&challenge.0[..], &counter.to_le_bytes(), message];
        take(&self.code(purpose, parts), 0)
    }

    /// Whether this is the code of the message, in a time that does not reveal how much of it is
    /// right.
    #[must_use]
    pub fn verifies(
        &self,
        direction: Direction,
        challenge: &Challenge,
        counter: u32,
        message: &[u8],
        tag: &[u8; 16],
    ) -> bool {
        let right = self.tag(direction, challenge, counter, message);
        right.ct_eq(tag).into()
    }

    /// Veils a new secret that is sent under this one, or unveils it.
    #[must_use]
    pub fn veiled(&self, challenge: &Challenge, counter: u32, new: &Secret) -> Secret {
        let veil = self.code(4, [&challenge.0, &counter.to_le_bytes(), &[]]);
        let mut bytes = new.0;
        for (byte, veil) in bytes.iter_mut().zip(veil) {
            *byte ^= veil;
        }
        Secret(bytes)
    }
}

/// A digest, to distinguish contents. A CRC does not serve where the contents end with their own:
/// what follows such a part has the same CRC whatever is in it.
pub struct Digest(Secret);

impl Digest {
    /// The digest of nothing.
    #[must_use]
    pub fn new() -> Digest {
        Digest(Secret([0; SECRET_LEN]))
    }

    /// The next piece. Where a piece ends makes a difference.
    pub fn add(&mut self, piece: &[u8]) {
        self.0 = Secret(self.0.code(5, [piece, &[], &[]]));
    }

    /// The digest of all pieces so far.
    #[must_use]
    pub fn value(self) -> [u8; 16] {
        take(&self.0.0, 0)
    }
}

impl Default for Digest {
    fn default() -> Digest {
        Digest::new()
    }
}
