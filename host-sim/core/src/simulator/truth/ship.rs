//! A ship in waves: it never stands. It moves in six degrees of freedom, turns slowly, and a
//! current carries it, so that its course over ground is not its heading.

use super::attitude::Turned;
use super::course::Course;
use super::dual::Dual;
use super::vibration::Shaker;
use super::waves::{GRAVITY, Sea, Waves};
use super::{Instant, Motion};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Hull: length in m, natural period of the roll in s, damping ratio of the roll (assumed: a small
/// vessel).
const LENGTH: f64 = 25.0;
const ROLL_PERIOD: f64 = 9.0;
const ROLL_DAMPING: f64 = 0.15;
/// The bow points into a turn: heading ahead of the path by so many seconds of the turn rate
/// (assumed: 6 deg at 1 deg/s).
const DRIFT_S: f64 = 6.0;
/// Share of the lateral acceleration by which the hull heels to the outside (assumed).
const HEEL: f64 = 0.4;
/// Share of a car's vibration that the engine causes (assumed).
const ENGINE: f64 = 0.1;

/// A ship.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ship {
    /// Significant height of the waves, m, 0 to 15.
    pub wave_height_m: f64,
    /// Period at the peak of the spectrum, s, 3 to 20.
    pub wave_period_s: f64,
    /// Mean speed through the water, m/s, 0 to 15. It changes by a quarter.
    pub speed_mps: f64,
    /// Speed of the current, m/s, 0 to 5. Its direction is random.
    pub current_mps: f64,
    /// The ship turns every one or two minutes. Without turns it keeps its heading and speed.
    pub turns: bool,
}

impl Default for Ship {
    /// A small vessel at 6 m/s in a moderate sea (sea state 4) and a current of 1 kn.
    fn default() -> Self {
        Self {
            wave_height_m: 1.5,
            wave_period_s: 7.0,
            speed_mps: 6.0,
            current_mps: 0.5,
            turns: true,
        }
    }
}

/// The motion of a [`Ship`].
pub(super) struct Hull {
    course: Course,
    waves: Waves,
    current: [f64; 2],
    shaker: Shaker,
}

impl Hull {
    /// Sails for `duration` s.
    pub(super) fn new(
        ship: &Ship,
        duration: f64,
        [heading, vibration]: [f64; 2],
        dt: f64,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let mut course = Course::new(ship.speed_mps, heading, dt);
        while course.duration() < duration {
            if !ship.turns {
                course.hold(duration);
                continue;
            }
            course.hold(rng.random_range(30.0..90.0));
            let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            let angle = side * rng.random_range(0.5..2.2);
            course.turn(angle, rng.random_range(0.012..0.035), 8.0);
            course.change(ship.speed_mps * rng.random_range(0.75..1.25), 20.0);
        }
        course.cut(duration);
        let sea = Sea {
            height: ship.wave_height_m,
            period: ship.wave_period_s,
            roll_period: ROLL_PERIOD,
            roll_damping: ROLL_DAMPING,
            length: LENGTH,
        };
        let waves = Waves::of_sea(&sea, rng);
        let (east, north) = rng.random_range(0.0..TAU).sin_cos();
        Self {
            course,
            waves,
            current: [north, east].map(|share| share * ship.current_mps),
            shaker: Shaker::new(rng, ENGINE * vibration, dt),
        }
    }
}

impl Motion for Hull {
    fn duration(&self) -> f64 {
        self.course.duration()
    }

    fn begin(&mut self, t: f64, second: bool) {
        self.course.advance(t);
        self.shaker.begin(t, second);
    }

    fn at(&self, t: f64, node: usize) -> Instant {
        let now = self.course.at(t);
        let [surge, sway, heave, roll, pitch, yaw] = self.waves.at(t);
        let shake = self.shaker.at(node);
        let angle = |i: usize| Dual::new(shake.angle[i], shake.rate[i]);
        let turn = now.heading.dual_rate();
        let speed = now.speed.dual();
        let (s, c) = now.heading.dual().sin_cos();
        let ahead = speed + surge;
        let [north, east] = self.current;
        let v = [
            ahead * c - sway * s + north.into(),
            ahead * s + sway * c + east.into(),
            heave + Dual::new(shake.heave[0], shake.heave[1]),
        ];
        let attitude = Turned::level()
            .yaw(now.heading.dual() + turn * DRIFT_S + yaw + angle(2))
            .pitch(pitch + angle(1))
            .roll(roll + angle(0) - speed * turn * (HEEL / GRAVITY));
        Instant::of(v, &attitude)
    }
}
