//! Loosely coupled error-state Kalman filter. Its states are nine navigation errors and the
//! parameters of a sensor-error model. Its measurements are fixes of position and velocity, with
//! feedback after every fix. It also records the input of a Rauch-Tung-Striebel smoother.
//!
//! Errors are estimate minus truth: `phi` (rad, `C_est = (I - phi x) C_true`), velocity (m/s),
//! position (m), all in north-east-down, then the parameters. Between fixes only `Phi` (9 x 9),
//! `Psi` (9 x n, effect of the parameters) and `Q` (9 x 9) are accumulated. The covariance is
//! updated once a fix.

mod abreast;
mod alignment;
mod belief;
mod covariance;
mod dynamics;
mod linearised;
mod model;
mod smoother;
mod transition;

pub use abreast::{Beside, Flight, alike, flies, free_abreast, pass};
pub use alignment::attitude_error;
pub use belief::{Belief, TurnOn};
pub use linearised::{Block, Linearised};
pub use model::{
    AuxiliaryData, ErrorModel, Inputs, Parameter, Prior, REFERENCE_DEGC, Regressor, SlowErrors,
    Triad,
};
pub use smoother::{Record, Smoothed, smooth};

use crate::inertial::gnss::Fix;
use crate::inertial::sins::{Increment, NavState, Samples, Sins, States};
use covariance::Evidence;
use dynamics::Interval;
use nalgebra::{DMatrix, DVector};

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

/// A navigator that is corrected by fixes and estimates sensor errors.
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
    before: Option<Increment>,
    slow: SlowErrors,
}

