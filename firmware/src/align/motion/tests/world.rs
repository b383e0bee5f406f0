//! True motions in closed form, and what sensors and a receiver make of them. Nothing here uses the
//! navigator: attitudes come from angles that are functions of time, specific forces from
//! differences of the velocity, the Earth from its textbook equations.

use crate::fix::{Fix, Position};
use crate::sample::{Counts, Lsb};
use core::f64::consts::{PI, TAU};

pub const LSB: Lsb = Lsb {
    rad: 1e-9,
    mps: 1e-7,
};
pub const SAMPLE_S: f64 = 0.01;
const EARTH: f64 = 7.292_115e-5;

pub type V = [f64; 3];
pub type Q = [f64; 4];

/// Attitude (yaw, pitch, roll) and velocity (north, east, down) at a time.
pub type Motion = fn(f64) -> (V, V);

fn times([a, b, c, d]: Q, [w, x, y, z]: Q) -> Q {
    [
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    ]
}

fn about(axis: usize, angle: f64) -> Q {
    let mut q = [(0.5 * angle).cos(), 0.0, 0.0, 0.0];
    q[axis + 1] = (0.5 * angle).sin();
    q
}

pub fn attitude([yaw, pitch, roll]: V) -> Q {
    times(times(about(2, yaw), about(1, pitch)), about(0, roll))
}

fn back([w, x, y, z]: Q) -> Q {
    [w, -x, -y, -z]
}

fn turned(q: Q, [x, y, z]: V) -> V {
    let [_, x, y, z] = times(times(q, [0.0, x, y, z]), back(q));
    [x, y, z]
}

fn log([w, x, y, z]: Q) -> V {
    let s = (x * x + y * y + z * z).sqrt();
    let k = if s < 1e-12 { 2.0 } else { 2.0 * s.atan2(w) / s };
    [x * k, y * k, z * k]
}

/// Error angles about north, east, down: `C_est = (I - phi x) C_true`.
pub fn error(got: Q, truth: Q) -> V {
    let q = times(got, back(truth));
    let sign = q[0].signum();
    log(q.map(|x| x * sign)).map(|x| -x)
}

/// Errors of sensors and receiver, one sigma.
#[derive(Clone, Copy)]
pub struct Errors {
    /// rad/s, m/s2.
    pub bias: [f64; 2],
    /// rad/sqrt(s), m/s/sqrt(s).
    pub noise: [f64; 2],
    pub scale: [f64; 2],
    /// Horizontal velocity, vertical velocity, m/s; position, m.
    pub receiver: [f64; 3],
}

const DEG: f64 = PI / 180.0;
const RECEIVER: [f64; 3] = [0.1, 0.15, 3.0];

/// Consumer MEMS: 0.2 deg/s, 30 mg, 0.5 deg/sqrt(h), 200 ug/sqrt(Hz).
pub const CONSUMER: Errors = Errors {
    bias: [0.2 * DEG, 0.3],
    noise: [0.5 * DEG / 60.0, 2e-3],
    scale: [5e-3, 5e-3],
    receiver: RECEIVER,
};
/// The class of a STIM300: 10 deg/h at power-on, 3 mg.
pub const STIM300: Errors = Errors {
    bias: [10.0 * DEG / 3600.0, 0.03],
    noise: [0.15 * DEG / 60.0, 1.2e-3],
    scale: [5e-4, 5e-4],
    receiver: RECEIVER,
};
/// Medium laser gyro.
pub const LASER: Errors = Errors {
    bias: [1.63e-6, 4e-3],
    noise: [1.46e-6, 1.96e-4],
    scale: [1e-4, 1e-4],
    receiver: RECEIVER,
};

struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (((z ^ (z >> 31)) >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (TAU * self.uniform()).cos()
    }
}

/// A vehicle under way.
pub struct World {
    motion: Motion,
    pub time: f64,
    pub position: Position,
    errors: Errors,
    pub bias: [V; 2],
    scale: [V; 2],
    random: Random,
    due: [V; 2],
    q: Q,
    /// Turn of the whole motion, so that seeds begin with any heading.
    yaw: f64,
}

impl World {
    pub fn new(motion: Motion, latitude: f64, errors: Errors, seed: u64) -> World {
        let mut random = Random(seed.wrapping_mul(77_777));
        let mut drawn = |sigma: [f64; 2]| sigma.map(|s| [(); 3].map(|()| s * random.normal()));
        let (bias, scale) = (drawn(errors.bias), drawn(errors.scale));
        let yaw = TAU * random.uniform();
        let mut world = World {
            motion,
            time: 0.0,
            position: Position {
                latitude,
                longitude: 0.4,
                height: 150.0,
            },
            errors,
            bias,
            scale,
            random,
            due: [[0.0; 3]; 2],
            q: [1.0, 0.0, 0.0, 0.0],
            yaw,
        };
        world.q = world.at(0.0).0;
        world
    }

