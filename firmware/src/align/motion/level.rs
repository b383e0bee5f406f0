//! Levelling of a moving vehicle.
//!
//! The navigator runs in a frame of any attitude, which the gyros carry on. What it gains in
//! velocity without gravity's share is `S = sum C f dt`. In a level frame that would be
//! `dv - g T down`, with the receiver's change of velocity `dv` over the time `T`. So `S` points up
//! to an angle of `|dv| / (g T)`. Its direction depends on the azimuth, as the matching knows. But
//! the angle must be small: a vehicle that accelerates has to be watched until `T` is long enough,
//! and one that circles until its velocity comes back. The gyros' bias limits `T`.

use super::UP;
use super::filter::STANDS_OUT;
use crate::align::Sensors;
use crate::fix::Fix;
use crate::nav;
use crate::nav::earth::Local;
use crate::nav::vector::{Q, V, add, cross, dot, product, rotated, scale};

/// Largest standard deviation of the tilt with which the matching begins, rad, after so many
/// seconds. At first it is better to wait.
const ENOUGH: [(f32, f32); 3] = [(0.0, 0.05), (5.0, 0.1), (15.0, 0.2)];
/// Largest tilt by the gyros' drift, rad, and longest time, s: then other data are needed.
const DRIFT: f32 = 0.1;
const LONGEST_S: f32 = 90.0;
/// Least standard deviation of the tilt, rad: vibration, and what the receiver does not show.
const LEAST: f32 = 2e-3;
/// How far the force may be from what it must be, in standard deviations, and m/s2 that the
/// receiver's times may cause.
const GATE: f32 = 5.0;
const FORCE: f32 = 0.5;

/// A levelling in progress.
#[derive(Debug, Clone, Copy, Default)]
pub struct Level {
    time: f32,
    /// `sum C f dt`, the navigator's frame.
    force: V,
    /// The receiver's velocity at the beginning, and its standard deviations, horizontal and down.
    velocity: V,
    sigma: [f32; 2],
}

/// A level attitude.
#[derive(Debug, Clone, Copy)]
pub struct Levelled {
    /// Rotation from the navigator's frame to a level one.
    pub turn: Q,
    /// The receiver's mean acceleration by gravity, north and east: the tilt that is left.
    pub slope: [f32; 2],
    /// Variance of the tilt by motion that the receiver does not measure, rad^2.
    pub tilt: f32,
    /// Gravity, m/s2.
    pub gravity: f32,
    /// Time of levelling, s.
    pub time: f32,
}

impl Level {
    /// Begins at a fix with a horizontal velocity.
    pub fn begin(fix: &Fix) -> Level {
        Level {
            velocity: fix.velocity,
            sigma: sigmas(fix),
            ..Level::default()
        }
    }

    /// Adds the gain of a navigator that was at rest, in `time` seconds.
    pub fn add(&mut self, state: &nav::State, time: f32) {
        let here = Local::at(state.position.latitude, state.position.height);
        let down = here.g * f64::from(time);
        self.force = add(self.force, add(state.velocity, scale(UP, down)));
        self.time += time;
    }

    /// The gyros have drifted too far.
    pub fn is_useless(&self, sensors: &Sensors) -> bool {
        let useful = 0.5 * sensors.bias[0] * self.time < DRIFT && self.time < LONGEST_S;
        !useful // a NaN is useless too
    }

    /// The level attitude when it is known well enough at this fix.
    pub fn solve(&self, fix: &Fix, sensors: &Sensors) -> Option<Levelled> {
        let size = libm::sqrt(dot(self.force, self.force));
        if !(self.time > 0.5 && size > 1.0) {
            return None;
        }
        let here = Local::at(fix.position.latitude, 0.0);
        let gravity = here.g as f32;
        let per = 1.0 / self.time;
        let [n, e, d] = add(fix.velocity, scale(self.velocity, -1.0)).map(|v| v as f32 * per);
        let [level, down] = {
            let now = sigmas(fix);
            [0, 1].map(|i| libm::hypotf(now[i], self.sigma[i]) * per)
        };
        // the size of the force must be that of gravity and the receiver's acceleration
        let expected = libm::sqrtf(n * n + e * e + (gravity - d) * (gravity - d));
        let doubt = if down.is_finite() {
            libm::hypotf(sensors.bias[1], libm::hypotf(level, down))
        } else {
            gravity / GATE * 0.5
        };
        let plausible = (size as f32 * per - expected).abs() <= FORCE + GATE * doubt;
        if !plausible {
            return None;
        }
        let blur = level / gravity;
        let noise = sensors.noise[1] * libm::sqrtf(per) / gravity;
        let tilt = blur * blur + noise * noise + LEAST * LEAST;
        // noise alone shows no direction
        let (lean, noisy) = (libm::hypotf(n, e), level * core::f32::consts::SQRT_2);
        let slope = if lean > STANDS_OUT * level {
            [n, e]
        } else {
            [0.0; 2]
        };
        let slope = slope.map(|part| part / gravity);
        let drift = 0.5 * sensors.bias[0] * self.time;
        let known = libm::hypotf(libm::sqrtf(tilt), lean.max(noisy) / gravity);
        let limit = ENOUGH.iter().rev().find(|(after, _)| self.time >= *after);
        if !(known <= limit.map_or(0.0, |(_, limit)| *limit) && drift <= DRIFT) {
            return None;
        }
        Some(Levelled {
            turn: shortest(scale(self.force, 1.0 / size)),
            slope,
            tilt,
            gravity,
            time: self.time,
        })
    }
}

/// The shortest rotation that turns a unit vector up.
pub fn shortest(v: V) -> Q {
    if 1.0 + dot(v, UP) < 1e-3 {
        // nearly down: first half a turn about another axis
        let half = [0.0, 1.0, 0.0, 0.0];
        return product(from_above(rotated(half, v)), half);
    }
    from_above(v)
}

/// Rotation from a direction that is not down.
fn from_above(v: V) -> Q {
    let w = 1.0 + dot(v, UP);
    let [x, y, z] = cross(v, UP);
    let k = 1.0 / libm::sqrt(w * w + x * x + y * y + z * z);
    [w * k, x * k, y * k, z * k]
}

/// Standard deviations of a fix's velocity, horizontal and down.
fn sigmas(fix: &Fix) -> [f32; 2] {
    let [.., n, e, d] = fix.sigmas;
    [n.max(e), d]
}
