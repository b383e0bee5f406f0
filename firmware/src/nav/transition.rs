//! Linear error dynamics in north-east-down (phi-angle form; Titterton & Weston 2004, ch. 12;
//! Groves 2013, ch. 14), f32.
//!
//! With `phi`, `v`, `p` the errors of attitude, velocity and position (m), `V` the velocity, `f`
//! the specific force:
//!
//! ```text
//! t    = B v + D p
//! phi' = t - omega_in x phi + C e_gyro
//! v'   = f x phi + V x (t + E p) - (2 omega_ie + omega_en) x v + [0, 0, 2 g / R] p_down
//!        - C e_accel
//! p'   = v + K p
//! ```
//!
//! `t` is the change of the navigation frame's rate with velocity and position.
//!
//! Two pieces, 100 ms, are a step of second order in their length (mean of `phi` in `v'`, mean of
//! `v` in `phi'` and `p'`), with the means of force, velocity and axes over them. Where force and
//! axes turn within the step, their first moments are added: without them `gamma` is wrong by
//! 1.4e-3 in a drive, with them by 6e-4. The 9 x 9 matrix is never formed: a column costs 70
//! operations where a dense product takes 162.

use super::earth::OMEGA_IE;
use super::local_earth::Coarse;
use super::vector::{V32, add, cross, scale};
use lrnn_nostd::learn::kalman::PROPORTIONAL;

/// Number of navigation errors: attitude (rad), velocity (m/s), position (m), each north, east,
/// down.
pub const ERRORS: usize = 9;

/// White noise of the sensors, per axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Angle random walk, rad/sqrt(s), >= 0.
    pub gyro: f32,
    /// Velocity random walk, m/s/sqrt(s), >= 0.
    pub accel: f32,
}

/// How errors moved over an interval: `x+ = phi x + gamma e + noise of covariance q`. `e` are the
/// sensor errors left in the increments, with the sign `residual = -e`, constant over the interval.
/// Rows first; errors in the order of [`ERRORS`].
pub type Transition = lrnn_nostd::learn::kalman::Transition<ERRORS>;

/// Motion over a piece, f32.
#[derive(Debug, Clone, Copy)]
pub struct Motion {
    /// Body to navigation axes at the piece's middle.
    pub c: [V32; 3],
    /// Integral of the specific force, NED, m/s.
    pub force: V32,
    /// Velocity at the middle, NED, m/s.
    pub velocity: V32,
    /// Duration, s.
    pub time: f32,
}

/// Sums over the pieces of a step.
#[derive(Debug, Clone, Copy)]
struct Pieces {
    time: f32,
    velocity: V32,
    // integrals of axes and force, and of both by the time since the step began
    c: [V32; 3],
    force: V32,
    c_time: [V32; 3],
    force_time: V32,
}

impl Pieces {
    const NONE: Pieces = Pieces {
        time: 0.0,
        velocity: [0.0; 3],
        c: [[0.0; 3]; 3],
        force: [0.0; 3],
        c_time: [[0.0; 3]; 3],
        force_time: [0.0; 3],
    };

    fn add(&mut self, piece: &Motion) {
        let middle = self.time + 0.5 * piece.time;
        let sums = self.c.iter_mut().zip(&mut self.c_time);
        for ((sum, by_time), row) in sums.zip(piece.c) {
            let row = scale(row, piece.time);
            *sum = add(*sum, row);
            *by_time = add(*by_time, scale(row, middle));
        }
        self.force = add(self.force, piece.force);
        self.force_time = add(self.force_time, scale(piece.force, middle));
        self.velocity = add(self.velocity, scale(piece.velocity, piece.time));
        self.time += piece.time;
    }
}

/// A column of errors.
#[derive(Debug, Clone, Copy, Default)]
struct Column {
    phi: V32,
    v: V32,
    p: V32,
}

