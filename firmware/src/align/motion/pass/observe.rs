//! Observations of a pass: position and velocity of a fix, course, heading, standstill.

use super::{AGE, ARM, Assumed, GYRO, N, POSITION, Pass, Row, SPIN, VELOCITY};
use super::{add_times, product_of, turned};
use crate::align::motion::TIMING_S;
use crate::align::motion::window::Node;
use crate::nav::vector::{V32, add, cross, dot, scale};

/// Rotation of a vehicle that stands, by people and wind, rad (assumed).
const SWAY: f32 = 5e-4;
/// A vehicle that may move turns about a point that is so far away at least, m (assumed).
const TURNS_M: f32 = 4.0;
/// An observation farther from its prediction than this, in squared standard deviations, counts as
/// if it were so far.
const GATE: f32 = 25.0;
/// Errors of a receiver's positions last for some seconds, those of its velocities do not: beside
/// velocities the positions' standard deviation counts so many times.
const LASTING: f32 = 3.0;
/// Share of the velocity by the lever arm that varies within an interval (assumed).
const VARIES: f32 = 0.3;
/// A course is one from this speed on, m/s, and from this many times its own standard deviation.
const COURSE_MPS: f32 = 3.0;
const COURSE_SIGMAS: f32 = 5.0;
/// Angle between the course and the forward axis: the slip of the tyres and the mounting. It stays
/// the same, so that many observations know no more than one (assumed).
const SLIP: f32 = 0.03;
/// In a curve the course is that of another point of the vehicle, m from the one that does not
/// slip (assumed).
const AXLE_M: f32 = 2.0;
/// An axis is horizontal enough for a heading: cosine of its pitch.
const HORIZONTAL: f32 = 0.5;
/// Observations that are the last ones.
const RECENT: f32 = 20.0;

impl Pass {
    /// The fix at the end of an interval, and that the vehicle stands.
    #[inline(never)]
    pub fn observe(&mut self, node: &Node, assumed: &Assumed) {
        let axes = self.axes();
        let arm: V32 = core::array::from_fn(|j| assumed.arm[j] + self.constants[ARM + j]);
        let arm = turned(&axes, arm);
        let velocity = self.estimated_velocity();
        let rows: [Row; 3] = core::array::from_fn(|i| self.attitude_row(i));
        // beside velocities they are for what those do not show
        let lasts = node.speed_sigma[0] <= node.sigma[0];
        let [level, down] = node
            .sigma
            .map(|sigma| if lasts { LASTING * sigma } else { sigma });
        self.wild = false;
        for i in 0..3 {
            let sigma = if i < 2 { level } else { down };
            if !sigma.is_finite() {
                continue;
            }
            // phi x arm
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let mut row: Row = core::array::from_fn(|n| rows[j][n] * arm[k] - rows[k][n] * arm[j]);
            row[POSITION + i] = 1.0;
            row[ARM..ARM + 3].copy_from_slice(&axes[i]);
            row[AGE] = -velocity[i];
            let ahead = velocity[i] * (node.late - self.constants[AGE]);
            let z = node.place[i] - (self.position[i] + arm[i] + ahead);
            let before = self.fit;
            let variance = sigma * sigma * assumed.scale;
            if node.speed_sigma[0].is_finite() && self.is_far(&row, z, variance) {
                // the velocities hold, only the position has jumped
                self.forget_position(i, z);
            }
            self.wild |= self.take(&row, z, variance) > GATE;
            if lasts {
                self.fit = before;
            }
        }
        if node.speed_sigma[0].is_finite() {
            self.moves(node, &axes, assumed);
            self.course(node, assumed);
        }
        if node.rest.is_finite() {
            self.stands(node, &axes, assumed);
        }
    }

    /// Whether an observation is too far from its prediction.
    fn is_far(&self, row: &Row, z: f32, variance: f32) -> bool {
        let left = z - product_of(&self.x, row);
        left * left > GATE * (self.variance(row) + variance)
    }

    /// A coordinate of the position may be anywhere as far as `z`.
    fn forget_position(&mut self, i: usize, z: f32) {
        let at = POSITION + i;
        for j in 0..N {
            self.set(at, j, 0.0);
        }
        self.set(at, at, z * z);
    }

    /// The velocity of a fix, by the mean rotation and acceleration of the interval before it.
    #[inline(never)]
    fn moves(&mut self, node: &Node, axes: &[V32; 3], assumed: &Assumed) {
        let mut swing = [0.0; 3];
        let mut change = [0.0; 3];
        let mut varies = 0.0;
        if node.time > 0.0 {
            let size = |v: V32| dot(v, v);
            let rate = scale(node.turn, 1.0 / node.time);
            let arm: V32 = core::array::from_fn(|j| assumed.arm[j] + self.constants[ARM + j]);
            swing = turned(axes, cross(rate, arm));
            let force = scale(turned(axes, node.gain), 1.0 / node.time);
            change = add(force, [0.0, 0.0, self.gravity]);
            varies = TIMING_S * TIMING_S * size(change)
                + assumed.sigma[ARM] * assumed.sigma[ARM] * size(rate)
                + VARIES * VARIES * size(swing);
        }
        let late = node.late - self.constants[AGE];
        let [level, down] = node.speed_sigma;
        for i in 0..3 {
            let sigma = if i < 2 { level } else { down };
            if !sigma.is_finite() {
                continue;
            }
            let mut row = [0.0; N];
            row[VELOCITY + i] = 1.0;
            row[AGE] = -change[i];
            let z = node.velocity[i] - (self.velocity[i] + swing[i] + change[i] * late);
            self.take(&row, z, sigma * sigma * assumed.scale + varies);
        }
    }

