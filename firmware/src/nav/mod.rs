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
//! - A **piece** of samples, about 50 ms long, is one step of the equations in f64. The Cortex-M4F
//!   has no f64 unit, but 20 steps a second cost less than the samples. f64 rounds a longitude to 3
//!   nm. 24 h have 1.7 million pieces, so that the position loses less than 3 mm even if every
//!   rounding went the same way, and about 2 um with random roundings. f32, or f64 increments
//!   rounded to f32 factors, would lose 6 cm over 2000 km driven one way.
//! - The **matrices** are f32: they weight errors and need three digits.
//!
//! No function here panics. Implausible samples, and estimates and corrections that are not finite,
//! are refused. A solution that leaves its range stops. [`Faults`] reports all of this.
#![forbid(unsafe_code)]

mod config;
pub(crate) mod earth;
pub(crate) mod gather;
mod past;
mod seen;
mod transition;
pub(crate) mod vector;

pub use config::{Config, ConfigError};
pub use seen::{ANTENNA, Seen};
pub use transition::{ERRORS, Noise, Transition};

use crate::fix::{Fix, Position};
use crate::sample::Counts;
use earth::{Local, wrapped};
use gather::{Gather, Piece};
use past::Past;
use transition::{Interval, motion};
use vector::{
    Q, V, add, cross, finite, matrix32, narrow, product, renormalised, rotated, scale, widen,
};

/// Greatest latitude: beyond it north and east are not defined well enough. 89.99 deg, in rad.
const MAX_LATITUDE: f64 = 1.570_621_793_869_697;
/// Greatest height above or below the ellipsoid, m.
const MAX_HEIGHT: f64 = 1e5;
/// Greatest velocity along an axis, m/s.
const MAX_VELOCITY: f64 = 1e4;
/// Greatest estimate of a sensor's error, rad/s and m/s2.
const MAX_ESTIMATE: [f32; 2] = [0.1, 10.0];
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

/// What went wrong since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Faults {
    /// Implausible samples (beyond 0.5 rad, 10 m/s); each was replaced by the last good one.
    pub samples: u32,
    /// Estimates and corrections refused because they were not finite or too large.
    pub inputs: u32,
    /// The solution has left the range of the equations and is frozen; make a new navigator.
    pub lost: bool,
}

/// The navigator.
#[derive(Debug, Clone)]
pub struct Navigator {
    config: Config,
    state: State,
    gather: Gather,
    interval: Interval,
    // mean acceleration over ground of the last piece, m/s2
    acceleration: V,
    // rotation vector of the last piece, body axes, rad, and its duration, s
    turn: (V, f64),
    past: Past,
    faults: Faults,
}

impl Navigator {
    /// Starts from a known state, with a zero estimate of the sensors' errors.
    ///
    /// # Errors
    /// Names the parameter that is out of range.
    pub fn new(config: Config, state: State) -> Result<Self, ConfigError> {
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
        Ok(Self {
            config,
            state: checked(state)?,
            gather: Gather::new(config.lsb, config.sample_s, config.piece_samples),
            interval: Interval::new(),
            acceleration: [0.0; 3],
            turn: ([0.0; 3], 0.0),
            past: Past::new(),
            faults: Faults::default(),
        })
    }

    /// As [`Self::new`] with the same configuration, in place: a new one would be built on the
    /// stack first.
    ///
    /// # Errors
    /// The state is out of range. Nothing has changed then.
    pub fn restart(&mut self, state: State) -> Result<(), ConfigError> {
        self.state = checked(state)?;
        let Config {
            lsb,
            sample_s,
            piece_samples,
            ..
        } = self.config;
        self.gather = Gather::new(lsb, sample_s, piece_samples);
        self.interval = Interval::new();
        self.acceleration = [0.0; 3];
        self.turn = ([0.0; 3], 0.0);
        self.past = Past::new();
        self.faults = Faults::default();
        Ok(())
    }

