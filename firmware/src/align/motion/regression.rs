//! Errors given the sensors' biases.
//!
//! The filter knows errors `x` and biases `b` together. Somebody who has his own opinion of the
//! biases needs `x = by (b - estimate) + rest` instead: the regression of `x` on `b`, which does
//! not depend on what the filter assumed about `b`.

use super::ERRORS;
use lrnn_nostd::learn::kalman::OUTPUTS;

/// Covariance of the errors.
pub type Matrix = [[f32; ERRORS]; ERRORS];
/// Covariance of the biases.
pub type OfBiases = [[f32; OUTPUTS]; OUTPUTS];

/// Observations of the sensors' errors `e` by the fixes: independent observations of `rows (e -
/// from)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BiasObservations {
    /// The errors in units of the observations, rad/s and m/s2.
    pub rows: [[f32; OUTPUTS]; OUTPUTS],
    /// The observed values.
    pub z: [f32; OUTPUTS],
    /// Variance of the values; infinite where there is no observation.
    pub variance: [f32; OUTPUTS],
    /// The sensors' errors that were known before, rad/s and m/s2.
    pub from: [f32; OUTPUTS],
}

/// Memory for the errors.
#[derive(Debug)]
pub struct Regression<'a> {
    /// Effect of the biases that are left.
    pub by: &'a mut [[f32; OUTPUTS]; ERRORS],
    /// Covariance of the other errors.
    pub rest: &'a mut Matrix,
    /// Covariance of both, as the filter knows them.
    pub all: &'a mut Matrix,
}

/// Puts the errors into `regression`: they would be too large to be on the stack twice. `unit`
/// scales the biases: their standard deviations before. The covariances are those of the errors, of
/// the errors with the biases, and of the biases. False when they are not positive or not finite.
#[inline(never)]
pub fn regress_on_biases(
    (xx, cross, tt): (&Matrix, &[[f32; OUTPUTS]; ERRORS], &OfBiases),
    unit: &[f32; OUTPUTS],
    regression: Regression,
) -> bool {
    let Regression { by, rest, all } = regression;
    *all = *xx;
    let Some(factor) = factor(tt, unit) else {
        return false;
    };
    // errors are estimate minus truth, also those of the biases: hence the sign
    for (by, row) in by.iter_mut().zip(cross) {
        let scaled = solved(&factor, core::array::from_fn(|j| row[j] / unit[j]));
        *by = core::array::from_fn(|j| -scaled[j] / unit[j]);
    }
    // rounding must leave it symmetric, and positive
    let known = |i: usize, j: usize| {
        let pairs = by[i].iter().zip(&cross[j]);
        pairs.fold(0.0, |sum, (a, b)| sum + a * b)
    };
    for i in 0..ERRORS {
        for j in 0..ERRORS {
            let value = all[i][j] + 0.5 * (known(i, j) + known(j, i));
            let least = if i == j { 1e-6 * all[i][i] } else { value };
            rest[i][j] = value.max(least);
        }
    }
    let mut values = by.as_flattened().iter().chain(rest.as_flattened());
    values.all(|x| x.is_finite())
}

/// Factor of the biases' covariance in these units; `None` when it is not positive.
fn factor(tt: &OfBiases, unit: &[f32; OUTPUTS]) -> Option<Factor> {
    cholesky(&core::array::from_fn(|i| {
        core::array::from_fn(|j| tt[i][j] / (unit[i] * unit[j]))
    }))
}

/// The information that the filter has beside its own prior, whose covariance is `unit` squared:
/// `inverse(P) - inverse(unit^2)`, as independent observations. `tt` is `P`, `of` the estimate.
/// `None`: `P` is not positive.
#[inline(never)]
pub fn bias_observations(
    tt: &OfBiases,
    of: &[f32; OUTPUTS],
    unit: &[f32; OUTPUTS],
) -> Option<BiasObservations> {
    let factor = &factor(tt, unit)?;
    let sum = solved(factor, core::array::from_fn(|j| of[j] / unit[j]));
    let inverse: Factor = core::array::from_fn(|j| {
        let mut one = [0.0; OUTPUTS];
        one[j] = 1.0;
        solved(factor, one)
    });
    let mut left: Factor = core::array::from_fn(|i| {
        core::array::from_fn(|j| {
            let prior = if i == j { 1.0 } else { 0.0 };
            0.5 * (inverse[i][j] + inverse[j][i]) - prior
        })
    });
    let mut sum = sum;
    let mut bias_observations = BiasObservations {
        rows: [[0.0; OUTPUTS]; OUTPUTS],
        z: [0.0; OUTPUTS],
        variance: [f32::INFINITY; OUTPUTS],
        from: [0.0; OUTPUTS],
    };
    // one observation after the other is taken out of the information (L D L')
    for k in 0..OUTPUTS {
        let weight = left[k][k];
        if !(weight > LEAST_SHOWN && weight.is_finite()) {
            continue;
        }
        let row = left[k].map(|x| x / weight);
        let z = sum[k] / weight;
        for i in 0..OUTPUTS {
            sum[i] -= weight * row[i] * z;
            for j in 0..OUTPUTS {
                left[i][j] -= weight * row[i] * row[j];
            }
        }
        bias_observations.rows[k] = core::array::from_fn(|j| row[j] / unit[j]);
        bias_observations.z[k] = z;
        bias_observations.variance[k] = 1.0 / weight;
    }
    Some(bias_observations)
}

/// Information in units of the prior's that says nothing: the prior's standard deviation would
/// become 0.5 % smaller.
const LEAST_SHOWN: f32 = 0.01;

type Factor = [[f32; OUTPUTS]; OUTPUTS];

/// The lower factor of a symmetric matrix; `None` when it is not positive.
fn cholesky(of: &Factor) -> Option<Factor> {
    let mut l = [[0.0; OUTPUTS]; OUTPUTS];
    // all bounds are constant, so that no index can be out of range
    for i in 0..OUTPUTS {
        for j in 0..OUTPUTS {
            if j > i {
                continue;
            }
            let pairs = l[i].iter().zip(&l[j]).take(j);
            let sum = pairs.fold(of[i][j], |sum, (a, b)| sum - a * b);
            if i != j {
                l[i][j] = sum / l[j][j];
            } else if sum > 0.0 {
                l[i][i] = libm::sqrtf(sum);
            } else {
                return None;
            }
        }
    }
    Some(l)
}

/// The solution of `l l' x = b`.
fn solved(l: &Factor, mut b: [f32; OUTPUTS]) -> [f32; OUTPUTS] {
    for i in 0..OUTPUTS {
        let mut sum = b[i];
        for k in 0..OUTPUTS {
            if k < i {
                sum -= l[i][k] * b[k];
            }
        }
        b[i] = sum / l[i][i];
    }
    for i in (0..OUTPUTS).rev() {
        let mut sum = b[i];
        for k in 0..OUTPUTS {
            if k > i {
                sum -= l[k][i] * b[k];
            }
        }
        b[i] = sum / l[i][i];
    }
    b
}

#[cfg(test)]
mod tests;
