//! Loosely coupled error-state Kalman filter: nine navigation errors and the parameters of a sensor-error model, fixes of position and
//! velocity, feedback after every fix. Also what a Rauch-Tung-Striebel smoother needs.
//!
//! Errors are estimate minus truth: `phi` (rad, `C_est = (I - phi x) C_true`), velocity (m/s), position (m), all north-east-down, then the
//! parameters. Between fixes only `Phi` (9 x 9), `Psi` (9 x n, effect of the parameters) and `Q` (9 x 9) are carried; the covariance
//! moves once a fix.

mod dynamics;
mod model;
mod smoother;

pub use model::{ErrorModel, Inputs, Parameter, Prior, Regressor, Triad};
pub use smoother::{Record, Smoothed, smooth};

use crate::gnss::Fix;
use crate::rotation::from_rotvec;
use crate::sins::{Increment, NavState, Sins};
use dynamics::Interval;
use nalgebra::{DMatrix, DVector, Vector3};

/// Number of navigation errors.
pub const NAV: usize = 9;

/// White noise of the sensors, per axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Angle random walk, rad/sqrt(s).
    pub gyro: f64,
    /// Velocity random walk, m/s/sqrt(s).
    pub accel: f64,
}

/// Standard deviations of the initial navigation errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InitialSigma {
    /// Roll and pitch, rad.
    pub tilt: f64,
    /// Heading, rad.
    pub heading: f64,
    /// Velocity, m/s.
    pub velocity: f64,
    /// Position, m.
    pub position: f64,
}

/// A navigator that fixes correct and that estimates sensor errors on the way.
#[derive(Debug, Clone)]
pub struct Aided {
    /// The navigator.
    pub sins: Sins,
    /// Estimated parameters.
    pub theta: DVector<f64>,
    /// Covariance of the errors, (9 + n) square.
    pub p: DMatrix<f64>,
    model: ErrorModel,
    interval: Interval,
    start: NavState,
    noise: Noise,
}

impl Aided {
    /// Starts at `nav` with parameters zero.
    #[must_use]
    pub fn new(nav: NavState, sigma: &InitialSigma, model: ErrorModel, noise: Noise) -> Self {
        let n = model.len();
        let mut p = DMatrix::zeros(NAV + n, NAV + n);
        let nav_sigma = [
            [sigma.tilt, sigma.tilt, sigma.heading],
            [sigma.velocity; 3],
            [sigma.position; 3],
        ];
        let all = nav_sigma
            .into_iter()
            .flatten()
            .chain(model.parameters.iter().map(|q| q.sigma));
        for (i, s) in all.enumerate() {
            p[(i, i)] = s * s;
        }
        Self {
            sins: Sins::new(nav),
            theta: DVector::zeros(n),
            p,
            interval: Interval::new(n),
            start: nav,
            model,
            noise,
        }
    }

    /// The same with the time since power-on at the start, s; needed by models with ramps or decays.
    #[must_use]
    pub fn powered_for(mut self, seconds: f64) -> Self {
        self.interval.clock = seconds;
        self
    }

    /// The word as it is after the present estimate of the sensor errors has been taken out.
    #[must_use]
    pub fn corrected(&self, word: &Increment, dt: f64) -> Increment {
        self.corrected_at(word, dt, self.interval.clock)
    }

    /// The same for a word `time` seconds after power-on.
    #[must_use]
    pub fn corrected_at(&self, word: &Increment, dt: f64, time: f64) -> Increment {
        if self.model.is_empty() {
            return *word;
        }
        let now = Inputs {
            rate: word.dtheta / dt,
            force: word.dv / dt,
            time,
        };
        let [e_g, e_a] = self.model.error(&self.theta, &now);
        Increment {
            dtheta: word.dtheta - e_g * dt,
            dv: word.dv - e_a * dt,
        }
    }

    /// Advances by one measured word.
    pub fn word(&mut self, word: &Increment, dt: f64) {
        let corrected = self.corrected(word, dt);
        self.sins.step(&corrected, dt);
        self.interval
            .word(&self.sins.nav, &corrected, dt, &self.model, self.noise);
    }

    /// Ends the interval with a fix (sigmas: north, east, down m, then m/s): covariance step, six scalar updates, feedback.
    pub fn fix(&mut self, fix: &Fix, sigmas: &[f64; 6]) -> Record {
        let before = (self.p.clone(), self.start, self.theta.clone());
        let phi = self.predict();
        let predicted = self.p.clone();
        let nav = &self.sins.nav;
        let dp = nav.position.ned_from(&fix.position);
        let dv = nav.velocity - fix.velocity;
        let mut e = DVector::zeros(self.p.nrows());
        let mut log_likelihood = 0.0;
        for i in 0..3 {
            log_likelihood += self.update(6 + i, dp[i], sigmas[i], &mut e);
            log_likelihood += self.update(3 + i, dv[i], sigmas[3 + i], &mut e);
        }
        self.feed_back(&e);
        self.start = self.sins.nav;
        let (p, nav, theta) = before;
        Record {
            p,
            nav,
            theta,
            phi,
            predicted,
            correction: e,
            log_likelihood,
        }
    }

    /// Covariance over the interval since the last call; returns the full transition matrix.
    pub fn predict(&mut self) -> DMatrix<f64> {
        let n = self.theta.len();
        let mut phi = DMatrix::identity(NAV + n, NAV + n);
        phi.fixed_view_mut::<NAV, NAV>(0, 0)
            .copy_from(&self.interval.phi);
        phi.view_mut((0, NAV), (NAV, n))
            .copy_from(&self.interval.psi);
        let time = self.interval.time;
        for (i, q) in self.model.parameters.iter().enumerate() {
            phi[(NAV + i, NAV + i)] = (-time / q.time_s).exp();
        }
        let mut p = &phi * &self.p * phi.transpose();
        let mut nav_block = p.fixed_view_mut::<NAV, NAV>(0, 0);
        nav_block += self.interval.q;
        for (i, q) in self.model.parameters.iter().enumerate() {
            p[(NAV + i, NAV + i)] += q.walk * q.walk * time;
        }
        self.p = (&p + p.transpose()) * 0.5;
        self.theta
            .component_mul_assign(&phi.diagonal().rows(NAV, n));
        self.interval.reset();
        phi
    }

    /// One scalar measurement of error state `i`; `e` is what earlier updates of this fix have already found. Gives the logarithm of
    /// the innovation's probability density.
    fn update(&mut self, i: usize, z: f64, sigma: f64, e: &mut DVector<f64>) -> f64 {
        let s = self.p[(i, i)] + sigma * sigma;
        let column = self.p.column(i).into_owned();
        let innovation = z - e[i];
        e.axpy(innovation / s, &column, 1.0);
        self.p.ger(-1.0 / s, &column, &column, 1.0);
        -0.5 * (innovation * innovation / s + (std::f64::consts::TAU * s).ln())
    }

    fn feed_back(&mut self, e: &DVector<f64>) {
        let nav = &mut self.sins.nav;
        *nav = displaced(nav, e);
        self.theta -= e.rows(NAV, self.theta.len());
    }
}

/// The state `nav` with the error `e` (first nine elements) taken out.
#[must_use]
pub fn displaced(nav: &NavState, e: &DVector<f64>) -> NavState {
    let v = |i: usize| Vector3::new(e[i], e[i + 1], e[i + 2]);
    let mut q_bn = from_rotvec(&v(0)) * nav.q_bn;
    q_bn.renormalize();
    NavState {
        position: nav.position.displaced(&-v(6)),
        velocity: nav.velocity - v(3),
        q_bn,
    }
}

#[cfg(test)]
mod tests;
