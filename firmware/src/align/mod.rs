//! Alignment: at standstill ([`Align`]), and in motion ([`motion`]).
//!
//! # At standstill
//! Self-alignment in the inertial frame, sample by sample in constant memory:
//! levelling and gyrocompassing in one.
//!
//! The gyros relate the body axes to the inertial frame `b0` of the start. In `b0` each second's
//! velocity increment is minus gravity's. As the Earth turns it traces a cone. In `n0`, the
//! navigation frame frozen at the start, the same cone follows from latitude and gravity:
//!
//! ```text
//! u(t1) - u(t0) = along (t1 - t0)
//!               + across (sin W t1 - sin W t0) / W
//!               + side (cos W t0 - cos W t1) / W
//! ```
//!
//! So the vectors are summed three times, once for each function of time, and a position is needed
//! only at the end: `B = sum u v'`, and Wahba's problem gives the rotation between both sets.
//! `host_sim::inertial::align` does the same over stored samples.

pub mod motion;
mod standstill;
mod wahba;

pub use standstill::{Rest, Sensors, Standstill};

use crate::nav::earth::{Local, OMEGA_IE};
use crate::nav::gather::Gather;
use crate::nav::vector::{
    Q, V, V32, add, cross, dot, from_rotvec, narrow, product, renormalised, rotated, scale,
};
use crate::sample::{Counts, Lsb};

/// Time over which gravity's direction is one vector, s: long against sway, short against the
/// Earth's rotation.
const SECOND: f64 = 1.0;
/// Shortest standstill that gives a heading, s.
pub const LEAST_S: f64 = 30.0;
/// Largest standard deviation of a heading that a standstill shows, rad.
pub const MAX_NORTH: f32 = 0.1;
/// Approximate length of a piece of the gyros' integration, s.
const PIECE_S: f64 = 0.05;

/// An attitude and its errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aligned {
    /// Body axes to north-east-down, unit quaternion, scalar first.
    pub q_bn: Q,
    /// Effect of the sensors' errors: attitude error about north, east, down (rad; `C_est = (I -
    /// phi x) C_true`) for errors of 1 rad/s and 1 m/s2 in body axes. Errors that were subtracted
    /// do not count.
    pub by: [[f32; 6]; 3],
    /// Covariance of the other errors, which noise causes, rad^2.
    pub rest: [[f32; 3]; 3],
    /// Time of standstill used, s.
    pub time_s: f64,
}

impl Aligned {
    /// Covariance of the attitude error, rad^2, for sensors whose errors have these standard
    /// deviations, rad/s and m/s2.
    #[must_use]
    pub fn covariance(&self, bias: [f32; 2]) -> [[f32; 3]; 3] {
        let [gyro, accel] = bias.map(|sigma| sigma * sigma);
        let variance = [gyro, gyro, gyro, accel, accel, accel];
        let mut p = self.rest;
        for (row, by) in p.iter_mut().zip(&self.by) {
            for (entry, of_column) in row.iter_mut().zip(&self.by) {
                for ((a, b), v) in by.iter().zip(of_column).zip(variance) {
                    *entry += a * b * v;
                }
            }
        }
        p
    }
}

/// An alignment in progress.
#[derive(Debug, Clone)]
pub struct Align {
    sensors: Sensors,
    gather: Gather,
    standstill: Standstill,
    /// The alignment is commanded: seconds count whatever the detector finds.
    commanded: bool,
    /// No more seconds are added, because the vehicle has moved since.
    closed: bool,
    q_b0b: Q,
    /// Since the start, s.
    time: f64,
    /// Samples in a second, and those left of the second in progress.
    second_samples: u32,
    left: u32,
    /// The second in progress: its beginning, and its velocity in `b0`.
    began: f64,
    velocity: V,
    /// Sums of velocities times the change of each function of time.
    sums: [V; 3],
    gathered: f64,
    /// A solution, of the sums when it was asked for.
    solved: Option<Solved>,
}

/// Position, time gathered, and the rotation from the standstill's beginning.
#[derive(Debug, Clone)]
struct Solved {
    here: Local,
    gathered: f64,
    rotation: Option<Q>,
}

impl Align {
    /// A new alignment for samples of this count value, one every `sample_s` seconds (> 0).
    #[must_use]
    pub fn new(sensors: Sensors, lsb: Lsb, sample_s: f64) -> Self {
        let piece_samples = (libm::round(PIECE_S / sample_s) as u16).max(1);
        let second_samples = (libm::round(SECOND / sample_s) as u32).max(1);
        Self {
            standstill: Standstill::new(&sensors, lsb, sample_s),
            sensors,
            gather: Gather::new(lsb, sample_s, piece_samples),
            commanded: false,
            closed: false,
            q_b0b: [1.0, 0.0, 0.0, 0.0],
            time: 0.0,
            second_samples,
            left: second_samples,
            began: 0.0,
            velocity: [0.0; 3],
            sums: [[0.0; 3]; 3],
            gathered: 0.0,
            solved: None,
        }
    }

