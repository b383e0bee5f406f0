//! Effect of sensor errors in proportion to what the sensors feel.
//!
//! Scale factors, misalignments and g-sensitivity are constants in the sensor's axes. An error of 1
//! of axis `i` by the rotation or the force along axis `j` turns the attitude about `C e_i` by what
//! was felt along `j`, and the force is then felt in a wrong direction:
//!
//! ```text
//! phi' = C e_i w_j        v' = f x phi        by rotation (gyros)
//! phi' = C e_i f_j        v' = f x phi        by force (gyros)
//!                         v' = -C e_i f_j     by force (accelerometers)
//! ```
//!
//! The force at rest when the navigator began is no cause: what it adds to a sensor's error then
//! passes for a bias.

use super::transition::{ERRORS, Motion};
use super::vector::{V32, add, cross, dot, scale};
use lrnn_nostd::learn::kalman::PROPORTIONAL;

/// Pairs of an axis with an error and an axis that causes it.
pub const PAIRS: usize = 9;

/// Attitude (rad) and velocity (m/s), north, east, down.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Effect {
    pub phi: V32,
    pub velocity: V32,
}

/// Effects over an interval. Pair `3 i + j`: axis `i` has the error, axis `j` causes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProportionalEffects {
    /// Of the gyros by rotation, per 1 rad/s in 1 rad/s.
    pub by_turn: [Effect; PAIRS],
    /// Of the gyros by force, per 1 rad/s in 1 m/s2. The attitude's part, with the other sign, is
    /// that of the accelerometers on the velocity, per 1 m/s2 in 1 m/s2.
    pub by_force: [Effect; PAIRS],
    /// The force at rest, in the sensor's axes, m/s2.
    rest: V32,
    /// Rotation since the last step, rad.
    turn: V32,
}

impl ProportionalEffects {
    /// Nothing yet. `rest`: the force at rest in the sensor's axes, m/s2.
    pub fn new(rest: V32) -> Self {
        Self {
            by_turn: [Effect::default(); PAIRS],
            by_force: [Effect::default(); PAIRS],
            rest,
            turn: [0.0; 3],
        }
    }

    /// The sensor has turned in a piece, rad.
    pub fn turns(&mut self, by: V32) {
        self.turn = add(self.turn, by);
    }

    /// Adds a step: the mean axes over its pieces, the integral of the force and the time.
    #[inline(never)]
    pub fn step(&mut self, step: &Motion) {
        let [n, e, d] = step.c;
        let axes: [V32; 3] = core::array::from_fn(|i| [n[i], e[i], d[i]]);
        let force = axes.map(|axis| dot(axis, step.force));
        let force = add(force, scale(self.rest, -step.time));
        let turn = core::mem::take(&mut self.turn);
        for (effects, felt) in [(&mut self.by_turn, turn), (&mut self.by_force, force)] {
            for (of_axis, axis) in effects.chunks_exact_mut(3).zip(axes) {
                for (effect, felt) in of_axis.iter_mut().zip(felt) {
                    let half = scale(axis, 0.5 * felt);
                    let middle = add(effect.phi, half);
                    effect.phi = add(middle, half);
                    effect.velocity = add(effect.velocity, cross(step.force, middle));
                }
            }
        }
    }

    /// What the sensors feel at rest: rad/s, m/s2. All above is by what they feel beyond it.
    pub fn at_rest(&self) -> [V32; 2] {
        [[0.0; 3], self.rest]
    }

    /// Effects of both maps on the navigator's errors, as
    /// [`lrnn_nostd::learn::kalman::Transition::proportional`], over an interval of `time` s: of
    /// the gyros by rotation, of the accelerometers by force.
    pub fn of_maps(&self, time: f32) -> [[f32; PROPORTIONAL]; ERRORS] {
        let mut rows = [[0.0; PROPORTIONAL]; ERRORS];
        for pair in 0..PAIRS {
            let (Some(turn), Some(force)) = (self.by_turn.get(pair), self.by_force.get(pair))
            else {
                continue;
            };
            let gained = scale(force.phi, -1.0);
            for i in 0..3 {
                rows[i][pair] = turn.phi[i];
                rows[3 + i][pair] = turn.velocity[i];
                rows[6 + i][pair] = 0.5 * time * turn.velocity[i];
                rows[3 + i][PAIRS + pair] = gained[i];
                rows[6 + i][PAIRS + pair] = 0.5 * time * gained[i];
            }
        }
        rows
    }

    /// A new interval begins.
    pub fn clear(&mut self) {
        *self = Self::new(self.rest);
    }
}
