//! The simulated truth: a vehicle that stands and drives, its sensor and its receiver.
//!
//! The vehicle is level and has no side slip. Heading and speed change at constant rates between
//! draws, so that increments and fixes are consistent, as in a real drive.

use crate::random::Random;
use firmware::sample::RawSample;
use firmware::units::DEGREE;
use firmware::wire::framer::LONGEST;
use firmware::wire::sequence::{Gap, Last};
use firmware::wire::ubx::Pvt;
use firmware::wire::{Checked, Fields, ImuFormat, Settings, Simulated};

/// Seconds at rest after each power-on: the learner aligns itself.
const STANDS_S: f64 = 170.0;
const LATITUDE: f64 = 0.92;
const LONGITUDE: f64 = 0.18;
const EARTH_RATE: f64 = 7.292_115e-5;
const RADIUS: f64 = 6.38e6;

/// A sensor to simulate.
#[derive(Debug, Clone, Copy)]
pub struct Sensor {
    /// Its format, with the layout of its frames.
    pub format: ImuFormat,
    /// The device's settings for it.
    pub settings: Settings,
    simulated: Simulated,
    step: u32,
    /// Value of a count of [`Fields`]: rad, m/s.
    count: [f64; 2],
}

impl Sensor {
    /// A sensor with this rate, by number; `None` beyond the last.
    #[must_use]
    pub fn of(rate: u32, number: u32) -> Option<Sensor> {
        let all = ImuFormat::ALL.into_iter().flat_map(|format| {
            let sensors = format.simulated().iter().filter(|s| s.has_accel);
            sensors.filter_map(move |simulated| Sensor::fitting(format, *simulated, rate))
        });
        all.into_iter().nth(number as usize)
    }

    /// Number of sensors with this rate.
    #[must_use]
    pub fn count(rate: u32) -> u32 {
        (0..).take_while(|n| Sensor::of(rate, *n).is_some()).count() as u32
    }

    fn fitting(format: ImuFormat, simulated: Simulated, rate: u32) -> Option<Sensor> {
        let mut settings = simulated.settings();
        settings.rate = rate.into();
        let format = format.configured(&settings);
        [1, 2, 4, 8].into_iter().find_map(|step| {
            let mut sensor = Sensor {
                format,
                settings,
                simulated,
                step,
                count: [0.0; 2],
            };
            sensor.count = sensor.worth(rate.into())?;
            Some(sensor)
        })
    }

    /// Value of a count for a device with these settings; `None` where the device finds another
    /// rate, or missing frames.
    fn worth(&self, rate: f64) -> Option<[f64; 2]> {
        const PROBE: i32 = 1 << 10;
        let (mut last, mut sample, mut units) = (Last::default(), None, None);
        for number in 0..3 {
            let mut buffer = [0; LONGEST];
            let len = self.emit(number, 1.0 / rate, [[PROBE; 3]; 2], &mut buffer);
            let frame = Checked::new(self.format, buffer.get_mut(..len)?).ok()?;
            let stream = frame.source().stream(&self.settings, frame.content())?;
            let reading = frame.read().ok()?;
            if stream.rate != rate || stream.gap(&mut last, &reading) != Gap::None {
                return None;
            }
            sample = Some(reading.sample);
            units = Some(stream.units);
        }
        let [gyro, accel] = match sample? {
            RawSample::Counts { gyro, accel } => [gyro[0], accel[0]].map(f64::from),
            RawSample::Floats { gyro, accel } => [gyro[0], accel[0]].map(f64::from),
        };
        let (probe, period, units) = (f64::from(PROBE), 1.0 / rate, units?);
        let rad = units.gyro.increment(period)? * gyro / probe;
        let mps = units.accel.increment(period)? * accel / probe;
        (rad > 0.0 && mps > 0.0).then_some([rad, mps])
    }

    /// Writes a frame and returns its length.
    pub fn emit(&self, index: u32, period: f64, counts: [[i32; 3]; 2], into: &mut [u8]) -> usize {
        let [gyro, accel] = counts;
        let fields = Fields {
            index: index.wrapping_mul(self.step),
            time: f64::from(index.wrapping_add(1)) * period,
            gyro,
            accel,
            rest: self.simulated.rest,
        };
        (self.simulated.emit)(&fields, into).unwrap_or(0)
    }

    /// The largest count of its fields.
    #[must_use]
    pub fn largest(&self) -> i32 {
        ((1i64 << (self.simulated.bits.clamp(2, 32) - 1)) - 1) as i32
    }
}

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
    /// Errors of the sensor: biases in rad/s and m/s2.
    bias: [[f64; 3]; 2],
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

    /// The counts of the next sample.
    pub fn sample(&mut self, sensor: &Sensor) -> [[i32; 3]; 2] {
        let dt = self.period;
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
        let noise = [1.46e-6, 1.96e-4].map(|density| density * libm::sqrt(dt));
        let mut counts = [[0; 3]; 2];
        for triad in 0..2 {
            let truth = [rate, force][triad];
            for axis in 0..3 {
                let noise = noise[triad] * f64::from(self.random.normal());
                let increment = dt * (truth[axis] + self.bias[triad][axis]) + noise;
                let exact = increment / sensor.count[triad] + self.left[triad][axis];
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
