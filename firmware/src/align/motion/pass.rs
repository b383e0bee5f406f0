//! One pass over the window: a Kalman filter about a guess.
//!
//! The guess is the attitude at the window's beginning and all that stays the same. The attitude
//! follows from it by the gyros; velocity and position are linear. Their errors are truth minus
//! reference:
//!
//! ```text
//! 0..3    phi    attitude at the beginning, in north, east, down: C_true = exp(phi x) C
//! 3..6           bias of the gyros
//! 6..9           their errors by a rotation of 1 rad about the vertical: scale, misalignment
//! 9..12          bias of the accelerometers
//! 12..15         lever arm
//! 15             age of the fixes
//! 16..19  w      what the gyros' noise has added to phi since
//! 19..22         velocity
//! 22..25         position
//! ```
//!
//! Constants are states from the beginning to the end. So a pass ends with the best phi
//! *at the beginning* given all fixes, and the next pass goes about that (Gauss-Newton). The
//! predictions of the fixes give the likelihood of the guess.

mod observe;

use super::window::Node;
use crate::nav::vector::{Q, V32, add, cross, dot, from_rotvec, matrix32, product, scale};

/// Number of errors, and of those that stay the same.
pub const N: usize = 25;
pub const CONSTANTS: usize = 16;
pub const GYRO: usize = 3;
pub const SPIN: usize = 6;
pub const ACCEL: usize = 9;
pub const ARM: usize = 12;
pub const AGE: usize = 15;
pub const WALK: usize = 16;
pub const VELOCITY: usize = 19;
pub const POSITION: usize = 22;

/// Standard deviation of the attitude about a guess, rad. Each pass forgets the one before, so that
/// it only bounds the step.
const ATTITUDE: f32 = 0.5;
/// Standard deviation of a velocity before the first interval, m/s: it may have turned.
const ANY_VELOCITY: f32 = 2.0;
/// Velocity that vibration adds, m/s in the root of a second (assumed).
const VIBRATION: f32 = 0.01;
/// A vector of all errors.
pub type Row = [f32; N];

/// Assumptions about sensors and receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Assumed {
    /// Standard deviations of the constants.
    pub sigma: [f32; CONSTANTS],
    /// White noise of gyros and accelerometers, rad and m/s in the root of a second.
    pub noise: [f32; 2],
    /// Errors in proportion to rotation and change of velocity.
    pub ratio: [f32; 2],
    /// Lever arm, m.
    pub arm: V32,
    /// Variance of the receiver's noise by the one it reports.
    pub scale: f32,
    /// The axis along which a vehicle on wheels moves; zero where it may move along any.
    pub forward: V32,
}

/// The Earth here.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Earth {
    /// Gravity, m/s2.
    pub gravity: f32,
    /// Its rotation, north, east, down, rad/s.
    pub rate: V32,
    /// 1 / radius, 1/m, and the tangent of the latitude.
    pub bent: [f32; 2],
}

/// How well the observations agree with their predictions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Sum of the normalised innovations squared, and their number.
    pub nis: f32,
    pub count: f32,
    /// Mean of the last of them.
    pub recent: f32,
}

impl Fit {
    const NONE: Fit = Fit {
        nis: 0.0,
        count: 0.0,
        recent: 0.0,
    };

    /// Mean of the normalised innovations squared.
    pub fn residual(&self) -> f32 {
        self.nis / self.count.max(1.0)
    }
}

/// A pass in progress, or its end.
#[derive(Debug, Clone)]
pub struct Pass {
    /// The reference: attitude, velocity, position, and the constants.
    pub q: Q,
    pub velocity: V32,
    pub position: V32,
    pub constants: [f32; CONSTANTS],
    /// Effect of the gyros' errors (3..9) on the attitude.
    by: [V32; 6],
    /// Estimate and covariance of the errors.
    pub x: Row,
    pub p: [Row; N],
    /// Gravity, m/s2.
    gravity: f32,
    /// Twice the negative logarithm of the likelihood.
    pub cost: f32,
    /// The innovations.
    pub fit: Fit,
    /// The last fix was too far from where it should be.
    wild: bool,
    /// A course was used.
    pub course: bool,
}

