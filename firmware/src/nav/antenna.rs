//! Innovation of a fix at the antenna, and how it depends on lever arm and age.
//!
//! With lever arm `l` in body axes and age `a`, a fix is compared with
//!
//! ```text
//! h_p(l, a) = p(t - a) + C(t - a) l
//! h_v(l, a) = v(t - a) + C(t - a) (omega(t - a) x l)
//! ```
//!
//! The last second is known here ([`super::past`]), where [`Navigator::innovation`] goes back with
//! the last piece's acceleration and rate. The derivative by the age is a secant as wide as the age
//! is uncertain, so that it holds for all ages that are likely.

use super::history::PastState;
use super::vector::{V32, add, cross, dot, narrow, scale};
use super::{Navigator, State};
use crate::fix::{Fix, OBSERVATIONS};

/// Number of errors of an antenna: the lever arm along three axes (m), and the age (s).
pub const ANTENNA: usize = 4;
/// Least width of the secant to either side, s: a link of the history.
const LEAST_S: f32 = 0.04;
/// Largest width of the secant to either side, s: the history is not much longer.
const MOST_S: f32 = 0.5;

/// Time over which an acceleration is taken, s.
const SHORT_S: f32 = 0.2;

/// Estimate minus fix, and its derivatives. Rows in the order of [`OBSERVATIONS`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AntennaInnovation {
    /// Estimate minus fix, m and m/s.
    pub z: [f32; OBSERVATIONS],
    /// Derivative by the lever arm (body axes, the first three columns) and by the age.
    pub by: [[f32; ANTENNA]; OBSERVATIONS],
    /// Variance of the second-order term in the age, which the secant leaves out.
    pub nonlinearity: [f32; OBSERVATIONS],
}

/// Motion some time ago.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PastMotion {
    /// Velocity over ground, north, east, down, m/s.
    pub velocity: V32,
    /// Its change, m/s2.
    pub acceleration: V32,
    /// Rate, body axes, rad/s.
    pub rate: V32,
    /// Body axes to north, east, down.
    pub c_bn: [V32; 3],
}

/// The antenna before and after the time of a fix: the ends of the secant.
#[derive(Debug, Clone, Copy)]
pub struct Secant {
    earlier: [f32; OBSERVATIONS],
    later: [f32; OBSERVATIONS],
}

impl Navigator {
    /// The lever arm from now on, body axes, m.
    pub fn set_lever_arm(&mut self, arm: [f32; 3]) {
        self.config.lever_arm = arm;
    }

    /// Estimate minus a fix that was valid `age` seconds before the end of the last piece, 0 to 1,
    /// where the age has the standard deviation `sigma`, s.
    #[must_use]
    pub fn antenna_innovation(&self, fix: &Fix, age: f32, sigma: f32) -> AntennaInnovation {
        self.innovation_between(fix, (age, sigma), &self.secant(age, sigma))
    }

    /// The first part of [`Self::innovation`]: the ends of the secant.
    #[must_use]
    #[inline(never)]
    pub fn secant(&self, age: f32, sigma: f32) -> Secant {
        let width = sigma.clamp(LEAST_S, MOST_S);
        let state = self.state();
        let [(_, earlier), (_, later)] =
            [age + width, age - width].map(|age| self.antenna_before(age, &state));
        Secant { earlier, later }
    }

    /// The second part of [`Self::innovation`].
    #[must_use]
    #[inline(never)]
    pub fn innovation_between(
        &self,
        fix: &Fix,
        (age, sigma): (f32, f32),
        secant: &Secant,
    ) -> AntennaInnovation {
        let width = sigma.clamp(LEAST_S, MOST_S);
        let state = self.state();
        let (then, at) = self.antenna_before(age, &state);
        let Secant { earlier, later } = *secant;
        let [position, velocity] = [
            narrow(state.position.ned_from(&fix.position)),
            narrow(add(state.velocity, fix.velocity.map(|v| -v))),
        ];
        let mut innovation = AntennaInnovation {
            z: at,
            by: [[0.0; ANTENNA]; OBSERVATIONS],
            nonlinearity: [0.0; OBSERVATIONS],
        };
        for (z, now) in innovation
            .z
            .iter_mut()
            .zip(position.into_iter().chain(velocity))
        {
            *z += now;
        }
        let c = then.matrix(state.q_bn);
        let axes: [V32; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let columns = axes.map(|axis| turned(&c, axis, cross(then.rate, axis)));
        let wider = sigma / width;
        for (k, (row, nonlinearity)) in innovation
            .by
            .iter_mut()
            .zip(&mut innovation.nonlinearity)
            .enumerate()
        {
            let of = |column: &[f32; OBSERVATIONS]| column.get(k).copied().unwrap_or(0.0);
            let [x, y, z] = columns.each_ref().map(of);
            let [at, earlier, later] = [&at, &earlier, &later].map(of);
            *row = [x, y, z, (earlier - later) / (2.0 * width)];
            // For a normal age the second-order term h'' (a^2 - sigma^2) / 2 has twice the square
            // of h'' sigma^2 / 2 as its variance.
            let second_order = (0.5 * (earlier + later) - at) * wider * wider;
            *nonlinearity = 2.0 * second_order * second_order;
        }
        innovation
    }

    /// The motion `age` seconds before the end of the last piece, 0 to 1.
    #[must_use]
    pub fn motion_before(&self, age: f32) -> PastMotion {
        let now = self.state();
        let velocity = narrow(now.velocity);
        let [then, earlier] = [age, age + SHORT_S].map(|age| self.history.before(age, velocity));
        let change = add(then.velocity, scale(earlier.velocity, -1.0));
        PastMotion {
            velocity: add(velocity, then.velocity),
            acceleration: scale(change, 1.0 / SHORT_S),
            rate: then.rate,
            c_bn: then.matrix(now.q_bn),
        }
    }

    /// Position and velocity of the antenna `age` seconds ago, as differences from those of the
    /// sensors now.
    fn antenna_before(&self, age: f32, now: &State) -> (PastState, [f32; OBSERVATIONS]) {
        let then = self.history.before(age, narrow(now.velocity));
        let arm = self.config.lever_arm;
        let mut of = turned(&then.matrix(now.q_bn), arm, cross(then.rate, arm));
        let moved = then.position.into_iter().chain(then.velocity);
        for (of, moved) in of.iter_mut().zip(moved) {
            *of += moved;
        }
        (then, of)
    }
}

impl AntennaInnovation {
    /// The age of this fix is known, so that nothing depends on it.
    pub fn age_is_known(&mut self) {
        for row in &mut self.by {
            let [.., age] = row;
            *age = 0.0;
        }
        self.nonlinearity = [0.0; OBSERVATIONS];
    }
}

/// Position and motion in body axes as observations.
fn turned(c: &[V32; 3], position: V32, motion: V32) -> [f32; OBSERVATIONS] {
    let [a, b, d] = c.map(|row| dot(row, position));
    let [e, f, g] = c.map(|row| dot(row, motion));
    [a, b, d, e, f, g]
}
