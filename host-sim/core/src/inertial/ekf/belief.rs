//! Knowledge of a sensor's parameters between two drives.
//!
//! A parameter of a drive is `theta = u + t`: `u` belongs to the unit and stays, `t` is new at
//! every turn-on. The belief is the mean `m` and the covariance `P` of `u`; `T` is the variance of
//! `t`, the turn-on variance. A drive begins with
//!
//! ```text
//! theta ~ N(m, P + T)
//! ```
//!
//! and its filter ends with the mean `m+` and the covariance `P+` of `theta`, which has walked by
//! the variance `W` meanwhile. The estimate of `u` from it is the backward step of a smoother
//! (Rauch, Tung and Striebel 1965), in which the walk of the drive counts as a part of the turn-on:
//!
//! ```text
//! G = P (P + T + W)^-1,   m <- m + G (m+ - m),   P <- P - G (P + T + W - P+) G'
//! ```
//!
//! For one bias without a walk, measured in each drive with the variance R, this is the mean of K
//! measurements with the variance T + R each: `1/P_K = 1/P_0 + K/(T + R)`.

use super::{Aided, ErrorModel, Parameter, Regressor, Triad};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Shares of the prior variance of a parameter that are new at every turn-on, 0 to 1: of the biases
/// of each triad, and of all other parameters (laws). With 1 nothing is carried over.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TurnOn {
    /// Share of a gyro's bias.
    pub gyro: f64,
    /// Share of an accelerometer's bias.
    pub accel: f64,
    /// Share of a law.
    pub law: f64,
}

/// Mean and covariance of parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Belief {
    /// Mean, in the order of the model, SI.
    pub mean: DVector<f64>,
    /// Covariance.
    pub p: DMatrix<f64>,
}

impl Belief {
    /// Belief on a unit before its first drive.
    #[must_use]
    pub fn of_unit(model: &ErrorModel, turn_on: TurnOn) -> Self {
        let stays = |q: &Parameter| (1.0 - turn_on.share_of(q)) * q.sigma.powi(2);
        let variances: Vec<f64> = model.parameters.iter().map(stays).collect();
        Self {
            mean: DVector::zeros(model.len()),
            p: DMatrix::from_diagonal(&DVector::from_vec(variances)),
        }
    }

    /// Belief on the parameters at power-on: the turn-on variance is added.
    #[must_use]
    pub fn turned_on(&self, model: &ErrorModel, turn_on: TurnOn) -> Self {
        let mut out = self.clone();
        for (i, q) in model.parameters.iter().enumerate() {
            out.p[(i, i)] += turn_on.share_of(q) * q.sigma.powi(2);
        }
        out
    }

    /// Belief on the unit after a drive of `time_s` seconds; `after`: belief on the parameters at
    /// its end. Without a Cholesky factor, that is with a parameter of no variance at all, nothing
    /// is learnt.
    #[must_use]
    pub fn powered_off(
        &self,
        model: &ErrorModel,
        turn_on: TurnOn,
        after: &Self,
        time_s: f64,
    ) -> Self {
        let mut before = self.turned_on(model, turn_on);
        for (i, q) in model.parameters.iter().enumerate() {
            before.p[(i, i)] += q.walk * q.walk * time_s;
        }
        let Some(root) = before.p.clone().cholesky() else {
            return self.clone();
        };
        // the transposed gain: (P + T + W)^-1 P
        let gain = root.solve(&self.p);
        let learnt = &before.p - &after.p;
        let p = &self.p - gain.transpose() * learnt * &gain;
        Self {
            mean: &self.mean + gain.transpose() * (&after.mean - &self.mean),
            p: (&p + p.transpose()) * 0.5,
        }
    }

    /// The present estimate of a filter.
    #[must_use]
    pub fn of_filter(filter: &Aided) -> Self {
        let n = filter.theta.len();
        Self {
            mean: filter.theta.clone(),
            p: filter.p.view((super::NAV, super::NAV), (n, n)).into_owned(),
        }
    }
}

impl TurnOn {
    /// The same share for all parameters.
    #[must_use]
    pub fn of_all(share: f64) -> Self {
        Self {
            gyro: share,
            accel: share,
            law: share,
        }
    }