impl Aided {
    /// Starts at `nav` with all parameters zero.
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
            before: None,
            slow: SlowErrors::default(),
        }
    }

    /// Selects another coning and sculling algorithm than the default.
    #[must_use]
    pub fn with_samples(mut self, samples: Samples) -> Self {
        self.sins = self.sins.with_samples(samples);
        self
    }

    /// Sets the time since power-on at the start, s. Models with ramps or decays need it.
    #[must_use]
    pub fn powered_for(mut self, seconds: f64) -> Self {
        self.interval.clock = seconds;
        self
    }

    /// The increment without the estimated sensor errors, for steady motion.
    #[must_use]
    pub fn corrected(&self, increment: &Increment, dt: f64) -> Increment {
        let time = self.interval.clock + 0.5 * dt;
        self.corrected_at(increment, increment, dt, time, &mut SlowErrors::default())
    }

    /// The increment without the estimated sensor errors, for any motion, at `time` seconds after
    /// power-on. `before` is the measured increment before it. `slow` is a new value, or that of
    /// the last call if the filter has not changed since.
    #[must_use]
    pub fn corrected_at(
        &self,
        increment: &Increment,
        before: &Increment,
        dt: f64,
        time: f64,
        slow: &mut SlowErrors,
    ) -> Increment {
        if self.model.is_empty() {
            return *increment;
        }
        self.model
            .corrected(&self.theta, [before, increment], dt, time, slow)
    }

    /// Advances by one measured increment.
    pub fn step(&mut self, increment: &Increment, dt: f64) {
        let before = self.before.replace(*increment).unwrap_or(*increment);
        let mut slow = self.slow;
        let time = self.interval.clock + 0.5 * dt;
        let corrected = self.corrected_at(increment, &before, dt, time, &mut slow);
        self.slow = slow;
        self.sins.step(&corrected, dt);
        self.interval
            .accumulate(&self.sins.nav, &corrected, dt, &self.model, self.noise);
    }

    /// Ends the interval with a fix that is valid now, at the IMU: covariance propagation, a
    /// scalar update for each value that is measured, feedback. `None`: nothing is measured.
    pub fn fix(&mut self, fix: Option<&Fix>) -> Record {
        let before = (self.p.clone(), self.start, self.theta.clone());
        self.propagate();
        let (phi, predicted) = (self.transition(), self.p.clone());
        let (correction, found) = self.absorb(fix);
        let (p, nav, theta) = before;
        Record {
            p,
            nav,
            theta,
            phi,
            predicted,
            correction,
            nis: found.nis,
        }
    }

    /// Like [`Self::fix`], but without a record. Gives the logarithm of the probability density of
    /// the fix, given all before it; 0 without a fix.
    pub fn take(&mut self, fix: Option<&Fix>) -> f64 {
        self.propagate();
        self.absorb(fix).1.log_likelihood
    }

    /// Transition over the interval since the last fix: `[Phi Psi; 0 D]`.
    fn transition(&self) -> DMatrix<f64> {
        let n = self.theta.len();
        let mut phi = DMatrix::identity(NAV + n, NAV + n);
        phi.fixed_view_mut::<NAV, NAV>(0, 0)
            .copy_from(&self.interval.phi);
        phi.view_mut((0, NAV), (NAV, n))
            .copy_from(&self.interval.psi);
        for (i, q) in self.model.parameters.iter().enumerate() {
            phi[(NAV + i, NAV + i)] = q.keeps(self.interval.time);
        }
        phi
    }

    /// Propagates covariance and parameters over the interval.
    fn propagate(&mut self) {
        self.interval
            .finish(&self.sins.nav, &self.model, self.noise);
        covariance::propagate(&mut self.p, &self.interval, &self.model);
        for (t, q) in self.theta.iter_mut().zip(&self.model.parameters) {
            *t *= q.keeps(self.interval.time);
        }
        self.slow = SlowErrors::default();
    }

    /// Scalar updates and feedback. Gives the estimated error, and how likely the fix was.
    fn absorb(&mut self, fix: Option<&Fix>) -> (DVector<f64>, Evidence) {
        let scalars = fix.map_or_else(Vec::new, |fix| self.innovations(fix));
        let (e, found) = covariance::update(&mut self.p, &scalars);
        if !scalars.is_empty() {
            self.feed_back(&e);
        }
        self.start = self.sins.nav;
        self.interval.reset();
        (e, found)
    }

    /// Samples are missing for `time` seconds. The navigator continues from `state` with errors of
    /// `sigma`, independent of the errors before; the estimates of the sensor errors stay.
    pub fn lose(&mut self, time: f64, state: NavState, sigma: &InitialSigma) -> Record {
        let (p, nav, theta) = (self.p.clone(), self.start, self.theta.clone());
        let size = p.nrows();
        let fresh = Self::new(state, sigma, self.model.clone(), self.noise).p;
        let mut phi = DMatrix::zeros(size, size);
        self.p.rows_mut(0, NAV).fill(0.0);
        self.p.columns_mut(0, NAV).fill(0.0);
        for i in 0..NAV {
            self.p[(i, i)] = fresh[(i, i)];
        }
        for (k, q) in self.model.parameters.iter().enumerate() {
            let (i, keeps) = (NAV + k, q.keeps(time));
            phi[(i, i)] = keeps;
            self.theta[k] *= keeps;
            self.p.row_mut(i).scale_mut(keeps);
            self.p.column_mut(i).scale_mut(keeps);
            self.p[(i, i)] += q.walk * q.walk * time;
        }
        self.sins = self.sins.at(state);
        self.start = state;
        self.before = None;
        self.slow = SlowErrors::default();
        let clock = self.interval.clock + time;
        self.interval = Interval::new(self.theta.len());
        self.interval.clock = clock;
        Record {
            p,
            nav,
            theta,
            phi,
            predicted: self.p.clone(),
            correction: DVector::zeros(size),
            nis: 0.0,
        }
    }

    /// Innovations of a fix: index of the error state, value, standard deviation.
    fn innovations(&self, fix: &Fix) -> Vec<(usize, f64, f64)> {
        let nav = &self.sins.nav;
        let dp = nav.position.ned_from(&fix.position);
        let dv = nav.velocity - fix.velocity;
        let sigmas = &fix.sigmas;
        let scalars = [0, 1, 2].map(|i| [(6 + i, dp[i], sigmas[i]), (3 + i, dv[i], sigmas[3 + i])]);
        let measured = |scalar: &&(usize, f64, f64)| scalar.2.is_finite();
        let measured = scalars.as_flattened().iter().filter(measured);
        measured.copied().collect()
    }

    fn feed_back(&mut self, e: &DVector<f64>) {
        let nav = &mut self.sins.nav;
        *nav = displaced(nav, e);
        self.theta -= e.rows(NAV, self.theta.len());
        self.slow = SlowErrors::default();
    }
}

/// The state `nav` without the error `e` (its first nine elements).
#[must_use]
pub fn displaced(nav: &NavState, e: &DVector<f64>) -> NavState {
    let mut states = States::<f64>::of((), |_| nav);
    states.displace(e.as_slice());
    states.state(0)
}
