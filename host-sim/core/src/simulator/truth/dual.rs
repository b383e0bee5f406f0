//! A quantity with its time derivative: sums, products and functions of such quantities carry the
//! derivative along by the rules of calculus.

use std::ops::{Add, Mul, Neg, Sub};

/// A value and its time derivative.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Dual {
    /// Value.
    pub(super) value: f64,
    /// Derivative, 1/s.
    pub(super) rate: f64,
}

impl Dual {
    pub(super) const fn new(value: f64, rate: f64) -> Self {
        Self { value, rate }
    }

    fn through(self, value: f64, slope: f64) -> Self {
        Self::new(value, slope * self.rate)
    }

    pub(super) fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.value.sin_cos();
        (self.through(s, c), self.through(c, -s))
    }

    pub(super) fn atan(self) -> Self {
        let slope = 1.0 / (1.0 + self.value * self.value);
        self.through(self.value.atan(), slope)
    }

    /// The angle of a sine between -1 and 1.
    pub(super) fn asin(self) -> Self {
        let slope = (1.0 - self.value * self.value).sqrt().recip();
        self.through(self.value.asin(), slope)
    }

    /// The root of a value above zero.
    pub(super) fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.through(root, 0.5 / root)
    }
}

impl From<f64> for Dual {
    fn from(constant: f64) -> Self {
        Self::new(constant, 0.0)
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.value + other.value, self.rate + other.rate)
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.value - other.value, self.rate - other.rate)
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        Self::new(-self.value, -self.rate)
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let rate = self.rate * other.value + self.value * other.rate;
        Self::new(self.value * other.value, rate)
    }
}

impl Mul<f64> for Dual {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self::new(self.value * factor, self.rate * factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The derivative of a long expression against a difference of its values.
    #[test]
    fn derivatives_are_those_of_differences() {
        let of = |t: f64| {
            let x = Dual::new(0.3 + 0.7 * t, 0.7);
            let y = Dual::new(2.0 - t * t, -2.0 * t);
            let (s, c) = (x * y).sin_cos();
            (s * y - c).atan() * 3.0 + (s * 0.6).asin() + (y * y + Dual::from(1.0)).sqrt() * -x
        };
        for t in [-1.0, 0.0, 0.4, 1.3] {
            let h = 1e-5;
            let difference = (of(t + h).value - of(t - h).value) / (2.0 * h);
            assert!((of(t).rate - difference).abs() < 1e-8, "{t}");
        }
    }
}
