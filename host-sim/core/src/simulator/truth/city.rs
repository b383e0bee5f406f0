//! A car in a town: it stands for seconds only, may first reverse out of a parking place, and slips
//! sideways in corners. Or it is on the move from the first sample to the last.

use super::attitude::Turned;
use super::course::{Course, To};
use super::dual::Dual;
use super::road::{BODY_ROLL, SQUAT};
use super::vibration::{Ride, Shaker};
use super::{Instant, Motion};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// From the rear axle to the IMU, m (assumed): the car turns about a point on the line of the axle.
const AHEAD: f64 = 1.5;
/// Slip angle of the rear tyres by lateral acceleration, rad per m/s2 (assumed: 0.5 deg).
const SLIP: f64 = 8.7e-3;

/// A car in a town.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct City {
    /// It begins in a parking place and reverses out of it.
    pub reverse_first: bool,
    /// It stops at crossings for seconds. Without stops it moves from the first sample on.
    pub stops: bool,
    /// It turns at crossings. Without turns it goes straight on at constant speed.
    pub turns: bool,
    /// The road shakes it less while it is slow, as it does a car on the road. Without this it is
    /// shaken alike at any speed, also while it stands.
    pub calm_stops: bool,
}

impl Default for City {
    fn default() -> Self {
        Self {
            reverse_first: true,
            stops: true,
            turns: true,
            calm_stops: false,
        }
    }
}

/// The motion of a car in a town or in traffic.
pub(super) struct Car {
    course: Course,
    shaker: Shaker,
    /// The road shakes it less while it is slow.
    rides: bool,
}

impl Car {
    /// Drives along a course without reverse.
    pub(super) fn along(course: Course, shaker: Shaker) -> Self {
        let rides = true;
        Self {
            course,
            shaker,
            rides,
        }
    }

    /// Stands for `standstill` s, then drives, `duration` s in all.
    pub(super) fn new(
        city: &City,
        [standstill, duration]: [f64; 2],
        [heading, vibration]: [f64; 2],
        dt: f64,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let stands = standstill > 0.0 || city.reverse_first || city.stops;
        let cruise = rng.random_range(9.0..13.0);
        let mut course = Course::new(if stands { 0.0 } else { cruise }, heading, dt);
        if stands {
            course.hold(standstill + rng.random_range(3.0..8.0));
        }
        if city.reverse_first {
            reverse(&mut course, rng);
        }
        if !city.turns {
            course.change(cruise, 12.0);
            course.hold(duration);
        }
        while course.duration() < duration {
            block(&mut course, city.stops, rng);
        }
        course.cut(duration);
        Self {
            course,
            shaker: Shaker::new(rng, vibration, dt),
            rides: city.calm_stops,
        }
    }

    fn shake(&self, node: usize, speed: Dual) -> Ride {
        if self.rides {
            // a car in reverse has a speed below 0
            let forward = if speed.value < 0.0 { -speed } else { speed };
            return self.shaker.riding(node, forward);
        }
        let shake = self.shaker.at(node);
        Ride {
            heave: Dual::new(shake.heave[0], shake.heave[1]),
            angle: [0, 1, 2].map(|i| Dual::new(shake.angle[i], shake.rate[i])),
        }
    }
}

/// Back out of a parking place in a bend, and a short stop.
fn reverse(course: &mut Course, rng: &mut ChaCha8Rng) {
    course.change(rng.random_range(-2.2..-1.2), 2.0);
    let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let angle = rng.random_range(0.3 * PI..0.55 * PI);
    course.turn(side * angle, 0.45, 1.0);
    course.change(0.0, 1.5);
    course.hold(rng.random_range(1.0..3.0));
}

/// To the next crossing, perhaps a stop there, and perhaps a turn.
fn block(course: &mut Course, stops: bool, rng: &mut ChaCha8Rng) {
    let speed: f64 = rng.random_range(8.0..14.0);
    let climb = rng.random_range(-0.03..0.03);
    course.go(&To {
        time: rng.random_range(6.0..10.0),
        speed: Some(speed),
        climb: Some(climb),
        ..To::default()
    });
    if rng.random_bool(0.5) {
        let bend = rng.random_range(-0.5..0.5);
        course.turn(bend, 0.15, 1.5);
    }
    course.hold(rng.random_range(3.0..20.0));
    let corner = rng.random_range(4.0..7.0);
    let brakes = rng.random_range(4.0..7.0);
    if stops && rng.random_bool(0.4) {
        course.change(0.0, brakes + 2.0);
        course.hold(rng.random_range(2.0..8.0));
        course.change(corner, 4.0);
    } else {
        course.change(corner, brakes);
    }
    if rng.random_bool(0.7) {
        let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        course.turn(side * rng.random_range(0.45 * PI..0.55 * PI), 0.5, 1.2);
    }
}

impl Motion for Car {
    fn duration(&self) -> f64 {
        self.course.duration()
    }

    fn begin(&mut self, t: f64, second: bool) {
        self.course.advance(t);
        self.shaker.begin(t, second);
    }

    fn at(&self, t: f64, node: usize) -> Instant {
        let now = self.course.at(t);
        let (speed, accel) = (now.speed.dual(), now.speed.dual_rate());
        let turn = now.heading.dual_rate();
        let Ride { heave, angle } = self.shake(node, speed);
        // the IMU swings out of a turn, and the rear tyres slip to the outside
        let sideways = turn * AHEAD - speed * speed * turn * SLIP;
        let (s, c) = now.heading.dual().sin_cos();
        let (up, level) = now.climb.dual().sin_cos();
        let along = speed * level;
        let v = [
            along * c - sideways * s,
            along * s + sideways * c,
            heave - speed * up,
        ];
        let attitude = Turned::level()
            .yaw(now.heading.dual() + angle[2])
            .pitch(now.climb.dual() + accel * SQUAT + angle[1])
            .roll(angle[0] - speed * turn * BODY_ROLL);
        Instant::of(v, &attitude)
    }
}
