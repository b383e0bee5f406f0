//! Errors given the sensors' biases.
//!
//! The filter knows errors `x` and biases `b` together. Somebody who has his own opinion of the
//! biases needs `x = by (b - estimate) + rest` instead: the regression of `x` on `b`, which does
//! not depend on what the filter assumed about `b`.

use super::filter::{Biased, ERRORS};
use lrnn_nostd::learn::kalman::OUTPUTS;

/// Covariance or map of the errors.
pub type Matrix = [[f32; ERRORS]; ERRORS];

/// Errors of a map.
#[derive(Debug, Clone, Copy)]
pub struct Given {
    /// Effect of the biases that are left.
    pub by: [[f32; OUTPUTS]; ERRORS],
    /// Covariance of the other errors.
    pub rest: Matrix,
    /// Covariance of both, as the filter knows them.
    pub all: Matrix,
}

/// The errors `m x`. `unit` scales the biases: their standard deviations before. `None` when the
/// covariance is not positive or not finite.
pub fn given_biases(kalman: &Biased, m: &Matrix, unit: &[f32; OUTPUTS]) -> Option<Given> {
    let covariance = kalman.covariance();
    let (xx, xt) = (covariance.errors(), covariance.cross());
    let half: Matrix = core::array::from_fn(|i| {
        core::array::from_fn(|j| (0..ERRORS).fold(0.0, |sum, k| sum + m[i][k] * xx[k][j]))
    });
    let all: Matrix = core::array::from_fn(|i| {
        core::array::from_fn(|j| (0..ERRORS).fold(0.0, |sum, k| sum + half[i][k] * m[j][k]))
    });
    let cross: [[f32; OUTPUTS]; ERRORS] = core::array::from_fn(|i| {
        core::array::from_fn(|j| (0..ERRORS).fold(0.0, |sum, k| sum + m[i][k] * xt[k][j]))
    });
    let scaled: Factor = core::array::from_fn(|i| {
        core::array::from_fn(|j| covariance.parameter(i, j) / (unit[i] * unit[j]))
    });
    let factor = cholesky(&scaled)?;
    // errors are estimate minus truth, also those of the biases: hence the sign
    let by = cross.map(|row| {
        let scaled = solved(&factor, core::array::from_fn(|j| row[j] / unit[j]));
        core::array::from_fn(|j| -scaled[j] / unit[j])
    });
    // rounding must leave it symmetric, and positive
    let known = |i: usize, j: usize| {
        let pairs = by[i].iter().zip(&cross[j]);
        pairs.fold(0.0, |sum, (a, b)| sum + a * b)
    };
    let rest: Matrix = core::array::from_fn(|i| {
        core::array::from_fn(|j| {
            let value = all[i][j] + 0.5 * (known(i, j) + known(j, i));
            let least = if i == j { 1e-6 * all[i][i] } else { value };
            value.max(least)
        })
    });
    let mut values = by.as_flattened().iter().chain(rest.as_flattened());
    values
        .all(|x| x.is_finite())
        .then_some(Given { by, rest, all })
}

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
