//! Strapdown navigation for learning from fixes: position, velocity, attitude, and how their errors
//! move.
//!
//! The learner subtracts its present estimate of the sensors' errors from their samples, navigates
//! with the result, and compares it with fixes. [`Transition`] describes how an error of the
//! estimate acts on the navigation. The order at a fix is [`Navigator::take_transition`],
//! [`Navigator::innovation`], then [`Navigator::feed_back`] and [`Navigator::set_estimate`].
//!
//! Errors are estimate minus truth: `phi` in rad with `C_est = (I - phi x) C_true`, velocity in
//! m/s, position in m; north, east, down. Sensor errors `e` that are left in the increments count
//! as `residual = -e`, so that `phi' = C e_gyro` and `v' = -C e_accel`. These are the conventions
//! of `host_sim::inertial::ekf`, whose f64 arithmetic is the reference.
//!
//! # Numbers
//! - **Samples** accumulate in exact integer sums. f32 computes what the sums leave out: coning,
//!   sculling, rotation (`gather`).
//! - A **piece** of samples, about 50 ms long, is one step of the equations in 64-bit fixed point
//!   (`fixed`, `solution`): the Cortex-M4F has no f64 unit, and f64 in software takes six times as
//!   many instructions. A longitude is rounded to 6 pm. Over 24 h, 1.7 million pieces, the position
//!   is within 21 um of an exact sum up to 80 deg, and the attitude within 1e-11 rad. [`State`] is
//!   f64; it is computed when somebody asks for it.
//! - The **Earth's quantities** are computed in f64 every 320 m north or 100 m up, and follow their
//!   slopes between (`local_earth`).
//! - The **error dynamics** take a step every two pieces (`transition`). A piece in which the Earth
//!   is computed has none, so that no pass of the frame path has both.
//! - The **matrices** are f32: they weight errors and need three digits.
//!
//! No function here panics. Implausible samples, and estimates and corrections that are not finite,
//! are refused. A solution that leaves its range stops. [`Faults`] reports all of this.
#![forbid(unsafe_code)]

mod antenna;
mod config;
pub(crate) mod earth;
mod fixed;
pub(crate) mod gather;
mod history;
mod local_earth;
pub(crate) mod proportional;
mod solution;
mod transition;
pub(crate) mod vector;

pub use antenna::{ANTENNA, AntennaInnovation, PastMotion, Secant};
pub use config::{Config, ConfigError};
pub use transition::{ERRORS, Noise, Transition};

use crate::fix::{Fix, Position};
use crate::sample::Counts;
use earth::wrapped;
use fixed::{ANGLE, TIME, VELOCITY, to_f32, to_f64};
use gather::{Gather, Piece};
use history::History;
use lrnn_nostd::learn::kalman::Correction;
use proportional::ProportionalEffects;
use solution::Solution;
use transition::{Interval, Motion};
use vector::{
    Q, V, V32, add, cross, dot, finite, narrow, product, renormalised, rotated, scale, widen,
};

/// Greatest latitude: beyond it north and east are not defined well enough. 89.99 deg, in rad.
const MAX_LATITUDE: f64 = 1.570_621_793_869_697;
/// Greatest height above or below the ellipsoid, m.
const MAX_HEIGHT: f64 = 1e5;
/// Greatest velocity along an axis, m/s.
const MAX_VELOCITY: f64 = 1e4;
/// Greatest estimate of a sensor's error, rad/s and m/s2.
const MAX_ESTIMATE: [f32; 2] = [0.1, 10.0];
/// Greatest element of a map.
const MAX_MAP: f32 = 0.2;
/// Greatest correction of attitude (rad), velocity (m/s) and position (m).
const MAX_FEEDBACK: [f32; 3] = [1.0, 1e3, 1e5];

/// Position, velocity, attitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Geodetic position.
    pub position: Position,
    /// Velocity over ground, north, east, down, m/s.
    pub velocity: [f64; 3],
    /// Body axes to north-east-down: unit quaternion, scalar first.
    pub q_bn: [f64; 4],
}

/// Estimate minus fix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Position, north, east, down, m.
    pub position: [f32; 3],
    /// Velocity, north, east, down, m/s.
    pub velocity: [f32; 3],
}

/// Faults since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Faults {
    /// Implausible samples (beyond 0.5 rad, 10 m/s); each was replaced by the last good one.
    pub samples: u32,
    /// Estimates and corrections refused because they were not finite or too large.
    pub inputs: u32,
    /// The solution has left the range of the equations and is frozen; make a new navigator.
    pub lost: bool,
}

