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

/// tanh as a rational function.
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

/// Beyond it f is constant.
const CLAMP: f64 = 7.9;
/// Coefficients of 1, t, t^2 ..., t = x^2.
const P: [f64; 5] = [
    0.999999990666042564,
    0.134258677299372703,
    0.0035491659261463987,
    0.0000215084442114492814,
    1.46481910504698911e-8,
];
const Q: [f64; 5] = [
    1.0,
    0.467591925570818625,
    0.0260799373570149148,
    0.000337394525001733992,
    8.29507991851934997e-7,
];

impl Activation for Rational {
    const CODE: u8 = 2;

    /// y = x P(t) / Q(t),   y' = (P + 2 t P' - 2 x y Q') / Q
    #[inline(always)]
    fn apply_with_slope<T: Real>(x: T) -> (T, T) {
        let c = T::from_f64(CLAMP);
        let inside = if x > c {
            c
        } else if x < -c {
            -c
        } else {
            x
        };
        let t = inside * inside;
        let (p, dp) = horner(&P, t);
        let (q, dq) = horner(&Q, t);
        let y = inside * p / q;
        let two = T::ONE + T::ONE;
        let slope = (p + two * (t * dp - inside * y * dq)) / q;
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
