//! Transition of navigation errors and parameters over the time since the last fix, increment by
//! increment.

use super::transition::{Sums, Transition, integrate, nothing};
use super::{AuxiliaryData, ErrorModel, Inputs, NAV, Noise};
use crate::inertial::lane::scaled;
use crate::inertial::rotation::from_rotvec;
use crate::inertial::sins::{Increment, NavState, States};
use nalgebra::{Dyn, OMatrix, SMatrix, U9, Vector3};

/// Increments are combined to pieces of about this length before attitude and regressors are
/// evaluated, s. It is short compared with the motion of a vehicle's attitude.
const PIECE_S: f64 = 0.05;
/// Pieces are combined to stretches of this length before the matrices are updated, s. Within a
/// stretch the rates that couple the errors (Earth and transport rate, below 1e-3 rad/s) count to
/// second order, and the specific force by its two integrals.
const STRETCH_S: f64 = 1.0;

/// Transition over the time since the last fix.
#[derive(Debug, Clone)]
pub(super) struct Interval {
    pub(super) phi: SMatrix<f64, NAV, NAV>,
    pub(super) psi: OMatrix<f64, U9, Dyn>,
    pub(super) q: SMatrix<f64, NAV, NAV>,
    pub(super) time: f64,
    /// Time since power-on, s.
    pub(super) clock: f64,
    piece: Increment,
    piece_time: f64,
    stretch: Stretch,
    pub(super) last_rate: Option<Vector3<f64>>,
}

/// Integrals over the present stretch, with `t` from its start to its end `T`.
#[derive(Debug, Clone)]
struct Stretch {
    time: f64,
    /// Specific force in NED: integral, m/s, and integral of the integral, m.
    force: Sums<f64>,
    /// The integrals for each body axis in NED, s and s2. Multiplied by the contribution of a slow
    /// parameter along the axis, they give the effect of that parameter.
    axes: [Sums<f64>; 3],
    /// For each other parameter, which adds `c` to rate or force in NED: the integrals of `c` and
    /// of `(T - t) c`.
    effects: Vec<Sums<f64>>,
}

impl Stretch {
    fn new(n: usize) -> Self {
        Self {
            time: 0.0,
            force: nothing(()),
            axes: [nothing(()); 3],
            effects: vec![nothing(()); n],
        }
    }

    fn reset(&mut self) {
        self.time = 0.0;
        self.force = nothing(());
        self.axes = [nothing(()); 3];
        self.effects.fill(nothing(()));
    }
}

impl Interval {
    pub(super) fn new(n: usize) -> Self {
        Self {
            phi: SMatrix::identity(),
            psi: OMatrix::<f64, U9, Dyn>::zeros(n),
            q: SMatrix::zeros(),
            time: 0.0,
            clock: 0.0,
            piece: Increment::default(),
            piece_time: 0.0,
            stretch: Stretch::new(n),
            last_rate: None,
        }
    }

    pub(super) fn reset(&mut self) {
        self.phi = SMatrix::identity();
        self.psi.fill(0.0);
        self.q = SMatrix::zeros();
        self.time = 0.0;
        self.piece = Increment::default();
        self.piece_time = 0.0;
        self.stretch.reset();
    }

    /// Accumulates one corrected increment. `nav` is the state after it.
    pub(super) fn accumulate(
        &mut self,
        nav: &NavState,
        increment: &Increment,
        dt: f64,
        model: &ErrorModel,
        noise: Noise,
    ) {
        self.time += dt;
        self.clock += dt;
        self.piece.dtheta += increment.dtheta;
        self.piece.dv += increment.dv;
        self.piece_time += dt;
        if self.piece_time >= PIECE_S - 1e-9 {
            self.end_piece(nav, model);
            if self.stretch.time >= STRETCH_S - 1e-9 {
                self.end_stretch(nav, noise, model);
            }
        }
    }

    /// Updates the matrices to the end of the last increment.
    pub(super) fn finish(&mut self, nav: &NavState, model: &ErrorModel, noise: Noise) {
        if self.piece_time > 0.0 {
            self.end_piece(nav, model);
        }
        if self.stretch.time > 0.0 {
            self.end_stretch(nav, noise, model);
        }
    }

    fn end_piece(&mut self, nav: &NavState, model: &ErrorModel) {
        let tau = self.piece_time;
        let per_s = 1.0 / tau;
        let rate = self.piece.dtheta * per_s;
        let now = Inputs {
            rate,
            force: self.piece.dv * per_s,
            rate_change: (rate - self.last_rate.replace(rate).unwrap_or(rate)) * per_s,
            time: self.clock - 0.5 * tau,
            ..Inputs::default()
        };
        // the attitude in the middle of the piece
        let q_mid = nav.q_bn * from_rotvec(&(self.piece.dtheta * -0.5));
        let c = q_mid.to_rotation_matrix().into_inner();
        integrate(&mut self.stretch.force, &(c * now.force).into(), tau);
        for (sums, axis) in self.stretch.axes.iter_mut().zip(c.column_iter()) {
            integrate(sums, &axis.into_owned().into(), tau);
        }
        let known = AuxiliaryData::default();
        for (sums, p) in self.stretch.effects.iter_mut().zip(&model.parameters) {
            if !p.regressor.is_slow() {
                let effect = c.column(p.axis) * p.value(&now, &known);
                integrate(sums, &effect.into(), tau);
            }
        }
        self.stretch.time += tau;
        self.piece = Increment::default();
        self.piece_time = 0.0;
    }