/// A state that a navigator can begin in, with an attitude of unit length.
#[derive(Debug, Clone)]
pub struct Beginning(Solution);

impl Beginning {
    /// A beginning from a state.
    ///
    /// # Errors
    /// [`ConfigError::State`]: it is out of range.
    #[inline(never)]
    pub fn new(state: State) -> Result<Self, ConfigError> {
        Ok(Self(Solution::new(&checked(state)?)))
    }
}

/// The navigator.
#[derive(Debug, Clone)]
pub struct Navigator {
    config: Config,
    solution: Solution,
    gather: Gather,
    interval: Interval,
    proportional: ProportionalEffects,
    correction: Correction,
    // the last piece, and what it has changed of the velocity over ground
    last: Piece,
    change: [i64; 3],
    history: History,
    faults: Faults,
}

impl Navigator {
    /// Starts from a known state, with a zero estimate of the sensors' errors.
    ///
    /// # Errors
    /// Names the parameter that is out of range.
    pub fn new(config: Config, state: State) -> Result<Self, ConfigError> {
        Self::begin(&config, &Beginning::new(state)?)
    }

    /// [`Self::new`] from a state that has been checked.
    ///
    /// # Errors
    /// Names the parameter that is out of range.
    pub fn begin(config: &Config, state: &Beginning) -> Result<Self, ConfigError> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        if !positive(config.lsb.rad) || !positive(config.lsb.mps) {
            return Err(ConfigError::Lsb);
        }
        if !(1e-5..=1.0).contains(&config.sample_s) {
            return Err(ConfigError::SamplePeriod);
        }
        if config.piece_samples == 0 {
            return Err(ConfigError::PieceSamples);
        }
        let Noise { gyro, accel } = config.noise;
        if ![gyro, accel].iter().all(|x| x.is_finite() && *x >= 0.0) {
            return Err(ConfigError::Noise);
        }
        Self::with(config, &state.0)
    }

    /// By itself, so that the stack does not hold both it and what [`Solution::new`] needs. Always
    /// a navigator: as a result it is built where it will be.
    #[inline(never)]
    fn with(config: &Config, solution: &Solution) -> Result<Self, ConfigError> {
        Ok(Self {
            config: *config,
            solution: solution.clone(),
            gather: Gather::new(config.lsb, config.sample_s, config.piece_samples),
            interval: Interval::new(),
            proportional: ProportionalEffects::new(at_rest(solution)),
            correction: Correction::NONE,
            last: Piece::default(),
            change: [0; 3],
            history: History::new(),
            faults: Faults::default(),
        })
    }

    /// [`Self::begin`] with the same configuration, in place: a new one would be built on the stack
    /// first.
    pub fn restart(&mut self, state: &Beginning) {
        self.solution = state.0.clone();
        let Config {
            lsb,
            sample_s,
            piece_samples,
            ..
        } = self.config;
        self.gather = Gather::new(lsb, sample_s, piece_samples);
        self.interval = Interval::new();
        self.proportional = ProportionalEffects::new(at_rest(&self.solution));
        self.correction = Correction::NONE;
        self.last = Piece::default();
        self.change = [0; 3];
        self.history = History::new();
        self.faults = Faults::default();
    }

    /// Takes one uncorrected sample.
    #[inline]
    pub fn sample(&mut self, counts: &Counts) {
        if self.gather(counts) {
            self.end_piece();
        }
    }

    /// Only adds the sample to its piece. True: the piece is full, and [`Self::end_piece`] must
    /// follow before anything else.
    #[inline]
    pub fn gather(&mut self, counts: &Counts) -> bool {
        if !self.gather.sample(counts) {
            self.faults.samples = self.faults.samples.saturating_add(1);
        }
        self.gather.is_full()
    }

    /// Goes on for `samples` missing samples as in the last one, `counts`.
    pub fn coast(&mut self, counts: &Counts, samples: u32) {
        let mut left = samples;
        while left > 0 {
            let taken = self.gather.repeat(counts, left);
            left = left.saturating_sub(taken.max(1));
            if self.gather.is_full() {
                self.end_piece();
            }
        }
    }

    /// Solution at the end of the last piece. [`Self::take_transition`] ends the one in progress.
    #[must_use]
    pub fn state(&self) -> State {
        self.solution.state()
    }

    /// The faults so far.
    #[must_use]
    pub fn faults(&self) -> Faults {
        self.faults
    }

    /// Estimated errors of gyros (rad/s) and accelerometers (m/s2), to be subtracted from the next
    /// sample on. False: refused, the old estimate stays.
    pub fn set_estimate(&mut self, gyro: [f32; 3], accel: [f32; 3]) -> bool {
        let [a, b, c] = gyro;
        let [d, e, f] = accel;
        self.set_correction(&Correction {
            estimate: [a, b, c, d, e, f],
            ..Correction::NONE
        })
    }

    /// [`Self::set_estimate`], with maps beside it: the estimate is of the errors at rest.
    pub fn set_correction(&mut self, correction: &Correction) -> bool {
        let Correction { estimate, maps } = correction;
        let [gyro, accel] = estimate.as_chunks::<3>().0 else {
            return false;
        };
        // a comparison with NaN is false
        let within = |v: &[f32], limit: f32| v.iter().all(|x| x.abs() <= limit);
        let good = within(gyro, MAX_ESTIMATE[0])
            && within(accel, MAX_ESTIMATE[1])
            && within(maps.as_flattened().as_flattened(), MAX_MAP);
        if good {
            self.end_piece();
            let rest = self.proportional.at_rest();
            let [of_gyro, of_accel] =
                core::array::from_fn(|k| maps[k].map(|row| dot(row, rest[k])));
            let constant = [
                add(*gyro, scale(of_gyro, -1.0)),
                add(*accel, scale(of_accel, -1.0)),
            ];
            self.gather.set_correction(constant, *maps);
            self.correction = *correction;
        } else {
            self.refused();
        }
        good
    }

    /// The correction in use.
    #[must_use]
    pub fn correction(&self) -> &Correction {
        &self.correction
    }

    /// The estimate in use, of the errors at rest, rad/s and m/s2.
    #[must_use]
    pub fn estimate(&self) -> [[f32; 3]; 2] {
        let [a, b, c, d, e, f] = self.correction.estimate;
        [[a, b, c], [d, e, f]]
    }

    /// Ends the piece in progress, gives how errors moved since the last call, and restarts.
    pub fn take_transition(&mut self) -> Transition {
        self.end_piece();
        self.step_proportional();
        self.interval
            .take(self.solution.local_earth().coarse(), self.config.noise)
    }

    fn step_proportional(&mut self) {
        if let Some(step) = self.interval.due() {
            self.proportional.step(&step);
        }
    }

    /// Effect of errors in proportion to what the sensors feel, since the last
    /// [`Self::clear_proportional`]. To be called after [`Self::take_transition`].
    pub(crate) fn proportional_effects(&self) -> &ProportionalEffects {
        &self.proportional
    }

    /// What the sensors feel at rest, rad/s and m/s2.
    pub(crate) fn at_rest(&self) -> [V32; 2] {
        self.proportional.at_rest()
    }

    /// Clears [`Self::proportional`]: a new interval begins.
    pub(crate) fn clear_proportional(&mut self) {
        self.proportional.clear();
    }

    /// Estimate minus a fix that was valid `age_s` seconds before the end of the last piece. The
    /// age is limited to 0 to 1 s; a NaN counts as 0. With a lever arm `l` the antenna is compared:
    /// its position is `p + C l`, its velocity `v + C (omega x l)`.
    ///
    /// That an error of the attitude turns the lever arm is left out of the error dynamics: 1 mrad
    /// moves an antenna at 3 m by 3 mm.
    #[must_use]
    pub fn innovation(&self, fix: &Fix, age_s: f32) -> Innovation {
        let State {
            position,
            velocity,
            q_bn,
        } = self.state();
        let age = f64::from(age_s.max(0.0).clamp(0.0, 1.0)); // clamp alone leaves a NaN
        let time = self.last.time();
        let pieces = if time > 0.0 { age / time } else { 0.0 };
        let change = self.change.map(|x| to_f64(x, VELOCITY));
        let then = add(velocity, scale(change, -pieces));
        let moved = scale(add(velocity, then), -0.5 * age);
        let mut dp = add(position.ned_from(&fix.position), moved);
        let mut dv = add(then, scale(fix.velocity, -1.0));
        if self.config.lever_arm != [0.0; 3] {
            let [position, motion] = self.antenna(age, q_bn);
            (dp, dv) = (add(dp, position), add(dv, motion));
        }
        Innovation {
            position: narrow(dp),
            velocity: narrow(dv),
        }
    }

    /// Where the antenna was, seen from the sensors, `age` seconds before the end of the last
    /// piece, and how it moved: north, east, down, m and m/s. The turn of the last piece goes on
    /// for that time. The Earth's rotation counts as the vehicle's: 0.2 mm/s at 3 m.
    fn antenna(&self, age: f64, q_bn: Q) -> [V; 2] {
        let time = self.last.time();
        let rate = if time > 0.0 {
            scale(self.last.phi(), 1.0 / time)
        } else {
            [0.0; 3]
        };
        let arm = widen(self.config.lever_arm);
        let then = product(q_bn, vector::from_rotvec(scale(rate, -age)));
        [arm, cross(rate, arm)].map(|v| rotated(then, v))
    }

    /// Subtracts an estimated error (attitude rad, velocity m/s, position m) from the solution.
    /// False: refused, the solution is unchanged.
    pub fn feed_back(&mut self, error: &[f32; 9]) -> bool {
        let [a, b, c, d, e, f, g, h, i] = *error;
        let [phi, dv, dp] = [[a, b, c], [d, e, f], [g, h, i]];
        let good = [phi, dv, dp]
            .iter()
            .zip(MAX_FEEDBACK)
            .all(|(v, limit)| v.iter().all(|x| x.abs() <= limit));
        let [phi, dv, dp] = [phi, dv, dp].map(widen);
        let good = good && self.solution.correct(phi, dv, dp);
        if !good {
            self.refused();
        }
        good
    }

    fn refused(&mut self) {
        self.faults.inputs = self.faults.inputs.saturating_add(1);
    }

    /// Ends the piece in progress, if it has any sample: the solution moves on.
    #[inline(never)]
    pub fn end_piece(&mut self) {
        if self.gather.is_empty() {
            return;
        }
        let piece = self.gather.end();
        if self.faults.lost {
            return;
        }
        let Some(step) = self.solution.step(&piece) else {
            self.faults.lost = true;
            return;
        };
        let time = to_f32(piece.time, TIME);
        let change = step.change.map(|x| to_f32(x, VELOCITY));
        self.history
            .piece(change, piece.phi.map(|x| to_f32(x, ANGLE)), time);
        (self.last, self.change) = (piece, step.change);
        let motion = Motion {
            c: step.c_mid,
            force: step.force,
            velocity: step.v_mid,
            time,
        };
        self.interval.piece(&motion);
        self.proportional.turns(piece.phi.map(|x| to_f32(x, ANGLE)));
        // two long computations in one pass of the frame path are put off for some pieces at most
        if self.interval.is_due(step.recomputed) {
            self.step_proportional();
            let here = self.solution.local_earth().coarse();
            self.interval.step(here, self.config.noise);
        }
    }
}