    /// No sample has come since the last piece ended.
    #[must_use]
    pub fn is_between_pieces(&self) -> bool {
        self.gather.is_empty()
    }

    /// Takes one uncorrected sample.
    #[inline]
    pub fn sample(&mut self, counts: &Counts) {
        if !self.gather.sample(counts) {
            self.faults.samples = self.faults.samples.saturating_add(1);
        }
        if self.gather.is_full() {
            self.end_piece();
        }
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
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The faults so far.
    #[must_use]
    pub fn faults(&self) -> Faults {
        self.faults
    }

    /// Estimated errors of gyros (rad/s) and accelerometers (m/s2), to be subtracted from the next
    /// sample on. False: refused, the old estimate stays.
    pub fn set_estimate(&mut self, gyro: [f32; 3], accel: [f32; 3]) -> bool {
        // a comparison with NaN is false
        let within = |v: &[f32; 3], limit: f32| v.iter().all(|x| x.abs() <= limit);
        let good = within(&gyro, MAX_ESTIMATE[0]) && within(&accel, MAX_ESTIMATE[1]);
        if good {
            self.end_piece();
            self.gather.set_estimate([gyro, accel]);
        } else {
            self.refused();
        }
        good
    }

    /// The estimate in use, rad/s and m/s2.
    #[must_use]
    pub fn estimate(&self) -> [[f32; 3]; 2] {
        self.gather.estimate()
    }

    /// Ends the piece in progress, gives how errors moved since the last call, and starts anew.
    pub fn take_transition(&mut self) -> Transition {
        self.end_piece();
        self.interval.take()
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
            position, velocity, ..
        } = &self.state;
        let age = f64::from(age_s.max(0.0).clamp(0.0, 1.0)); // clamp alone leaves a NaN
        let then = add(*velocity, scale(self.acceleration, -age));
        let moved = scale(add(*velocity, then), -0.5 * age);
        let mut dp = add(position.ned_from(&fix.position), moved);
        let mut dv = add(then, scale(fix.velocity, -1.0));
        if self.config.lever_arm != [0.0; 3] {
            let [place, motion] = self.antenna(age);
            (dp, dv) = (add(dp, place), add(dv, motion));
        }
        Innovation {
            position: narrow(dp),
            velocity: narrow(dv),
        }
    }

    /// Where the antenna was, seen from the sensors, `age` seconds before the end of the last
    /// piece, and how it moved: north, east, down, m and m/s. The turn of the last piece goes on
    /// for that time. The Earth's rotation counts as the vehicle's: 0.2 mm/s at 3 m.
    fn antenna(&self, age: f64) -> [V; 2] {
        let (turn, time) = self.turn;
        let rate = if time > 0.0 {
            scale(turn, 1.0 / time)
        } else {
            [0.0; 3]
        };
        let arm = widen(self.config.lever_arm);
        let then = product(self.state.q_bn, vector::from_rotvec(scale(rate, -age)));
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
        let State {
            position,
            velocity,
            q_bn,
        } = self.state;
        let q = product(vector::from_rotvec(widen(phi)), q_bn);
        let corrected = State {
            position: position.displaced(scale(widen(dp), -1.0)),
            velocity: add(velocity, scale(widen(dv), -1.0)),
            q_bn: renormalised(q),
        };
        let good = good && in_range(&corrected);
        if good {
            self.state = corrected;
        } else {
            self.refused();
        }
        good
    }

    fn refused(&mut self) {
        self.faults.inputs = self.faults.inputs.saturating_add(1);
    }

    #[inline(never)]
    fn end_piece(&mut self) {
        if self.gather.is_empty() {
            return;
        }
        let piece = self.gather.end();
        if self.faults.lost {
            return;
        }
        let step = step(&self.state, &piece);
        if in_range(&step.state) {
            let change = scale(step.acceleration, piece.time);
            self.past.piece(change, piece.phi, piece.time);
            self.state = step.state;
            self.acceleration = step.acceleration;
            self.turn = (piece.phi, piece.time);
            let motion = motion(step.c_mid, step.force, step.v_mid, piece.time);
            self.interval.piece(&motion, &step.here, self.config.noise);
        } else {
            self.faults.lost = true;
        }
    }
}

