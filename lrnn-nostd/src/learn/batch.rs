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
    /// Nothing summed.
    pub const fn new() -> Self {
        Self {
            cost: T::ZERO,
            gradient: [T::ZERO; PARAMS],
        }
    }

    /// Adds the residuals `r` of one window, with `psi` = dr/dtheta.
    #[inline]
    pub fn add(&mut self, psi: &[[T; PARAMS]; NEURONS], r: &[T; NEURONS], weight: T) {
        let half = T::from_f64(0.5);
        for (row, &r) in psi.iter().zip(r) {
            let wr = weight * r;
            self.cost += half * wr * r;
            for (gradient, &psi) in self.gradient.iter_mut().zip(row) {
                *gradient += psi * wr;
            }
        }
    }

    /// Cost and gradient are finite.
    pub fn is_finite(&self) -> bool {
        self.cost.is_finite() && all_finite(&self.gradient)
    }
}

impl<T: Real> Default for Batch<T> {
    fn default() -> Self {
        Self::new()
    }
}
