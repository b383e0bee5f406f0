//! Corrections smaller than the resolution of a sample: what one sample cannot hold is carried over
//! to the next, so that the sum of all corrections is exact however many samples there are.

/// Correction of one value of a sample, and the remainder of earlier samples.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Owed {
    /// Steps of 2^-32 counts to be subtracted, or the bits of a float to be added.
    pub due: u64,
    /// Steps of 2^-32 counts, or the bits of a float.
    pub left: u32,
}

/// Steps of one count in corrections and remainders of integer samples, 2^32.
pub const COUNT: f32 = 4_294_967_296.0;

/// Largest correction of a sample, 2^30 counts: with the remainder it stays within 64 bits.
pub const LARGEST: i64 = 1 << 62;

/// Largest number of 24 bits.
pub const I24_MAX: i32 = 0x007F_FFFF;
/// Smallest number of 24 bits.
pub const I24_MIN: i32 = -0x0080_0000;

/// `value` saturated at 24 bits, and whether it was.
#[inline]
pub fn saturate_i24(value: i32) -> (i32, bool) {
    let saturated = value.clamp(I24_MIN, I24_MAX);
    (saturated, saturated != value)
}

/// Remainder when nothing is carried: half a count, in steps of 2^-32 counts. So the whole counts
/// that are due are the upper half of a sum, and need no rounding.
pub const HALF: u32 = 1 << 31;

/// Subtracts a correction, in steps of 2^-32 counts, and carries what whole counts leave, and
/// [`HALF`] more. A value at the end of its 32 bits saturates. Returns the values, and which of
/// them saturated, x in bit 0.
#[inline(always)]
pub fn subtract(sample: &[i32; 3], due: &[i64; 3], left: &mut [u32; 3]) -> ([i32; 3], u8) {
    let mut out = *sample;
    let mut lost = 0;
    for ((o, d), left) in out.iter_mut().zip(due).zip(left) {
        let sum = d.wrapping_add(i64::from(*left));
        *left = sum as u32;
        let whole = (sum >> 32) as i32;
        let wrapped = o.wrapping_sub(whole);
        lost |= o.saturating_sub(whole) ^ wrapped;
        *o = wrapped;
    }
    if lost == 0 {
        (out, 0)
    } else {
        saturated(*sample, out)
    }
}

/// The whole counts that are due now, and carries the rest.
#[inline(always)]
pub fn carried(due: i64, remainder: &mut i32) -> i32 {
    let sum = due.wrapping_add(i64::from(*remainder));
    *remainder = sum as i32; // the lower half, signed: what the nearest whole count leaves
    (sum.wrapping_add(1 << 31) >> 32) as i32
}

/// The values with those saturated that have wrapped around.
#[cold]
fn saturated(sample: [i32; 3], wrapped: [i32; 3]) -> ([i32; 3], u8) {
    let mut out = wrapped;
    let mut axes = 0;
    for (axis, (o, before)) in out.iter_mut().zip(sample).enumerate() {
        let whole = before.wrapping_sub(*o);
        let held = before.saturating_sub(whole);
        axes |= u8::from(held != *o) << axis;
        *o = held;
    }
    (out, axes)
}

/// Adds a correction to three floats.
pub fn add_float(sample: &mut [f32; 3], due: &[f32; 3], remainder: &mut [f32; 3]) {
    for ((value, due), left) in sample.iter_mut().zip(due).zip(remainder) {
        *value = add_carried(*value, *due, left);
    }
}

/// [`add_float`] by [`add_early`]. A function of its own, so that it costs other frames nothing.
#[inline(never)]
pub fn add_float_early(sample: &mut [f32; 3], due: &[f32; 3], remainder: &mut [f32; 3]) {
    for ((value, due), left) in sample.iter_mut().zip(due).zip(remainder) {
        *value = add_early(*value, *due, left);
    }
}

/// Adds `correction` to `value` and keeps what single precision cannot hold in `remainder`, which
/// starts at 0.
///
/// Two exact sums (Knuth's `TwoSum`) take the place of f64, which costs a Cortex-M4F ten times as
/// much. Remainder and value together hold the sum to 48 bits: over any run of samples the sum of
/// the values sent differs from the exact sum by the last remainder only, at most half a unit in
/// the last place of one value. A value that is not finite passes unchanged and clears the
/// remainder.
pub fn add_carried(value: f32, correction: f32, remainder: &mut f32) -> f32 {
    let (due, lost) = two_sum(*remainder, correction);
    if due == 0.0 {
        *remainder = 0.0; // the correction has taken it back
        return value; // -0.0 stays -0.0
    }
    let (sent, rest) = two_sum(value, due);
    let rest = rest + lost;
    if !sent.is_finite() {
        *remainder = 0.0;
        return value;
    }
    *remainder = if rest.is_finite() { rest } else { 0.0 };
    sent
}

