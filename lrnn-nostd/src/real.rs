//! The number type: `f32` on the target, `f64` to check the same code in higher precision.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// The arithmetic that the network and its learning need. Only `f32` and `f64` implement it.
///
/// No operation is fused or reordered, so the results have the same bits on every machine with IEEE
/// 754 arithmetic.
pub trait Real:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + PartialEq
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + 'static
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// Distance from 1 to the next larger number.
    const EPSILON: Self;

    /// The nearest value of a constant.
    fn from_f64(value: f64) -> Self;
    /// The nearest value of a whole number.
    fn from_i32(value: i32) -> Self;
    /// The integer part; the nearest `i32` if it does not fit, 0 for NaN.
    fn truncated(self) -> i32;
    /// The same value as `f64`; exact.
    fn to_f64(self) -> f64;
    /// tanh(self) of `libm`.
    #[must_use]
    fn tanh(self) -> Self;
    /// The square root, correctly rounded; NaN for a negative value.
    #[must_use]
    fn sqrt(self) -> Self;

    /// Whether the value is neither infinite nor NaN.
    #[inline(always)]
    fn is_finite(self) -> bool {
        self * Self::ZERO == Self::ZERO
    }

    /// [`Real::is_finite`] without arithmetic, which is a call on a core without an FPU.
    fn has_finite_bits(self) -> bool;

    /// -1, 0 or +1; 0 for NaN.
    #[inline(always)]
    #[must_use]
    fn sign(self) -> Self {
        let above = if self > Self::ZERO {
            Self::ONE
        } else {
            Self::ZERO
        };
        if self < Self::ZERO { -Self::ONE } else { above }
    }
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const EPSILON: Self = f32::EPSILON;

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value as f32
    }
    #[inline(always)]
    fn from_i32(value: i32) -> Self {
        value as f32
    }
    #[inline(always)]
    fn truncated(self) -> i32 {
        self as i32
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        libm::tanhf(self)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        libm::sqrtf(self)
    }
    #[inline(always)]
    fn has_finite_bits(self) -> bool {
        let largest = f32::INFINITY.to_bits();
        self.to_bits() & largest != largest
    }
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const EPSILON: Self = f64::EPSILON;

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn from_i32(value: i32) -> Self {
        f64::from(value)
    }
    #[inline(always)]
    fn truncated(self) -> i32 {
        self as i32
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        libm::tanh(self)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        libm::sqrt(self)
    }
    #[inline(always)]
    fn has_finite_bits(self) -> bool {
        let largest = f64::INFINITY.to_bits();
        self.to_bits() & largest != largest
    }
}

/// Whether three values are finite, with a single comparison. Written out, so that it is as short
/// at every level of optimisation.
#[inline(always)]
pub(crate) fn three_finite<T: Real>([a, b, c]: [T; 3]) -> bool {
    a * T::ZERO + b * T::ZERO + c * T::ZERO == T::ZERO
}

/// Whether every value is finite, with a single comparison: 0 * v is 0 for a finite v and NaN
/// otherwise. Long slices use eight independent sums, which do not wait for each other.
#[inline(always)]
pub(crate) fn all_finite<T: Real>(values: &[T]) -> bool {
    let (eights, rest) = values.as_chunks::<8>();
    let mut sums = [T::ZERO; 8];
    for values in eights {
        for (sum, &value) in sums.iter_mut().zip(values) {
            *sum += value * T::ZERO;
        }
    }
    let start = if eights.is_empty() {
        T::ZERO
    } else {
        sums.iter().fold(T::ZERO, |total, &sum| total + sum)
    };
    rest.iter().fold(start, |sum, &value| sum + value * T::ZERO) == T::ZERO
}
