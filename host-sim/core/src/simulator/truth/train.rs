//! A train: long stretches at constant speed, gentle curves with cant between transitions, and
//! stops at stations.
//!
//! In a curve of radius `R` the outer rail lies higher by the cant `D`. At speed `v` a cant of
//! `S v^2 / (g R)` would leave no lateral force, with the distance `S` of the contact points of the
//! rails. The missing part is the deficiency `I`:
//!
//! ```text
//! D + I = S v^2 / (g R)
//! ```
//!
//! Cant and deficiency keep one ratio, that of their largest values. Curvature and cant change
//! together over a transition, smoothly instead of linearly as in a clothoid. Suspension and the
//! IMU's height above the rails are left out.

use super::attitude::Turned;
use super::course::{Course, To};
use super::vibration::Shaker;
use super::waves::GRAVITY;
use super::{Instant, Motion};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Distance of the contact points of wheels and rails at standard gauge, mm (EN 13803).
const RAILS_MM: f64 = 1500.0;
/// Largest deficiency of cant, mm (assumed; of the size of the limits in EN 13803).
const DEFICIENCY_MM: f64 = 110.0;
/// Fastest changes of cant and of its deficiency in a transition, mm/s (assumed, of the size of the
/// limits in EN 13803), and the shortest transition, s.
const CHANGES_MMPS: [f64; 2] = [50.0, 55.0];
const TRANSITION_S: f64 = 3.0;
/// Largest slope of the smooth change from one value to another, divided by its mean.
const STEEPEST: f64 = 1.875;
/// Largest acceleration from a station and deceleration to it, m/s2 (assumed).
const STARTS: f64 = 0.5;
const BRAKES: f64 = 0.6;
/// Largest grade, rad: 1.25 % as on lines for freight (assumed).
const GRADE: f64 = 0.0125;
/// Share of a car's vibration (assumed).
const RIDE: f64 = 0.2;

/// A train.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Train {
    /// Speed between stations, m/s, 5 to 90.
    pub speed_mps: f64,
    /// Least radius of the curves, m, 150 to 20000. Where cant and its deficiency would be too
    /// large for the speed, the radius is larger.
    pub radius_m: f64,
    /// Largest cant, mm, 0 to 180.
    pub cant_mm: f64,
    /// Mean time from a station to the next, s, 60 to 7200; 0 is never.
    pub stop_every_s: f64,
}

impl Default for Train {
    /// A regional train at 144 km/h.
    fn default() -> Self {
        Self {
            speed_mps: 40.0,
            radius_m: 1500.0,
            cant_mm: 150.0,
            stop_every_s: 480.0,
        }
    }
}

impl Train {
    /// Share of the cant in cant and deficiency together.
    fn share(&self) -> f64 {
        self.cant_mm / (self.cant_mm + DEFICIENCY_MM)
    }

    /// To the next curve, and through it.
    fn curve(&self, course: &mut Course, rng: &mut ChaCha8Rng) {
        course.go(&To {
            time: rng.random_range(10.0..30.0),
            climb: Some(rng.random_range(-GRADE..GRADE)),
            ..To::default()
        });
        course.hold(rng.random_range(10.0..60.0));
        let square = self.speed_mps * self.speed_mps / GRAVITY;
        let least = RAILS_MM * square / (self.cant_mm + DEFICIENCY_MM);
        let radius = (self.radius_m * 5.0_f64.powf(rng.random_range(0.0..1.0))).max(least);
        let whole = RAILS_MM * square / radius;
        let shares = [self.share(), 1.0 - self.share()];
        let times = [0, 1].map(|i| STEEPEST * shares[i] * whole / CHANGES_MMPS[i]);
        let ramp = times[0].max(times[1]).max(TRANSITION_S);
        let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let angle = side * rng.random_range(0.1..0.8);
        course.turn(angle, self.speed_mps / radius, ramp);
    }

    /// Brakes, stands at a platform and starts again.
    fn station(&self, course: &mut Course, rng: &mut ChaCha8Rng) {
        course.go(&To {
            time: STEEPEST * self.speed_mps / BRAKES,
            speed: Some(0.0),
            climb: Some(0.0),
            ..To::default()
        });
        course.hold(rng.random_range(30.0..90.0));
        self.start(course);
    }

    fn start(&self, course: &mut Course) {
        course.change(self.speed_mps, STEEPEST * self.speed_mps / STARTS);
    }
}

/// The motion of a [`Train`].
pub(super) struct Cars {
    course: Course,
    share: f64,
    shaker: Shaker,
}

impl Cars {
    /// Stands for `standstill` s, then travels, `duration` s in all. Without a standstill it is on
    /// the move at once.
    pub(super) fn new(
        train: &Train,
        [standstill, duration]: [f64; 2],
        [heading, vibration]: [f64; 2],
        dt: f64,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let stands = standstill > 0.0;
        let mut course = Course::new(if stands { 0.0 } else { train.speed_mps }, heading, dt);
        if stands {
            course.hold(standstill);
            train.start(&mut course);
        }
        let interval = |rng: &mut ChaCha8Rng| match train.stop_every_s {
            0.0 => f64::INFINITY,
            mean => mean * rng.random_range(0.7..1.3),
        };
        let mut station = course.duration() + interval(rng);
        while course.duration() < duration {
            train.curve(&mut course, rng);
            if course.duration() >= station {
                train.station(&mut course, rng);
                station = course.duration() + interval(rng);
            }
        }
        course.cut(duration);
        Self {
            course,
            share: train.share(),
            shaker: Shaker::new(rng, RIDE * vibration, dt),
        }
    }
}

impl Motion for Cars {
    fn duration(&self) -> f64 {
        self.course.duration()
    }

    fn begin(&mut self, t: f64, second: bool) {
        self.course.advance(t);
        self.shaker.begin(t, second);
    }

    fn at(&self, t: f64, node: usize) -> Instant {
        let now = self.course.at(t);
        let (speed, turn) = (now.speed.dual(), now.heading.dual_rate());
        let shake = self.shaker.riding(node, speed);
        let (s, c) = now.heading.dual().sin_cos();
        let (up, level) = now.climb.dual().sin_cos();
        let along = speed * level;
        let v = [along * c, along * s, shake.heave - speed * up];
        // sin(roll) = D / S, and v * turn rate = v^2 / R
        let canted = (speed * turn * (self.share / GRAVITY)).asin();
        let attitude = Turned::level()
            .yaw(now.heading.dual() + shake.angle[2])
            .pitch(now.climb.dual() + shake.angle[1])
            .roll(canted + shake.angle[0]);
        Instant::of(v, &attitude)
    }
}
