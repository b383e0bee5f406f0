//! 64-bit fixed point: products of `i64` numbers that stand for fractions.
//!
//! The Cortex-M4F multiplies 32 by 32 bits to 64 in one instruction and has no f64 unit. A product
//! of two `i64` takes 15 to 20 instructions here, one of two f64 in software some 50.
//!
//! A number is `value * 2^bits`. The bits belong to the quantity ([`ANGLE`] and the others); types
//! do not carry them. A factor must lie within `-2^61 .. 2^61`. It is split into a signed upper
//! part and 31 lower bits, so that each partial product is one signed multiplication and sums of a
//! few of them fit. What keeps factors and results in range is said where they come from
//! (`super::solution`); a debug build checks it.

/// Bits of an angle in rad, of a latitude or longitude, and of a quaternion's element: 1e-18.
pub const ANGLE: u32 = 60;
/// Bits of a velocity, m/s: 1.4e-14 m/s, up to 32 km/s as a factor.
pub const VELOCITY: u32 = 46;
/// Bits of a length, m: 2.3e-13 m, up to 524 km as a factor.
pub const LENGTH: u32 = 42;
/// Bits of a time, s: up to 8 s as a factor.
pub const TIME: u32 = 58;
/// Bits of a rate, rad/s, and of gravity, m/s2: up to 16 as a factor.
pub const RATE: u32 = 57;
/// Bits of the reciprocal of a radius of curvature, 1/m.
pub const CURVATURE: u32 = 83;
/// Bits of the secant and of the tangent of the latitude: up to 8192 as a factor.
pub const SECANT: u32 = 48;

/// A factor is smaller than this.
const FACTOR: i64 = 1 << 61;

/// Upper part, and 31 lower bits.
#[inline(always)]
fn split(a: i64) -> [i64; 2] {
    debug_assert!((-FACTOR..FACTOR).contains(&a), "{a} is no factor");
    [i64::from((a >> 31) as i32), a & 0x7fff_ffff]
}

/// `a b / 2^SHIFT`, rounded down; `SHIFT` is 31 to 62. The result must fit. (In place at each call
/// it would save 5 000 instructions a second of the navigator, and cost 2.7 kB of flash.)
#[inline(never)]
pub fn mul<const SHIFT: u32>(a: i64, b: i64) -> i64 {
    let ([a, a_low], [b, b_low]) = (split(a), split(b));
    let middle = a * b_low + a_low * b + ((a_low * b_low) >> 31);
    // the two may be beyond the range of `i64` where their sum is not
    ((a * b) << (62 - SHIFT)).wrapping_add(middle >> (SHIFT - 31))
}

/// A sum of products. It leaves out the products of the lower bits: each adds an error below
/// `2^(62 - SHIFT)` units of the result. At most four products whose factors are within `2^60`.
#[derive(Clone, Copy)]
pub struct Sum {
    upper: i64,
    middle: i64,
}

impl Sum {
    /// `a b`.
    #[inline(always)]
    pub fn of(a: i64, b: i64) -> Self {
        let ([a, a_low], [b, b_low]) = (split(a), split(b));
        Self {
            upper: a * b,
            middle: a * b_low + a_low * b,
        }
    }

    /// The sum with `a b`.
    #[inline(always)]
    pub fn plus(self, a: i64, b: i64) -> Self {
        let more = Self::of(a, b);
        Self {
            upper: self.upper + more.upper,
            middle: self.middle + more.middle,
        }
    }

    /// The sum without `a b`.
    #[inline(always)]
    pub fn minus(self, a: i64, b: i64) -> Self {
        let less = Self::of(a, b);
        Self {
            upper: self.upper - less.upper,
            middle: self.middle - less.middle,
        }
    }

    /// The sum divided by `2^SHIFT`, 31 to 62.
    #[inline(always)]
    pub fn over<const SHIFT: u32>(self) -> i64 {
        (self.upper << (62 - SHIFT)).wrapping_add(self.middle >> (SHIFT - 31))
    }
}

/// `a x b`, where one of the two is an angle or a part of a quaternion.
#[inline(never)]
pub fn cross([a, b, c]: [i64; 3], [x, y, z]: [i64; 3]) -> [i64; 3] {
    [
        Sum::of(b, z).minus(c, y).over::<ANGLE>(),
        Sum::of(c, x).minus(a, z).over::<ANGLE>(),
        Sum::of(a, y).minus(b, x).over::<ANGLE>(),
    ]
}