impl Pass {
    /// Nothing.
    pub const ZEROED: Pass = Pass {
        q: [1.0, 0.0, 0.0, 0.0],
        velocity: [0.0; 3],
        position: [0.0; 3],
        constants: [0.0; CONSTANTS],
        by: [[0.0; 3]; 6],
        x: [0.0; N],
        p: [[0.0; N]; N],
        gravity: 0.0,
        cost: 0.0,
        fit: Fit::NONE,
        wild: false,
        course: false,
    };

    /// Begins at the first fix of a window with a guess. `next` is the interval that follows.
    #[inline(never)]
    pub fn begin(
        &mut self,
        (q, constants): (Q, &[f32; CONSTANTS]),
        (first, next): (&Node, &Node),
        assumed: &Assumed,
    ) {
        (self.q, self.constants) = (q, *constants);
        self.by = [[0.0; 3]; 6];
        (self.cost, self.fit, self.course) = (0.0, Fit::NONE, false);
        let per = 1.0 / (next.time + next.late - first.late);
        // between two fixes, or as the receiver says
        self.velocity = scale(add(next.place, scale(first.place, -1.0)), per);
        if !(first.sigma[1].is_finite() && next.sigma[1].is_finite()) {
            self.velocity[2] = 0.0;
        }
        if first.speed_sigma[0].is_finite() {
            let [north, east, down] = first.velocity;
            (self.velocity[0], self.velocity[1]) = (north, east);
            if first.speed_sigma[1].is_finite() {
                self.velocity[2] = down;
            }
        }
        let [place, speed] = [first.sigma[0], first.speed_sigma[0]];
        let level = if place.is_finite() { place } else { 1.0 };
        let speed = speed.min(level * per);
        self.position = add(first.place, scale(self.velocity, -first.late));
        (self.x, self.p) = ([0.0; N], [[0.0; N]; N]);
        let arm = assumed.sigma[ARM];
        let free = [
            ATTITUDE,
            ANY_VELOCITY + 3.0 * speed,
            10.0 * level + 2.0 * (arm + dot(assumed.arm, assumed.arm)),
        ];
        for i in 0..N {
            let sigma = if i < GYRO {
                free[0]
            } else if i < CONSTANTS {
                // the mean of the prior is zero
                self.x[i] = -self.constants[i];
                assumed.sigma[i]
            } else if i < VELOCITY {
                0.0
            } else if i < POSITION {
                free[1]
            } else {
                free[2]
            };
            self.p[i][i] = sigma * sigma;
        }
        self.observe(first, assumed);
    }

    /// Axes of the sensor to north, east, down.
    fn axes(&self) -> [V32; 3] {
        matrix32(self.q.map(|part| part as f32))
    }

    /// The velocity by reference and estimate, m/s.
    pub fn estimated_velocity(&self) -> V32 {
        core::array::from_fn(|i| self.velocity[i] + self.x[VELOCITY + i])
    }

    /// An estimated constant.
    pub fn constant(&self, i: usize) -> f32 {
        let of = |row: &[f32]| row.get(i).copied().unwrap_or(0.0);
        of(&self.constants) + of(&self.x)
    }

    /// Whether the last fix was too far from where it should be.
    pub fn is_wild(&self) -> bool {
        self.wild
    }