    fn at(&self, t: f64) -> (Q, V) {
        let (angles, v) = (self.motion)(t);
        let turn = about(2, self.yaw);
        (times(turn, attitude(angles)), turned(turn, v))
    }

    pub fn attitude(&self) -> Q {
        self.q
    }

    pub fn velocity(&self) -> V {
        self.at(self.time).1
    }

    /// True heading of the x axis.
    pub fn heading(&self) -> f64 {
        let [x, y, _] = turned(self.q, [1.0, 0.0, 0.0]);
        y.atan2(x)
    }

    pub fn sample(&mut self) -> Counts {
        let dt = SAMPLE_S;
        let (t, p) = (self.time, self.position);
        let (q1, v1) = self.at(t + dt);
        let (q_mid, v) = self.at(t + 0.5 * dt);
        let v0 = self.at(t).1;
        let (sin, cos) = p.latitude.sin_cos();
        let (a, e2) = (6_378_137.0, 6.694_379_990_14e-3);
        let w2 = 1.0 - e2 * sin * sin;
        let (m, n) = (
            a * (1.0 - e2) / w2.powf(1.5) + p.height,
            a / w2.sqrt() + p.height,
        );
        let g = 9.780_325_335_9 * (1.0 + 0.001_931_852_652_41 * sin * sin) / w2.sqrt()
            * (1.0
                - 2.0 * p.height / a
                    * (1.0 + 1.0 / 298.257 + 0.003_449_8 - 2.0 / 298.257 * sin * sin));
        let ie = [EARTH * cos, 0.0, -EARTH * sin];
        let en = [v[1] / n, -v[0] / m, -v[1] / n * sin / cos];
        let omega: V = core::array::from_fn(|i| ie[i] + en[i]);
        let twice: V = core::array::from_fn(|i| 2.0 * ie[i] + en[i]);
        let coriolis = [
            twice[1] * v[2] - twice[2] * v[1],
            twice[2] * v[0] - twice[0] * v[2],
            twice[0] * v[1] - twice[1] * v[0],
        ];
        let mut force: V = core::array::from_fn(|i| (v1[i] - v0[i]) / dt + coriolis[i]);
        force[2] -= g;
        let size = omega.iter().map(|x| x * x).sum::<f64>().sqrt();
        let mut frame = [(0.5 * size * dt).cos(), 0.0, 0.0, 0.0];
        for i in 0..3 {
            frame[i + 1] = (0.5 * size * dt).sin() * omega[i] / size;
        }
        let angle = log(times(back(self.q), times(frame, q1)));
        let push = turned(back(q_mid), force).map(|f| f * dt);
        self.q = q1;
        self.time = t + dt;
        self.position = Position {
            latitude: p.latitude + v[0] / m * dt,
            longitude: p.longitude + v[1] / (n * cos) * dt,
            height: p.height - v[2] * dt,
        };
        self.counts([angle, push])
    }

    fn counts(&mut self, truth: [V; 2]) -> Counts {
        let lsb = [LSB.rad, LSB.mps];
        let mut whole = |k: usize| {
            core::array::from_fn(|i| {
                let wrong = self.bias[k][i] * SAMPLE_S
                    + self.scale[k][i] * truth[k][i]
                    + self.errors.noise[k] * SAMPLE_S.sqrt() * self.random.normal();
                self.due[k][i] += (truth[k][i] + wrong) / lsb[k];
                let count = self.due[k][i].round();
                self.due[k][i] -= count;
                count as i32
            })
        };
        Counts {
            dtheta: whole(0),
            dv: whole(1),
        }
    }

    /// The receiver's fix, valid now.
    pub fn fix(&mut self) -> Fix {
        let v = self.velocity();
        let [level, down, place] = self.errors.receiver;
        let mut noisy = |v: f64, sigma: f64| v + sigma * self.random.normal();
        let velocity = [noisy(v[0], level), noisy(v[1], level), noisy(v[2], down)];
        let off = [noisy(0.0, place), noisy(0.0, place), noisy(0.0, place)];
        let [h, d, p] = self.errors.receiver.map(|sigma| sigma as f32);
        Fix {
            position: self.position.displaced(off),
            velocity,
            sigmas: [p, p, p, h, h, d],
            time_ms: (self.time * 1e3).round() as u32,
            ..Fix::EMPTY
        }
    }
}

/// A smooth step from 0 to 1 between two times, by a third of a turn of a cosine.
fn step(t: f64, from: f64, to: f64) -> f64 {
    let x = ((t - from) / (to - from)).clamp(0.0, 1.0);
    0.5 - 0.5 * (PI * x).cos()
}

