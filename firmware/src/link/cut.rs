//! Cut-through: the bytes of a frame leave corrected while the frame still arrives.
//!
//! The receiving interrupt hands each byte to [`Cut::came`] and sends what it returns. A byte
//! leaves when [`HOLD`] more have come. So every byte has the same delay. With the frame's last
//! byte all pending bytes leave, and the line's own pace spaces them.
//!
//! **Saturation.** A value whose least significant byte comes first is corrected byte by byte. That
//! it saturates is known with its last byte, when its first one has left. So it leaves with the
//! other three bytes of the greatest or the smallest number: at most 255 counts from it.
//!
//! **Floats.** Sign and exponent come first, and rounding can carry into them from the last byte.
//! The third byte decides on the first ([`crate::remainder::add_early`]). Where the sum then
//! begins otherwise, the nearest number leaves, and the next value makes good what it lacks. The
//! loop corrects frames of such a stream in the same way, so they leave as the same bytes.
//!
//! **Checksum.** CRCs are linear: the CRC of what leaves is that of what came, exclusive-or that of
//! the changed bits. Each byte of the CRC that comes is changed by this difference as long as all
//! before it were right. Let byte i be the first that disagrees with what came. Then what leaves
//! at i disagrees with what left, and the frame is as damaged as it was. The bytes behind i leave
//! as they come, since one that was lost makes them the next frame's.
//!
//! **Who decides.** The frame path gives the [`Plan`] ([`Cut::arm`]) and the byte of the stream
//! from which on it holds. From there every frame is cut that looks as planned, has followed the
//! last one without a byte between, and finds room. The first that does not ends it. What has left
//! is counted in bytes of the stream; the loop sends all that is behind ([`Cut::claim`]) as it
//! would without. Only one of both sends at a time: the loop ends the cutting before it sends.
//!
//! The interrupt has `Cut` for itself, and the loop has it with interrupts masked. Nothing here can
//! panic, and a byte costs a bounded number of steps.

mod behind;
mod crc;
mod plan;
#[cfg(test)]
mod tests;
mod value;

use crate::remainder::Owed;
pub use behind::Behind;
pub use crc::Crc;
use plan::mixed;
pub use plan::{CHECKS, HOLD, NOWHERE, Plan, Word};

/// Bytes that leave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Leaving {
    bytes: u32,
    len: u8,
}

impl Leaving {
    /// None.
    pub const NONE: Leaving = Leaving { bytes: 0, len: 0 };

    /// The oldest of them first.
    #[inline(always)]
    pub fn each(self, mut send: impl FnMut(u8)) {
        let mut left = self.len.min(4);
        while left > 0 {
            left -= 1;
            send((self.bytes >> (8 * left)) as u8);
        }
    }

    /// Number of bytes.
    pub fn len(self) -> usize {
        self.len.into()
    }

    /// Whether there are none.
    pub fn is_empty(self) -> bool {
        self.len == 0
    }
}

/// State of the cutting.
#[derive(Debug)]
pub struct Cut {
    plan: Plan,
    /// Correction of each value, and the remainder of earlier frames.
    due: [u64; 6],
    carried: [u32; 6],
    /// Remainder that the frame under way leaves; carried when its CRC was right.
    left: [u32; 6],
    /// Frames are cut.
    on: bool,
    /// Bytes of the frame under way.
    came: u8,
    /// The next value, and the next check.
    value: u8,
    check: u8,
    /// A byte of the CRC was wrong.
    wrong: bool,
    /// The last bytes as they will leave, the newest one lowest, and the bits of them that differ
    /// from what came.
    held: u32,
    bits: u32,
    /// Correction of the value under way, less its bytes that have come, and the carry included.
    adds: i32,
    /// CRC of what came, and of the bits changed in what has left.
    crc: u32,
    change: u32,
    /// Position in the stream of the frame under way or the next one, modulo 2^32.
    next: u32,
    /// Position behind the last byte that has left.
    gone: u32,
    /// Check of plan, dues and remainders.
    sum: u32,
}

impl Default for Cut {
    fn default() -> Cut {
        Cut::new()
    }
}

impl Cut {
    /// A state in which nothing is cut.
    pub const fn new() -> Cut {
        Cut {
            plan: Plan::NONE,
            due: [0; 6],
            carried: [0; 6],
            left: [0; 6],
            on: false,
            came: 0,
            value: 0,
            check: 0,
            wrong: false,
            held: 0,
            bits: 0,
            adds: 0,
            crc: 0,
            change: 0,
            next: 0,
            gone: 0,
            sum: 0,
        }
    }

    /// Whether frames are cut.
    pub fn is_on(&self) -> bool {
        self.on
    }

    /// Whether a frame is under way.
    pub fn is_within(&self) -> bool {
        self.on && self.came > 0
    }

    /// Frames are cut from this byte of the stream on. All before it has been sent. `owed` is in
    /// the order of the plan.
    pub fn arm(&mut self, plan: &Plan, owed: [Owed; 6], next: u32) {
        self.plan = *plan;
        (self.due, self.carried) = (owed.map(|owed| owed.due), owed.map(|owed| owed.left));
        (self.next, self.gone) = (next, next);
        self.begin();
        self.on = plan.len > 8;
        self.sum = self.checked();
    }

    /// Frames like a good one that has left, whose last byte is before `next`, are cut from there
    /// on. Where they are cut already, plan and dues become these as soon as no frame is under way.
    /// Gives what is left, in the order of the plan, if dues or plan have changed with frames being
    /// cut.
    pub fn offer(&mut self, plan: &Plan, owed: [Owed; 6], next: u32) -> Option<[u32; 6]> {
        if !self.on {
            // a loop that is late may not know yet what has left behind this frame
            if self.gone.wrapping_sub(next).cast_signed() <= 0 {
                self.arm(plan, owed, next);
            }
            return None;
        }
        if self.plan == *plan && self.due == owed.map(|owed| owed.due) {
            return None;
        }
        self.renew(plan, owed, next)
    }