/// The system's blocks over one piece.
struct Dynamics {
    time: f32,
    // means
    velocity: V32,
    force: V32,
    // integrals of force and axes by the time before the middle
    force_moment: V32,
    c_moment: [V32; 3],
    omega_in: V32,
    // 2 omega_ie + omega_en
    coriolis: V32,
    // 1/(N + h), 1/(M + h), tan/(N + h)
    inv_n: f32,
    inv_m: f32,
    tan_n: f32,
    // change of omega_ie with a metre north: north and down
    ie_north: f32,
    ie_down: f32,
    // change of omega_en with a metre north (down) and down (north, east, down)
    en_down: f32,
    by_height: V32,
    gravity: f32,
    // change of the position error's rate with north, east and down error
    k_north: [f32; 2],
    k_east: V32,
}

impl Dynamics {
    fn new(pieces: &Pieces, here: &Coarse) -> Self {
        let per = 1.0 / pieces.time;
        let half = 0.5 * pieces.time;
        let moment = |of: V32, by_time: V32| add(scale(of, half), scale(by_time, -1.0));
        let velocity = scale(pieces.velocity, per);
        let [vn, ve, vd] = velocity;
        let Coarse {
            sin,
            cos,
            inv_cos,
            inv_m,
            inv_n,
            g,
        } = *here;
        let tan = sin * inv_cos;
        let omega = OMEGA_IE as f32;
        let ie = [omega * cos, 0.0, -omega * sin];
        let en = [ve * inv_n, -vn * inv_m, -ve * inv_n * tan];
        let omega_in = add(ie, en);
        Self {
            time: pieces.time,
            velocity,
            force: scale(pieces.force, per),
            force_moment: moment(pieces.force, pieces.force_time),
            c_moment: core::array::from_fn(|i| moment(pieces.c[i], pieces.c_time[i])),
            omega_in,
            coriolis: add(ie, omega_in),
            inv_n,
            inv_m,
            tan_n: tan * inv_n,
            ie_north: -sin * omega * inv_m,
            ie_down: -cos * omega * inv_m,
            en_down: -ve * inv_n * inv_m * inv_cos * inv_cos,
            by_height: [en[0] * inv_n, en[1] * inv_m, en[2] * inv_n],
            // gravity falls with height; the radius is the geometric mean of the two
            gravity: 2.0 * g * libm::sqrtf(inv_m * inv_n),
            k_north: [-vd * inv_m, vn * inv_m],
            k_east: [ve * tan * inv_m, -vn * tan * inv_m - vd * inv_n, ve * inv_n],
        }
    }

    /// `B v`.
    #[inline(always)]
    fn by_velocity(&self, v: V32) -> V32 {
        [v[1] * self.inv_n, -v[0] * self.inv_m, -v[1] * self.tan_n]
    }

    /// A column after one piece.
    #[inline(always)]
    fn step(&self, x: &Column) -> Column {
        let Column { phi, v, p } = *x;
        let half = 0.5 * self.time;
        let t = add(
            self.by_velocity(v),
            [
                self.ie_north * p[0] + self.by_height[0] * p[2],
                self.by_height[1] * p[2],
                (self.ie_down + self.en_down) * p[0] + self.by_height[2] * p[2],
            ],
        );
        let phi_half = scale(add(t, cross(phi, self.omega_in)), half);
        let phi_mid = add(phi, phi_half);
        let twice = add(t, [self.ie_north * p[0], 0.0, self.ie_down * p[0]]);
        let v_rate = add(cross(self.force, phi_mid), cross(self.velocity, twice));
        let v_rate = add(v_rate, cross(v, self.coriolis));
        let v_rate = [v_rate[0], v_rate[1], v_rate[2] + self.gravity * p[2]];
        let v_half = scale(v_rate, half);
        let v_mid = add(v, v_half);
        let k_p = [
            self.k_north[0] * p[0] + self.k_north[1] * p[2],
            self.k_east[0] * p[0] + self.k_east[1] * p[1] + self.k_east[2] * p[2],
            0.0,
        ];
        let bent = scale(self.by_velocity(v_half), self.time);
        Column {
            phi: add(add(phi_mid, phi_half), bent),
            v: add(v_mid, v_half),
            p: add(p, scale(add(v_mid, k_p), self.time)),
        }
    }
}

