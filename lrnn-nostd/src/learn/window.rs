//! A reference over a window, with constant memory: sums are kept instead of samples.

use crate::gradient::Sensitivities;
use crate::normalisation::Normalisation;
use crate::real::Real;
use crate::shape::{NEURONS, PARAMS};

/// A = sum y_3(k) dt and Psi = dA/dtheta = sum s_3(k) dt over the steps of a window; 768 bytes in
/// `f32`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window<T = f32> {
    sum: [T; NEURONS],
    psi: [[T; PARAMS]; NEURONS],
}

impl<T: Real> Window<T> {
    /// An empty window.
    pub const fn new() -> Self {
        Self {
            sum: [T::ZERO; NEURONS],
            psi: [[T::ZERO; PARAMS]; NEURONS],
        }
    }

    /// Resets to [`Window::new`].
    pub fn reset(&mut self) {
        *self = Self::new();
    }

    /// Adds one step: `output` = y_3, `dt` in s.
    #[inline]
    pub fn add(&mut self, output: &[T; NEURONS], sens: &Sensitivities<T>, dt: T) {
        for j in 0..NEURONS {
            self.sum[j] += output[j] * dt;
            for theta in 0..PARAMS {
                self.psi[j][theta] += sens.of(theta)[j] * dt;
            }
        }
    }

    /// r = A - A_ref, where A_ref = `reference` / output_scale. `reference` is in physical units
    /// times s, r in network units times s.
    #[inline]
    pub fn residual(
        &self,
        reference: &[T; NEURONS],
        normalisation: &Normalisation<T>,
    ) -> [T; NEURONS] {
        core::array::from_fn(|j| self.sum[j] - reference[j] / normalisation.output_scale[j])
    }

    /// A = sum y_3 dt, in network units times s.
    pub fn sum(&self) -> &[T; NEURONS] {
        &self.sum
    }

    /// Psi = dA/dtheta: one row for each output.
    #[inline]
    pub fn psi(&self) -> &[[T; PARAMS]; NEURONS] {
        &self.psi
    }
}

impl<T: Real> Default for Window<T> {
    fn default() -> Self {
        Self::new()
    }
}
