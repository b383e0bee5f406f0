//! What the speed of the wheels shows: that the vehicle stands, and its velocity in its own axes.
//!
//! The axle that does not steer moves along its wheels, not to the side and not up. With the
//! sensors' rate `w` and the lever arm `l` to that axle, and forward, right and down as unit
//! vectors `u` in the sensors' axes:
//!
//! ```text
//! p = C_est' v_est + w x l
//! z = u p - (speed (1 + scale), 0, 0)        by = (v x C u) phi + (C u) x_v
//! ```
//!
//! Scale and forward axis are constants of the vehicle, which fixes show: the scale within tyres,
//! the axis within the mounting. Each is a filter of its own, as sure as errors allow that last for
//! seconds, and no surer than load and slip leave it. Before they are known, and while fixes come,
//! the hypotheses learn nothing from wheels: fixes know better. Without fixes wheels hold the
//! velocity, so that the navigator and its hypotheses stay where they are. They never judge a
//! rehearsal: their velocity to the north depends on the attitude that is on trial.
//!
//! Slow wheels may be counted forward in reverse: then only their speed counts, whatever its sign.
//! A wheel that slips or locks is refused as an outlier and never believed, however often it comes.

use super::FixLearner;
use crate::learn::bank::Row;
use crate::learn::prior::NAV;
use crate::learn::settings::Wheels as Mounted;
use crate::nav;
use crate::nav::vector::{V32, add, cross, dot, scale};
use crate::wheels::WheelSpeed;

/// Time between two observations, s: more would know the same.
const EVERY_S: f32 = 1.0;
/// Time without a fix from which they teach, s.
const ALONE_S: f32 = 2.0;
/// Greatest age of a speed, s.
const OLDEST_S: f32 = 1.0;
/// Least speed at which scale and forward axis show, and the sign of a speed is believed: by then
/// the navigator's own velocity contradicts a wrong one. m/s.
const LEAST_MPS: f32 = 3.0;
/// Errors of wheels and fixes last for so many observations (assumed).
const LASTING: f32 = 10.0;
/// Standard deviation of the forward axis before it is known, rad (assumed).
const AXIS: f32 = 0.05;
/// Least standard deviations of scale and forward axis: temperature of the tyres, load (assumed).
const FLOOR: [f32; 3] = [1e-3, 2e-3, 3e-3];
/// Standard deviations up to which they are known well enough.
const KNOWN: [f32; 3] = [0.01, 0.01, 0.01];
/// Squared distance beyond which an observation of them is refused, in variances.
const SQUARED_RATIO: f32 = 25.0;
/// Standard deviation of the velocity to the side and up, m/s, by the road (assumed).
const ROAD_MPS: f32 = 0.05;
/// Slip along the wheels and to their side, per m/s2 (assumed: tyres on a dry road).
const SLIP: f32 = 0.005;

/// A constant and its variance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Constant {
    value: f32,
    variance: f32,
}

impl Constant {
    /// Takes an observation with this variance.
    fn observe(&mut self, z: f32, variance: f32, floor: f32) {
        let (off, sum) = (z - self.value, self.variance + variance);
        if off * off <= SQUARED_RATIO * sum {
            let gain = self.variance / sum;
            self.value += gain * off;
            self.variance = (self.variance - gain * self.variance).max(floor * floor);
        }
    }
}

/// What is known of the wheels.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Wheels {
    /// Error of the scale as a ratio; turn of the forward axis to the right and down, rad. Variance
    /// 0: nothing has been observed.
    constants: [Constant; 3],
    /// Number of the sample of the last observation.
    last: Option<u32>,
}

/// The axle's velocity by the navigator and by its wheels.
#[derive(Debug, Clone, Copy)]
struct Compared {
    /// Forward, right, down, m/s, by the navigator.
    moves: V32,
    /// By the wheels, m/s.
    rolls: f32,
    /// Forward, right and down in north, east, down.
    axes: [V32; 3],
    /// The navigator's velocity, m/s.
    velocity: V32,
    /// Rate about down, rad/s, and change of the speed, m/s2.
    turns: f32,
    speeds_up: f32,
}

impl Wheels {
    /// What wheels and navigator observe of the constants together. `doubt`: standard deviations of
    /// the navigator's velocity and attitude.
    fn calibrate(&mut self, of: &Compared, mounted: &Mounted, [velocity, attitude]: [f32; 2]) {
        if self.constants == [Constant::default(); 3] {
            let sigmas = [mounted.scale, AXIS, AXIS];
            for ((constant, sigma), floor) in self.constants.iter_mut().zip(sigmas).zip(FLOOR) {
                constant.variance = sigma.max(floor) * sigma.max(floor);
            }
        }
        let [forward, right, down] = of.moves;
        if of.rolls.abs() < LEAST_MPS || forward * of.rolls <= 0.0 {
            return;
        }
        let [along, side] = of.variance(mounted);
        let own = velocity * velocity;
        let across = own + side + attitude * attitude * forward * forward;
        let observed = [
            (
                forward / of.rolls - 1.0,
                (own + along) / (of.rolls * of.rolls),
            ),
            (right / forward, across / (forward * forward)),
            (down / forward, across / (forward * forward)),
        ];
        for ((constant, (z, variance)), floor) in self.constants.iter_mut().zip(observed).zip(FLOOR)
        {
            constant.observe(z, LASTING * variance, floor);
        }
    }

