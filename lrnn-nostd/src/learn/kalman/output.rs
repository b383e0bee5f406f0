//! Observations of an output itself, the error of a sensor, as a rest shows it; beside it they may
//! depend on the navigator's errors.

use super::covariance::Innovation;
use super::row::{Rows, axpy, dot, of_outputs};
use super::{Kalman, NEURONS, OUTPUTS, ParameterSet};
use crate::activation::Activation;
use crate::real::Real;

impl<L, const X: usize, const N: usize, const PACKED: usize, H, T> Kalman<L, X, N, PACKED, H, T>
where
    L: ParameterSet,
    H: Activation,
    T: Real,
{
    /// The innovation of an observation `z` = e_k + `by` x of output `k`, rad/s or m/s^2, and of
    /// the navigator's errors: at rest the mean of a gyro, less the Earth's rotation by the
    /// navigator's attitude. An output beyond [`OUTPUTS`] is 0 and known.
    pub fn innovation_of_output(
        &mut self,
        k: usize,
        by: &[T; X],
        z: T,
        variance: T,
    ) -> Innovation<T> {
        let (_, _, own) = self.of_output(k, by);
        self.innovation_with(k, by, z, own + variance)
    }

    fn innovation_with(&self, k: usize, by: &[T; X], z: T, variance: T) -> Innovation<T> {
        let estimate = self.model.estimate().get(k).copied().unwrap_or(T::ZERO);
        Innovation {
            value: z - (estimate + dot(by, &self.x)),
            variance,
        }
    }

    /// Measurement update with such an observation. Gives the gains in the form of
    /// [`Kalman::gains`]: of the navigator's errors, and of the estimate of the sensors', which
    /// takes its own off.
    ///
    /// ```text
    /// x += c_x v / s,   theta' = c_t v / s,   P -= c c' / s
    /// ```
    pub fn update_output(
        &mut self,
        k: usize,
        by: &[T; X],
        z: T,
        variance: T,
    ) -> ([T; X], [T; OUTPUTS]) {
        let (of_x, of_theta, own) = self.of_output(k, by);
        let innovation = self.innovation_with(k, by, z, own + variance);
        let weight = T::ONE / innovation.variance;
        self.covariance.update_output(&of_x, &of_theta, weight);
        let change = weight * innovation.value;
        axpy(&mut self.x, change, &of_x);
        let of_e = of_outputs(&self.model.jacobian(), &of_theta, weight);
        self.model.subtract(&of_theta.map(|c| change * c));
        (of_x.map(|c| weight * c), of_e)
    }

    fn of_output(&mut self, k: usize, by: &[T; X]) -> ([T; X], [T; N], T) {
        let none = Rows {
            start: 0,
            values: &[],
        };
        let rows = self.model.jacobian();
        let rows = rows.get(k / NEURONS).unwrap_or(&none);
        self.covariance.of_output(rows, k % NEURONS, by)
    }
}

#[cfg(test)]
mod tests;
