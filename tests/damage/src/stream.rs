//! A stream of good frames and damage, with the position of each piece.

use crate::kind::{self, Kind};
use crate::protocol::{Protocol, Speaker, all};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::ops::Range;

/// A piece of a stream.
#[derive(Debug, Clone)]
pub struct Piece {
    /// Its position, bytes.
    pub at: Range<usize>,
    /// Kind of damage; `None`: an undamaged frame.
    pub damage: Option<Kind>,
    /// The frame as it would have been without the damage.
    pub frame: Vec<u8>,
}

/// A damaged stream.
#[derive(Debug)]
pub struct Stream {
    /// The sensor that sends.
    pub speaker: Speaker,
    /// The bytes.
    pub bytes: Vec<u8>,
    /// Its pieces, without a gap. The zeros at the end belong to none.
    pub pieces: Vec<Piece>,
}

/// Zeros at the end, so that the last false start does not wait for more bytes.
const END: usize = 600;

impl Stream {
    /// Chunk `number` of a protocol: about `len` bytes, and always the same ones.
    pub fn new(protocol: Protocol, number: u64, len: usize) -> Stream {
        let mut rng = rng(protocol, number, 0);
        let speaker = protocol.speaker(number as usize);
        let foreign: Vec<_> = all()
            .into_iter()
            .filter(|other| other.name() != protocol.name())
            .flat_map(|other| (0..4).map(move |n| other.speaker(n)))
            .map(|speaker| speaker.frame(rng.random(), &mut rng))
            .collect();
        let mut stream = Stream {
            speaker,
            bytes: Vec::with_capacity(len + 1000),
            pieces: Vec::new(),
        };
        let mut n = 0;
        while stream.bytes.len() < len {
            for _ in 0..rng.random_range(1..=6) {
                n += 1;
                let frame = speaker.frame(n, &mut rng);
                stream.add(frame.clone(), None, frame);
            }
            // one piece of damage, at times several in a row
            for _ in 0..[1, 1, 1, 2, 4][rng.random_range(0..5)] {
                n += 1;
                let kind = kind::ALL[rng.random_range(0..kind::ALL.len())];
                let frame = speaker.frame(n, &mut rng);
                let other = &foreign[rng.random_range(0..foreign.len())];
                let bytes = kind.damage(&frame, other, &mut rng);
                let damage = (bytes != frame).then_some(kind);
                stream.add(bytes, damage, frame);
            }
        }
        stream.bytes.extend([0; END]);
        stream
    }

    fn add(&mut self, bytes: Vec<u8>, damage: Option<Kind>, frame: Vec<u8>) {
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let at = start..self.bytes.len();
        self.pieces.push(Piece { at, damage, frame });
    }

    /// The pieces that these bytes touch, and their neighbours.
    pub fn around(&self, bytes: &Range<usize>) -> &[Piece] {
        let first = self
            .pieces
            .partition_point(|piece| piece.at.end <= bytes.start);
        let last = self
            .pieces
            .partition_point(|piece| piece.at.start < bytes.end);
        &self.pieces[first.saturating_sub(1)..(last + 1).min(self.pieces.len())]
    }
}

/// The random numbers of a chunk: the same on every machine.
pub fn rng(protocol: Protocol, chunk: u64, purpose: u8) -> ChaCha8Rng {
    let mut seed = [0; 32];
    seed[..8].copy_from_slice(&chunk.to_le_bytes());
    seed[8] = purpose;
    let name = protocol.name().as_bytes();
    seed[16..16 + name.len()].copy_from_slice(name);
    ChaCha8Rng::from_seed(seed)
}