    /// Standard deviation of the heading, rad, that a standstill of `seconds` at this latitude
    /// (rad) gives with these sensors, whatever their attitude.
    #[must_use]
    pub fn predicted_heading(sensors: &Sensors, latitude: f64, seconds: f64) -> f32 {
        let here = Local::at(latitude, 0.0);
        let (sin, cos, t) = (here.sin as f32, here.cos as f32, seconds as f32);
        let turn = 1.0 / (OMEGA_IE as f32 * cos);
        let [gyro, accel] = sensors.bias;
        let lean = accel * sin / (cos * here.g as f32);
        let [white, _] = sensors.noise;
        let slope = white * turn * libm::sqrtf(1.2 / t);
        libm::hypotf(libm::hypotf(gyro * turn, lean), slope)
    }

    /// Restarts. `commanded`: the vehicle stands whatever the detector finds.
    pub fn restart(&mut self, commanded: bool) {
        if !self.gather.is_empty() {
            self.gather.end();
        }
        self.commanded = commanded;
        self.closed = false;
        self.q_b0b = [1.0, 0.0, 0.0, 0.0];
        self.time = 0.0;
        self.sums = [[0.0; 3]; 3];
        self.gathered = 0.0;
        self.solved = None;
        self.begin_second();
    }

    /// Samples are missing: restarts.
    pub fn gap(&mut self) {
        self.standstill.gap();
        self.restart(self.commanded);
    }

    /// The commanded standstill is over: no more seconds are added.
    pub fn finish_command(&mut self) {
        self.closed = self.commanded;
        self.commanded = false;
    }

    /// Errors of gyros (rad/s) and accelerometers (m/s2) to be subtracted from the samples from now
    /// on.
    pub fn set_estimate(&mut self, estimate: [V32; 2]) {
        self.end_piece();
        self.gather.set_estimate(estimate);
    }

    /// Takes a sample.
    pub fn sample(&mut self, counts: &Counts) {
        self.gather.sample(counts);
        self.standstill.sample(counts);
        self.left = self.left.saturating_sub(1);
        if self.left == self.second_samples / 2 || self.left == 0 {
            self.standstill.end_window();
        }
        if self.gather.is_full() || self.left == 0 {
            self.end_piece();
        }
        if self.left == 0 {
            self.end_second();
        }
    }

    /// Another source shows that the vehicle moves. No effect on a commanded alignment.
    pub fn moves(&mut self) {
        self.standstill.moves();
        if !self.commanded {
            self.moved();
        }
    }

    /// A receiver shows a speed at which a vehicle is under way: as [`Self::moves`], and what the
    /// sensors feel now is no standstill ([`Standstill::is_under_way`]).
    pub fn is_under_way(&mut self) {
        self.standstill.is_under_way();
        self.moves();
    }

    /// The wheels stand, or turn.
    pub fn wheels(&mut self, stand: bool) {
        if !stand {
            self.moves();
        }
        self.standstill.wheels(stand);
    }

    /// A receiver shows that the vehicle stands, as the detector finds.
    pub fn is_right(&mut self) {
        self.standstill.is_right();
    }

    /// The navigation computer says that the vehicle stands.
    #[must_use]
    pub fn is_commanded(&self) -> bool {
        self.commanded
    }

    /// Seconds in a row that the vehicle has stood.
    #[must_use]
    pub fn still(&self) -> u32 {
        self.standstill.seconds()
    }

    /// The rest in progress.
    #[must_use]
    pub fn rest(&self) -> Option<Rest> {
        self.standstill.rest()
    }

    /// The velocity that the vehicle may have gained in the last of them, m/s: see
    /// [`Standstill::gain_mps`].
    #[must_use]
    pub fn gain_mps(&self) -> f32 {
        self.standstill.gain_mps()
    }

    /// Time of standstill so far, s.
    #[must_use]
    pub fn gathered(&self) -> f64 {
        self.gathered
    }

