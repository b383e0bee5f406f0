//! Observations of an output itself: the error of a sensor, as a rest shows it.

use super::covariance::Innovation;
use super::row::{axpy, of_outputs};
use super::{Kalman, NEURONS, OUTPUTS, ParameterSet};
use crate::activation::Activation;
use crate::real::Real;

impl<L, const X: usize, const N: usize, const PACKED: usize, H, T> Kalman<L, X, N, PACKED, H, T>
where
    L: ParameterSet,
    H: Activation,
    T: Real,
{
    /// The innovation of an observation `z` of output `k`, rad/s or m/s^2: at rest the mean of a
    /// gyro, less the Earth's rotation. An output beyond [`OUTPUTS`] has variance 0.
    pub fn innovation_of_output(&mut self, k: usize, z: T, variance: T) -> Innovation<T> {
        let expected = self.model.estimate().get(k).copied().unwrap_or(T::ZERO);
        let (_, _, own) = self.of_output(k);
        Innovation {
            value: z - expected,
            variance: own + variance,
        }
    }

    /// Measurement update with an observation of output `k`. Gives the gains in the form of
    /// [`Kalman::gains`]: of the navigator's errors, and of the estimate of the sensors', which
    /// takes its own off.
    ///
    /// The truth is `estimate - J theta'` with the parameters' errors `theta'`, so an innovation
    /// above 0 shows that they are below 0:
    ///
    /// ```text
    /// x -= P_xt J_k' v / s,   theta' = -P_tt J_k' v / s,   P -= c c' / s
    /// ```
    pub fn update_output(&mut self, k: usize, innovation: Innovation<T>) -> ([T; X], [T; OUTPUTS]) {
        let weight = T::ONE / innovation.variance;
        let (of_x, of_theta, _) = self.of_output(k);
        self.covariance.update_output(&of_x, &of_theta, weight);
        let change = -(weight * innovation.value);
        axpy(&mut self.x, change, &of_x);
        let of_e = of_outputs(&self.model.jacobian(), &of_theta, -weight);
        self.model.subtract(&of_theta.map(|c| change * c));
        (of_x.map(|c| -(weight * c)), of_e)
    }

    /// Products of the covariance with row `k` of J, and the variance of output `k`.
    fn of_output(&mut self, k: usize) -> ([T; X], [T; N], T) {
        let rows = self.model.jacobian();
        match rows.get(k / NEURONS) {
            Some(rows) => self.covariance.of_output(rows, k % NEURONS),
            None => ([T::ZERO; X], [T::ZERO; N], T::ZERO),
        }
    }
}

#[cfg(test)]
mod tests;
