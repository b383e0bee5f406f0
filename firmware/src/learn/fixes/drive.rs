//! A vehicle with a receiver, for tests: its own kinematics and its own arithmetic in f64, after
//! the textbook equations, without the code that it tests. Speed and heading are functions of time;
//! the samples follow from them. The functions of `libm` give the same bits on every machine.

mod road;

use super::{FixLearner, Memory};
use crate::compensator::{Compensator, Limit};
use crate::fix::{Fix, NOT_MEASURED, OBSERVATIONS, Position};
use crate::learn::prior::Datasheet;
use crate::learn::{Learner, Settings};
use crate::model::Nets;
use crate::nav::{self, Noise as SensorNoise};
use crate::sample::{Counts, Lsb, RawSample};
use crate::wheels::WheelSpeed;

type V = [f64; 3];
type Q = [f64; 4];

pub const HZ: u32 = 100;
const DT: f64 = 1.0 / HZ as f64;
pub const LSB: Lsb = Lsb {
    rad: 1e-8,
    mps: 1e-6,
};
const EARTH_RATE: f64 = 7.292_115e-5;

fn add(a: V, b: V) -> V {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}
fn times(a: V, k: f64) -> V {
    a.map(|x| x * k)
}
fn cross(a: V, b: V) -> V {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
fn product(a: Q, b: Q) -> Q {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}
fn inverse([w, x, y, z]: Q) -> Q {
    [w, -x, -y, -z]
}
fn turned(q: Q, v: V) -> V {
    let [_, x, y, z] = product(product(q, [0.0, v[0], v[1], v[2]]), inverse(q));
    [x, y, z]
}
fn of_vector(v: V) -> Q {
    let n = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let k = if n < 1e-12 {
        0.5
    } else {
        libm::sin(0.5 * n) / n
    };
    [libm::cos(0.5 * n), v[0] * k, v[1] * k, v[2] * k]
}
fn to_vector([w, x, y, z]: Q) -> V {
    let n = (x * x + y * y + z * z).sqrt();
    let k = if n < 1e-12 {
        2.0
    } else {
        2.0 * libm::atan2(n, w) / n
    };
    [x * k, y * k, z * k]
}

/// Radii of curvature, north and east, m, and gravity, m/s2 (WGS-84, Somigliana).
fn earth(latitude: f64, height: f64) -> (f64, f64, f64) {
    let e2 = 0.006_694_379_990_14;
    let s2 = libm::sin(latitude) * libm::sin(latitude);
    let w = 1.0 - e2 * s2;
    let gravity = 9.780_325_335_9 * (1.0 + 0.001_931_852_652_41 * s2) / w.sqrt();
    (
        6_378_137.0 * (1.0 - e2) / (w * w.sqrt()) + height,
        6_378_137.0 / w.sqrt() + height,
        gravity - 3.0877e-6 * (1.0 - 0.00142 * s2) * height,
    )
}

pub use road::Road;

/// Numbers that look random, mean 0, standard deviation 1.
pub struct Noise(pub u64);

impl Noise {
    pub fn next(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            sum += (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum
    }
    fn vector(&mut self, sigma: f64) -> V {
        [(); 3].map(|()| sigma * self.next())
    }
}

/// A consumer MEMS unit of 0.5 deg/s.
pub fn mems() -> Settings {
    Settings {
        sheet: Datasheet {
            scale: Settings::MEDIUM.sheet.scale,
            misalignment: Settings::MEDIUM.sheet.misalignment,
            ..Datasheet::land_vehicle(8.7e-3, 0.1)
        },
        noise: SensorNoise {
            gyro: 5e-5,
            accel: 7e-4,
        },
        ..Settings::MEDIUM
    }
}

/// The receiver as it is.
#[derive(Debug, Clone, Copy)]
pub struct Receiver {
    /// Antenna in body axes, m.
    pub arm: V,
    /// Age of its fixes at arrival, s.
    pub delay: f64,
    /// Fixes a second.
    pub hz: u32,
    /// Accuracy that it states, m and m/s; infinite: it does not measure this.
    pub sigmas: [f32; OBSERVATIONS],
    /// Standard deviations that it has in fact: position and velocity.
    pub errors: [f64; 2],
    /// Correlation time of its errors, s; 0: white.
    pub memory: f64,
}

impl Receiver {
    pub const GOOD: Receiver = Receiver {
        arm: [0.0; 3],
        delay: 0.1,
        hz: 1,
        sigmas: [1.5, 1.5, 1.5, 0.05, 0.05, 0.05],
        errors: [1.5, 0.05],
        memory: 0.0,
    };
    /// It measures nothing.
    pub const NONE: Receiver = Receiver {
        sigmas: [NOT_MEASURED; OBSERVATIONS],
        ..Receiver::GOOD
    };
}

/// Wheels whose speed is reported ten times a second.
#[derive(Clone, Copy)]
pub struct Odometer {
    /// Reported speed over true speed, and slip at a time, s.
    pub scale: f64,
    pub slip: fn(f64) -> f64,
    /// Distance of the measured axle ahead of the one that does not steer, m.
    pub ahead: f64,
    /// Time between validity and arrival, s.
    pub delay: f64,
}

/// The vehicle with a learner on board.
pub struct Drive<'m> {
    pub learner: FixLearner<'m>,
    compensator: (Compensator, crate::compensator::State),
    road: Road,
    pub receiver: Receiver,
    noise: Noise,
    /// Standard deviation of white noise, rad/sqrt(s) and m/s/sqrt(s), and constant errors, rad/s
    /// and m/s2.
    sensors: [(f64, V); 2],
    /// Random walk of these errors, rad/s/sqrt(s) and m/s2/sqrt(s).
    walk: [f64; 2],
    /// Errors in proportion, row by row: of the gyros by rotation and by force, of the
    /// accelerometers by force. Force counts less that of a vehicle at rest in the beginning.
    pub ratios: [[V; 3]; 3],
    /// Biases by the datasheet.
    sheet: [f64; 2],
    due: [V; 2],
    number: u32,
    position: Position,
    /// Errors of the receiver now.
    errors: [V; 2],
    /// Fixes under way: the sample number of their arrival.
    under_way: Vec<(u32, Fix)>,
    /// Whether the receiver's time pulse is wired.
    pub pulse: bool,
    pub wheels: Option<Odometer>,
}

impl<'m> Drive<'m> {
    /// Sensors of the settings' noise and of these biases. The learner starts where it is, with
    /// errors of its initial state.
    pub fn new(
        memory: &'m mut Memory,
        settings: Settings,
        road: Road,
        receiver: Receiver,
        biases: [V; 2],
        seed: u64,
    ) -> Drive<'m> {
        let limit = Limit {
            gyro: 1.0,
            accel: 1.0,
        };
        let nets = Nets::NONE;
        let compensator =
            Compensator::new(nets.gyro, nets.accel, LSB, DT, HZ as u16, limit).unwrap();
        let mut learner = FixLearner::new(memory, settings);
        learner.begin(&nets, compensator.scale());
        let position = Position {
            latitude: 0.8,
            longitude: 0.3,
            height: 150.0,
        };
        let mut noise = Noise(seed);
        let mut q_bn = road.attitude(0.0);
        let off = [
            1e-4 * noise.next(),
            1e-4 * noise.next(),
            1e-3 * noise.next(),
        ];
        q_bn = product(of_vector(off), q_bn);
        let start = nav::State {
            position,
            velocity: add(road.velocity(0.0), noise.vector(0.05)),
            q_bn,
        };
        let sigmas = [1e-4, 1e-4, 1e-3, 0.05, 0.05, 0.05, 1.0, 1.0, 1.0];
        learner.navigate_from(start, &sigmas).unwrap();
        let errors = receiver.errors.map(|sigma| noise.vector(sigma));
        Drive {
            learner,
            compensator: (compensator, crate::compensator::State::default()),
            road,
            receiver,
            noise,
            sensors: [
                (f64::from(settings.noise.gyro), biases[0]),
                (f64::from(settings.noise.accel), biases[1]),
            ],
            walk: [0.0; 2],
            ratios: [[[0.0; 3]; 3]; 3],
            sheet: [settings.sheet.gyro_bias, settings.sheet.accel_bias].map(f64::from),
            due: [[0.0; 3]; 2],
            number: 0,
            position,
            errors,
            under_way: Vec::new(),
            pulse: false,
            wheels: None,
        }
    }

    /// The biases walk from now on.
    pub fn walks_as_the_datasheet_says(&mut self) {
        self.walk = self.sheet.map(|bias| bias * 0.05 / 60.0);
    }

    /// Nothing navigates, as at power-on.
    pub fn begin_unaligned(&mut self) {
        let scale = self.compensator.0.scale();
        self.learner.begin(&Nets::NONE, scale);
    }

    pub fn seconds(&mut self, seconds: u32) {
        for _ in 0..seconds * HZ {
            self.sample();
        }
    }

    pub fn sample(&mut self) {
        let t = f64::from(self.number) * DT;
        if self.walk != [0.0; 2] {
            for (k, walk) in self.walk.into_iter().enumerate() {
                let step = self.noise.vector(walk * DT.sqrt());
                self.sensors[k].1 = add(self.sensors[k].1, step);
            }
        }
        if self.number.is_multiple_of(HZ / self.receiver.hz) {
            self.measure(t);
        }
        let counts = self.counts(t);
        let sample = RawSample::Counts {
            gyro: counts.dtheta,
            accel: counts.dv,
        };
        self.number += 1;
        self.learner.sample(self.number, &sample);
        let (compensator, state) = &mut self.compensator;
        if let Some(block) = compensator.accumulate(state, &sample) {
            self.learner.block(self.number, &block);
        }
        self.roll();
        let now = self.number;
        let mut under_way = std::mem::take(&mut self.under_way);
        under_way.retain(|(number, fix)| {
            if *number == now {
                self.learner.fix(now, fix);
            }
            *number != now
        });
        self.under_way = under_way;
    }

    /// A speed of the wheels arrives.
    fn roll(&mut self) {
        let Some(wheels) = self.wheels.filter(|_| self.number.is_multiple_of(HZ / 10)) else {
            return;
        };
        let t = f64::from(self.number) * DT - wheels.delay;
        let (speed, across) = ((self.road.speed)(t), wheels.ahead * self.road.turns(t));
        let speed = (speed * speed + across * across).sqrt().copysign(speed);
        let reported = speed * wheels.scale * (wheels.slip)(t);
        let reported = WheelSpeed {
            speed: (reported / 0.02).round() as f32 * 0.02,
            age_ms: (wheels.delay * 1000.0) as u16,
        };
        self.learner.wheel_speed(self.number, &reported);
    }

    /// Increments of the sample that begins at `t`, errors included.
    pub fn counts(&mut self, t: f64) -> Counts {
        let Position {
            latitude, height, ..
        } = self.position;
        let (north, east, gravity) = earth(latitude, height);
        let middle = self.road.velocity(t + 0.5 * DT);
        let ie = [
            EARTH_RATE * libm::cos(latitude),
            0.0,
            -EARTH_RATE * libm::sin(latitude),
        ];
        let en = [
            middle[1] / east,
            -middle[0] / north,
            -middle[1] * libm::tan(latitude) / east,
        ];
        let frame = of_vector(times(add(ie, en), DT));
        let [from, to] = [t, t + DT].map(|t| self.road.attitude(t));
        let angle = to_vector(product(product(inverse(from), frame), to));
        let force = |t: f64| {
            let coriolis = cross(add(times(ie, 2.0), en), self.road.velocity(t));
            let f = add(
                add(self.road.acceleration(t), coriolis),
                [0.0, 0.0, -gravity],
            );
            turned(inverse(self.road.attitude(t)), f)
        };
        // Simpson's rule
        let ends = add(force(t), force(t + DT));
        let velocity = times(add(ends, times(force(t + 0.5 * DT), 4.0)), DT / 6.0);
        let at_rest = turned(inverse(self.road.attitude(0.0)), [0.0, 0.0, -gravity * DT]);
        let felt = add(velocity, times(at_rest, -1.0));
        let [turn, force, push] = self.ratios;
        let dot = |a: V, b: V| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let by_turn = turn.map(|row| dot(row, angle));
        let angle = add(add(angle, by_turn), force.map(|row| dot(row, felt)));
        let velocity = add(velocity, push.map(|row| dot(row, felt)));
        self.position.latitude += middle[0] * DT / north;
        self.position.longitude += middle[1] * DT / (east * libm::cos(latitude));
        let mut whole = |k: usize, value: V, lsb: f64| {
            let (density, bias) = self.sensors[k];
            let noise = self.noise.vector(density * DT.sqrt());
            let value = add(value, add(noise, times(bias, DT)));
            core::array::from_fn(|i| {
                self.due[k][i] += value[i] / lsb;
                let count = self.due[k][i].round();
                self.due[k][i] -= count;
                count as i32
            })
        };
        Counts {
            dtheta: whole(0, angle, LSB.rad),
            dv: whole(1, velocity, LSB.mps),
        }
    }

    /// A fix of this time goes on its way.
    fn measure(&mut self, t: f64) {
        let Receiver {
            arm,
            delay,
            hz,
            sigmas,
            errors,
            memory,
        } = self.receiver;
        let keeps = if memory > 0.0 {
            libm::exp(-1.0 / (f64::from(hz) * memory))
        } else {
            0.0
        };
        for (error, sigma) in self.errors.iter_mut().zip(errors) {
            let new = self.noise.vector(sigma * (1.0 - keeps * keeps).sqrt());
            *error = add(times(*error, keeps), new);
        }
        let q = self.road.attitude(t);
        let h = 1e-3;
        let around = product(
            inverse(self.road.attitude(t - h)),
            self.road.attitude(t + h),
        );
        let rate = times(to_vector(around), 0.5 / h);
        let [n, e, d] = add(turned(q, arm), self.errors[0]);
        let (north, east, _) = earth(self.position.latitude, self.position.height);
        let position = Position {
            latitude: self.position.latitude + n / north,
            longitude: self.position.longitude + e / (east * libm::cos(self.position.latitude)),
            height: self.position.height - d,
        };
        let motion = turned(q, cross(rate, arm));
        let fix = Fix {
            position,
            velocity: add(add(self.road.velocity(t), motion), self.errors[1]),
            sigmas,
            heading: None,
            time_ms: (t * 1000.0).round() as u32,
            arrived_us: 0,
            waited: 0,
            age: self.pulse.then_some(delay as f32),
        };
        let late = (delay * f64::from(HZ)).round() as u32;
        self.under_way.push((self.number + late, fix));
    }

    /// Errors of the six biases of the hypothesis that has nothing else, in units of the datasheet.
    pub fn bias_errors(&self) -> [f64; 6] {
        let sheet = self.sheet;
        let estimate = self.learner.bank().estimate_of(1);
        core::array::from_fn(|i| {
            (f64::from(estimate[i]) - self.sensors[i / 3].1[i % 3]) / sheet[i / 3]
        })
    }

    /// Error of the learner's heading and what it says of it, rad.
    pub fn heading(&self) -> Option<[f64; 2]> {
        let q = self.learner.nav()?.q_bn;
        let t = f64::from(self.number) * DT;
        let off = product(q, inverse(self.road.attitude(t)));
        let [_, _, error] = to_vector(off.map(|x| x * off[0].signum()));
        Some([error, f64::from(self.learner.report().heading_sigma)])
    }

    /// Error of the learner's position, m, and of its velocity, m/s.
    pub fn error(&mut self) -> [f64; 2] {
        let nav = self.learner.nav().unwrap();
        let t = f64::from(self.number) * DT;
        let (north, east, _) = earth(self.position.latitude, 0.0);
        let off = [
            (nav.position.latitude - self.position.latitude) * north,
            (nav.position.longitude - self.position.longitude)
                * east
                * libm::cos(self.position.latitude),
            nav.position.height - self.position.height,
        ];
        let slip = add(nav.velocity, times(self.road.velocity(t), -1.0));
        [off, slip].map(|v| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt())
    }
}