    /// An interval between fixes, without the fix at its end.
    #[inline(never)]
    pub fn interval(&mut self, node: &Node, earth: &Earth, assumed: &Assumed) {
        let t = node.time;
        let axes = self.axes();
        let velocity = self.estimated_velocity();
        let [[_, _, _, gx, gy, gz, sx, sy, sz, ax, ay, az, ..]] = [self.constants];
        let (bias, spins, accel) = ([gx, gy, gz], [sx, sy, sz], [ax, ay, az]);
        let [bent, tangent] = earth.bent;
        let [vn, ve, _] = velocity;
        let transport = scale([ve, -vn, -ve * tangent], bent);
        let frame = add(earth.rate, transport);
        let down = axes[2];
        let spin = dot(down, node.turn);
        let wrong = add(
            add(scale(bias, t), scale(spins, spin)),
            scale(back(&axes, frame), t),
        );
        // a rotation that is wrong by so much turns what was gained on the way
        let turn = add(node.turn, scale(wrong, -1.0));
        let [of_gain, of_way] = constant_in(turn, t, accel);
        let gain = add(
            add(node.gain, scale(cross(wrong, node.gain), -0.5)),
            scale(of_gain, -1.0),
        );
        let way = add(
            add(node.way, scale(cross(wrong, node.way), -1.0 / 3.0)),
            scale(of_way, -1.0),
        );
        let (gain, way) = (turned(&axes, gain), turned(&axes, way));
        let q = product(self.q, from_rotvec(turn.map(f64::from)));
        let after = matrix32(q.map(|part| part as f32));
        let rows = self.rows((&axes, &after), (gain, way), turn, [t, spin]);
        self.propagate(&rows);
        (self.q, self.gravity) = (q, earth.gravity);
        // north, east, down of the reference
        let apparent = cross(add(earth.rate, frame), velocity);
        let fall = add([0.0, 0.0, earth.gravity], scale(apparent, -1.0));
        let ahead = add(way, scale(fall, 0.5 * t * t));
        self.position = add(self.position, add(scale(self.velocity, t), ahead));
        self.velocity = add(self.velocity, add(gain, scale(fall, t)));
        let across = add(node.turn, scale(down, -spin));
        let change = add(gain, scale([0.0, 0.0, earth.gravity], t));
        self.add_noise([dot(across, across), dot(change, change)], t, assumed);
    }

    /// Rows of the transition of velocity and position, and the attitude's effects after it.
    #[inline(never)]
    fn rows(
        &mut self,
        (axes, after): (&[V32; 3], &[V32; 3]),
        (gain, way): (V32, V32),
        turn: V32,
        [t, spin]: [f32; 2],
    ) -> [Row; 6] {
        let mut rows = [[0.0; N]; 6];
        let mut put = |column: usize, of_gain: V32, of_way: V32| {
            for i in 0..3 {
                if let Some(entry) = rows[i].get_mut(column) {
                    *entry += of_gain[i];
                }
                if let Some(entry) = rows[3 + i].get_mut(column) {
                    *entry += of_way[i];
                }
            }
        };
        for (j, by) in self.by.iter_mut().enumerate() {
            let (j3, size) = if j < 3 { (j, t) } else { (j - 3, spin) };
            // the mean axis over the interval
            let grows: V32 = core::array::from_fn(|i| -0.5 * size * (axes[i][j3] + after[i][j3]));
            let half = add(*by, scale(grows, 0.5));
            let third = add(*by, scale(grows, 1.0 / 3.0));
            put(GYRO + j, cross(half, gain), cross(third, way));
            *by = add(*by, grows);
        }
        for j in 0..3 {
            let mut unit = [0.0; 3];
            unit[j] = 1.0;
            let (of_gain, of_way) = (cross(unit, gain), cross(unit, way));
            put(j, of_gain, of_way);
            put(WALK + j, of_gain, of_way);
            let [of_gain, of_way] = constant_in(turn, t, unit).map(|v| turned(axes, v));
            put(ACCEL + j, scale(of_gain, -1.0), scale(of_way, -1.0));
            put(VELOCITY + j, unit, scale(unit, t));
            put(POSITION + j, [0.0; 3], unit);
        }
        rows
    }

    /// Velocity and position move by `rows`, which are six; a slice, so that it is not unrolled.
    #[inline(never)]
    fn propagate(&mut self, rows: &[Row]) {
        let mut moved = [[0.0; N]; 6];
        let mut x = [0.0; 6];
        for ((to, x), row) in moved.iter_mut().zip(&mut x).zip(rows) {
            for (of, p) in row.iter().zip(&self.p) {
                add_times(to, *of, p);
            }
            *x = product_of(row, &self.x);
        }
        let moved = moved.as_slice();
        for (i, (moved, x)) in moved.iter().zip(x).enumerate() {
            let dynamic = VELOCITY + i;
            if let Some(of) = self.x.get_mut(dynamic) {
                *of = x;
            }
            for (j, value) in moved.iter().enumerate().take(VELOCITY) {
                self.set(dynamic, j, *value);
            }
            for (j, row) in rows.iter().enumerate().take(i + 1) {
                self.set(dynamic, VELOCITY + j, product_of(moved, row));
            }
        }
    }

