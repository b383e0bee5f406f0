//! Faults as a decorator over a line, by seed: the effects of a cable, a wrong bit rate or a full
//! buffer.
//!
//! After the fault injector of `smoltcp`. All chances are per byte received, in parts of 65536,
//! except `full`, per message sent. The same seed gives the same faults.

use super::{Full, Line, Lost};

/// Probabilities of the faults. With all 0 the line is perfect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Chances {
    /// One bit of a byte is inverted.
    pub flip: u16,
    /// A byte is dropped.
    pub drop: u16,
    /// Random bytes replace a burst of 1 to 32 bytes.
    pub burst: u16,
    /// The line reports lost bytes.
    pub lost: u16,
    /// A message to be sent finds no room.
    pub full: u16,
}

/// Damage that was done so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Done {
    /// Bytes received that were corrupted, dropped or replaced.
    pub bytes: u32,
    /// Losses reported.
    pub lost: u32,
    /// Messages refused.
    pub full: u32,
}

/// A line with faults.
#[derive(Debug)]
pub struct Faulty<L> {
    line: L,
    /// May be changed while it runs.
    pub chances: Chances,
    random: u64,
    /// Bytes of a burst yet to come.
    burst: u8,
    done: Done,
}

impl<L> Faulty<L> {
    /// `seed` chooses the faults.
    pub fn new(line: L, chances: Chances, seed: u64) -> Faulty<L> {
        Faulty {
            line,
            chances,
            random: seed ^ 0x9E37_79B9_7F4A_7C15, // not 0 for small seeds
            burst: 0,
            done: Done::default(),
        }
    }

    /// The line inside.
    pub fn inner(&mut self) -> &mut L {
        &mut self.line
    }

    /// Damage that was done so far.
    pub fn done(&self) -> Done {
        self.done
    }

    /// Xorshift64 (Marsaglia 2003), its upper half.
    fn random(&mut self) -> u32 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        (self.random >> 32) as u32
    }

    fn happens(&mut self, chance: u16) -> bool {
        chance > 0 && (self.random() & 0xFFFF) < u32::from(chance)
    }

    /// Result of a byte.
    fn damage(&mut self, byte: u8) -> Option<u8> {
        if self.happens(self.chances.burst) {
            self.burst = (self.random() % 32 + 1) as u8;
        }
        if self.burst > 0 {
            self.burst -= 1;
            self.done.bytes += 1;
            return Some(self.random() as u8);
        }
        if self.happens(self.chances.drop) {
            self.done.bytes += 1;
            return None;
        }
        if self.happens(self.chances.flip) {
            self.done.bytes += 1;
            return Some(byte ^ 1 << (self.random() % 8));
        }
        Some(byte)
    }
}

impl<L: Line> Line for Faulty<L> {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        if self.happens(self.chances.lost) {
            self.done.lost += 1;
            return Err(Lost);
        }
        let received = self.line.receive(buffer)?;
        let mut kept = 0;
        for at in 0..received {
            let byte = buffer.get(at).copied().unwrap_or_default();
            if let Some(byte) = self.damage(byte)
                && let Some(place) = buffer.get_mut(kept)
            {
                *place = byte;
                kept += 1;
            }
        }
        Ok(kept)
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        if self.happens(self.chances.full) {
            self.done.full += 1;
            return Err(Full);
        }
        self.line.send(message)
    }

    fn poll(&mut self) {
        self.line.poll();
    }
}