    fn are_known(&self) -> bool {
        let mut constants = self.constants.iter().zip(KNOWN);
        constants.all(|(of, known)| of.variance > 0.0 && of.variance <= known * known)
    }

    /// The observations: forward, right, down.
    fn rows(&self, of: &Compared, mounted: &Mounted) -> [Row; 3] {
        let [size, right, down] = self.constants;
        let [x, y, z] = of.axes;
        let axes = [
            x,
            add(y, scale(x, -right.value)),
            add(z, scale(x, -down.value)),
        ];
        let [forward, ..] = of.moves;
        let [to_right, to_down] = [(right, of.moves[1]), (down, of.moves[2])]
            .map(|(turn, moves)| moves - turn.value * forward);
        let [along, side] = of.variance(mounted);
        let (rolls, along) = if of.rolls.abs() < LEAST_MPS {
            (0.0, along + of.rolls * of.rolls)
        } else {
            (of.rolls * (1.0 + size.value), along)
        };
        let off = [forward - rolls, to_right, to_down];
        let white = [along, side, side];
        core::array::from_fn(|k| {
            let doubt = self.constants[k].variance * of.rolls * of.rolls;
            Row {
                z: off[k],
                by: row(axes[k], of.velocity),
                variance: LASTING * (white[k] + doubt),
            }
        })
    }
}

/// What the navigator's errors add to its velocity along `axis`: north, east, down.
fn row(axis: V32, velocity: V32) -> [f32; NAV] {
    let [a, b, c] = cross(velocity, axis);
    let [d, e, f] = axis;
    [a, b, c, d, e, f, 0.0, 0.0, 0.0]
}

impl Compared {
    /// Variances along the wheels and to their side, (m/s)^2.
    fn variance(&self, mounted: &Mounted) -> [f32; 2] {
        let v = self.rolls;
        let along = SLIP * self.speeds_up * v;
        let side = SLIP * self.turns * v * v;
        [
            mounted.noise * mounted.noise + along * along,
            ROAD_MPS * ROAD_MPS + side * side,
        ]
    }
}

impl FixLearner<'_> {
    /// A speed that arrived after sample `number`.
    #[inline(never)]
    pub(super) fn take_wheel_speed(&mut self, number: u32, reported: &WheelSpeed) -> Option<()> {
        let mounted = self.settings.wheels?;
        let stream = self.samples.stream?;
        if let Some(align) = &mut self.navigation.align {
            align.wheels(reported.speed == 0.0);
        }
        let waited = self.number().wrapping_sub(number) as f32 * stream.period_s as f32;
        let age = f32::from(reported.age_ms) / 1000.0 + mounted.delay + waited;
        let since = self
            .motion
            .wheels
            .last
            .map(|last| number.wrapping_sub(last));
        let soon = since.is_some_and(|n| (n as f32) * (stream.period_s as f32) < EVERY_S);
        // wheels that do not turn may be locked: a rest is what shows a velocity of zero
        let turns = reported.speed != 0.0 && age <= OLDEST_S;
        if soon || !turns || !self.navigation.course.navigates() || !self.interval_is_over() {
            return None;
        }
        self.motion.wheels.last = Some(number);
        if self.take_transition() {
            self.move_means();
            self.memory.antenna.update(&self.memory.scratch.block);
            (self.memory.bank).propagate_covariance(&mut self.memory.scratch);
        }
        let compared = self.compare_wheels(&mounted, reported.speed, age)?;
        let bank = &mut self.memory.bank;
        if self.motion.rests.since_fix_s() < ALONE_S {
            let most =
                |from: usize| (from..from + 3).fold(0.0_f32, |m, i| m.max(bank.error_doubt(i)));
            let doubt = [most(3), most(0)];
            self.motion.wheels.calibrate(&compared, &mounted, doubt);
        } else if self.motion.wheels.are_known() {
            let rows = self.motion.wheels.rows(&compared, &mounted);
            bank.wheels(&rows);
            self.choose();
        }
        Some(())
    }

    /// The axle's velocity by the navigator and by its wheels, `age` seconds ago.
    fn compare_wheels(&self, mounted: &Mounted, speed: f32, age: f32) -> Option<Compared> {
        let navigator = self.navigation.course.navigator()?;
        let nav::PastMotion {
            velocity,
            acceleration,
            rate,
            c_bn,
        } = navigator.motion_before(age);
        let in_ned = |axis: V32| c_bn.map(|row| dot(row, axis));
        let [_, _, down] = mounted.axes?;
        let axes = mounted.axes?.map(in_ned);
        let of_arm = in_ned(cross(rate, mounted.lever_arm));
        let moves = add(velocity, of_arm);
        let turns = dot(rate, down);
        // wheels that steer roll along a wider circle
        let wider = mounted.ahead * turns;
        let rolls = libm::sqrtf((speed * speed - wider * wider).max(0.0));
        Some(Compared {
            moves: axes.map(|axis| dot(axis, moves)),
            rolls: libm::copysignf(rolls, speed),
            axes,
            velocity,
            turns,
            speeds_up: dot(acceleration, axes[0]),
        })
    }
}

#[cfg(test)]
mod tests;
