//! A car in traffic: between stretches of free road it stands, creeps and stands again in queues,
//! and it leaves a queue so slowly that it hardly seems to move.
//!
//! B. S. Kerner, S. L. Klenov, A. Hiller and H. Rehborn ("Microscopic features of moving traffic
//! jams", Physical Review E 73, 046107, 2006) find the pattern of jams in data of single cars:
//! standstill and low speed alternate. The figures are assumed.

use super::city::Car;
use super::course::{Course, To};
use super::vibration::Shaker;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Slowest creeping as a share of the fastest.
const SLOWEST: f64 = 0.1;
/// Speed to which a car leaves a queue slowly, m/s, and the least time that it takes, s.
const DEPARTURE_MPS: f64 = 0.5;
const DEPARTURE_S: f64 = 4.0;
/// Duration of acceleration to the speed of creeping, and of braking, s.
const NUDGE_S: f64 = 2.0;

/// A car in traffic.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Traffic {
    /// Share of the time in queues, 0 to 1.
    pub queue_share: f64,
    /// Fastest creeping in a queue, m/s, 0.1 to 3. The slowest is a tenth of it.
    pub creep_mps: f64,
    /// Mean time of creeping between two stops, s, 6 to 300. Each is between half and one and a
    /// half of it.
    pub creep_s: f64,
    /// Mean time of a stop in a queue, s, 1 to 300, with the same spread.
    pub stop_s: f64,
    /// Longest time in which the car leaves a queue, until it drives 0.5 m/s, s, 5 to 120.
    pub departure_s: f64,
    /// Mean speed between queues, m/s, 5 to 35.
    pub speed_mps: f64,
}

impl Default for Traffic {
    /// Half of the time in queues that creep with 0.1 to 1 m/s.
    fn default() -> Self {
        Self {
            queue_share: 0.5,
            creep_mps: 1.0,
            creep_s: 20.0,
            stop_s: 15.0,
            departure_s: 60.0,
            speed_mps: 12.0,
        }
    }
}

impl Traffic {
    /// Stands for `standstill` s, then drives, `duration` s in all.
    pub(super) fn car(
        &self,
        [standstill, duration]: [f64; 2],
        [heading, vibration]: [f64; 2],
        dt: f64,
        rng: &mut ChaCha8Rng,
    ) -> Car {
        let mut course = Course::new(0.0, heading, dt);
        if standstill > 0.0 {
            course.hold(standstill);
        }
        let mut queued = 0.0;
        while course.duration() < duration {
            let begin = course.duration();
            if queued < self.queue_share * (begin - standstill) || self.queue_share == 1.0 {
                self.queue(&mut course, rng);
                queued += course.duration() - begin;
            } else {
                self.road(&mut course, rng);
            }
        }
        course.cut(duration);
        Car::along(course, Shaker::new(rng, vibration, dt))
    }

    /// Stops and creeps for some minutes, then leaves the queue. The car stands before.
    fn queue(&self, course: &mut Course, rng: &mut ChaCha8Rng) {
        let end = course.duration() + rng.random_range(60.0..180.0);
        while course.duration() < end {
            course.hold(self.stop_s * rng.random_range(0.5..1.5));
            let speed = self.creep_mps * SLOWEST.powf(rng.random_range(0.0..1.0));
            course.change(speed, NUDGE_S);
            let time = self.creep_s * rng.random_range(0.5..1.5) - 2.0 * NUDGE_S;
            course.hold(time.max(1.0));
            course.change(0.0, NUDGE_S);
        }
        let time = rng.random_range(0.0..1.0) * (self.departure_s - DEPARTURE_S);
        course.change(DEPARTURE_MPS, DEPARTURE_S + time);
    }

    /// A few blocks of free road with turns at crossings, to a stop.
    fn road(&self, course: &mut Course, rng: &mut ChaCha8Rng) {
        for _ in 0..rng.random_range(2..5) {
            let speed = self.speed_mps * rng.random_range(0.8..1.2);
            course.go(&To {
                time: 1.2 * speed * rng.random_range(0.8..1.2),
                speed: Some(speed),
                climb: Some(rng.random_range(-0.03..0.03)),
                ..To::default()
            });
            course.hold(rng.random_range(5.0..25.0));
            if rng.random_bool(0.5) {
                let corner = rng.random_range(4.0..7.0);
                course.change(corner, 1.2 * (speed - corner).abs() + 1.0);
                let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
                course.turn(side * rng.random_range(0.45 * PI..0.55 * PI), 0.5, 1.2);
            }
        }
        course.go(&To {
            time: 1.2 * self.speed_mps,
            speed: Some(0.0),
            climb: Some(0.0),
            ..To::default()
        });
    }
}
