//! The kinds of damage.

use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

/// Damage to a frame, or bytes between frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// One wrong bit.
    Bit,
    /// 2 to 8 wrong bits.
    Bits,
    /// 2 to 16 bytes in a row are random.
    Burst,
    /// 1 to 4 bytes are missing.
    Drop,
    /// The end is missing.
    Truncate,
    /// The beginning is missing.
    Behead,
    /// 1 to 8 random bytes more.
    Insert,
    /// A piece comes twice.
    Duplicate,
    /// Two pieces are exchanged.
    Swap,
    /// The beginning of a frame without the rest: the worst noise.
    Beginning,
    /// A beginning with one wrong byte: wrong lengths and kinds.
    Lie,
    /// Random bytes with start marks among them.
    Noise,
    /// The same byte for long: a broken line.
    Stuck,
    /// A good frame of another protocol.
    Foreign,
}

/// All kinds.
pub const ALL: [Kind; 14] = [
    Kind::Bit,
    Kind::Bits,
    Kind::Burst,
    Kind::Drop,
    Kind::Truncate,
    Kind::Behead,
    Kind::Insert,
    Kind::Duplicate,
    Kind::Swap,
    Kind::Beginning,
    Kind::Lie,
    Kind::Noise,
    Kind::Stuck,
    Kind::Foreign,
];

impl Kind {
    /// The bytes that replace this frame, which has at least 8 bytes.
    pub fn damage(self, frame: &[u8], foreign: &[u8], rng: &mut impl Rng) -> Vec<u8> {
        let mut bytes = frame.to_vec();
        let len = bytes.len();
        let random = |rng: &mut _, count| random_bytes(rng, count);
        match self {
            Kind::Bit => flip(&mut bytes, rng),
            Kind::Bits => {
                for _ in 0..rng.random_range(2..=8) {
                    flip(&mut bytes, rng);
                }
            }
            Kind::Burst => {
                let (at, count) = piece(rng, len, 2..17);
                bytes.splice(at..at + count, random(rng, count));
            }
            Kind::Drop => {
                let (at, count) = piece(rng, len, 1..5);
                bytes.drain(at..at + count);
            }
            Kind::Truncate => bytes.truncate(rng.random_range(1..len)),
            Kind::Behead => {
                bytes.drain(..rng.random_range(1..len));
            }
            Kind::Insert => {
                let (at, count) = (rng.random_range(1..len), rng.random_range(1..=8));
                bytes.splice(at..at, random(rng, count));
            }
            Kind::Duplicate => {
                let (at, count) = piece(rng, len, 1..17);
                let twice = bytes[at..at + count].to_vec();
                bytes.splice(at..at, twice);
            }
            Kind::Swap => {
                let half = len / 2;
                let (a, count) = piece(rng, half, 1..9);
                let b = rng.random_range(half..=len - count);
                for k in 0..count {
                    bytes.swap(a + k, b + k);
                }
            }
            Kind::Beginning => bytes.truncate(rng.random_range(1..len)),
            Kind::Lie => {
                bytes.truncate(rng.random_range(2..=len.min(24)));
                let at = rng.random_range(1..bytes.len());
                bytes[at] = rng.random();
            }
            Kind::Noise => {
                let count = rng.random_range(1..300);
                bytes = random(rng, count);
                for _ in 0..rng.random_range(0..4) {
                    let mark = &frame[..rng.random_range(1..=4)];
                    let at = rng.random_range(0..bytes.len());
                    let end = (at + mark.len()).min(bytes.len());
                    bytes[at..end].copy_from_slice(&mark[..end - at]);
                }
            }
            Kind::Stuck => {
                let byte = [0x00, 0xFF, rng.random()][rng.random_range(0..3)];
                bytes = vec![byte; rng.random_range(1..400)];
            }
            Kind::Foreign => bytes = foreign.to_vec(),
        }
        bytes
    }
}

fn random_bytes(rng: &mut impl Rng, count: usize) -> Vec<u8> {
    (0..count).map(|_| rng.random()).collect()
}

fn flip(bytes: &mut [u8], rng: &mut impl Rng) {
    let bit = rng.random_range(0..8 * bytes.len());
    bytes[bit / 8] ^= 1 << (bit % 8);
}

/// A random piece of `len` bytes: start and length.
fn piece(rng: &mut impl Rng, len: usize, counts: core::ops::Range<usize>) -> (usize, usize) {
    let count = rng.random_range(counts).min(len);
    (rng.random_range(0..=len - count), count)
}
