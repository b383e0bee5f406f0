//! The activation function f and its derivative.

mod cubic;
#[cfg(feature = "micromath")]
mod micro;

use core::fmt::Debug;

use crate::real::{Real, three_finite};
use crate::shape::NEURONS;
pub use cubic::Cubic;
#[cfg(target_arch = "arm")]
#[allow(unused_imports, reason = "for the kernel in assembly")]
pub(crate) use cubic::{MIDDLE, TABLE};
#[cfg(feature = "micromath")]
pub use micro::MicroMath;

/// The activation function f of a layer: [`Rational`], [`Cubic`], [`Tanh`] or [`Identity`].
///
/// ```
/// use lrnn_nostd::{Activation, Cubic, Rational, Tanh};
///
/// let exact = Tanh::apply(0.7_f32);
/// assert!((Rational::apply(0.7_f32) - exact).abs() < 2e-7);
/// assert!((Cubic::apply(0.7_f32) - exact).abs() < 1.5e-7);
/// assert_eq!(Rational::slope(exact), 1.0 - exact * exact);
/// ```
pub trait Activation: Copy + Debug + Default + PartialEq + 'static {
    /// Code of this activation in the weight image.
    const CODE: u8;

    /// f(x).
    fn apply<T: Real>(x: T) -> T;

    /// f'(x), computed from y = f(x). |f'| <= 1, on which the bound of the sensitivities relies.
    fn slope<T: Real>(y: T) -> T;

    /// f for the three units of a layer; `None` when an x is infinite or NaN.
    #[inline(always)]
    fn layer<T: Real>(x: [T; NEURONS]) -> Option<[T; NEURONS]> {
        let [a, b, c] = x;
        // Written out: `map` is not always inlined.
        if three_finite(x) {
            Some([Self::apply(a), Self::apply(b), Self::apply(c)])
        } else {
            None
        }
    }
}

/// The tanh of `libm`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tanh;

/// f(x) = x.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Identity;

/// tanh as a rational function, for cores with a fast multiplier and divider. It uses only + - * /,
/// no branch and no table.
///
/// tanh x = 2 s / (1 + s^2) with s = tanh(x/2), where s is x P(x^2) / Q(x^2), with P of degree 2
/// and Q of degree 3 in x^2. The doubling keeps |y| <= 1 without a clamp, and an error of s matters
/// less the nearer s is to 1.
///
/// In `f32` |f(x) - tanh x| < 2.0e-7 for every x (3.3 units of the last place below 1), |f(x)| <=
/// 1, f(-x) = -f(x), and where x rises f never falls by more than 2.4e-7 (rounding). Beyond |x| =
/// 8.4 f is constant. In `f64`, without the rounding, the error is below 1.2e-7. The slope is 1 -
/// y^2, as for tanh; it differs from the slope of the approximation by less than 5e-8, which is
/// below the rounding of `f32`.
///
/// Coefficients: Remez exchange with 60 digits, minimax of the relative error of y (not of s) for
/// |x| <= 7; 2.8e-9 there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rational;

impl Activation for Tanh {
    const CODE: u8 = 1;

    #[inline(always)]
    fn apply<T: Real>(x: T) -> T {
        x.tanh()
    }

    #[inline(always)]
    fn slope<T: Real>(y: T) -> T {
        T::ONE - y * y
    }
}

impl Activation for Identity {
    const CODE: u8 = 0;

    #[inline(always)]
    fn apply<T: Real>(x: T) -> T {
        x
    }

    #[inline(always)]
    fn slope<T: Real>(_: T) -> T {
        T::ONE
    }
}

/// [`Rational`] is constant for |x| beyond this value.
const CLAMP: f64 = 8.4;
/// Numerator of s / x: coefficients of 1, t, t^2 with t = x^2.
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

    #[inline(always)]
    fn apply<T: Real>(x: T) -> T {
        let clamp = T::from_f64(CLAMP);
        let inside = if x > clamp { clamp } else { x };
        let inside = if inside < -clamp { -clamp } else { inside };
        Self::inside(inside, inside * inside)
    }

    #[inline(always)]
    fn slope<T: Real>(y: T) -> T {
        T::ONE - y * y
    }

    /// One test for all three units: while x_0^2 + x_1^2 + x_2^2 is below the square of the clamp,
    /// each x is finite and none is clamped.
    #[inline(always)]
    fn layer<T: Real>(x: [T; NEURONS]) -> Option<[T; NEURONS]> {
        let [a, b, c] = x;
        let (ta, tb, tc) = (a * a, b * b, c * c);
        if ta + tb + tc < T::from_f64(CLAMP * CLAMP) {
            Some([
                Self::inside(a, ta),
                Self::inside(b, tb),
                Self::inside(c, tc),
            ])
        } else {
            Self::saturated(x)
        }
    }
}

impl Rational {
    /// f(x) for |x| within the clamp; t = x^2. With n = x P(t) and d = Q(t), so that s = n/d:
    ///
    /// ```text
    /// y = 2 n d / (d^2 + n^2)
    /// ```
    #[inline(always)]
    fn inside<T: Real>(x: T, t: T) -> T {
        let c = T::from_f64;
        // Horner's scheme, written out.
        let n = x * ((c(P[2]) * t + c(P[1])) * t + c(P[0]));
        let d = ((c(Q[3]) * t + c(Q[2])) * t + c(Q[1])) * t + c(Q[0]);
        (n + n) * d / (d * d + n * n)
    }

    /// [`Activation::layer`] for the case that an x may be clamped.
    #[cold]
    #[inline(never)]
    fn saturated<T: Real>(x: [T; NEURONS]) -> Option<[T; NEURONS]> {
        three_finite(x).then(|| x.map(Self::apply))
    }
}
