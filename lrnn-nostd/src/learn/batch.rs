//! Cost and gradient of one pass.

use crate::real::{Real, all_finite};
use crate::shape::{NEURONS, PARAMS};

/// E = 1/2 sum weight r^2 (eq. 3) and dE/dtheta = sum weight Psi^T r (eq. 4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Batch<T = f32> {
    /// E.
    pub cost: T,
    /// dE/dtheta, in parameter order.
    pub gradient: [T; PARAMS],
}

impl<T: Real> Batch<T> {
    /// A constant for the same reason as that of `Window`.
    const EMPTY: Self = Self::new();

    /// Sums of 0.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            cost: T::ZERO,
            gradient: [T::ZERO; PARAMS],
        }
    }

    /// Resets to [`Batch::new`].
    #[inline]
    pub fn reset(&mut self) {
        *self = Self::EMPTY;
    }

    /// Adds the residuals `r` of one window, with `psi` = dr/dtheta.
    #[inline]
    pub fn add(&mut self, psi: &[[T; PARAMS]; NEURONS], r: &[T; NEURONS], weight: T) {
        let half = T::from_f64(0.5);
        let [a, b, c] = *r;
        self.cost += half * weight * (a * a + b * b + c * c);
        let (wa, wb, wc) = (weight * a, weight * b, weight * c);
        let [psi_a, psi_b, psi_c] = psi;
        let columns = psi_a.iter().zip(psi_b).zip(psi_c);
        for (gradient, ((&a, &b), &c)) in self.gradient.iter_mut().zip(columns) {
            *gradient += a * wa + b * wb + c * wc;
        }
    }

    /// Whether cost and gradient are finite.
    pub fn is_finite(&self) -> bool {
        self.cost.is_finite() && all_finite(&self.gradient)
    }
}

impl<T: Real> Default for Batch<T> {
    fn default() -> Self {
        Self::new()
    }
}