/// `a + b`.
#[inline(always)]
pub fn add([a, b, c]: [i64; 3], [x, y, z]: [i64; 3]) -> [i64; 3] {
    [a + x, b + y, c + z]
}

/// Whether all numbers are within `-bound ..= bound`.
#[inline(always)]
pub fn within(v: &[i64], bound: i64) -> bool {
    v.iter().all(|x| (-bound..=bound).contains(x))
}

/// 2^`bits`.
pub const fn unit(bits: u32) -> f64 {
    f64::from_bits((1023 + bits as u64) << 52)
}

/// 2^`bits`, -126 to 127.
const fn unit32(bits: i32) -> f32 {
    f32::from_bits(((127 + bits) as u32) << 23)
}

/// `fraction * 2^exponent` with a sign, rounded towards 0; too large a number is the end of `i64`.
#[inline(always)]
fn shifted(fraction: u64, exponent: i32, negative: bool) -> i64 {
    let room = fraction.leading_zeros() as i32 - 1;
    let size = if exponent > room {
        i64::MAX
    } else if exponent >= 0 {
        (fraction << exponent) as i64
    } else {
        (fraction >> exponent.unsigned_abs().min(63)) as i64
    };
    if negative { -size } else { size }
}

/// A number from f64, rounded towards 0. What is too large, or no number, is the end of `i64`.
#[inline(never)]
pub fn from_f64(x: f64, bits: u32) -> i64 {
    let of = x.to_bits();
    let exponent = (of >> 52) as i32 & 0x7ff;
    let fraction = (of & ((1 << 52) - 1)) | (1 << 52);
    shifted(fraction, exponent - 1075 + bits as i32, of >> 63 != 0)
}

/// A number from f32, as [`from_f64`].
#[inline(never)]
pub fn from_f32(x: f32, bits: u32) -> i64 {
    let of = x.to_bits();
    let exponent = (of >> 23) as i32 & 0xff;
    let fraction = (of & ((1 << 23) - 1)) | (1 << 23);
    shifted(
        u64::from(fraction),
        exponent - 150 + bits as i32,
        of >> 31 != 0,
    )
}

/// A number as f64, to the nearest.
#[inline(never)]
pub fn to_f64(x: i64, bits: u32) -> f64 {
    x as f64 * f64::from_bits((1023 - bits as u64) << 52)
}

/// A number as f32, to the nearest.
#[inline(always)]
pub fn to_f32(x: i64, bits: u32) -> f32 {
    x as f32 * unit32(-(bits as i32))
}

/// A positive finite number as a fraction of 0.5 to 1 and a power of 2. (`libm::frexp` calls itself
/// for the smallest numbers, and a bound of the stack allows no recursion.)
#[inline(always)]
fn parts(x: f64) -> (f64, i32) {
    let (x, less) = if x < f64::MIN_POSITIVE {
        (x * unit(64), 64)
    } else {
        (x, 0)
    };
    let of = x.to_bits();
    let fraction = f64::from_bits((of & ((1 << 52) - 1)) | (1022 << 52));
    (fraction, (of >> 52) as i32 - 1022 - less)
}

/// Value of a count, for exact sums of counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    factor: i64,
    before: u32,
    most: i64,
}

impl Scale {
    /// A count is `lsb`, positive and finite; sums are bounded by `most`.
    #[inline(never)]
    pub fn new(lsb: f64, bits: u32, most: f64) -> Self {
        // lsb 2^bits = mantissa 2^-after
        let (fraction, exponent) = parts(lsb);
        let after = 61_i32
            .saturating_sub(exponent)
            .saturating_sub_unsigned(bits);
        // A count that is worth less than 2^-48 of a unit keeps fewer digits.
        let less = (after - 48).clamp(0, 61).unsigned_abs();
        Self {
            factor: from_f64(fraction, 61) >> less,
            before: (48 - after).clamp(0, 61).unsigned_abs(),
            // the sum of the most samples of the largest counts is below 2^47
            most: ((most / lsb) as i64).min(1 << 48),
        }
    }

    /// A sum of counts, at most the bound.
    #[inline(never)]
    pub fn of(&self, sum: i64) -> i64 {
        let sum = sum.max(-self.most).min(self.most); // `clamp` could panic
        mul::<48>(sum << self.before, self.factor)
    }
}

#[cfg(test)]
mod tests;