/// The integral of [`step`].
fn ramp(t: f64, from: f64, to: f64) -> f64 {
    let length = to - from;
    let x = ((t - from) / length).clamp(0.0, 1.0);
    length * (0.5 * x - 0.5 / PI * (PI * x).sin()) + (t - to).max(0.0)
}

/// Along its own axis, with this yaw and speed.
fn along(yaw: f64, speed: f64, tilt: [f64; 2]) -> (V, V) {
    let (sin, cos) = yaw.sin_cos();
    ([yaw, tilt[0], tilt[1]], [speed * cos, speed * sin, 0.0])
}

/// A car: 20 s at rest, off to 12 m/s, a turn to the right every 25 s, a stop at 140 s.
pub fn car(t: f64) -> (V, V) {
    let speed =
        12.0 * step(t, 20.0, 28.0) - 12.0 * step(t, 140.0, 147.0) + 15.0 * step(t, 160.0, 170.0);
    let yaw = (0..8).map(|k| {
        let from = 35.0 + 25.0 * f64::from(k);
        let way = if k % 3 == 2 { -1.0 } else { 1.0 };
        if (140.0..165.0).contains(&from) {
            0.0
        } else {
            way * 1.4 * step(t, from, from + 6.0)
        }
    });
    let bump = 0.004 * (1.3 * t).sin() * (speed / 12.0);
    along(yaw.sum(), speed, [0.02 + bump, -0.03])
}

/// As [`car`], but it reverses out first, in a curve.
pub fn reversing(t: f64) -> (V, V) {
    let speed = -2.5 * step(t, 15.0, 18.0) + 2.5 * step(t, 24.0, 27.0);
    if t < 30.0 {
        return along(0.8 * step(t, 18.0, 25.0), speed, [0.0, 0.0]);
    }
    let ([yaw, pitch, roll], [vn, ve, vd]) = car(t - 10.0);
    let (sin, cos) = 0.8_f64.sin_cos();
    let ease = step(t, 30.0, 31.0);
    (
        [yaw + 0.8, pitch * ease, roll * ease],
        [vn * cos - ve * sin, vn * sin + ve * cos, vd],
    )
}

/// Straight on with a constant speed.
pub fn straight(_: f64) -> (V, V) {
    along(0.3, 25.0, [0.01, 0.0])
}

/// A ship of 6 m/s in waves: roll 8 deg, pitch 3 deg, heave and sway, a turn by 70 deg every 80 s.
pub fn ship(t: f64) -> (V, V) {
    let turns = (0..10).map(|k| {
        let from = 20.0 + 80.0 * f64::from(k);
        let way = if k % 2 == 0 { 1.2 } else { -1.2 };
        way * step(t, from, from + 30.0)
    });
    let yaw = turns.sum::<f64>() + 0.03 * (0.31 * t).sin();
    let (sin, cos) = yaw.sin_cos();
    let sway = 0.4 * (0.63 * t + 0.5).sin();
    let v = [
        6.0 * cos - sway * sin,
        6.0 * sin + sway * cos,
        0.6 * (0.7 * t).sin(),
    ];
    (
        [yaw, 0.05 * (0.7 * t + 1.0).sin(), 0.14 * (0.63 * t).sin()],
        v,
    )
}

/// An aircraft of 70 m/s that banks by 35 deg from the start and then flies curves.
pub fn aircraft(t: f64) -> (V, V) {
    let (speed, g) = (70.0, 9.8);
    // bank: 35 deg for 25 s, level for 15 s, the other way for 25 s, and again
    let parts = [
        (35.0_f64, -10.0, 25.0),
        (-35.0, 40.0, 65.0),
        (35.0, 80.0, 105.0),
        (-35.0, 120.0, 145.0),
    ];
    let (mut roll, mut yaw) = (0.0, 0.0);
    for (bank, from, to) in parts {
        let share = step(t, from, from + 4.0) - step(t, to, to + 4.0);
        roll += bank.to_radians() * share;
        let rate = g * bank.to_radians().tan() / speed;
        yaw += rate * (ramp(t, from, from + 4.0) - ramp(t, to, to + 4.0));
    }
    let (sin, cos) = yaw.sin_cos();
    let climb = -3.0 * (0.05 * t).sin();
    ([yaw, 0.04, roll], [speed * cos, speed * sin, climb])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ramp_is_the_integral_of_step() {
        let (mut sum, dt) = (0.0, 1e-3);
        for k in 0..20_000 {
            let t = f64::from(k) * dt;
            assert!((ramp(t, 3.0, 9.0) - sum).abs() < 1e-2);
            sum += step(t, 3.0, 9.0) * dt;
        }
    }
}
