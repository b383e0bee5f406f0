//! An aircraft: coordinated banked turns, climbs, wind and turbulence. It starts in the air or on
//! the runway.

use super::attitude::Turned;
use super::course::{Course, To};
use super::dual::Dual;
use super::profile::Smooth;
use super::vibration::Shaker;
use super::waves::{GRAVITY, Waves};
use super::{Instant, Motion};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Angle of attack in level flight, rad (assumed: 3 deg). It grows with the load factor.
const ATTACK: f64 = 0.052;
/// Length of the take-off run, and time in which the aircraft then reaches the full wind, s
/// (assumed).
const RUN_S: f64 = 25.0;
const LIFT_S: f64 = 30.0;
/// Share of a car's vibration that the engine causes (assumed).
const ENGINE: f64 = 0.3;
/// Turbulence: velocity in m/s and wobble in rad, 1 sigma (assumed: light).
const GUST: f64 = 0.5;
const WOBBLE: f64 = 0.01;

/// An aircraft.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Aircraft {
    /// Speed through the air, m/s, 30 to 120. It changes by a tenth.
    pub speed_mps: f64,
    /// Largest bank in a turn, deg, 0 to 60. With 0 the aircraft flies straight on.
    pub bank_deg: f64,
    /// Speed of the wind, m/s, 0 to 30. Its direction is random.
    pub wind_mps: f64,
    /// Whether it climbs and descends.
    pub climbs: bool,
}

impl Default for Aircraft {
    /// A light aircraft at 60 m/s in a wind of 10 m/s.
    fn default() -> Self {
        Self {
            speed_mps: 60.0,
            bank_deg: 30.0,
            wind_mps: 10.0,
            climbs: true,
        }
    }
}

/// The motion of an [`Aircraft`].
pub(super) struct Flight {
    course: Course,
    air: Waves,
    wind: [f64; 2],
    /// Time of lift-off, s; below 0 for a flight that begins in the air.
    lift_off: f64,
    shaker: Shaker,
}

impl Flight {
    /// Flies for `duration` s: from the runway after a standstill, or from the air without one.
    pub(super) fn new(
        aircraft: &Aircraft,
        [standstill, duration]: [f64; 2],
        [heading, vibration]: [f64; 2],
        dt: f64,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let speed = aircraft.speed_mps;
        let runway = standstill > 0.0;
        let mut course = Course::new(if runway { 0.0 } else { speed }, heading, dt);
        let mut lift_off = -LIFT_S;
        if runway {
            course.hold(standstill);
            course.change(speed, RUN_S);
            lift_off = course.duration();
            course.go(&To {
                time: LIFT_S,
                climb: aircraft.climbs.then_some(0.08),
                ..To::default()
            });
        }
        while course.duration() < duration {
            leg(&mut course, aircraft, rng);
        }
        course.cut(duration);
        let (east, north) = rng.random_range(0.0..TAU).sin_cos();
        Self {
            course,
            air: Waves::of_air(GUST, WOBBLE, rng),
            wind: [north, east].map(|share| share * aircraft.wind_mps),
            lift_off,
            shaker: Shaker::new(rng, ENGINE * vibration, dt),
        }
    }
}

/// Adds a straight leg, perhaps with a climb and another speed, and then a turn.
fn leg(course: &mut Course, aircraft: &Aircraft, rng: &mut ChaCha8Rng) {
    let climb = rng.random_range(-0.07..0.08);
    let speed = aircraft.speed_mps * rng.random_range(0.9..1.1);
    course.go(&To {
        time: rng.random_range(10.0..20.0),
        speed: Some(speed),
        climb: Some(if aircraft.climbs { climb } else { 0.0 }),
        ..To::default()
    });
    course.hold(rng.random_range(10.0..40.0));
    let bank = aircraft.bank_deg.to_radians() * rng.random_range(0.5..1.0);
    if bank > 0.0 {
        let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let angle = side * rng.random_range(0.25 * PI..1.5 * PI);
        course.turn(angle, GRAVITY * bank.tan() / speed, 4.0);
    }
}

impl Motion for Flight {
    fn duration(&self) -> f64 {
        self.course.duration()
    }

    fn begin(&mut self, t: f64, second: bool) {
        self.course.advance(t);
        self.shaker.begin(t, second);
    }

    fn at(&self, t: f64, node: usize) -> Instant {
        let now = self.course.at(t);
        let u = (t - self.lift_off).clamp(0.0, LIFT_S);
        // share of the wind and of the lift: none on the runway
        let aloft = Smooth::between(0.0, 1.0, u, LIFT_S).dual();
        let [gust_n, gust_e, gust_d, wobble_x, wobble_y, wobble_z] =
            self.air.at(t).map(|part| part * aloft);
        let shake = self.shaker.at(node);
        let angle = |i: usize| Dual::new(shake.angle[i], shake.rate[i]);
        let (speed, turn) = (now.speed.dual(), now.heading.dual_rate());
        let (s, c) = now.heading.dual().sin_cos();
        let (up, level) = now.climb.dual().sin_cos();
        let [north, east] = self.wind;
        let along = speed * level;
        let v = [
            along * c + aloft * north + gust_n,
            along * s + aloft * east + gust_e,
            gust_d - speed * up + Dual::new(shake.heave[0], shake.heave[1]),
        ];
        // tan(bank) = v * turn rate / g: no lateral force
        let tangent = speed * turn * (1.0 / GRAVITY);
        let load = (tangent * tangent + Dual::from(1.0)).sqrt();
        let attitude = Turned::level()
            .yaw(now.heading.dual())
            .pitch(now.climb.dual())
            .roll(tangent.atan() + wobble_x + angle(0))
            .yaw(wobble_z + angle(2))
            .pitch(load * aloft * ATTACK + wobble_y + angle(1));
        Instant::of(v, &attitude)
    }
}
