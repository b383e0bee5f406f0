//! The plan of the frames that are cut.

/// Encoding of values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Word {
    /// 24 bits, most significant byte first.
    I24,
    /// 32 bits, least significant byte first; the second of three values is negated.
    I32,
    /// Floats, most significant byte first.
    F32,
}

impl Word {
    /// Bytes of a value.
    #[inline(always)]
    pub const fn bytes(self) -> u8 {
        match self {
            Word::I24 => 3,
            Word::I32 | Word::F32 => 4,
        }
    }
}

/// Bytes that a byte waits for. The last byte of 24 bits decides on the first. Where the least
/// significant byte comes first, each is known at once, unless the value saturates: waiting for two
/// then leaves the lowest byte only behind, and for one at least the mark and the type of the IMU
/// behind it stay together. The first byte of a float follows from three
/// ([`crate::remainder::first_byte`]).
pub const HOLD: u8 = 2;

/// Most bytes of a frame that are looked at.
pub const CHECKS: usize = 9;

/// No position in a frame.
pub const NOWHERE: u8 = u8::MAX;

/// Changes of the frames of one kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// Encoding of their values.
    pub word: Word,
    /// Bytes of a frame; the last four are its CRC.
    pub len: u8,
    /// Zeros that the CRC covers behind the frame's other bytes.
    pub zeros: u8,
    /// Offsets of the values, in the order in which they come; [`NOWHERE`] behind the last one.
    pub at: [u8; 6],
    /// Places and bytes by which a frame is of this kind, in the order in which they come.
    pub checks: [(u8, u8); CHECKS],
    /// Bits to be inverted in the first byte.
    pub first: u8,
    /// Offset and bits of the mark of our own fault; [`NOWHERE`]: none.
    pub mark: (u8, u8),
}

impl Plan {
    /// A plan for no frame.
    pub const NONE: Plan = Plan {
        word: Word::I24,
        len: 0,
        zeros: 0,
        at: [NOWHERE; 6],
        checks: [(NOWHERE, 0); CHECKS],
        first: 0,
        mark: (NOWHERE, 0),
    };

    /// Check of all of it.
    pub(super) fn checked(&self) -> u32 {
        let Plan {
            word,
            len,
            zeros,
            at: [a, b, c, d, e, f],
            checks,
            first,
            mark,
        } = *self;
        let few = [
            [a, b, c, d],
            [e, f, len, zeros],
            [first, mark.0, mark.1, word as u8],
        ];
        let checks = checks.iter().map(|(at, byte)| [*at, *byte, 0, 0]);
        let parts = few.into_iter().chain(checks).map(u32::from_le_bytes);
        parts.fold(0x5A5A, mixed)
    }
}

/// A check with one word more.
#[inline(always)]
pub(super) fn mixed(sum: u32, part: u32) -> u32 {
    sum.rotate_left(7) ^ part
}
