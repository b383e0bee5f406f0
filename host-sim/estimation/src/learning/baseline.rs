//! Linear models for comparison: a bias, and a bias with a 3x3 matrix (scale factor and
//! misalignment). Both are fitted by least squares to the same references that the networks learn
//! from.

use host_core::inertial::sins::Increment;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// `error = bias + matrix * input` for one triad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    /// Bias, SI.
    pub bias: Vector3<f64>,
    /// Scale factor and misalignment.
    pub matrix: Matrix3<f64>,
}

impl Default for Linear {
    fn default() -> Self {
        Self {
            bias: Vector3::zeros(),
            matrix: Matrix3::zeros(),
        }
    }
}

/// Linear models of both triads.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LinearModel {
    /// Gyros.
    pub gyro: Linear,
    /// Accelerometers.
    pub accel: Linear,
}

/// Input (mean rate or specific force) and error of one epoch.
pub type Sample = (Vector3<f64>, Vector3<f64>);

/// Mean error.
#[must_use]
pub fn fit_bias(samples: &[Sample]) -> Linear {
    let sum: Vector3<f64> = samples.iter().map(|(_, e)| e).sum();
    Linear {
        bias: sum / (samples.len().max(1) as f64),
        matrix: Matrix3::zeros(),
    }
}

/// Least squares of bias and 3x3 matrix through the singular value decomposition. Directions that
/// the drive does not excite stay at zero: on a level road the vertical accelerometer's bias cannot
/// be separated from its scale factor.
#[must_use]
pub fn fit_3x3(samples: &[Sample]) -> Linear {
    if samples.len() < 4 {
        return fit_bias(samples);
    }
    // columns are centred, so that the matrix contains no part of the bias
    let n = samples.len().max(1) as f64;
    let mean_in: Vector3<f64> = samples.iter().map(|(x, _)| x).sum::<Vector3<f64>>() / n;
    let mean_err: Vector3<f64> = samples.iter().map(|(_, e)| e).sum::<Vector3<f64>>() / n;
    let a = DMatrix::from_fn(samples.len(), 3, |i, j| samples[i].0[j] - mean_in[j]);
    let svd = a.svd(true, true);
    let cut = svd.singular_values.max() * 1e-3;
    let mut matrix = Matrix3::zeros();
    for axis in 0..3 {
        let b = DVector::from_fn(samples.len(), |i, _| samples[i].1[axis] - mean_err[axis]);
        if let Ok(x) = svd.solve(&b, cut) {
            matrix.set_row(axis, &nalgebra::RowVector3::new(x[0], x[1], x[2]));
        }
    }
    Linear {
        bias: mean_err - matrix * mean_in,
        matrix,
    }
}

impl LinearModel {
    /// The increment minus the estimated errors.
    #[must_use]
    pub fn correct(&self, increment: &Increment, dt: f64) -> Increment {
        let fix = |l: &Linear, d: &Vector3<f64>| d - l.bias * dt - l.matrix * d;
        Increment {
            dtheta: fix(&self.gyro, &increment.dtheta),
            dv: fix(&self.accel, &increment.dv),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_errors_are_found_exactly() {
        let truth = Linear {
            bias: Vector3::new(1e-6, -2e-6, 3e-6),
            matrix: Matrix3::new(1e-4, 2e-5, -3e-5, 4e-5, -2e-4, 1e-5, 0.0, 6e-5, 5e-5),
        };
        let samples: Vec<Sample> = (0..100)
            .map(|k| {
                let t = f64::from(k);
                let x = Vector3::new((0.3 * t).sin(), (0.7 * t).cos(), 0.2 + (1.1 * t).sin());
                (x, truth.bias + truth.matrix * x)
            })
            .collect();
        let got = fit_3x3(&samples);
        assert!(
            (got.bias - truth.bias).norm() < 1e-15 && (got.matrix - truth.matrix).norm() < 1e-13
        );
        let only_bias = fit_bias(&samples);
        assert!(
            only_bias.matrix == Matrix3::zeros() && (only_bias.bias - truth.bias).norm() > 1e-7
        );
    }

    #[test]
    fn unexcited_directions_stay_at_zero() {
        let samples: Vec<Sample> = (0..50)
            .map(|k| {
                (
                    Vector3::new(f64::from(k % 7), 0.0, -9.8),
                    Vector3::new(0.0, 0.0, 1e-3),
                )
            })
            .collect();
        let got = fit_3x3(&samples);
        assert!(got.matrix.norm() < 1e-12 && (got.bias.z - 1e-3).abs() < 1e-15);
    }
}
