//! Covariance of six estimated biases on a drive on which more errs than they.
//!
//! A filter that estimates biases alone knows nothing of scale factors, misalignments and
//! g-sensitivity. Tilts and rates that these cause pass for biases, and its own covariance does not
//! know. Here the filter's gains, which are those of its own covariance, act on a second covariance
//! with all these errors and the datasheet's sigmas: Schmidt's "considered" parameters, with
//! `P = (I - K H) P (I - K H)' + K R K'` at each fix (Jazwinski 1970, section 8.4). No gain has a
//! smaller one than the filter that estimates them all: its Cramer-Rao bound
//! ([`learnability`](crate::analysis::learnability)) is below.

use crate::learning::aiding::{Passed, fix_at, pass};
use crate::learning::teacher::Assumptions;
use host_core::inertial::ekf::{Aided, ErrorModel, NAV, Parameter, Regressor, Triad};
use host_core::inertial::gnss::Fix;
use host_core::inertial::motion::Motion;
use host_core::inertial::session::Session;
use nalgebra::{DMatrix, SMatrix};
use std::ops::Range;

/// Number of biases.
const BIASES: usize = 6;

/// Covariance of the biases: rad/s, then m/s2.
pub type Covariance = SMatrix<f64, BIASES, BIASES>;

/// A bias changes in run by a flicker noise. Two processes of these correlation times, s, stand for
/// it, each with the variance of a decade and a half of its spectrum `B^2 / (2 pi f)`, in shares of
/// `B`: `sqrt(1.5 ln 10 / (2 pi))`.
const IN_RUN_S: [f64; 2] = [20.0, 600.0];
const OF_FLICKER: f64 = 0.741;
/// Floor of the Allan deviation of a flicker noise, which datasheets give, in shares of `B` (IEEE
/// Std 952-1997, C.1.1).
const FLOOR: f64 = 0.664;

/// Everything that the datasheet says: the walking biases, 3x3 matrices of both triads, the gyros'
/// sensitivity to specific force, and last the parts of the biases that change in run.
fn all(assumptions: &Assumptions) -> ErrorModel {
    let mut model = ErrorModel::with_matrices(&assumptions.prior);
    let sigma = assumptions.g_sensitivity;
    let changes = [assumptions.prior.gyro_bias, assumptions.prior.accel_bias];
    let in_run = |time_s: f64| {
        move |axis, triad: Triad| {
            let floor = assumptions.in_run[triad.index()] * changes[triad.index()];
            let sigma = floor * OF_FLICKER / FLOOR;
            vec![Parameter {
                walk: sigma * (2.0 / time_s).sqrt(),
                time_s,
                ..Parameter::constant(triad, axis, Regressor::One, sigma)
            }]
        }
    };
    let by_force =
        |axis| move |j| Parameter::constant(Triad::Gyro, axis, Regressor::Force(j), sigma);
    let each = (0..3).flat_map(|axis| (0..3).map(by_force(axis)));
    model.parameters.extend(each);
    IN_RUN_S
        .iter()
        .for_each(|time_s| model.extend(in_run(*time_s)));
    model
}

/// The covariance after each of `epochs`, of a filter that begins with them. `filter` begins one
/// with a model. Biases walk by the datasheet.
pub fn considered(
    session: &Session,
    increments: &dyn Motion,
    assumptions: &Assumptions,
    filter: impl Fn(ErrorModel) -> Aided,
    epochs: Range<usize>,
) -> Vec<Covariance> {
    let assumptions = assumptions.walking(assumptions.datasheet_walk());
    let mut own = filter(ErrorModel::biases(&assumptions.prior));
    let mut whole = filter(all(&assumptions));
    let each = epochs.map(|k| {
        whole.sins = own.sins.clone();
        let fix = fix_at(session, k + 1);
        let passed = pass(&mut own, session, increments, k, fix);
        if let Passed::Epoch(_) = pass(&mut whole, session, increments, k, fix) {
            whole.take(None);
        }
        if let Passed::Epoch(fix) = passed {
            let predicted = own.fix(fix.as_ref()).predicted;
            if let Some(fix) = fix {
                update(&mut whole.p, &predicted, &fix);
            }
        }
        of_sums(&whole.p)
    });
    each.collect()
}

/// The covariance of the biases with their parts that change in run.
fn of_sums(p: &DMatrix<f64>) -> Covariance {
    let parts = (1..=IN_RUN_S.len()).map(|k| p.nrows() - k * BIASES);
    let parts: Vec<usize> = parts.chain([NAV]).collect();
    let of = |i: &usize, j: &usize| p.fixed_view::<BIASES, BIASES>(*i, *j).into_owned();
    let pairs = parts.iter().flat_map(|i| parts.iter().map(move |j| (i, j)));
    pairs.map(|(i, j)| of(i, j)).sum()
}

/// A fix with the gains of the filter whose covariance before it is `own`.
fn update(whole: &mut DMatrix<f64>, own: &DMatrix<f64>, fix: &Fix) {
    // the values of a fix are errors of the state: position 6 to 8, velocity 3 to 5
    let states = [6, 7, 8, 3, 4, 5];
    let measured = states.iter().zip(&fix.sigmas);
    let measured: Vec<(usize, f64)> = (measured.filter(|(_, sigma)| sigma.is_finite()))
        .map(|(state, sigma)| (*state, sigma * sigma))
        .collect();
    let m = measured.len();
    let h = |n: usize| DMatrix::from_fn(m, n, |i, j| f64::from(u8::from(measured[i].0 == j)));
    let r = DMatrix::from_fn(m, m, |i, j| measured[i].1 * f64::from(u8::from(i == j)));
    let ph = own * h(own.nrows()).transpose();
    let Some(inverse) = (h(own.nrows()) * &ph + &r).try_inverse() else {
        return;
    };
    let n = whole.nrows();
    let mut gain = DMatrix::zeros(n, m);
    gain.rows_mut(0, own.nrows()).copy_from(&(ph * inverse));
    let keeps = DMatrix::identity(n, n) - &gain * h(n);
    *whole = &keeps * &*whole * keeps.transpose() + &gain * r * gain.transpose();
}

#[cfg(test)]
mod tests;
