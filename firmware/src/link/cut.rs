//! Cut-through: the bytes of a frame leave corrected while the frame still arrives.
//!
//! The receiving interrupt hands each byte to [`Cut::came`] and sends what it gives. A byte leaves
//! when `hold` more have come: 2 where values have three bytes, 3 where they have four, for a value
//! is known with its last byte. So every byte has the same delay. With the frame's last byte all
//! that is held leaves, and the line's own pace spaces it.
//!
//! **Checksum.** CRCs are linear: the CRC of what leaves is that of what came, exclusive-or that of
//! the changed bits. Each byte of the CRC that comes is changed by this difference as long as all
//! before it were right. Let byte i be the first that disagrees with what came. Then what leaves
//! at i disagrees with what left, and the frame is as damaged as it was. The bytes behind i leave
//! as they come, since one that was lost makes them the next frame's.
//!
//! **Who decides.** The main loop tells the [`Plan`] ([`Cut::arm`]) and from which byte of the
//! stream on it holds. From there every frame is cut that looks as planned, has followed the last
//! one without a byte between, and finds room. The first that does not ends it. What has left is
//! counted in bytes of the stream; the loop sends all that is behind ([`Cut::claim`]) as it would
//! without. Only one of both sends at a time: the loop ends the cutting before it sends.
//!
//! The interrupt has `Cut` for itself, and the loop has it with interrupts masked. Nothing here can
//! panic, and a byte costs a bounded number of steps.

mod behind;
mod crc;
#[cfg(test)]
mod tests;

use crate::remainder::{Owed, add_carried, carried};
pub use behind::Behind;
pub use crc::Crc;

/// How values are written.
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

    /// Bytes that a byte waits for.
    pub const fn hold(self) -> u8 {
        self.bytes() - 1
    }
}

/// Most bytes of a frame that are looked at.
pub const CHECKS: usize = 9;

/// No place in a frame.
pub const NOWHERE: u8 = u8::MAX;

/// How frames of one kind are changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// How their values are written.
    pub word: Word,
    /// Bytes of a frame; the last four are its CRC.
    pub len: u8,
    /// Zeros that the CRC covers behind the frame's other bytes.
    pub zeros: u8,
    /// Where the values are, in the order in which they come; [`NOWHERE`] behind the last one.
    pub at: [u8; 6],
    /// Places and bytes by which a frame is of this kind, in the order in which they come.
    pub checks: [(u8, u8); CHECKS],
    /// Bits to be inverted in the first byte.
    pub first: u8,
    /// Place and bits of the mark of our own fault; [`NOWHERE`]: none.
    pub mark: (u8, u8),
}

impl Plan {
    /// Of no frame.
    pub const NONE: Plan = Plan {
        word: Word::I24,
        len: 0,
        zeros: 0,
        at: [NOWHERE; 6],
        checks: [(NOWHERE, 0); CHECKS],
        first: 0,
        mark: (NOWHERE, 0),
    };
}

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

    /// How many.
    pub fn len(self) -> usize {
        self.len.into()
    }

    /// Whether there are none.
    pub fn is_empty(self) -> bool {
        self.len == 0
    }
}

/// Where the cutting is.
#[derive(Debug)]
pub struct Cut {
    plan: Plan,
    /// What each value is corrected by, and what earlier frames have left of it.
    due: [u64; 6],
    carried: [u32; 6],
    /// What the frame under way leaves; carried when its CRC was right.
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
    /// The last bytes as they will leave, the newest one lowest.
    held: u32,
    /// CRC of what came, and of the bits changed.
    crc: u32,
    change: u32,
    /// Place in the stream of the frame under way or the next one, modulo 2^32.
    next: u32,
    /// Place behind the last byte that has left.
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
    /// Nothing is cut.
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

    /// How many of `len` bytes from this place of the stream on have left. If not all have, the
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

    /// The cutting ends, wherever it is. What is held is the loop's.
    pub fn end(&mut self) {
        self.on = false;
    }

    fn begin(&mut self) {
        (self.came, self.value, self.check) = (0, 0, 0);
        (self.wrong, self.held, self.change) = (false, 0, 0);
        self.crc = Crc::of(self.plan.word).start();
    }

