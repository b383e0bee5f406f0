//! Series that navigators need at every step. The same code serves one number and several side by
//! side, so that both give the same bits, on every machine and with every C library.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::ops::{Add, Mul, Sub};

/// A number, or several side by side.
pub trait Number:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Add<f64, Output = Self>
    + Mul<f64, Output = Self>
{
}

impl<T> Number for T where
    T: Copy
        + Add<Output = T>
        + Sub<Output = T>
        + Mul<Output = T>
        + Add<f64, Output = T>
        + Mul<f64, Output = T>
{
}

/// Cosine of half of an angle `n`, and sine of its half over `n`, from `n2 = n^2`: exact to f64
/// for `n` below 0.06 rad.
#[inline(always)]
pub(in crate::inertial) fn half_angle<T: Number>(n2: T) -> (T, T) {
    const C: [f64; 3] = [-1.0 / 8.0, 1.0 / 384.0, -1.0 / 46_080.0];
    const S: [f64; 3] = [-1.0 / 48.0, 1.0 / 3_840.0, -1.0 / 645_120.0];
    (
        n2 * (n2 * (n2 * C[2] + C[1]) + C[0]) + 1.0,
        n2 * (n2 * (n2 * S[2] + S[1]) + S[0]) + 0.5,
    )
}

/// `(1 - cos n)/n^2` and `(n - sin n)/n^3` from `n2 = n^2`: relative error `n^4/720`, 3e-8 at
/// 0.07 rad.
#[inline(always)]
pub(in crate::inertial) fn turned_force<T: Number>(n2: T) -> (T, T) {
    (n2 * (-1.0 / 24.0) + 0.5, n2 * (-1.0 / 120.0) + 1.0 / 6.0)
}

/// Largest magnitude of an angle that [`sin_cos`] computes by its series, rad: every latitude.
pub(in crate::inertial) const MOST: f64 = 3.0 * FRAC_PI_4;
/// Difference of pi/2 from its f64.
pub(in crate::inertial) const REST: f64 = 6.123_233_995_736_766e-17;

/// Sine and cosine of an angle in rad: error below 1 unit in the last place up to [`MOST`]; beyond
/// that the standard library's.
#[inline]
pub(in crate::inertial) fn sin_cos(x: f64) -> (f64, f64) {
    let a = x.abs();
    if a <= FRAC_PI_4 {
        let (s, c) = near_zero(a, 0.0);
        return (s.copysign(x), c);
    }
    if a <= MOST {
        let (y, rest) = below_right_angle(a);
        let (s, c) = near_zero(y, rest);
        return (c.copysign(x), -s);
    }
    x.sin_cos()
}

/// `a - pi/2` for `a` from pi/4 to 3 pi/4, and its rounding error.
#[inline(always)]
pub(in crate::inertial) fn below_right_angle<T: Number>(a: T) -> (T, T) {
    let exact = a + -FRAC_PI_2;
    let y = exact + -REST;
    (y, exact - y + -REST)
}

/// Sine and cosine of `y + rest`, `|y| <= pi/4`: Taylor's series to the 17th and 18th power. The
/// truncation error is below 1e-19.
#[inline(always)]
pub(in crate::inertial) fn near_zero<T: Number>(y: T, rest: T) -> (T, T) {
    const S: [f64; 8] = [
        -1.0 / 6.0,
        1.0 / 120.0,
        -1.0 / 5_040.0,
        1.0 / 362_880.0,
        -1.0 / 39_916_800.0,
        1.0 / 6_227_020_800.0,
        -1.0 / 1_307_674_368_000.0,
        1.0 / 355_687_428_096_000.0,
    ];
    const C: [f64; 8] = [
        1.0 / 24.0,
        -1.0 / 720.0,
        1.0 / 40_320.0,
        -1.0 / 3_628_800.0,
        1.0 / 479_001_600.0,
        -1.0 / 87_178_291_200.0,
        1.0 / 20_922_789_888_000.0,
        -1.0 / 6_402_373_705_728_000.0,
    ];
    let y2 = y * y;
    let half = y2 * 0.5;
    // 1 - y^2/2, and its rounding error
    let first = half * -1.0 + 1.0;
    let lost = first * -1.0 + 1.0 - half;
    let sin = y + (y * y2 * polynomial(y2, &S) + rest * first);
    let cos = first + (lost + (y2 * y2 * polynomial(y2, &C) - y * rest));
    (sin, cos)
}

