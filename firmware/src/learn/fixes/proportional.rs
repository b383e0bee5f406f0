//! Errors in proportion to the motion: scale factors, and the gyros' g-sensitivity.
//!
//! The hypotheses have no states for them. They make an error when the vehicle turns or gains
//! velocity, and take it back when it turns back. So their variance is that of a constant times the
//! angle or the velocity `s` since some time ago, about or along each axis:
//!
//! ```text
//! s(k) = exp(-t / T) s(k-1) + change         variance(k) = sigma^2 s(k)^2
//! ```
//!
//! What the variance grows beyond the largest before is noise for the hypotheses; the largest is
//! forgotten at the same pace. For a turn that goes on this is the noise of a constant that is
//! drawn again each `T` (first-order Gauss-Markov).
//!
//! The larger growth of two memories counts. The long one is for steady turns, whose error passes
//! for a bias and then ends with them. The short one is for a turn back: the fixes have corrected
//! what the first turn did, so that the way back does it again. To swing to and fro faster than the
//! fixes correct costs little. A vehicle that stands or goes straight on adds nothing.
//!
//! **Misalignments of the gyros** are no such noise. A turn about one axis by a misaligned gyro
//! turns the attitude about the others by `C(angle) m - C(0) m`: the attitude is off by a constant
//! `m` in the vehicle's axes, however long it goes on turning. Of this the tilt passes for a bias
//! of the accelerometers, and the heading is what the sensors show, which is not the vehicle's.
//! Misalignments of the accelerometers show a gain of velocity across the real one.

use crate::learn::bank::Sizes;
use crate::nav::State;
use crate::nav::vector::{Q, V, V32, add, narrow, product, scale};

/// The times `T`, s (assumed): in which fixes correct an attitude, and of the longest turns.
const MEMORIES_S: [f32; 2] = [15.0, 150.0];

/// One kind of motion: an angle or a velocity, about or along north, east, down.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    /// Sum with each memory, and its largest square about or along each axis.
    sums: [(V32, V32); 2],
}

impl Sum {
    /// Growth of the squares beyond the largest.
    fn adds(&mut self, change: V32, time: f32) -> V32 {
        let mut most = [0.0; 3];
        for ((sum, largest), memory) in self.sums.iter_mut().zip(MEMORIES_S) {
            let keep = memory / (memory + time);
            *sum = add(scale(*sum, keep), change);
            *largest = scale(*largest, keep * keep);
            for ((sum, largest), most) in sum.iter().zip(largest).zip(&mut most) {
                let grown = sum * sum - *largest;
                if grown > 0.0 && grown.is_finite() {
                    *largest += grown;
                    *most = grown.max(*most);
                }
            }
        }
        most
    }
}

/// What the variances of attitude (rad2) and velocity (m2/s2) grow by, about and along north, east,
/// down.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Growth {
    /// Of the attitude about each, by g-sensitivity.
    pub by_force: f32,
    /// Of the attitude, by scale factors.
    pub turn: V32,
    /// Of the velocity, by scale factors and misalignments.
    pub gain: V32,
}

/// The motion of the navigator, as far as such errors follow from it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Proportional {
    /// Attitude and velocity at the last call.
    from: Option<(Q, V)>,
    turn: Sum,
    gain: Sum,
}

impl Proportional {
    /// The navigator has been set to this state: that was no motion.
    pub fn set(&mut self, state: &State) {
        self.from = Some((state.q_bn, state.velocity));
    }

    /// The navigator has moved to this state in `time` seconds. The result is what the variances of
    /// attitude (rad2) and velocity (m2/s2) grow by, about and along north, east, down.
    pub fn moves(&mut self, state: &State, time: f32, of: &Sizes) -> Growth {
        let before = self.from.replace((state.q_bn, state.velocity));
        let Some((q, velocity)) = before else {
            return Growth::default();
        };
        let [w, x, y, z] = q;
        let [c, turn @ ..] = product(state.q_bn, [w, -x, -y, -z]);
        // twice the sine of half the angle, which is 4 % less than an angle of 1 rad
        let turn = scale(narrow(turn), if c < 0.0 { -2.0 } else { 2.0 });
        let turn = self.turn.adds(turn, time);
        let gain = narrow(add(state.velocity, scale(velocity, -1.0)));
        let gain = self.gain.adds(gain, time);
        let [gyro, accel] = of.scale.map(|ratio| ratio * ratio);
        // a force along any axis is felt by all gyros
        let all: f32 = gain.iter().sum();
        let by_force = of.g_sensitivity * of.g_sensitivity * all;
        let [_, misalignment] = of.misalignment;
        let across = misalignment * misalignment;
        Growth {
            by_force,
            turn: turn.map(|turn| gyro * turn),
            gain: gain.map(|gain| accel * gain + across * (all - gain)),
        }
    }
}

#[cfg(test)]
mod tests;