/// Length of a velocity, m/s.
#[must_use]
pub fn speed(velocity: &[f64; 3]) -> f32 {
    let v = narrow(*velocity);
    libm::sqrtf(vector::dot(v, v))
}

/// One step, with the quantities that the error dynamics need.
struct Step {
    state: State,
    acceleration: V,
    force: V,
    v_mid: V,
    c_mid: [[f32; 3]; 3],
    here: Local,
}

/// Savage (1998), Groves (2013) ch. 5; as `host_sim::inertial::sins::Sins::step`, but with the
/// Earth's quantities at the middle of the piece itself.
fn step(state: &State, piece: &Piece) -> Step {
    let State {
        position,
        velocity,
        q_bn,
    } = *state;
    let tau = piece.time;
    // a metre north is 1.57e-7 rad within 0.7 %, which is exact enough for the place of the middle
    let here = Local::at(
        position.latitude + velocity[0] * (0.5 * tau / 6.37e6),
        position.height - velocity[2] * (0.5 * tau),
    );
    let force_body = rotated(q_bn, piece.velocity);
    let v_mid = [
        velocity[0] + 0.5 * force_body[0],
        velocity[1] + 0.5 * force_body[1],
        velocity[2] + 0.5 * (force_body[2] + here.g * tau),
    ];
    let (inv_m, inv_n) = (1.0 / here.m_h, 1.0 / here.n_h);
    let inv_cos = 1.0 / here.cos;
    let east = v_mid[1] * inv_n;
    let omega_en = [east, -v_mid[0] * inv_m, -east * here.sin * inv_cos];
    let omega_ie = here.omega_ie();
    let omega_in = add(omega_ie, omega_en);
    let zeta = scale(omega_in, tau);

    let dv_n = add(force_body, scale(cross(force_body, zeta), 0.5));
    let coriolis = cross(v_mid, add(omega_ie, omega_in));
    let mut change = add(dv_n, scale(coriolis, tau));
    change[2] += here.g * tau;
    let v_mean = add(velocity, scale(change, 0.5));

    let q_bn_new = turned(q_bn, piece.phi, zeta);
    let middle: [f32; 4] = core::array::from_fn(|i| 0.5 * (q_bn[i] as f32 + q_bn_new[i] as f32));
    let inv_tau = 1.0 / tau;
    Step {
        state: State {
            position: Position {
                latitude: position.latitude + v_mean[0] * tau * inv_m,
                longitude: wrapped(position.longitude + v_mean[1] * tau * inv_n * inv_cos),
                height: position.height - v_mean[2] * tau,
            },
            velocity: add(velocity, change),
            q_bn: q_bn_new,
        },
        acceleration: scale(change, inv_tau),
        force: scale(dv_n, inv_tau),
        v_mid,
        c_mid: matrix32(unit32(middle)),
        here,
    }
}

/// Attitude after the body has turned by `phi` (in body axes at the start) and the navigation frame
/// by `zeta`, rad. `zeta` is some urad: its cosine is 1 to 1e-11, which renormalising corrects.
fn turned(q_bn: Q, phi: V, zeta: V) -> Q {
    let [w, x, y, z] = product(q_bn, vector::from_rotvec(phi));
    let half = scale(zeta, -0.5);
    let [a, b, c] = add(scale(half, w), cross(half, [x, y, z]));
    let along = half[0] * x + half[1] * y + half[2] * z;
    renormalised([w - along, x + a, y + b, z + c])
}

/// The mean of two quaternions a piece apart, brought to unit length; its length is 1 within 2 %.
fn unit32([w, x, y, z]: [f32; 4]) -> [f32; 4] {
    let k = 1.0 / libm::sqrtf(w * w + x * x + y * y + z * z);
    [w * k, x * k, y * k, z * k]
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