/// A polynomial of seventh degree, by halves: they do not wait for one another.
#[inline(always)]
fn polynomial<T: Number>(x: T, k: &[f64; 8]) -> T {
    let x2 = x * x;
    let x4 = x2 * x2;
    let low = x2 * (x * k[3] + k[2]) + (x * k[1] + k[0]);
    let high = x2 * (x * k[7] + k[6]) + (x * k[5] + k[4]);
    x4 * high + low
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// One as a whole number of units of 2^-61.
    const ONE: i128 = 1 << 61;

    /// Sine and cosine in units of 2^-61 by Taylor's series in whole numbers: good to some units.
    fn reference(x: f64) -> [i128; 2] {
        let x = (x * ONE as f64) as i128;
        let (mut power, mut sums) = (ONE, [0; 2]);
        for k in 0..32_usize {
            let sign = if k % 4 < 2 { 1 } else { -1 };
            sums[(k + 1) % 2] += sign * power;
            power = ((power * x + ONE / 2) >> 61) / (k as i128 + 1);
        }
        sums
    }

    fn angles() -> impl Iterator<Item = f64> {
        let steps = (0..=20_000).map(|k| MOST / 20_000.0 * f64::from(k));
        let small = (1..300).map(|k| 0.5_f64.powi(k));
        let near = (1..50).map(|k| FRAC_PI_2 - 0.5_f64.powi(k));
        let edges = [FRAC_PI_4, FRAC_PI_4.next_up(), FRAC_PI_2, MOST];
        let all = steps.chain(small).chain(near).chain(edges);
        all.flat_map(|x| [x, -x])
    }

    fn last_place(x: f64) -> f64 {
        x.abs().next_up() - x.abs()
    }

    #[test]
    fn sine_and_cosine_are_good_to_the_last_place() {
        let mut worst: f64 = 0.0;
        for x in angles() {
            let (sin, cos) = sin_cos(x);
            let library = x.sin_cos();
            for (got, library, want) in [(sin, library.0), (cos, library.1)]
                .into_iter()
                .zip(reference(x))
                .map(|((got, library), want)| (got, library, want))
            {
                // small results have last places below the reference's
                if got.abs() >= 0.25 {
                    let off = ((got * ONE as f64) as i128 - want) as f64 / ONE as f64;
                    worst = worst.max(off.abs() / last_place(got));
                }
                assert!((got - library).abs() <= last_place(library), "{x:e}");
            }
        }
        println!("{worst} units in the last place");
        assert!(worst < 0.9, "{worst}");
    }

    #[test]
    fn beyond_all_latitudes_the_library_answers() {
        for x in [MOST.next_up(), -3.0, 100.0 * TAU + 1.0] {
            assert_eq!(sin_cos(x), x.sin_cos());
        }
        let (sin, cos) = sin_cos(f64::NAN);
        assert!(sin.is_nan() && cos.is_nan());
        assert!(sin_cos(-0.0).0.is_sign_negative());
    }

    #[test]
    fn series_are_their_functions() {
        for n in [1e-3, 0.02, 0.0599] {
            let (cos, sin_per_n) = half_angle(n * n);
            assert!((cos - (0.5 * n).cos()).abs() < 3e-16);
            assert!((sin_per_n - (0.5 * n).sin() / n).abs() < 2e-16);
            let (one, two) = turned_force(n * n);
            assert!((one - 2.0 * (0.5 * n).sin().powi(2) / (n * n)).abs() < n.powi(4) / 700.0);
            let cubic = 1.0 / 6.0 - n * n / 120.0 + n.powi(4) / 5040.0;
            assert!((two - cubic).abs() < n.powi(4) / 5000.0);
        }
    }
}