/// [`add_carried`] for a value whose first byte (sign and upper seven bits of the exponent) leaves
/// before its last one has come: [`first_byte`], then [`add_behind`].
pub fn add_early(value: f32, correction: f32, remainder: &mut f32) -> f32 {
    let first = first_byte(value.to_bits(), correction, *remainder);
    add_behind(value, correction, remainder, first)
}

/// The first byte of a corrected value, by the upper three bytes of `bits`: that of the number in
/// the middle of those that begin so.
#[inline(always)]
pub fn first_byte(bits: u32, correction: f32, mut remainder: f32) -> u8 {
    let middle = f32::from_bits(bits & !0xFF | 0x80);
    first(add_carried(middle, correction, &mut remainder))
}

/// [`add_carried`] where the corrected value begins with this byte. If it does not, the nearest
/// number that does leaves instead, and the difference is carried over with the rest.
///
/// With the byte of [`first_byte`] the difference is at most 128 units in the last place of `value`
/// (2^-16 of it) and one of what leaves: no number that begins so is nearer to the sum than the
/// nearest, and that of the middle is no farther. The next value makes it good. The remainder then
/// has 24 bits.
#[inline(always)]
pub fn add_behind(value: f32, correction: f32, remainder: &mut f32, begins: u8) -> f32 {
    let sent = add_carried(value, correction, remainder);
    if first(sent) == begins {
        return sent;
    }
    instead(sent, remainder, begins)
}

#[cold]
fn instead(sent: f32, remainder: &mut f32, begins: u8) -> f32 {
    let smallest = u32::from(begins) << 24;
    let beyond = smallest ^ sent.to_bits();
    let larger = sent.to_bits() > smallest;
    // of the other sign, the number next to zero; else bits grow with the magnitude
    let nearest = f32::from_bits(if beyond >> 31 == 0 && larger {
        smallest | 0x00FF_FFFF
    } else {
        smallest
    });
    let (rest, lost) = two_sum(sent, -nearest);
    let rest = rest + (lost + *remainder);
    *remainder = if rest.is_finite() { rest } else { 0.0 };
    nearest
}

/// Sign and upper seven bits of the exponent.
#[inline(always)]
fn first(value: f32) -> u8 {
    value.to_bits().to_be_bytes()[0]
}