    /// The standstill is over and was long enough.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.closed && self.gathered >= LEAST_S
    }

    /// The attitude now, at a position of this latitude (rad) and height (m). `None` before
    /// [`LEAST_S`] seconds of standstill, or when the samples determine no rotation (all zero, for
    /// example).
    pub fn finish(&mut self, latitude: f64, height: f64) -> Option<Aligned> {
        self.solve(latitude, height);
        self.aligned()
    }

    /// Solves for the attitude at the standstill's beginning. [`Self::aligned`] gives the attitude
    /// then, now or later.
    pub fn solve(&mut self, latitude: f64, height: f64) {
        if self.gathered < LEAST_S - 0.5 * SECOND {
            return;
        }
        let here = Local::at(latitude, height);
        self.solved = Some(Solved {
            here,
            gathered: self.gathered,
            rotation: wahba::rotation(&expected(&here, &self.sums)),
        });
    }

    /// Whether there is a solution that [`Self::aligned`] has not taken.
    #[must_use]
    pub fn is_solved(&self) -> bool {
        self.solved.is_some()
    }

    /// The attitude now, from the standstill up to the call of [`Self::solve`]: the gyros have
    /// carried it on since.
    pub fn aligned(&mut self) -> Option<Aligned> {
        self.end_piece();
        let Solved {
            here,
            gathered,
            rotation,
        } = self.solved.take()?;
        let q_nn0 = from_rotvec(scale(here.omega_ie(), -self.time));
        let q_bn = renormalised(product(product(q_nn0, rotation?), self.q_b0b));
        Some(Aligned {
            q_bn,
            by: by(self.time, &here, q_bn),
            rest: self.of_noise(&here, gathered),
            time_s: gathered,
        })
    }

    /// Ends the piece in progress, so that the attitude is that of the last sample.
    fn end_piece(&mut self) {
        if self.gather.is_empty() {
            return;
        }
        let piece = self.gather.end();
        let (phi, velocity) = (piece.phi(), piece.velocity());
        self.velocity = add(self.velocity, rotated(self.q_b0b, velocity));
        self.q_b0b = renormalised(product(self.q_b0b, from_rotvec(phi)));
        self.time += piece.time();
    }

    fn end_second(&mut self) {
        let (from, to) = (self.began, self.time);
        let still = self.standstill.passes();
        if !(still || self.commanded) {
            self.moved();
        } else if !self.closed {
            let [before, after] = [from, to].map(functions);
            for (sum, (a, b)) in self.sums.iter_mut().zip(after.iter().zip(before)) {
                *sum = add(*sum, scale(self.velocity, a - b));
            }
            self.gathered += to - from;
        }
        self.begin_second();
    }

    /// The vehicle moves. A standstill that was long enough stays in use: the gyros carry the
    /// attitude on.
    fn moved(&mut self) {
        if self.gathered < LEAST_S {
            self.restart(false);
        } else {
            self.closed = true;
        }
    }

    fn begin_second(&mut self) {
        self.began = self.time;
        self.left = self.second_samples;
        self.velocity = [0.0; 3];
    }

    /// Covariance of the errors caused by white noise. It acts on the tilt as on a mean and on the
    /// heading as on the slope of a line; the gyros' random walk since the middle adds to both.
    fn of_noise(&self, here: &Local, gathered: f64) -> [[f32; 3]; 3] {
        let square = |x: f32| x * x;
        let [gyro, accel] = self.sensors.noise;
        let (gyro, accel) = (square(gyro), square(accel / here.g as f32));
        let t = gathered as f32;
        let tilt = accel / t + gyro * (self.time as f32) / 3.0;
        let slope = 1.2 * gyro / t + 12.0 * accel / (t * t * t);
        let heading = slope / square(OMEGA_IE as f32 * here.cos as f32);
        [
            [tilt, 0.0, 0.0],
            [0.0, tilt, 0.0],
            [0.0, 0.0, heading + tilt],
        ]
    }
}

/// Effect of the sensors' errors on the attitude. The vehicle stood, its axes turned with the
/// Earth's. The tilt is such that gravity cancels the accelerometers' error. A gyro's error
/// about east looks like the Earth's rate on a wrong heading, and so does the tilt about north,
/// which inclines the Earth's axis. About north and down the attitude has drifted since the
/// middle of the time:
///
/// ```text
/// phi_N = a_E / g - w_N t / 2
/// phi_E = -a_N / g
/// phi_D = w_E / (W cos latitude) - tan latitude a_E / g - w_D t / 2
/// ```
fn by(time: f64, here: &Local, q_bn: Q) -> [[f32; 6]; 3] {
    let (half, tilt) = (-0.5 * time, 1.0 / here.g);
    let turn = 1.0 / (OMEGA_IE * here.cos);
    let lean = tilt * here.sin / here.cos;
    let rows = [
        ([half, 0.0, 0.0], [0.0, tilt, 0.0]),
        ([0.0, 0.0, 0.0], [-tilt, 0.0, 0.0]),
        ([0.0, turn, half], [0.0, -lean, 0.0]),
    ];
    let [w, x, y, z] = q_bn;
    rows.map(|(gyro, accel)| {
        // a row times C is C' times it
        let [a, b, c] = narrow(rotated([w, -x, -y, -z], gyro));
        let [d, e, f] = narrow(rotated([w, -x, -y, -z], accel));
        [a, b, c, d, e, f]
    })
}

/// The three functions of time: t, sin W t / W, (1 - cos W t) / W.
fn functions(t: f64) -> V {
    let (half_sin, half_cos) = libm::sincos(0.5 * OMEGA_IE * t);
    let k = 2.0 * half_sin / OMEGA_IE;
    [t, k * half_cos, k * half_sin]
}

/// `B = sum u v'` from the sums of `v`: `u` has the vectors along the Earth's axis, across it, and
/// to the side.
fn expected(here: &Local, sums: &[V; 3]) -> [V; 3] {
    let axis = scale(here.omega_ie(), 1.0 / OMEGA_IE);
    let up = [0.0, 0.0, -here.g];
    let along = scale(axis, dot(axis, up));
    let across = add(up, scale(along, -1.0));
    let side = cross(axis, up);
    core::array::from_fn(|i| {
        let part = |k: usize, by: V| scale(sums[k], by[i]);
        add(add(part(0, along), part(1, across)), part(2, side))
    })
}

#[cfg(test)]
mod tests;
