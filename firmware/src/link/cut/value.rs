//! Corrects the values of a frame while they come.

use super::{Cut, NOWHERE, Plan, Word};
use crate::remainder::{add_behind, carried, first_byte, saturate_i24};

impl Cut {
    /// Changes a byte before the CRC, or the value that it completes.
    #[inline(always)]
    pub(super) fn change(&mut self, at: u8, byte: u8) {
        let Plan {
            word, first, mark, ..
        } = self.plan;
        let came = self.held ^ self.bits;
        let begins = self.plan.at.get(usize::from(self.value));
        let n = at.checked_sub(begins.copied().unwrap_or(NOWHERE));
        let last = word.bytes() - 1;
        match n {
            None => {
                let set = if at == mark.0 { mark.1 & !byte } else { 0 };
                self.held ^= u32::from(if at == 0 { set ^ first } else { set });
            }
            Some(n) if word == Word::I32 => self.add(n, byte),
            Some(n) if word == Word::F32 => self.correct_float(n, came),
            Some(n) if n == last => self.correct_counts(),
            Some(_) => {}
        }
        self.bits = came ^ self.held;
        self.value += u8::from(n == Some(last));
    }

    /// Adds to byte `n` of a value whose least significant one comes first.
    #[inline(always)]
    fn add(&mut self, n: u8, byte: u8) {
        if n == 0 {
            let whole = self.whole();
            // the second of three is negated
            self.adds = if self.value % 3 == 1 {
                whole
            } else {
                whole.saturating_neg()
            };
        }
        let sum = i32::from(byte).wrapping_add(self.adds & 0xFF);
        self.held = self.held & !0xFF | sum.cast_unsigned() & 0xFF;
        self.adds = (self.adds >> 8).wrapping_add(sum >> 8);
        if n == 3 {
            // what is carried out of the value is its sign, or it saturates
            let sign = i32::from(byte.cast_signed() >> 7);
            let high = self.adds.wrapping_add(sign);
            let low = -i32::from((sum as u8).cast_signed() < 0);
            if high > low {
                self.held = 0x00FF_FF7F | self.held & 0xFF00_0000;
            } else if high < low {
                self.held = 0x0000_0080 | self.held & 0xFF00_0000;
            }
        }
    }

    /// The whole counts that are due of the value under way; carries the rest.
    #[inline(always)]
    fn whole(&mut self) -> i32 {
        let n = usize::from(self.value);
        let (due, carried_over) = (self.due.get(n), self.carried.get(n));
        let (Some(due), Some(carried_over), Some(left)) = (due, carried_over, self.left.get_mut(n))
        else {
            return 0;
        };
        let mut rest = carried_over.cast_signed();
        let whole = carried(due.cast_signed(), &mut rest);
        *left = rest.cast_unsigned();
        whole
    }

    /// Corrects the pending value, of 24 bits.
    #[inline(always)]
    fn correct_counts(&mut self) {
        let value = (self.held << 8).cast_signed() >> 8;
        let (value, _) = saturate_i24(value.saturating_sub(self.whole()));
        self.held = self.held & 0xFF00_0000 | value.cast_unsigned() & 0x00FF_FFFF;
    }

    /// The third byte of a float decides on the first, and the fourth completes it. `came`: the
    /// last bytes as they came.
    #[inline(always)]
    fn correct_float(&mut self, n: u8, came: u32) {
        if n < 2 {
            return;
        }
        let at = usize::from(self.value);
        let (due, carried_over) = (self.due.get(at), self.carried.get(at));
        let (Some(due), Some(carried_over), Some(left)) =
            (due, carried_over, self.left.get_mut(at))
        else {
            return;
        };
        let due = f32::from_bits(*due as u32);
        let mut rest = f32::from_bits(*carried_over);
        if n == 2 {
            let first = first_byte(came << 8, due, rest);
            self.held = self.held & 0xFF00_FFFF | u32::from(first) << 16;
        } else {
            let first = (self.held >> 24) as u8;
            let value = f32::from_bits(came);
            self.held = add_behind(value, due, &mut rest, first).to_bits();
            *left = rest.to_bits();
        }
    }
}
