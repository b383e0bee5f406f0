//! Numbers, times, dates and angles in text, without floating point until the end.

use crate::units::DEGREE;
use core::num::NonZeroU64;

/// Most digits of a number. With more, the products below would not fit 64 bits.
const DIGITS: usize = 15;

const TEN: NonZeroU64 = NonZeroU64::MIN.saturating_add(9);
const HUNDRED: NonZeroU64 = TEN.saturating_mul(TEN);

/// A decimal number: `digits` / `scale`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Number {
    negative: bool,
    digits: u64,
    /// 10 to the power of the decimals.
    scale: NonZeroU64,
}

/// Text of fields with commas between them.
#[derive(Debug, Clone, Copy)]
pub struct Fields<'t>(pub &'t [u8]);

impl<'t> Fields<'t> {
    /// Field `n`, from 0 on; empty where there are fewer.
    #[inline(never)]
    pub fn get(self, n: usize) -> &'t [u8] {
        let (mut rest, mut left) = (self.0, n);
        loop {
            let end = rest.iter().position(|&byte| byte == b',');
            let (field, after) = match end {
                Some(end) => rest.split_at_checked(end).unwrap_or_default(),
                None => (rest, &[][..]),
            };
            if left == 0 {
                return field;
            }
            left -= 1;
            rest = after.get(1..).unwrap_or_default();
        }
    }

    /// The number in it.
    pub fn number(self, n: usize) -> Option<Number> {
        Number::of(self.get(n))
    }
}

impl Number {
    /// Reads digits with or without a sign and a decimal point; `None` for anything else.
    #[inline(never)]
    pub fn of(text: &[u8]) -> Option<Number> {
        let (negative, text) = match text {
            [b'-', rest @ ..] => (true, rest),
            [b'+', rest @ ..] => (false, rest),
            text => (false, text),
        };
        let (mut digits, mut scale, mut count) = (0_u64, NonZeroU64::MIN, 0);
        let mut point = false;
        for &byte in text {
            match byte {
                b'0'..=b'9' if count < DIGITS => {
                    digits = digits * 10 + u64::from(byte - b'0');
                    count += 1;
                    if point {
                        scale = scale.saturating_mul(TEN);
                    }
                }
                b'.' if !point => point = true,
                _ => return None,
            }
        }
        (count > 0).then_some(Number {
            negative,
            digits,
            scale,
        })
    }

    /// Value of the number.
    #[inline(never)]
    pub fn value(self) -> f64 {
        let value = self.digits as f64 / self.scale.get() as f64;
        if self.negative { -value } else { value }
    }

    /// Value of one in the last digit.
    pub fn digit(self) -> f32 {
        1.0 / self.scale.get() as f32
    }
}

/// `hhmmss.sss` in ms of the day. The second 60 is a leap second.
#[inline(never)]
pub fn time_of_day(text: &[u8]) -> Option<u32> {
    let number = positive(text)?;
    let whole = number.digits / number.scale;
    let rest = number.digits % number.scale;
    let (hours, minutes, seconds) = (whole / 10_000, whole / 100 % 100, whole % 100);
    if hours > 23 || minutes > 59 || seconds > 60 {
        return None;
    }
    let seconds = (hours * 60 + minutes) * 60 + seconds;
    u32::try_from(seconds * 1000 + rest * 1000 / number.scale).ok()
}

/// `ddmmyy` as day of the week, 0 for Sunday; years 2000 to 2099.
#[inline(never)]
pub fn day_of_week(text: &[u8]) -> Option<u8> {
    let date = whole(text).filter(|_| text.len() == 6)?;
    day_of(date / 10_000, date / 100 % 100, date % 100)
}

/// Day, month and year in fields of their own, as [`day_of_week`].
#[inline(never)]
pub fn day_of_parts(parts: [&[u8]; 3]) -> Option<u8> {
    let [day, month, year] = parts.map(whole);
    day_of(day?, month?, year?.checked_sub(2000)?)
}

fn whole(text: &[u8]) -> Option<u32> {
    let number = positive(text).filter(|number| number.scale == NonZeroU64::MIN)?;
    u32::try_from(number.digits).ok()
}

fn day_of(day: u32, month: u32, year: u32) -> Option<u8> {
    // days before each month, and leap days: every fourth year in these
    let before = match month {
        1 | 10 => 0,
        2 | 3 | 11 => 3,
        4 | 7 => 6,
        5 => 1,
        6 => 4,
        8 => 2,
        9 | 12 => 5,
        _ => return None,
    };
    if !(1..=31).contains(&day) || year > 99 {
        return None;
    }
    let leap = year / 4 + 1 - u32::from(year.is_multiple_of(4) && month < 3);
    // 1 January 2000 was a Saturday
    Some(((day + before + year + leap + 5) % 7) as u8)
}

/// A time of week in seconds, `s.sss`, in ms.
#[inline(never)]
pub fn time_of_week(text: &[u8]) -> Option<u32> {
    let number = positive(text)?;
    u32::try_from(number.digits.saturating_mul(1000) / number.scale).ok()
}

/// `dddmm.mmmm` with one of two letters, the second of which is negative. In rad, with what one in
/// the last digit is worth in minutes; `None` beyond `most` degrees.
pub fn angle(text: &[u8], side: &[u8], [plus, minus]: [u8; 2], most: u64) -> Option<(f64, f32)> {
    let number = positive(text)?;
    let scale = number.scale.get();
    let degree = number.scale.saturating_mul(HUNDRED);
    let (degrees, minutes) = (number.digits / degree, number.digits % degree);
    let all = degrees * 60 * scale + minutes;
    if minutes >= 60 * scale || all > 60 * most * scale {
        return None;
    }
    let value = all as f64 / scale as f64 * (DEGREE / 60.0);
    match side {
        [letter] if *letter == plus => Some((value, number.digit())),
        [letter] if *letter == minus => Some((-value, number.digit())),
        _ => None,
    }
}

/// A number without a sign.
fn positive(text: &[u8]) -> Option<Number> {
    Number::of(text).filter(|_| text.first().is_some_and(u8::is_ascii_digit))
}
