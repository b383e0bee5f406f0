//! The simulated truth: a vehicle that stands and drives, the errors of its sensor, its receiver.
//!
//! The vehicle is level and has no side slip. Heading and speed change at constant rates between
//! draws, so that increments and fixes are consistent, as in a real drive.

use crate::random::Random;
use crate::sensor::{Counts, Sensor};
use firmware::units::DEGREE;
use firmware::wire::ubx::Pvt;

/// Seconds at rest after each power-on: the learner aligns itself.
const STANDS_S: f64 = 170.0;
const LATITUDE: f64 = 0.92;
const LONGITUDE: f64 = 0.18;
const EARTH_RATE: f64 = 7.292_115e-5;
const RADIUS: f64 = 6.38e6;
/// Temperature of the surroundings and of the warm sensor, degrees Celsius, and how long it takes
/// to warm up, s.
const COLD: f64 = 3.0;
const WARM: f64 = 41.0;
const WARMS_UP_S: f64 = 600.0;
/// Biases a degree, of the biases at [`COLD`].
const PER_DEGREE: f64 = 0.05;

/// The vehicle.
#[derive(Debug, Clone)]
pub struct World {
    random: Random,
    period: f64,
    /// Time since power-on, s.
    time: f64,
    /// Cosine and sine of the heading.
    heading: [f64; 2],
    speed: f64,
    /// Rate of the heading, rad/s; acceleration, m/s2; and their remaining time, s.
    turns: f64,
    gains: f64,
    lasts: f64,
    /// Position relative to the start: north and east, m.
    way: [f64; 2],
    /// Gravity, m/s2; cosine and sine of the latitude.
    gravity: f64,
    latitude: [f64; 2],
    /// Errors of the sensor: biases in rad/s and m/s2, at [`COLD`].
    bias: [[f64; 3]; 2],
    /// Temperature of the sensor, degrees Celsius.
    celsius: f64,
    /// Remainders of the rounding, counts.
    left: [[f64; 3]; 2],
}

impl World {
    /// A vehicle at power-on.
    #[must_use]
    pub fn new(mut random: Random, rate: u32) -> World {
        let (c, s) = (libm::cos(LATITUDE), libm::sin(LATITUDE));
        let gravity =
            9.780_325_34 * (1.0 + 0.001_931_852 * s * s) / libm::sqrt(1.0 - 0.006_694_38 * s * s);
        let bias = [1.6e-6, 4e-3].map(|sigma| [0; 3].map(|_| sigma * f64::from(random.normal())));
        World {
            random,
            period: 1.0 / f64::from(rate),
            time: 0.0,
            heading: [0.8, 0.6],
            speed: 0.0,
            turns: 0.0,
            gains: 0.0,
            lasts: STANDS_S,
            way: [0.0; 2],
            gravity,
            latitude: [c, s],
            bias,
            celsius: COLD,
            left: [[0.0; 3]; 2],
        }
    }

    /// Draws another manoeuvre.
    fn draw(&mut self) {
        self.lasts = 5.0 + f64::from(self.random.below(25));
        let wanted = f64::from(self.random.below(25));
        self.gains = (wanted - self.speed) / self.lasts;
        let turns = self.random.below(3) == 0;
        self.turns = if turns {
            0.15 * f64::from(self.random.signed())
        } else {
            0.0
        };
        if self.random.below(8) == 0 {
            (self.gains, self.turns) = (-self.speed / self.lasts, 0.0);
        }
    }

    /// Temperature of the sensor, degrees Celsius.
    #[must_use]
    pub fn celsius(&self) -> f64 {
        self.celsius
    }

    /// The counts of the next sample.
    pub fn sample(&mut self, sensor: &Sensor) -> Counts {
        let dt = self.period;
        self.celsius += dt / WARMS_UP_S * (WARM - self.celsius);
        self.time += dt;
        self.lasts -= dt;
        if self.lasts <= 0.0 {
            self.draw();
        }
        let ([c, s], [cos, sin]) = (self.heading, self.latitude);
        let (north, east) = (self.speed * c, self.speed * s);
        let earth = [EARTH_RATE * cos, 0.0, -EARTH_RATE * sin];
        let moves = [east / RADIUS, -north / RADIUS, -east / RADIUS * sin / cos];
        let [wn, we, wd] = [0, 1, 2].map(|i| earth[i] + moves[i]);
        let rate = [c * wn + s * we, -s * wn + c * we, wd + self.turns];
        // Coriolis: (2 earth + moves) x v
        let [a, b, d] = [0, 1, 2].map(|i| 2.0 * earth[i] + moves[i]);
        let coriolis = [-d * east, d * north, a * east - b * north];
        let along = c * coriolis[0] + s * coriolis[1];
        let across = -s * coriolis[0] + c * coriolis[1];
        let force = [
            self.gains + along,
            self.speed * self.turns + across,
            coriolis[2] - self.gravity,
        ];
        // the motion
        self.way[0] += dt * (north + 0.5 * dt * self.gains * c);
        self.way[1] += dt * (east + 0.5 * dt * self.gains * s);
        self.speed = (self.speed + dt * self.gains).max(0.0);
        let turn = dt * self.turns;
        let (c, s) = (c - s * turn, s + c * turn);
        let length = libm::sqrt(c * c + s * s);
        self.heading = [c / length, s / length];
        let grown = 1.0 + PER_DEGREE * (self.celsius - COLD);
        let noise = [1.46e-6, 1.96e-4].map(|density| density * libm::sqrt(dt));
        let mut counts = [[0; 3]; 2];
        for triad in 0..2 {
            let truth = [rate, force][triad];
            for axis in 0..3 {
                let noise = noise[triad] * f64::from(self.random.normal());
                let increment = dt * (truth[axis] + grown * self.bias[triad][axis]) + noise;
                let exact = increment / sensor.count()[triad] + self.left[triad][axis];
                let whole = libm::rint(exact);
                self.left[triad][axis] = exact - whole;
                let largest = sensor.largest();
                counts[triad][axis] = (whole as i32).clamp(-largest, largest);
            }
        }
        counts
    }

    /// The receiver's message; `wrong`: a position some kilometres off.
    pub fn fix(&mut self, time_ms: u32, wrong: bool) -> [u8; firmware::wire::ubx::PVT_LEN] {
        let mut off = |metres: f64| metres * f64::from(self.random.normal());
        let jump = if wrong { 3000.0 } else { 0.0 };
        let [c, s] = self.heading;
        let north = self.way[0] + off(1.0) + jump;
        let east = self.way[1] + off(1.0);
        let velocity = [
            self.speed * c + off(0.05),
            self.speed * s + off(0.05),
            off(0.05),
        ];
        let latitude = LATITUDE + north / RADIUS;
        let longitude = LONGITUDE + east / (RADIUS * self.latitude[0]);
        let degrees = |radians: f64| libm::rint(radians / DEGREE * 1e7) as i32;
        Pvt {
            time_of_week: time_ms,
            year: 2026,
            month_to_second: [11, 21, 0, 0, 0],
            valid: 7,
            fix: 3,
            flags: 1,
            satellites: 12,
            longitude: degrees(longitude),
            latitude: degrees(latitude),
            height: 300_000,
            horizontal_accuracy: 1400,
            vertical_accuracy: 1500,
            velocity: velocity.map(|v| libm::rint(v * 1e3) as i32),
            speed_accuracy: 90,
            pdop: 130,
            ..Pvt::default()
        }
        .emit()
    }
}