/// s = fl(a + b) and the error e with s + e = a + b exactly.
fn two_sum(a: f32, b: f32) -> (f32, f32) {
    let s = a + b;
    let from_b = s - a;
    let from_a = s - from_b;
    (s, (a - from_a) + (b - from_b))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A carried remainder arrives with the next value, also when that is not corrected itself. A
    /// correction that takes it back leaves nothing.
    #[test]
    fn what_is_carried_arrives_once() {
        let mut remainder = 0.25;
        assert_eq!(add_carried(1.0, 0.0, &mut remainder), 1.25);
        assert_eq!(
            (add_carried(1.0, 0.0, &mut remainder), remainder),
            (1.0, 0.0)
        );
        let mut remainder = 3e-9;
        assert_eq!(
            (add_carried(1.0, -3e-9, &mut remainder), remainder),
            (1.0, 0.0)
        );
        let zero = add_carried(-0.0, 0.0, &mut remainder);
        assert_eq!((zero.to_bits(), remainder), ((-0.0f32).to_bits(), 0.0));
    }

    /// A correction far below one unit in the last place must still arrive: 10^5 samples of 1 g
    /// with 10^-9 g each.
    #[test]
    fn corrections_below_an_ulp_add_up() {
        let (value, correction) = (1.000_000_1_f32, 1e-9_f32);
        let mut remainder = 0.0;
        let mut sum = 0.0_f64;
        let n = 100_000;
        for _ in 0..n {
            sum += f64::from(add_carried(value, correction, &mut remainder));
        }
        let exact = f64::from(n) * (f64::from(value) + f64::from(correction));
        let half_ulp = f64::from(f32::EPSILON) / 2.0;
        assert!((sum - exact).abs() <= half_ulp * 1.001, "{}", sum - exact);
        // without the remainder the whole correction is lost
        assert!(value + correction == value);
    }

    /// A change too small for the remainder is not lost either: values and remainder together are
    /// the exact sum to 48 bits.
    #[test]
    fn nothing_is_lost_below_the_remainder() {
        let correction = f32::from_bits(0x3280_0001); // 2^-26 and one bit in its last place
        let (mut remainder, mut sum) = (0.0f32, 0.0f64);
        let n = 1 << 20;
        for _ in 0..n {
            sum += f64::from(add_carried(1.0, correction, &mut remainder));
        }
        let exact = f64::from(n) * (1.0 + f64::from(correction));
        let off = sum + f64::from(remainder) - exact;
        assert!(off.abs() < 1e-10, "{off:e}");
    }

    /// A value at either end of its 32 bits stays there and is named. The remainder goes on as if
    /// nothing had happened.
    #[test]
    fn the_ends_of_32_bits_hold() {
        let due = [3, -3, 3].map(|counts: i64| counts << 32);
        let left = [HALF + 7, HALF - 7, HALF];
        let mut after = left;
        let ends = [i32::MIN + 2, i32::MAX - 2, 0];
        let (out, axes) = subtract(&ends, &due, &mut after);
        assert_eq!((out, axes), ([i32::MIN, i32::MAX, -3], 0b011));
        assert_eq!(after, left);
        // the largest correction of all with the largest remainder
        let due = [LARGEST, -LARGEST, LARGEST];
        let mut left = [u32::MAX, 0, u32::MAX];
        let (out, axes) = subtract(&[i32::MIN, i32::MAX, i32::MAX], &due, &mut left);
        assert_eq!(axes, 0b011);
        assert_eq!(out, [i32::MIN, i32::MAX, i32::MAX - (1 << 30)]);
    }

    /// Counts sent and counts carried are what was due and what was carried before, to the last
    /// step, whatever is carried; and every sample is off by these counts, or at an end of its 32
    /// bits and named.
    fn nothing_is_lost(stride: usize) {
        let dues = [
            0,
            1,
            -1,
            1 << 31,
            -(1 << 31),
            0x1234_5678_9ABC,
            -0x7_6543_2109_8765,
        ];
        for due in dues.into_iter().chain([LARGEST, -LARGEST]) {
            for before in (0..=u32::MAX).step_by(stride) {
                let mut left = [before; 3];
                let (out, _) = subtract(&[0; 3], &[due; 3], &mut left);
                let sent = -(i128::from(out[0]) << 32) + i128::from(left[0]);
                assert_eq!(sent, i128::from(due) + i128::from(before), "{due} {before}");
            }
            let whole = due.wrapping_add(HALF.into()) >> 32;
            for sample in (i32::MIN..=i32::MAX).step_by(stride) {
                let (out, over) = subtract(&[sample; 3], &[due; 3], &mut [HALF; 3]);
                let exact = i64::from(sample) - whole;
                let ends = exact.clamp(i32::MIN.into(), i32::MAX.into());
                assert_eq!(i64::from(out[1]), ends, "{due} {sample}");
                assert_eq!(
                    over,
                    if ends == exact { 0 } else { 0b111 },
                    "{due} {sample}"
                );
            }
        }
    }

    #[test]
    fn nothing_is_lost_of_counts() {
        nothing_is_lost(65_521);
    }

    /// Every remainder and every sample; some minutes.
    #[test]
    #[ignore = "long: cargo test -p firmware --lib --release -- --ignored at_every"]
    fn nothing_is_lost_at_every_remainder_and_every_sample() {
        nothing_is_lost(1);
    }

    /// Half a count more in what is carried does what rounding does in [`carried`].
    #[test]
    fn half_a_count_more_rounds() {
        let mut state = 1u64;
        let (mut left, mut remainder) = ([HALF; 3], [0; 3]);
        for _ in 0..10_000 {
            let due = [20, 31, 62].map(|bits| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                state.cast_signed() >> (63 - bits)
            });
            let (out, _) = subtract(&[0; 3], &due, &mut left);
            let mut expected = [0; 3];
            for ((expected, due), remainder) in expected.iter_mut().zip(due).zip(&mut remainder) {
                *expected = -carried(due, remainder);
            }
            assert_eq!(out, expected);
            assert_eq!(left, remainder.map(|r: i32| r.cast_unsigned() ^ HALF));
        }
    }

    /// The neighbours of a value in the order of numbers.
    fn steps(value: f32, count: i32) -> f32 {
        let ordered = |bits: i32| if bits < 0 { i32::MIN - bits } else { bits };
        let at = ordered(value.to_bits().cast_signed()) + count;
        f32::from_bits(ordered(at).cast_unsigned())
    }

    /// The first byte depends on three bytes only, and what it costs is at most 128 units in the
    /// last place, also around zero and where the exponent changes.
    #[test]
    fn the_first_byte_is_decided_by_three() {
        let mut state = 3u64;
        let mut instead = 0;
        let powers = [-9, -5, -2, -1, 0, 1, 3, 7].map(|n| f32::powi(2.0, n));
        for n in 0..200_000 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let [a, b, c, _] = ((state >> 33) as u32).to_be_bytes();
            let sign = if a & 1 == 0 { 1.0 } else { -1.0 };
            let value = sign * powers[usize::from(a >> 1) % 8] * (1.0 + f32::from(b) / 256.0);
            // the sum is near zero, or near a power of two
            let ends = [0.0, 2.0, -0.5, 0.125, -8.0, 1.0][usize::from(c) % 6];
            let value = steps(value, n % 331);
            let due = ends - steps(value, n % 517 - 258);
            let left = if n % 3 == 0 { 0.0 } else { due * 1e-8 };
            let (mut exact, mut early) = (left, left);
            let sent = add_carried(value, due, &mut exact);
            let got = add_early(value, due, &mut early);
            for last in [0, 0x7F, 0xFF] {
                let other = value.to_bits() & !0xFF | last;
                assert_eq!(first_byte(other, due, left), first(got), "{value} {due}");
            }
            let ulp = |of: f32| f64::from(steps(of.abs(), 1)) - f64::from(of.abs());
            let off = f64::from(got) - f64::from(sent);
            let most = 128.0 * ulp(value) + ulp(sent).max(ulp(got));
            assert!(off.abs() <= most, "{value} {due}: {off:e}");
            if off == 0.0 {
                assert_eq!(
                    (got.to_bits(), early.to_bits()),
                    (sent.to_bits(), exact.to_bits())
                );
                continue;
            }
            instead += 1;
            let whole = f64::from(sent) + f64::from(exact);
            let kept = f64::from(got) + f64::from(early);
            assert!((whole - kept).abs() <= off.abs() * 1.2e-7, "{value} {due}");
        }
        assert!(instead > 10_000, "{instead}");
    }

    /// Values around zero whose first bytes are often decided too soon add up exactly.
    #[test]
    fn what_an_early_byte_cost_is_made_good() {
        let correction = -0.001_f32;
        let (mut remainder, mut lacks, mut instead) = (0.0f32, 0.0f64, 0);
        for n in 0..100_000 {
            let value = steps(-correction, n * 7919 % 777 - 388);
            let mut exact = remainder;
            let sent = add_early(value, correction, &mut remainder);
            instead += u32::from(sent != add_carried(value, correction, &mut exact));
            lacks += f64::from(value) + f64::from(correction) - f64::from(sent);
            let off = lacks - f64::from(remainder);
            assert!(off.abs() < 1e-12, "{n}: {off:e}");
            // 128 units in the last place of a value
            assert!(remainder.abs() < 1.5e-8, "{n}: {remainder}");
        }
        assert!(instead > 1000, "{instead}");
    }

    #[test]
    fn a_value_that_is_no_number_passes() {
        let mut remainder = 1e-9;
        assert!(add_carried(f32::NAN, 1.0, &mut remainder).is_nan());
        assert!(remainder == 0.0);
        assert_eq!(add_carried(f32::MAX, 1e38, &mut remainder), f32::MAX);
        assert_eq!(add_carried(f32::MAX, f32::NAN, &mut remainder), f32::MAX);
        assert!(remainder == 0.0);
        let quiet = f32::from_bits(0xFFC1_2345);
        for add in [add_carried, add_early] {
            for value in [-0.0, 1e-45, quiet, f32::NEG_INFINITY] {
                let got = add(value, 0.0, &mut remainder);
                assert_eq!(got.to_bits(), value.to_bits());
            }
        }
        assert_eq!(
            add_early(f32::INFINITY, -1.0, &mut remainder),
            f32::INFINITY
        );
        assert!(add_early(f32::NAN, 1.0, &mut remainder).is_nan());
    }
}