impl Dynamics {
    /// Effect of a constant rate about a body axis within the step, to third order. `axis` (NED) is
    /// integrated, `moment` by the time before the middle.
    #[inline(always)]
    fn turn(&self, x: &mut Column, axis: V32, moment: V32, per: f32) {
        let first = scale(cross(self.force, axis), 0.5 * self.time);
        let second = add(
            cross(self.force, moment),
            scale(cross(axis, self.force_moment), per),
        );
        x.phi = add(x.phi, axis);
        x.v = add(x.v, add(first, second));
        x.p = add(x.p, scale(first, self.time * (1.0 / 3.0)));
    }

    /// Effect of a constant acceleration against a body axis within the step, to second order.
    #[inline(always)]
    fn push(&self, x: &mut Column, axis: V32, moment: V32) {
        let p = scale(axis, -0.5 * self.time);
        x.phi = add(x.phi, self.by_velocity(p));
        x.v = add(x.v, scale(axis, -1.0));
        x.p = add(x.p, add(p, scale(moment, -1.0)));
    }
}

/// A step is this long at least, s: two pieces.
const STEP_S: f32 = 0.09;
/// A step is at most this long where there is something else to do, s.
const LATEST_S: f32 = 0.45;

/// Accumulates a [`Transition`].
#[derive(Debug, Clone)]
pub struct Interval {
    // columns
    phi: [Column; 9],
    gamma: [Column; 6],
    q: [[f32; 9]; 9],
    time: f64,
    // since the last step
    pieces: Pieces,
}

impl Interval {
    pub fn new() -> Self {
        let mut phi = [Column::default(); 9];
        set_diagonal(&mut phi);
        Self {
            phi,
            gamma: [Column::default(); 6],
            q: [[0.0; 9]; 9],
            time: 0.0,
            pieces: Pieces::NONE,
        }
    }

    /// Adds a piece.
    pub fn piece(&mut self, motion: &Motion) {
        self.pieces.add(motion);
    }

    /// Whether the pieces make a step. `late`: it may come later.
    pub fn is_due(&self, late: bool) -> bool {
        self.pieces.time >= if late { LATEST_S } else { STEP_S }
    }

    /// The pieces of the step that comes next, as one; `None`: there are none.
    pub fn due(&self) -> Option<Motion> {
        let Pieces {
            time,
            c,
            force,
            velocity,
            ..
        } = self.pieces;
        let per = 1.0 / time;
        (time > 0.0).then(|| Motion {
            c: c.map(|row| scale(row, per)),
            force,
            velocity: scale(velocity, per),
            time,
        })
    }

    /// A step over the pieces since the last one.
    #[inline(never)]
    pub fn step(&mut self, here: &Coarse, noise: Noise) {
        let pieces = &self.pieces;
        let dynamics = Dynamics::new(pieces, here);
        self.time += f64::from(pieces.time);
        for column in self.phi.iter_mut().chain(&mut self.gamma) {
            let bent = cross(dynamics.force_moment, column.phi);
            *column = dynamics.step(column);
            column.p = add(column.p, bent);
        }
        let [axes, moments] = [&pieces.c, &dynamics.c_moment].map(columns);
        let per = 1.0 / pieces.time;
        let (gyro, accel) = self.gamma.split_at_mut(3);
        for (column, (axis, moment)) in gyro.iter_mut().zip(axes.into_iter().zip(moments)) {
            dynamics.turn(column, axis, moment, per);
        }
        for (column, (axis, moment)) in accel.iter_mut().zip(axes.into_iter().zip(moments)) {
            dynamics.push(column, axis, moment);
        }
        self.pieces = Pieces::NONE;
        self.white(&dynamics, noise);
    }

