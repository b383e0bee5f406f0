//! Uncertainty of a self-alignment, and the correlation of its error with the sensor errors that
//! caused it.
//!
//! Let `u_k` be the true velocity that piece `k` of the standstill adds in the frozen navigation
//! frame, `M_k = |u_k|^2 I - u_k u_k'`, `M = sum M_k`. Gyro errors turn the measured pieces by
//! `psi_k`, their integral up to the middle of the piece. Accelerometer errors add `a_k`. To first
//! order, Wahba's problem gives `M phi_0 = sum (M_k psi_k + u_k x a_k)`. The attitude error at the
//! end is `phi = phi_0 - psi_end`. With `g_j`, the gyro error integrated over piece `j`,
//!
//! ```text
//! phi = sum_k M^-1 (u_k x a_k) - sum_j A_j g_j,      A_j = I - M^-1 (M_j / 2 + sum_{k>j} M_k).
//! ```

use super::{Aided, Belief, ErrorModel, Inputs, NAV, Noise, Prior};
use crate::inertial::align::{Alignment, Piece};
use nalgebra::{Matrix3, Matrix3x6, Matrix3xX, Vector3};

/// Attitude error of an alignment in the filter's definition (rad, NED): `sensitivity * theta +
/// rest`.
struct Uncertainty {
    /// Derivative by the parameters at the end of the alignment, 3 x n.
    sensitivity: Matrix3xX<f64>,
    /// Covariance of the rest: noise, and the change of the parameters during the alignment.
    rest: Matrix3<f64>,
}

/// The parts of the attitude error of an alignment (rad, NED): its derivative by a constant error
/// of each sensor (gyros in rad/s, then accelerometers in m/s2, body axes), and the covariance that
/// white noise and the random walk of the biases add.
#[must_use]
pub fn attitude_error(
    alignment: &Alignment,
    prior: &Prior,
    noise: Noise,
) -> (Matrix3x6<f64>, Matrix3<f64>) {
    let all = uncertainty(alignment, &ErrorModel::biases(prior), noise);
    (all.sensitivity.fixed_columns::<6>(0).into(), all.rest)
}

/// `|u|^2 I - u u'`.
fn moment(u: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::identity() * u.norm_squared() - u * u.transpose()
}

fn uncertainty(alignment: &Alignment, model: &ErrorModel, noise: Noise) -> Uncertainty {
    let mut out = Uncertainty {
        sensitivity: Matrix3xX::zeros(model.len()),
        rest: Matrix3::zeros(),
    };
    let mut left: Matrix3<f64> = alignment.pieces.iter().map(|p| moment(&p.u)).sum();
    // singular only at the poles, where there is no heading
    let inverse = left.try_inverse().unwrap_or_else(Matrix3::zeros);
    for piece in &alignment.pieces {
        let m = moment(&piece.u);
        let by_gyro = inverse * (left - m * 0.5) - Matrix3::identity();
        left -= m;
        let by_accel = inverse * crate::inertial::rotation::skew(&piece.u);
        out.rest += (by_gyro * by_gyro.transpose() * noise.gyro.powi(2)
            + by_accel * by_accel.transpose() * noise.accel.powi(2))
            * piece.time;
        out.add(piece, model, &[by_gyro * piece.c, by_accel * piece.c]);
    }
    let turn = alignment.q_nn0.to_rotation_matrix().into_inner();
    Uncertainty {
        sensitivity: turn * out.sensitivity,
        rest: turn * out.rest * turn.transpose(),
    }
}

impl Uncertainty {
    /// Adds one piece. In it the parameters change and sensor errors act through `by` (gyros,
    /// accelerometers; body axes).
    fn add(&mut self, piece: &Piece, model: &ErrorModel, by: &[Matrix3<f64>; 2]) {
        let now = Inputs {
            rate: piece.rate,
            force: piece.force,
            time: piece.middle,
            ..Inputs::default()
        };
        let known = model.known_at(now.time);
        for (i, p) in model.parameters.iter().enumerate() {
            let mut column = self.sensitivity.column_mut(i);
            // The effect of the earlier pieces is expressed by the present value of the parameter,
            // which has changed since then.
            let before = column.clone_owned();
            self.rest += before * before.transpose() * (p.walk * p.walk * piece.time);
            let effect = by[p.triad.index()].column(p.axis) * p.value(&now, &known);
            column.copy_from(&(before * p.keeps(piece.time) + effect * piece.time));
        }
    }
}

impl Aided {
    /// Takes the uncertainty of the initial attitude and its correlation with the parameters from
    /// the alignment. The effect of `unmodelled` errors is added.
    #[must_use]
    pub fn aligned_by(self, alignment: &Alignment, unmodelled: &ErrorModel) -> Self {
        let sigmas = self.model.parameters.iter().map(|q| q.sigma * q.sigma);
        let prior: Vec<f64> = sigmas.collect();
        let times_prior = |by: &mut Matrix3xX<f64>| {
            for (mut column, variance) in by.column_iter_mut().zip(&prior) {
                column *= *variance;
            }
        };
        self.aligned(alignment, unmodelled, times_prior)
    }

    /// As [`Self::aligned_by`], for a filter that begins with a [`Belief`]. In the alignment its
    /// mean was subtracted from the samples.
    #[must_use]
    pub fn aligned_knowing(mut self, alignment: &Alignment, known: &Belief) -> Self {
        let n = self.theta.len();
        self.theta.copy_from(&known.mean);
        self.p.view_mut((NAV, NAV), (n, n)).copy_from(&known.p);
        self.aligned(alignment, &ErrorModel::default(), |by| *by *= &known.p)
    }

    /// `times_prior` multiplies by the covariance of the filter's parameters.
    fn aligned(
        mut self,
        alignment: &Alignment,
        unmodelled: &ErrorModel,
        times_prior: impl Fn(&mut Matrix3xX<f64>),
    ) -> Self {
        let blank = Noise {
            gyro: 0.0,
            accel: 0.0,
        };
        let alien = uncertainty(alignment, unmodelled, blank);
        let attitude = uncertainty(alignment, &self.model, self.noise);
        let mut by = attitude.sensitivity.clone();
        times_prior(&mut by);
        let mut alien_by = alien.sensitivity.clone();
        for (mut column, q) in alien_by.column_iter_mut().zip(&unmodelled.parameters) {
            column *= q.sigma * q.sigma;
        }
        let tilt = attitude.rest
            + &by * attitude.sensitivity.transpose()
            + alien.rest
            + alien_by * alien.sensitivity.transpose();
        self.p.fixed_view_mut::<3, 3>(0, 0).copy_from(&tilt);
        let n = self.theta.len();
        // the error of an estimate is the estimate minus the parameter
        self.p.view_mut((0, NAV), (3, n)).copy_from(&-&by);
        self.p
            .view_mut((NAV, 0), (n, 3))
            .copy_from(&-by.transpose());
        self
    }
}