    fn checked(&self) -> u32 {
        let Plan {
            word,
            len,
            zeros,
            at,
            checks,
            first,
            mark,
        } = self.plan;
        let all = |sum: u32, part: u32| sum.rotate_left(7) ^ part;
        let [a, b, c, d, e, f] = at;
        let few = [
            u32::from_le_bytes([a, b, c, d]),
            u32::from_le_bytes([e, f, len, zeros]),
            u32::from_le_bytes([first, mark.0, mark.1, word as u8]),
        ];
        let sum = few.into_iter().fold(0x5A5A, all);
        let checks = checks
            .iter()
            .map(|(at, byte)| u32::from_le_bytes([*at, *byte, 0, 0]));
        let sum = checks.fold(sum, all);
        let owed = self.due.iter().zip(self.carried);
        owed.fold(sum, |sum, (due, left)| {
            all(all(all(sum, *due as u32), (*due >> 32) as u32), left)
        })
    }

    /// A byte has come, at this place of the stream. `room`: bytes that find room at the output.
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

    /// Takes a byte of the frame and changes what is held.
    #[inline(always)]
    fn take(&mut self, at: u8, byte: u8) {
        let Plan {
            word,
            len,
            zeros,
            first,
            mark,
            ..
        } = self.plan;
        let crc = Crc::of(word);
        let sum_at = len.saturating_sub(4);
        self.held = self.held << 8 | u32::from(byte);
        if at >= sum_at {
            if at == sum_at {
                for _ in 0..zeros.min(3) {
                    self.crc = crc.next(self.crc, 0);
                    self.change = crc.next(self.change, 0);
                }
            }
            let n = at - sum_at;
            if !self.wrong {
                self.held ^= u32::from(crc.byte(self.change, n));
            }
            self.wrong |= byte != crc.byte(self.crc, n);
            return;
        }
        self.crc = crc.next(self.crc, byte);
        let begins = self.plan.at.get(usize::from(self.value));
        let begins = begins.copied().unwrap_or(NOWHERE);
        if at < begins {
            let set = if at == mark.0 { mark.1 & !byte } else { 0 };
            let bits = if at == 0 { set ^ first } else { set };
            self.held ^= u32::from(bits);
            self.change = crc.next(self.change, bits);
        } else if at == begins.saturating_add(word.hold()) {
            let before = self.held;
            self.correct(word);
            let bits = before ^ self.held;
            let mut left = word.bytes();
            while left > 0 {
                left -= 1;
                self.change = crc.next(self.change, (bits >> (8 * left)) as u8);
            }
            self.value += 1;
        }
    }

    /// Corrects the value that is held.
    #[inline(always)]
    fn correct(&mut self, word: Word) {
        let n = usize::from(self.value);
        let owed = (self.due.get(n), self.carried.get(n), self.left.get_mut(n));
        let (Some(&due), Some(&carried_over), Some(left)) = owed else {
            return;
        };
        let held = self.held;
        if word == Word::F32 {
            let mut rest = f32::from_bits(carried_over);
            let due = f32::from_bits(due as u32);
            self.held = add_carried(f32::from_bits(held), due, &mut rest).to_bits();
            *left = rest.to_bits();
            return;
        }
        let mut rest = carried_over.cast_signed();
        let whole = carried(due.cast_signed(), &mut rest);
        *left = rest.cast_unsigned();
        self.held = match word {
            Word::I24 => {
                let value = (held << 8).cast_signed() >> 8;
                let value = value.saturating_sub(whole).clamp(-0x0080_0000, 0x007F_FFFF);
                held & 0xFF00_0000 | value.cast_unsigned() & 0x00FF_FFFF
            }
            _ => {
                let on_wire = held.swap_bytes().cast_signed();
                let negated = n % 3 == 1;
                let value = if negated {
                    on_wire.saturating_neg()
                } else {
                    on_wire
                };
                let value = value.saturating_sub(whole);
                let value = if !negated {
                    value
                } else if on_wire.saturating_neg() == value {
                    on_wire // the smallest number stays
                } else {
                    value.saturating_neg()
                };
                value.cast_unsigned().swap_bytes()
            }
        };
    }

    /// What leaves with the byte that has come.
    #[inline(always)]
    fn leave(&mut self, at: u8) -> Leaving {
        let Plan { word, len, .. } = self.plan;
        let hold = word.hold();
        self.came = at + 1;
        if self.came < len {
            if at < hold {
                return Leaving::NONE;
            }
            self.gone = self.gone.wrapping_add(1);
            return Leaving {
                bytes: self.held >> (8 * hold),
                len: 1,
            };
        }
        let leaving = Leaving {
            bytes: self.held,
            len: word.bytes(),
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
