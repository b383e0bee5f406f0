//! A device in the hand of somebody who walks: steps, pauses, turns on the spot, and swings of the
//! attitude that are independent of the path.
//!
//! The steps follow H. Bachmann and W. Ammann ("Vibrations in structures: induced by man and
//! machines", IABSE, 1987), who give walking 1.6 to 2.4 steps a second, and a force on the ground
//! with harmonics of the step up and down and ahead, and of half its frequency to the sides. Force
//! by weight is the acceleration of the body's centre in g, which is taken for that of the hand
//! (assumed).

use super::attitude::Turned;
use super::course::{Course, To};
use super::dual::Dual;
use super::profile::Smooth;
use super::waves::{GRAVITY, Waves};
use super::{Instant, Motion};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Accelerations by the one up and down at the frequency of the steps: that at twice the frequency,
/// ahead at the frequency, and to the sides at half of it (assumed, of the size in the source).
const SECOND: f64 = 0.25;
const AHEAD: f64 = 0.5;
const SIDES: f64 = 0.25;
/// Pitch with each step, and roll with each pair, rad (assumed).
const NOD: f64 = 0.02;
/// Time in which the device is picked up after a standstill, s (assumed).
const PICK_UP_S: f64 = 3.0;

/// A walking survey with a device in the hand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HandHeld {
    /// Mean walking speed, m/s, 0.3 to 2.5. It changes by a fifth.
    pub speed_mps: f64,
    /// Steps a second, 1 to 3.
    pub step_hz: f64,
    /// Amplitude of the vertical acceleration of the steps, g, 0 to 1.
    pub step_g: f64,
    /// Swings of roll and pitch, deg, 1 sigma, 0 to 60; half of it in heading.
    pub swing_deg: f64,
    /// Every 20 to 60 s a pause of 5 to 20 s, in which the hand still swings.
    pub pauses: bool,
}

impl Default for HandHeld {
    /// An easy walk: 1.3 m/s with 1.8 steps a second.
    fn default() -> Self {
        Self {
            speed_mps: 1.3,
            step_hz: 1.8,
            step_g: 0.3,
            swing_deg: 20.0,
            pauses: true,
        }
    }
}

/// The motion of a [`HandHeld`] device.
pub(super) struct Walk {
    course: Course,
    swings: Waves,
    picked_up: f64,
    speed_mps: f64,
    omega: f64,
    acceleration: f64,
    /// Phases of the steps' parts, rad.
    phases: [f64; 4],
}

impl Walk {
    /// Lies still for `standstill` s, then walks, `duration` s in all. Without a standstill it is
    /// in the hand at once.
    pub(super) fn new(
        walk: &HandHeld,
        [standstill, duration]: [f64; 2],
        heading: f64,
        dt: f64,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let lies = standstill > 0.0;
        let mut course = Course::new(0.0, heading, dt);
        if lies {
            course.hold(standstill + PICK_UP_S);
        }
        while course.duration() < duration {
            walk.stretch(&mut course, rng);
        }
        course.cut(duration);
        Self {
            course,
            swings: Waves::of_air(0.0, walk.swing_deg.to_radians(), rng),
            picked_up: if lies { standstill } else { -PICK_UP_S },
            speed_mps: walk.speed_mps,
            omega: TAU * walk.step_hz,
            acceleration: walk.step_g * GRAVITY,
            phases: std::array::from_fn(|_| rng.random_range(0.0..TAU)),
        }
    }
}

impl HandHeld {
    /// Walks on and around corners, and then perhaps pauses.
    fn stretch(&self, course: &mut Course, rng: &mut ChaCha8Rng) {
        let end = course.duration() + rng.random_range(20.0..60.0);
        while course.duration() < end {
            course.go(&To {
                time: rng.random_range(1.5..3.0),
                speed: Some(self.speed_mps * rng.random_range(0.8..1.2)),
                climb: Some(rng.random_range(-0.05..0.05)),
                ..To::default()
            });
            course.hold(rng.random_range(3.0..15.0));
            let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            let angle = side * rng.random_range(0.05 * PI..0.8 * PI);
            course.turn(angle, rng.random_range(0.3..1.0), 1.0);
        }
        if self.pauses {
            course.change(0.0, rng.random_range(1.0..2.0));
            course.hold(rng.random_range(5.0..20.0));
        }
    }
}

impl Motion for Walk {
    fn duration(&self) -> f64 {
        self.course.duration()
    }

    fn begin(&mut self, t: f64, _second: bool) {
        self.course.advance(t);
    }

    fn at(&self, t: f64, _node: usize) -> Instant {
        let now = self.course.at(t);
        let speed = now.speed.dual();
        // steps of a slower walk are smaller
        let stride = speed * (1.0 / self.speed_mps);
        let wave = |harmonic: f64, phase: f64| {
            let omega = harmonic * self.omega;
            Dual::new(omega * t + phase, omega).sin_cos().0 * stride
        };
        let [first, second, ahead, sides] = self.phases;
        // the velocity of an acceleration a at omega has the amplitude a / omega
        let size = self.acceleration / self.omega;
        let bob = wave(1.0, first) * size + wave(2.0, second) * (0.5 * SECOND * size);
        let surge = wave(1.0, ahead) * (AHEAD * size);
        let sway = wave(0.5, sides) * (2.0 * SIDES * size);
        let (s, c) = now.heading.dual().sin_cos();
        let (up, level) = now.climb.dual().sin_cos();
        let along = speed * level + surge;
        let v = [along * c - sway * s, along * s + sway * c, bob - speed * up];
        let u = (t - self.picked_up).clamp(0.0, PICK_UP_S);
        let in_hand = Smooth::between(0.0, 1.0, u, PICK_UP_S).dual();
        let [.., roll, pitch, yaw] = self.swings.at(t).map(|swing| swing * in_hand);
        let attitude = Turned::level()
            .yaw(now.heading.dual() + yaw)
            .pitch(pitch + wave(1.0, first) * NOD)
            .roll(roll + wave(0.5, sides) * NOD);
        Instant::of(v, &attitude)
    }
}