    fn end_stretch(&mut self, nav: &NavState, noise: Noise, model: &ErrorModel) {
        let t = self.stretch.time;
        let states = States::<f64>::of((), |_| nav);
        let noise = [noise.gyro, noise.accel];
        let over = Transition::over(&states, &self.stretch.force, &noise, t);
        let [step, q] =
            [&over.phi, &over.q].map(|by| SMatrix::<f64, NAV, NAV>::from_fn(|r, c| by[c][r]));
        let fresh = self.time - t < 1e-9;
        self.phi = if fresh { step } else { step * self.phi };
        self.q = if fresh {
            q
        } else {
            step * self.q * step.transpose() + q
        };
        if !fresh && !model.is_empty() {
            self.psi = step * &self.psi;
        }
        let middle = Inputs {
            time: self.clock - 0.5 * t,
            ..Inputs::default()
        };
        let known = model.known_at(middle.time);
        for ((mut column, effect), p) in self
            .psi
            .column_iter_mut()
            .zip(&self.stretch.effects)
            .zip(&model.parameters)
        {
            let integrals = if p.regressor.is_slow() {
                let value = p.value(&middle, &known);
                self.stretch.axes[p.axis].map(|c| scaled(&c, value))
            } else {
                *effect
            };
            let effect = over.effect(p.triad, &integrals, t);
            for (cell, add) in column.iter_mut().zip(effect) {
                *cell += add;
            }
        }
        self.stretch.reset();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertial::earth::Geodetic;
    use crate::inertial::rotation::from_rotvec;
    use crate::inertial::sins::Sins;
    use nalgebra::SVector;

    /// Error state between two navigators.
    fn difference(a: &NavState, b: &NavState) -> SVector<f64, 9> {
        let phi = (b.q_bn * a.q_bn.inverse()).scaled_axis();
        let dv = a.velocity - b.velocity;
        let dr = a.position.ned_from(&b.position);
        SVector::from_iterator(phi.iter().chain(dv.iter()).chain(dr.iter()).copied())
    }

    /// Compares every column of `Phi` over 20 s of a turning, climbing drive with two navigators
    /// that start a little apart.
    #[test]
    fn transition_matrix_is_the_derivative_of_the_mechanisation() {
        let start = NavState {
            position: Geodetic {
                lat: 0.7,
                lon: 0.3,
                h: 200.0,
            },
            velocity: Vector3::new(12.0, 25.0, -1.0),
            q_bn: from_rotvec(&Vector3::new(0.05, -0.03, 1.1)),
        };
        let dt = 0.01;
        let increment = |k: usize| {
            let t = k as f64 * dt;
            Increment {
                dtheta: Vector3::new(0.01, 0.02 * (0.5 * t).sin(), 0.2) * dt,
                dv: Vector3::new(1.0 + t.sin(), 2.0, -9.8) * dt,
            }
        };
        let run = |nav: NavState| {
            let mut sins = Sins::new(nav);
            (0..2000).for_each(|k| sins.step(&increment(k), dt));
            sins.nav
        };
        let mut sins = Sins::new(start);
        let mut interval = Interval::new(0);
        let noise = Noise {
            gyro: 0.0,
            accel: 0.0,
        };
        for k in 0..2000 {
            sins.step(&increment(k), dt);
            interval.accumulate(&sins.nav, &increment(k), dt, &ErrorModel::default(), noise);
        }
        interval.finish(&sins.nav, &ErrorModel::default(), noise);
        let steps = [1e-5, 1e-5, 1e-5, 1e-2, 1e-2, 1e-2, 10.0, 10.0, 10.0];
        for (i, step) in steps.into_iter().enumerate() {
            let mut e = nalgebra::DVector::zeros(9);
            e[i] = -step;
            let plus = run(super::super::displaced(&start, &e));
            e[i] = step;
            let minus = run(super::super::displaced(&start, &e));
            let got = (difference(&plus, &sins.nav) - difference(&minus, &sins.nav)) / (2.0 * step);
            let want = interval.phi.column(i);
            for j in 0..9 {
                // relative to the effect of an error of that size on this kind of state
                let scale = interval
                    .phi
                    .row(j)
                    .iter()
                    .zip(steps)
                    .map(|(a, s)| (a * s).abs())
                    .fold(0.0, f64::max)
                    / step;
                assert!(
                    (got[j] - want[j]).abs() < 2e-3 * scale,
                    "d{j}/d{i}: {} {} scale {scale}",
                    got[j],
                    want[j]
                );
            }
        }
    }
}