    /// Covariance over a step: `S (q + n / 2) S' + n / 2` with the step's white noise `n`. That
    /// has all terms of second order. Of third order it has the position's variance as 1/2 instead
    /// of 1/3, which is corrected.
    fn white(&mut self, dynamics: &Dynamics, noise: Noise) {
        let time = dynamics.time;
        let (g, a) = (noise.gyro * noise.gyro, noise.accel * noise.accel);
        let mut half = [g, g, g, a, a, a, 0.0, 0.0, 0.0].map(|density| 0.5 * density * time);
        add_diagonal(&mut self.q, &half);
        // S q S' = S (S q)', and q is symmetric: twice the columns are stepped and become rows
        for _ in 0..2 {
            let before = self.q;
            for (j, line) in self.q.iter_mut().enumerate() {
                let old = before
                    .each_ref()
                    .map(|row| row.get(j).copied().unwrap_or(0.0));
                *line = row(&dynamics.step(&column(&old)));
            }
        }
        let third = -a * time * time * time * (1.0 / 6.0);
        half[6..].fill(third);
        add_diagonal(&mut self.q, &half);
    }

    /// The transition since the last call.
    pub fn take(&mut self, here: &Coarse, noise: Noise) -> Transition {
        if self.pieces.time > 0.0 {
            self.step(here, noise);
        }
        // written where it will be: it is too large to be on the stack twice
        let mut taken = Transition {
            proportional: [[0.0; PROPORTIONAL]; ERRORS],
            phi: [[0.0; 9]; 9],
            gamma: [[0.0; 6]; 9],
            q: self.q,
            time: self.time as f32,
        };
        for (j, column) in self.phi.iter().enumerate() {
            set_column(&mut taken.phi, j, row(column));
        }
        for (j, column) in self.gamma.iter().enumerate() {
            set_column(&mut taken.gamma, j, row(column));
        }
        // rounding leaves q symmetric to a few units in the last place; the mean makes it exact
        for i in 0..9 {
            for j in 0..9 {
                if j < i {
                    let mean = 0.5 * (taken.q[i][j] + taken.q[j][i]);
                    (taken.q[i][j], taken.q[j][i]) = (mean, mean);
                }
            }
        }
        *self = Self::new();
        taken
    }
}

fn set_column<const N: usize>(of: &mut [[f32; N]; 9], j: usize, column: [f32; 9]) {
    for (row, value) in of.iter_mut().zip(column) {
        if let Some(entry) = row.get_mut(j) {
            *entry = value;
        }
    }
}

fn columns([a, b, c]: &[[f32; 3]; 3]) -> [V32; 3] {
    [[a[0], b[0], c[0]], [a[1], b[1], c[1]], [a[2], b[2], c[2]]]
}

fn row(c: &Column) -> [f32; 9] {
    let Column { phi, v, p } = c;
    [phi[0], phi[1], phi[2], v[0], v[1], v[2], p[0], p[1], p[2]]
}

fn column(r: &[f32; 9]) -> Column {
    Column {
        phi: [r[0], r[1], r[2]],
        v: [r[3], r[4], r[5]],
        p: [r[6], r[7], r[8]],
    }
}

fn add_diagonal(rows: &mut [[f32; 9]; 9], by: &[f32; 9]) {
    for (i, (row, by)) in rows.iter_mut().zip(by).enumerate() {
        if let Some(entry) = row.get_mut(i) {
            *entry += by;
        }
    }
}

fn set_diagonal([a, b, c, d, e, f, g, h, i]: &mut [Column; 9]) {
    const UNIT: [V32; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    [a.phi, b.phi, c.phi] = UNIT;
    [d.v, e.v, f.v] = UNIT;
    [g.p, h.p, i.p] = UNIT;
}
