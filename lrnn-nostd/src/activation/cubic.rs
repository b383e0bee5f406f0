//! tanh from a table of cubic polynomials. The table is computed at compile time.

use super::Activation;
use crate::real::Real;

/// tanh from a table of 256 cubics (4 kB of flash): no division, and a third of the instructions of
/// [`super::Rational`].
///
/// In `f32` |f(x) - tanh x| < 1.5e-7 for every x, |f(x)| <= 1, f(-x) = -f(x), and where x rises f
/// never falls by more than 6e-8. From |x| = 127/16 on f is constant. The slope is taken as 1 -
/// y^2. The bits are the same on every machine. [`crate::kernel`] implements it in assembly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cubic;

/// Intervals per unit of x.
const PER_UNIT: i32 = 16;
/// Intervals on either side of 0.
const SIDE: i32 = 128;
/// Row of the table that belongs to x = 0.
#[cfg(target_arch = "arm")]
#[allow(dead_code, reason = "for the kernel in assembly")]
pub(crate) const MIDDLE: usize = SIDE as usize;
/// Coefficients of 1, d, d^2, d^3 with d = x - i/16, i = trunc(16 x) from -128 to 127.
pub(crate) static TABLE: [[f32; 4]; 2 * SIDE as usize] = table();

impl Activation for Cubic {
    const CODE: u8 = 3;

    /// A non-finite x gives NaN, because 0 times x is then NaN.
    #[inline(always)]
    fn apply<T: Real>(x: T) -> T {
        let i = (x * T::from_i32(PER_UNIT)).truncated();
        let d = x - T::from_i32(i) * T::from_f64(1.0 / f64::from(PER_UNIT));
        let row = i.clamp(-SIDE, SIDE - 1) + SIDE;
        // The clamp keeps it in 0..256; the remainder shows that to the compiler.
        let [c0, c1, c2, c3] = TABLE[row as usize % TABLE.len()];
        // Written out: `map` is not always inlined.
        let c = |c: f32| T::from_f64(f64::from(c));
        c(c0) + (c(c1) + (c(c2) + c(c3) * d) * d) * d
    }

    #[inline(always)]
    fn slope<T: Real>(y: T) -> T {
        T::ONE - y * y
    }
}

const fn table() -> [[f32; 4]; 2 * SIDE as usize] {
    let mut table = [[0.0; 4]; 2 * SIDE as usize];
    let mut i = 0;
    while i < SIDE {
        let [c0, c1, c2, c3] = cubic(i);
        let (up, down) = ((SIDE + i) as usize, (SIDE - i) as usize);
        table[up] = [c0 as f32, c1 as f32, c2 as f32, c3 as f32];
        table[down] = [-c0 as f32, c1 as f32, -c2 as f32, c3 as f32];
        i += 1;
    }
    table[0] = table[1];
    table
}

/// The cubic of interval `i` >= 0, which passes through tanh at the Chebyshev points. The first
/// interval, from -1/16 to 1/16, is odd. The last one is constant, half way between tanh and 1.
const fn cubic(i: i32) -> [f64; 4] {
    let h = 1.0 / PER_UNIT as f64;
    let start = i as f64 * h;
    if i == SIDE - 1 {
        return [0.5 + 0.5 * tanh(start), 0.0, 0.0, 0.0];
    }
    // cos(pi/8), cos(3 pi/8)
    const POINTS: [f64; 2] = [0.923_879_532_511_286_7, 0.382_683_432_365_089_8];
    let [outer, inner] = POINTS;
    if i == 0 {
        let (a, b) = (outer * h, inner * h);
        let (fa, fb) = (tanh(a) / a, tanh(b) / b);
        let c3 = (fa - fb) / (a * a - b * b);
        return [0.0, fa - c3 * a * a, 0.0, c3];
    }
    let half = 0.5 * h;
    let at = [
        half - half * outer,
        half - half * inner,
        half + half * inner,
        half + half * outer,
    ];
    // Newton's divided differences.
    let mut f = [
        tanh(start + at[0]),
        tanh(start + at[1]),
        tanh(start + at[2]),
        tanh(start + at[3]),
    ];
    let mut order = 1;
    while order < 4 {
        let mut k = 3;
        while k >= order {
            f[k] = (f[k] - f[k - 1]) / (at[k] - at[k - order]);
            k -= 1;
        }
        order += 1;
    }
    // (((f3 (d - p2) + f2) (d - p1) + f1) (d - p0) + f0, multiplied out
    let mut c = [f[3], 0.0, 0.0, 0.0];
    let mut k = 3;
    while k > 0 {
        k -= 1;
        c = [
            f[k] - at[k] * c[0],
            c[0] - at[k] * c[1],
            c[1] - at[k] * c[2],
            c[2],
        ];
    }
    c
}

/// tanh x for 0 <= x <= 8, to 1e-13.
const fn tanh(x: f64) -> f64 {
    // e^2x: the series of its 256th root, squared eight times.
    let z = 2.0 * x / 256.0;
    let (mut term, mut e, mut k) = (1.0, 1.0, 1);
    while k < 14 {
        term = term * z / k as f64;
        e += term;
        k += 1;
    }
    let mut squarings = 0;
    while squarings < 8 {
        e *= e;
        squarings += 1;
    }
    (e - 1.0) / (e + 1.0)
}
