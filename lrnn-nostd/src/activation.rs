//! f and its derivative.

use core::fmt::Debug;

use crate::real::Real;

/// f of a layer, with the derivative of the very function that is used.
pub trait Activation: Copy + Debug + Default + PartialEq + 'static {
    /// Value in the weight image.
    const CODE: u8;

    /// (f(x), f'(x)).
    fn apply_with_slope<T: Real>(x: T) -> (T, T);

    /// f(x).
    #[inline(always)]
    fn apply<T: Real>(x: T) -> T {
        Self::apply_with_slope(x).0
    }
}

/// tanh of `libm`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tanh;

/// f(x) = x.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Identity;

/// tanh as a rational function, for cores with a fast multiplier and divider: only + - * /, no branch, no table.
///
/// tanh x = 2 s / (1 + s^2) with s = tanh(x/2), and s is x P(x^2) / Q(x^2) with P of degree 2, Q of degree 3 in x^2. The doubling
/// keeps |y| <= 1 by itself and forgives an error of s the more, the nearer s is to 1.
///
/// In `f32` |f(x) - tanh x| < 2.0e-7 for every x (3.3 units of the last place below 1), |f(x)| <= 1, f(-x) = -f(x), and f never
/// falls by more than 2.4e-7 where x rises (rounding). Beyond |x| = 8.4 it is constant and its derivative 0. In `f64`, without
/// the rounding, the error is below 1.2e-7.
///
/// Coefficients: Remez exchange with 60 digits, minimax of the relative error of y (not of s) for |x| <= 7; 2.8e-9 there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rational;

impl Activation for Tanh {
    const CODE: u8 = 1;

    #[inline(always)]
    fn apply_with_slope<T: Real>(x: T) -> (T, T) {
        let y = x.tanh();
        (y, T::ONE - y * y)
    }
}

impl Activation for Identity {
    const CODE: u8 = 0;

    #[inline(always)]
    fn apply_with_slope<T: Real>(x: T) -> (T, T) {
        (x, T::ONE)
    }
}

/// |x| from which on [`Rational`] is constant.
const CLAMP: f64 = 8.4;
/// Numerator of s over x: coefficients of 1, t, t^2 with t = x^2.
const P: [f64; 3] = [
    0.4999999985828751,
    0.014948389358075317,
    5.848059574056591e-05,
];
/// Denominator of s.
const Q: [f64; 4] = [
    1.0,
    0.11323009129298194,
    0.0012194886055114343,
    1.2874903965831551e-06,
];

impl Activation for Rational {
    const CODE: u8 = 2;

    /// With n = x P(t) and d = Q(t), so s = n/d:
    ///     y = 2 n d / (d^2 + n^2)      y' = 2 (d^2 - n^2) (n' d - n d') / (d^2 + n^2)^2
    #[inline(always)]
    fn apply_with_slope<T: Real>(x: T) -> (T, T) {
        let clamp = T::from_f64(CLAMP);
        let inside = if x > clamp { clamp } else { x };
        let inside = if inside < -clamp { -clamp } else { inside };
        let t = inside * inside;
        let (p, dp) = horner(&P, t);
        let (d, dq) = horner(&Q, t);
        let n = inside * p;
        let sum = d * d + n * n;
        let y = (n + n) * d / sum;

        let wronskian = (p + (t + t) * dp) * d - n * (inside + inside) * dq;
        let product = (d - n) * (d + n) * wronskian;
        let slope = (product + product) / (sum * sum);
        (y, if inside == x { slope } else { T::ZERO })
    }
}

/// Value and derivative of a polynomial.
#[inline(always)]
fn horner<T: Real, const N: usize>(coefficients: &[f64; N], t: T) -> (T, T) {
    let (mut value, mut derivative) = (T::ZERO, T::ZERO);
    for &c in coefficients.iter().rev() {
        derivative = derivative * t + value;
        value = value * t + T::from_f64(c);
    }
    (value, derivative)
}