    /// A vehicle on wheels moves along its forward axis, forwards or backwards.
    #[inline(never)]
    fn course(&mut self, node: &Node, assumed: &Assumed) {
        let [vn, ve, _] = node.velocity;
        let (speed, sigma) = (libm::hypotf(vn, ve), node.speed_sigma[0]);
        let fast = speed > COURSE_MPS.max(COURSE_SIGMAS * sigma) && node.time > 0.0;
        let Some(heading) = self.heading_of(assumed.forward).filter(|_| fast) else {
            return;
        };
        let off = libm::atan2f(ve, vn) - heading;
        let off = off - core::f32::consts::PI * libm::roundf(off / core::f32::consts::PI);
        let row = self.attitude_row(2);
        let arm = libm::sqrtf(dot(assumed.arm, assumed.arm));
        let rate = libm::sqrtf(dot(node.turn, node.turn)) / node.time;
        let (noise, curve) = (sigma / speed, (AXLE_M + arm) * rate / speed);
        let white = noise * noise + curve * curve;
        let (p, constant) = (self.variance(&row), SLIP * SLIP);
        let left = off - product_of(&self.x, &row);
        let fits = self.compare(left, p + white + constant) <= GATE;
        // a course shows nothing new of a heading that is known as well as that
        if fits && p > constant {
            let column = core::array::from_fn(|i| product_of(&self.p[i], &row));
            self.change(&column, left, p + white.max(p * constant / (p - constant)));
            self.course = true;
        }
    }

    /// An observation that is not used counts all the same.
    fn compare(&mut self, left: f32, own: f32) -> f32 {
        let ratio = left * left / own;
        self.cost += ratio.min(GATE) + libm::logf(own);
        let fit = &mut self.fit;
        fit.nis += ratio.min(GATE);
        fit.count += 1.0;
        fit.recent += (ratio.min(GATE) - fit.recent) / fit.count.min(RECENT);
        ratio
    }

    /// A vehicle that stands: no velocity, and what the gyros have turned is their error.
    #[inline(never)]
    fn stands(&mut self, node: &Node, axes: &[V32; 3], assumed: &Assumed) {
        let spin = dot(axes[2], node.turn);
        let noise = assumed.noise[0] * assumed.noise[0] * node.time;
        for i in 0..3 {
            let mut row = [0.0; N];
            row[VELOCITY + i] = 1.0;
            self.take(&row, -self.velocity[i], node.rest * node.rest);
            if node.time > 0.0 {
                let mut row = [0.0; N];
                (row[GYRO + i], row[SPIN + i]) = (node.time, spin);
                let known = self.constants[GYRO + i] * node.time + self.constants[SPIN + i] * spin;
                let turns = node.rest / TURNS_M * node.time;
                let variance = 2.0 * SWAY * SWAY + turns * turns + noise;
                self.take(&row, node.turn[i] - known, variance);
            }
        }
    }

    /// The heading of an axis of the sensor, rad. `None`: it is not horizontal enough.
    fn heading_of(&self, axis: V32) -> Option<f32> {
        let [n, e, _] = turned(&self.axes(), axis);
        (libm::hypotf(n, e) > HORIZONTAL).then(|| libm::atan2f(e, n))
    }

    /// A heading of a horizontal direction in the sensor's axes: its value and variance.
    pub fn heading(&mut self, forward: V32, angle: f32, variance: f32) {
        let Some(heading) = self.heading_of(forward) else {
            return;
        };
        let off = angle - heading;
        let turns = libm::roundf(off / core::f32::consts::TAU);
        let row = self.attitude_row(2);
        self.take(&row, off - core::f32::consts::TAU * turns, variance);
    }

    /// One observation `z = row x`; its normalised innovation squared.
    #[inline(never)]
    fn take(&mut self, row: &Row, z: f32, variance: f32) -> f32 {
        let column: Row = core::array::from_fn(|i| product_of(&self.p[i], row));
        let own = product_of(&column, row).max(0.0) + variance;
        let left = z - product_of(&self.x, row);
        let ratio = self.compare(left, own);
        // what is too far counts less, so that one wrong fix moves little
        self.change(&column, left, own * (ratio / GATE).max(1.0));
        ratio
    }

    /// The estimate follows an observation that is off by `left`, whose covariance with the errors
    /// is `column` and whose variance is `own`.
    #[inline(never)]
    fn change(&mut self, column: &Row, left: f32, own: f32) {
        for ((x, p), k) in self.x.iter_mut().zip(&mut self.p).zip(column) {
            let k = k / own;
            *x += k * left;
            add_times(p, -k, column);
        }
    }
}