    fn share_of(self, parameter: &Parameter) -> f64 {
        match (parameter.regressor, parameter.triad) {
            (Regressor::One, Triad::Gyro) => self.gyro,
            (Regressor::One, Triad::Accel) => self.accel,
            _ => self.law,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model(regressors: &[Regressor], walk: f64) -> ErrorModel {
        let of = |&regressor: &Regressor| Parameter {
            walk,
            ..Parameter::constant(Triad::Gyro, 0, regressor, 2.0)
        };
        ErrorModel {
            parameters: regressors.iter().map(of).collect(),
            ..ErrorModel::default()
        }
    }

    /// A drive that measures the parameters: `z = theta` with the variance `r`, independent of one
    /// another.
    fn measured(prior: &Belief, z: &[f64], r: f64) -> Belief {
        let n = z.len();
        let s = &prior.p + DMatrix::identity(n, n) * r;
        let gain = &prior.p * s.try_inverse().unwrap();
        Belief {
            mean: &prior.mean + &gain * (DVector::from_row_slice(z) - &prior.mean),
            p: &prior.p - &gain * &prior.p,
        }
    }

    /// One bias: after K drives with the turn-on variance T and measurements of the variance R, the
    /// information is the sum, and the mean is the weighted mean.
    #[test]
    fn a_bias_after_k_drives_is_the_scalar_kalman_filter() {
        let model = model(&[Regressor::One], 0.0);
        let turn_on = TurnOn {
            gyro: 0.1,
            accel: 0.1,
            law: 1.0,
        };
        let (stays, fresh, r) = (0.9 * 4.0, 0.1 * 4.0, 0.3);
        let mut belief = Belief::of_unit(&model, turn_on);
        assert!((belief.p[(0, 0)] - stays).abs() < 1e-12);
        let measurements = [1.3, 0.7, 1.1, 1.9, -0.2];
        let mut sum = 0.0;
        for (k, z) in measurements.into_iter().enumerate() {
            let at_start = belief.turned_on(&model, turn_on);
            let after = measured(&at_start, &[z], r);
            belief = belief.powered_off(&model, turn_on, &after, 1e4);
            sum += z;
            let drives = (k + 1) as f64;
            let variance = 1.0 / (1.0 / stays + drives / (fresh + r));
            let mean = variance * sum / (fresh + r);
            assert!((belief.p[(0, 0)] / variance - 1.0).abs() < 1e-12);
            assert!((belief.mean[0] - mean).abs() < 1e-12);
            // the next drive begins with the turn-on variance on top
            let next = belief.turned_on(&model, turn_on).p[(0, 0)];
            assert!((next - variance - fresh).abs() < 1e-12);
        }
    }

    /// As above with two parameters of which each drive measures only the sum, against one Kalman
    /// filter whose state holds the unit's parameters and those of all turn-ons at once.
    #[test]
    fn correlated_parameters_are_those_of_one_filter_with_all_turn_ons() {
        let model = model(&[Regressor::One, Regressor::Hours], 0.0);
        let turn_on = TurnOn {
            gyro: 0.2,
            accel: 0.2,
            law: 0.05,
        };
        let (fresh, r) = ([0.8, 0.2], 0.5);
        let measurements = [0.9, 1.6, -0.4];
        let size = 2 + 2 * measurements.len();
        let mut all = DMatrix::<f64>::zeros(size, size);
        for i in 0..size {
            all[(i, i)] = match i {
                0 | 1 => 4.0 - fresh[i],
                _ => fresh[i % 2],
            };
        }
        let mut mean = DVector::<f64>::zeros(size);
        let mut belief = Belief::of_unit(&model, turn_on);
        for (k, z) in measurements.into_iter().enumerate() {
            let mut h = DVector::<f64>::zeros(size);
            for i in [0, 1, 2 + 2 * k, 3 + 2 * k] {
                h[i] = 1.0;
            }
            let column = &all * &h;
            let s = h.dot(&column) + r;
            let innovation = z - h.dot(&mean);
            mean += &column * (innovation / s);
            all -= &column * column.transpose() / s;

            let prior = belief.turned_on(&model, turn_on);
            let column = &prior.p * DVector::repeat(2, 1.0);
            let s = column.sum() + r;
            let after = Belief {
                mean: &prior.mean + &column * ((z - prior.mean.sum()) / s),
                p: &prior.p - &column * column.transpose() / s,
            };
            belief = belief.powered_off(&model, turn_on, &after, 0.0);
        }
        assert!((belief.p - all.view((0, 0), (2, 2))).amax() < 1e-12);
        assert!((belief.mean - mean.rows(0, 2)).amax() < 1e-12);
    }

    /// A law that is the same at every turn-on is known better with every drive; one that is new at
    /// every turn-on is never known.
    #[test]
    fn only_what_stays_is_remembered() {
        let model = model(&[Regressor::One, Regressor::Decay(900.0)], 0.0);
        let stays = TurnOn {
            gyro: 1.0,
            accel: 1.0,
            law: 0.0,
        };
        let mut belief = Belief::of_unit(&model, stays);
        let mut last = f64::INFINITY;
        for k in 1..=4 {
            let after = measured(&belief.turned_on(&model, stays), &[0.5, 1.5], 1.0);
            belief = belief.powered_off(&model, stays, &after, 0.0);
            let variance = belief.p[(1, 1)];
            assert!((variance - 1.0 / (0.25 + f64::from(k))).abs() < 1e-12);
            assert!(variance < last);
            last = variance;
            assert_eq!((belief.mean[0], belief.p[(0, 0)]), (0.0, 0.0));
        }
    }

    /// A walk so large that the end of a drive has no information on its beginning leaves the unit
    /// unknown. With a small walk less is learnt than without.
    #[test]
    fn a_walk_counts_as_a_part_of_the_turn_on() {
        let turn_on = TurnOn {
            gyro: 0.1,
            accel: 0.1,
            law: 0.1,
        };
        let variance = |walk: f64| {
            let model = model(&[Regressor::One], walk);
            let belief = Belief::of_unit(&model, turn_on);
            let mut prior = belief.turned_on(&model, turn_on);
            prior.p[(0, 0)] += walk * walk * 100.0;
            let after = measured(&prior, &[1.0], 0.1);
            belief.powered_off(&model, turn_on, &after, 100.0).p[(0, 0)]
        };
        assert!(variance(0.0) < variance(0.02) && variance(0.02) < variance(0.2));
        assert!((variance(1e6) - 3.6).abs() < 1e-9);
    }
}