/// The specific force at rest, in the sensor's axes, m/s2.
fn at_rest(solution: &Solution) -> V32 {
    let [w, x, y, z] = solution.state().q_bn;
    let gravity = f64::from(solution.local_earth().coarse().g);
    narrow(rotated([w, -x, -y, -z], [0.0, 0.0, -gravity]))
}

/// Length of a velocity, m/s.
#[must_use]
pub fn speed(velocity: &[f64; 3]) -> f32 {
    let v = narrow(*velocity);
    libm::sqrtf(dot(v, v))
}

/// A state to start from, with an attitude of unit length.
fn checked(mut state: State) -> Result<State, ConfigError> {
    let [w, x, y, z] = state.q_bn;
    let norm = w * w + x * x + y * y + z * z;
    if !in_range(&state) || !(0.998..1.002).contains(&norm) {
        return Err(ConfigError::State);
    }
    state.q_bn = renormalised(renormalised(state.q_bn));
    state.position.longitude = wrapped(state.position.longitude);
    Ok(state)
}

/// Whether the equations hold in this state; false when a value is not a number.
fn in_range(state: &State) -> bool {
    let Position {
        latitude,
        longitude,
        height,
    } = state.position;
    latitude.abs() <= MAX_LATITUDE
        && longitude.abs() <= 2.0 * core::f64::consts::TAU
        && height.abs() <= MAX_HEIGHT
        && state.velocity.iter().all(|v| v.abs() <= MAX_VELOCITY)
        && finite(&state.q_bn)
}

#[cfg(test)]
pub(crate) mod tests;