    /// Another plan and other dues, if all bytes before `next` have left and none since. What is
    /// left stays, but nothing is owed where the correction of a float is zero. Gives what is
    /// left, in the order of the plan, or `None` if nothing was done.
    pub fn renew(&mut self, plan: &Plan, owed: [Owed; 6], next: u32) -> Option<[u32; 6]> {
        if !self.on || self.came != 0 || self.next != next {
            return None;
        }
        let left = self.carried;
        self.arm(plan, owed, next);
        for ((carried, due), left) in self.carried.iter_mut().zip(self.due).zip(left) {
            let zero = plan.word == Word::F32 && f32::from_bits(due as u32) == 0.0;
            *carried = if zero { *carried } else { left };
        }
        self.sum = self.checked();
        Some(self.carried)
    }

    /// The loop sends something that is no frame. False: not now, a frame is under way.
    pub fn stop(&mut self) -> bool {
        let free = !self.is_within();
        if free {
            self.on = false;
        }
        free
    }

    /// How many of `len` bytes from this position of the stream on have left. If not all have, the
    /// cutting ends, and the rest is to be sent by whoever asks.
    pub fn claim(&mut self, start: u32, len: u32) -> u32 {
        let gone = self.gone.wrapping_sub(start).cast_signed();
        let gone = gone.clamp(0, len.cast_signed().max(0)).cast_unsigned();
        if gone < len {
            self.on = false;
            self.gone = start.wrapping_add(len);
        }
        gone
    }

    /// The cutting ends, wherever it is. The pending bytes are the loop's.
    pub fn end(&mut self) {
        self.on = false;
    }

    fn begin(&mut self) {
        (self.came, self.value, self.check) = (0, 0, 0);
        (self.wrong, self.held, self.bits, self.change) = (false, 0, 0, 0);
        self.crc = Crc::of(self.plan.word).start();
    }

    fn checked(&self) -> u32 {
        let owed = self.due.iter().zip(self.carried);
        owed.fold(self.plan.checked(), |sum, (due, left)| {
            [*due as u32, (*due >> 32) as u32, left]
                .into_iter()
                .fold(sum, mixed)
        })
    }

    /// A byte has come, at this position of the stream. `room`: bytes that find room at the output.
    /// What leaves always finds room.
    #[inline(never)]
    pub fn came(&mut self, place: u32, byte: u8, room: usize) -> Leaving {
        if !self.on {
            return Leaving::NONE;
        }
        let plan = &self.plan;
        let at = self.came;
        let fits = at > 0 || (room >= usize::from(plan.len) && self.sum == self.checked());
        if !fits || place != self.next.wrapping_add(at.into()) {
            self.on = false;
            return Leaving::NONE;
        }
        if let Some((where_, expected)) = plan.checks.get(usize::from(self.check))
            && *where_ == at
        {
            if *expected != byte {
                self.on = false;
                return Leaving::NONE;
            }
            self.check += 1;
        }
        self.take(at, byte);
        self.leave(at)
    }

    /// Takes a byte of the frame and changes the pending bytes.
    #[inline(always)]
    fn take(&mut self, at: u8, byte: u8) {
        let Plan { word, len, .. } = self.plan;
        let crc = Crc::of(word);
        self.held = self.held << 8 | u32::from(byte);
        self.bits <<= 8;
        let Some(n) = at.checked_sub(len.saturating_sub(4)) else {
            self.crc = crc.next(self.crc, byte);
            return self.change(at, byte);
        };
        if n == 0 {
            self.end_of_values();
        }
        if !self.wrong {
            self.held ^= u32::from(crc.byte(self.change, n));
        }
        self.wrong |= byte != crc.byte(self.crc, n);
    }

    /// The CRC's first byte has come: what it covers is complete.
    #[inline(always)]
    fn end_of_values(&mut self) {
        let Plan { word, zeros, .. } = self.plan;
        let crc = Crc::of(word);
        for place in (0..HOLD).rev() {
            self.change = crc.next(self.change, (self.bits >> (8 * (place + 1))) as u8);
        }
        for _ in 0..zeros.min(3) {
            self.crc = crc.next(self.crc, 0);
            self.change = crc.next(self.change, 0);
        }
    }

    /// Bytes that leave with the byte that has come.
    #[inline(always)]
    fn leave(&mut self, at: u8) -> Leaving {
        let Plan { word, len, .. } = self.plan;
        self.came = at + 1;
        if self.came < len {
            if at < HOLD {
                return Leaving::NONE;
            }
            self.gone = self.gone.wrapping_add(1);
            if at < len.saturating_sub(4) {
                let bits = (self.bits >> (8 * HOLD)) as u8;
                self.change = Crc::of(word).next(self.change, bits);
            }
            return Leaving {
                bytes: self.held >> (8 * HOLD),
                len: 1,
            };
        }
        let leaving = Leaving {
            bytes: self.held,
            len: HOLD + 1,
        };
        self.next = self.next.wrapping_add(len.into());
        self.gone = self.next;
        if self.wrong {
            self.on = false;
        } else {
            for ((carried, left), at) in self.carried.iter_mut().zip(self.left).zip(self.plan.at) {
                if at != NOWHERE {
                    *carried = left;
                }
            }
            self.sum = self.checked();
        }
        self.begin();
        leaving
    }
}