    /// Sets two entries of the covariance.
    #[inline(never)]
    fn set(&mut self, i: usize, j: usize, value: f32) {
        for (i, j) in [(i, j), (j, i)] {
            if let Some(entry) = self.p.get_mut(i).and_then(|row| row.get_mut(j)) {
                *entry = value;
            }
        }
    }

    #[inline(never)]
    fn add_noise(&mut self, [across, change]: [f32; 2], t: f32, assumed: &Assumed) {
        let square = |x: f32| x * x;
        let [gyro, accel] = assumed.noise;
        let [by_turn, by_change] = assumed.ratio;
        let angle = square(gyro) * t + square(by_turn) * across;
        let white = (square(accel) + square(VIBRATION) * assumed.scale) * t;
        let velocity = white + square(by_change) * change;
        for i in 0..3 {
            self.p[WALK + i][WALK + i] += angle;
            self.p[VELOCITY + i][VELOCITY + i] += velocity;
            self.p[POSITION + i][POSITION + i] += velocity * t * t / 3.0;
            self.p[VELOCITY + i][POSITION + i] += velocity * t / 2.0;
            self.p[POSITION + i][VELOCITY + i] += velocity * t / 2.0;
        }
    }

    /// The row of the attitude now about north, east or down.
    #[inline(never)]
    pub fn attitude_row(&self, i: usize) -> Row {
        let mut row = [0.0; N];
        for j in 0..3 {
            let one = if i == j { 1.0 } else { 0.0 };
            (row[j], row[WALK + j]) = (one, one);
        }
        for (j, by) in self.by.iter().enumerate() {
            row[GYRO + j] = by.get(i).copied().unwrap_or(0.0);
        }
        row
    }

    /// Variance of a combination of the errors.
    pub fn variance(&self, row: &Row) -> f32 {
        self.covariance(row, row).max(0.0)
    }

    /// Covariance of two combinations of the errors.
    #[inline(never)]
    pub fn covariance(&self, a: &Row, b: &Row) -> f32 {
        let pairs = a.iter().zip(&self.p);
        pairs.fold(0.0, |sum, (a, p)| sum + a * product_of(p, b))
    }
}

/// `to += by of`.
#[inline(never)]
fn add_times(to: &mut [f32], by: f32, of: &[f32]) {
    for (to, of) in to.iter_mut().zip(of) {
        *to += by * of;
    }
}

/// Velocity and way by a constant acceleration in axes that turn by `turn` in the time `t`, in the
/// axes at the beginning.
#[inline(never)]
fn constant_in(turn: V32, t: f32, accel: V32) -> [V32; 2] {
    let once = cross(turn, accel);
    let twice = cross(turn, once);
    let sum = |[a, b, c]: [f32; 3], by: f32| {
        scale(
            add(add(scale(accel, a), scale(once, b)), scale(twice, c)),
            by,
        )
    };
    [
        sum([1.0, 1.0 / 2.0, 1.0 / 6.0], t),
        sum([1.0 / 2.0, 1.0 / 6.0, 1.0 / 24.0], t * t),
    ]
}

/// A vector in the axes of `m`'s rows.
fn turned(m: &[V32; 3], v: V32) -> V32 {
    m.map(|row| dot(row, v))
}

/// A vector in the axes of `m`'s columns: the inverse of [`turned`].
fn back(m: &[V32; 3], v: V32) -> V32 {
    core::array::from_fn(|i| m[0][i] * v[0] + m[1][i] * v[1] + m[2][i] * v[2])
}

/// Not inlined, and of slices: unrolled it would be in flash dozens of times.
#[inline(never)]
pub fn product_of(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}
