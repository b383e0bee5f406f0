//! Generates the committed input vectors, with integer arithmetic only, so that they do not depend
//! on the rounding of a machine.
//!
//! Body rates in counts of 2^-20 rad/s: a triangular swing on each axis (amplitudes 2, 1.5 and 0.05
//! rad/s, periods without a common divisor), a drift of one to three counts per sample, and noise
//! of 511 counts. Some samples are what a broken sensor or a decoding error would deliver; the
//! largest and smallest numbers are among them.

/// Number of vectors.
pub const VECTORS: usize = 300;

/// 2 rad/s in counts of 2^-20 rad/s.
const FULL_SWING: i32 = 2 << 20;

/// Samples that are not a plausible rate: index, axis, bits.
const ODD: [(usize, usize, u32); 9] = [
    (70, 0, 0x7fc0_0000),  // NaN
    (71, 2, 0xffc1_2345),  // another NaN
    (120, 1, 0x7f80_0000), // +infinity
    (121, 1, 0xff80_0000), // -infinity
    (170, 0, 0x8000_0000), // -0.0
    (171, 1, 0x0000_0001), // smallest subnormal
    (172, 2, 0x8000_0001),
    (220, 0, 0x7f7f_ffff), // largest finite
    (221, 0, 0xff7f_ffff),
];

/// Bits of the `f32` rates in rad/s of vector `index`.
pub fn vector(index: usize) -> [u32; 3] {
    let rates = [
        triangle(index, 97, FULL_SWING) + drift(index, 3),
        triangle(index, 61, FULL_SWING / 4 * 3) + drift(index, -1),
        triangle(index, 43, FULL_SWING / 40) + drift(index, 2),
    ];
    core::array::from_fn(|axis| {
        let odd = ODD.iter().find(|&&(at, on, _)| (at, on) == (index, axis));
        odd.map_or_else(
            || bits(rates[axis] + noise(index, axis)),
            |&(_, _, bits)| bits,
        )
    })
}

/// Starts at 0, swings to +amplitude, to -amplitude and back to 0 in `period` samples.
fn triangle(index: usize, period: i32, amplitude: i32) -> i32 {
    let phase = index as i32 % period; // 0..period
    let step = amplitude / period * 4;
    match 4 * phase / period {
        0 => phase * step,
        1 | 2 => (period - 2 * phase) * (step / 2),
        _ => (phase - period) * step,
    }
}

fn drift(index: usize, counts_per_sample: i32) -> i32 {
    index as i32 * counts_per_sample
}

/// -511 to 511 counts from a linear congruential generator (Numerical Recipes' constants) seeded by
/// index and axis.
fn noise(index: usize, axis: usize) -> i32 {
    let mut seed = (index * 3 + axis) as u32 ^ 0x5eed_0001;
    for _ in 0..4 {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    }
    (seed >> 16) as i32 % 1023 - 511
}

/// Counts of 2^-20 rad/s as bits of the `f32` in rad/s; exact, because |counts| < 2^24 and the LSB
/// is a power of two.
fn bits(counts: i32) -> u32 {
    const RADIANS_PER_SECOND: f32 = 1.0 / (1 << 20) as f32;
    (counts as f32 * RADIANS_PER_SECOND).to_bits()
}
