//! Drives from physics: a rotating Earth, gravity by latitude, a vehicle with attitude and
//! acceleration, and a sensor with the errors of its datasheet. Nothing of this comes from the
//! room that is tested.

use crate::configuration::{Triad, VehicleKind};
use crate::plausibility::Expected;
use crate::plausibility::rest::{Judged, RestCheck};
use std::f64::consts::PI;
use std::vec::Vec;

pub const DEG: f64 = PI / 180.0;
pub const DEG_PER_HOUR: f64 = DEG / 3600.0;
pub const UG: f64 = 9.80665e-6;

/// Gravity at sea level (Somigliana's formula of WGS 84), m/s2.
pub fn gravity(latitude: f64) -> f64 {
    let s = latitude.sin().powi(2);
    9.780_325_335_9 * (1.0 + 0.001_931_852_652_41 * s) / (1.0 - 0.006_694_379_990_14 * s).sqrt()
}

/// A datasheet, as a maker prints it, and what it means in SI.
#[derive(Clone, Copy)]
pub struct Sheet {
    pub name: &'static str,
    /// deg/h, deg/sqrt(h), ug, ug/sqrt(Hz)
    pub gyro_bias: f64,
    pub arw: f64,
    pub accel_bias: f64,
    pub vrw: f64,
}

pub const LASER: Sheet = sheet("laser gyro", 0.34, 0.005, 410.0, 20.0);
pub const NAVIGATION: Sheet = sheet("navigation grade", 0.004, 0.002, 25.0, 5.0);
pub const TACTICAL: Sheet = sheet("tactical laser gyro", 1.1, 0.125, 1000.0, 34.0);
pub const STIM: Sheet = sheet("tactical MEMS", 10.0, 0.15, 2000.0, 60.0);
pub const MEMS: Sheet = sheet("industrial MEMS", 500.0, 0.3, 5000.0, 100.0);
pub const CHIP: Sheet = sheet("consumer MEMS", 1800.0, 0.2, 20_000.0, 100.0);
pub const SHEETS: [Sheet; 6] = [LASER, NAVIGATION, TACTICAL, STIM, MEMS, CHIP];

const fn sheet(name: &'static str, gyro_bias: f64, arw: f64, accel_bias: f64, vrw: f64) -> Sheet {
    Sheet {
        name,
        gyro_bias,
        arw,
        accel_bias,
        vrw,
    }
}

impl Sheet {
    pub fn expected(&self, vehicle: VehicleKind) -> Expected {
        let triad = |bias: f64, noise: f64, range: f32| Triad {
            bias_turn_on: bias as f32,
            bias_in_run: 0.0,
            white_noise: noise as f32,
            scale: 1e-3,
            misalignment: 1e-3,
            g_sensitivity: 0.0,
            range,
        };
        Expected {
            check_rate: true,
            up: [0.0, 0.0, -1.0],
            vehicle,
            gyro: triad(self.gyro_bias * DEG_PER_HOUR, self.arw * DEG / 60.0, 7.0),
            accel: triad(self.accel_bias * UG, self.vrw * UG, 100.0),
        }
    }
}

/// Random numbers of a fixed seed: a linear congruential generator (Knuth's MMIX), and the sum of
/// twelve uniform numbers as a normal deviate.
pub struct Random(pub u64);

impl Random {
    pub fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Motion of a vehicle at a moment: roll, pitch, heading (rad) with their rates, and acceleration
/// north, east, down (m/s2).
#[derive(Clone, Copy, Default)]
pub struct Motion {
    pub angles: [f64; 3],
    pub rates: [f64; 3],
    pub acceleration: [f64; 3],
}

/// Rotates from north-east-down to forward-right-down.
pub fn into_body(m: &Motion, v: [f64; 3]) -> [f64; 3] {
    let [(sr, cr), (sp, cp), (sh, ch)] = m.angles.map(f64::sin_cos);
    let (n, e, d) = (v[0] * ch + v[1] * sh, v[1] * ch - v[0] * sh, v[2]);
    let (f, d) = (n * cp - d * sp, n * sp + d * cp);
    [f, e * cr + d * sr, d * cr - e * sr]
}

/// True rate and specific force in body axes.
pub fn truth(m: &Motion, latitude: f64) -> [[f64; 3]; 2] {
    let earth = 7.2921e-5;
    let earth = into_body(m, [earth * latitude.cos(), 0.0, -earth * latitude.sin()]);
    let [a_n, a_e, a_d] = m.acceleration;
    let force = into_body(m, [a_n, a_e, a_d - gravity(latitude)]);
    let [(sr, cr), (sp, cp), _] = m.angles.map(f64::sin_cos);
    let [roll, pitch, heading] = m.rates;
    let turn = [
        roll - heading * sp,
        pitch * cr + heading * sr * cp,
        heading * cr * cp - pitch * sr,
    ];
    [[0, 1, 2].map(|i| earth[i] + turn[i]), force]
}

/// A motion by time.
pub type Moves = fn(f64) -> Motion;
/// Effect of a mistake on a block's rate and force.
pub type Mistake = fn([[f32; 3]; 2]) -> [[f32; 3]; 2];
/// Turns a vector into the axes of another mounting.
pub type Turn = fn([f32; 3]) -> [f32; 3];

/// Report of the receiver at a time: speed and its standard deviation.
pub type Receiver = Option<fn(f64) -> (f32, f32)>;

/// A drive of some seconds: its motion by time, and the sensor.
pub struct Drive {
    pub sheet: Sheet,
    pub vehicle: VehicleKind,
    pub latitude: f64,
    pub seconds: u32,
    /// Biases in standard deviations.
    pub sigmas: f64,
    pub receiver: Receiver,
    pub motion: Moves,
    /// Effect of the mistake on a block's rate and force.
    pub mistake: Mistake,
}

/// Samples of a block.
pub const STEPS: u32 = 60;
/// Units drawn.
pub const SEEDS: u64 = 6;

impl Drive {
    pub fn parked(sheet: Sheet) -> Drive {
        Drive {
            sheet,
            vehicle: VehicleKind::Land,
            latitude: 0.8,
            seconds: 180,
            sigmas: 1.0,
            receiver: None,
            motion: |_| Motion::default(),
            mistake: |means| means,
        }
    }

    /// Everything that was ever judged wrong, and when a fault was first raised, s; and the times
    /// at which something was judged.
    pub fn run(&self, seed: u64) -> (u32, Option<f64>, Vec<f64>) {
        let mut random = Random(seed);
        let mut rest = RestCheck::new(self.sheet.expected(self.vehicle));
        // the worst sign of the biases is not known: each is drawn
        let mut biases = |sigma: f64| {
            [0; 3].map(|_| {
                let sign = if random.uniform() < 0.5 { -1.0 } else { 1.0 };
                sign * sigma * self.sigmas
            })
        };
        let bias = [
            biases(self.sheet.gyro_bias * DEG_PER_HOUR),
            biases(self.sheet.accel_bias * UG),
        ];
        let noise = [self.sheet.arw * DEG / 60.0, self.sheet.vrw * UG];
        let (mut found, mut first, mut judged) = (0, None, Vec::new());
        for second in 0..self.seconds {
            if let Some(receiver) = self.receiver {
                let (speed, sigma) = receiver(f64::from(second));
                rest.fix(speed, sigma);
            }
            let mut sums = [[0.0; 3]; 2];
            for step in 0..STEPS {
                let t = f64::from(second) + (f64::from(step) + 0.5) / f64::from(STEPS);
                let values = truth(&(self.motion)(t), self.latitude);
                for (sum, value) in sums.iter_mut().zip(values) {
                    for (s, v) in sum.iter_mut().zip(value) {
                        *s += v / f64::from(STEPS);
                    }
                }
            }
            let means: [[f32; 3]; 2] = core::array::from_fn(|i| {
                core::array::from_fn(|axis| {
                    (sums[i][axis] + bias[i][axis] + noise[i] * random.normal()) as f32
                })
            });
            let [rate, force] = (self.mistake)(means);
            if let Some(Judged { faults, .. }) = rest.block(1.0, rate, force) {
                let end = f64::from(second) + 1.0;
                judged.push(end);
                found |= faults;
                if faults != 0 {
                    first = first.or(Some(end));
                }
            }
        }
        (found, first, judged)
    }

    /// No seed raises a fault. Gives how often something was judged.
    pub fn is_silent(&self, what: &str) -> usize {
        let mut judged = 0;
        for seed in 1..=SEEDS {
            let (found, at, times) = self.run(seed);
            let name = self.sheet.name;
            assert_eq!(found, 0, "{what}, {name}, seed {seed}: raised at {at:?}");
            judged += times.len();
        }
        judged
    }

    /// Every seed raises the fault, within two minutes of the beginning. Others may come with it.
    pub fn raises(&self, fault: u32, what: &str) {
        for seed in 1..=SEEDS {
            let (found, first, _) = self.run(seed);
            let name = self.sheet.name;
            assert_eq!(
                found & fault,
                fault,
                "{what}, {name}, seed {seed}: {found:#x}"
            );
            assert!(
                first.is_some_and(|at| at <= 121.0),
                "{what}, {name}: {first:?}"
            );
        }
    }
}

pub fn engine(t: f64) -> Motion {
    // 25 Hz at idle, 0.5 m/s2, and a body that rocks by 0.05 mrad at 1.3 Hz
    let shake = 0.5 * (2.0 * PI * 25.3 * t).sin();
    let (s, c) = (2.0 * PI * 1.3 * t).sin_cos();
    Motion {
        angles: [5e-5 * s, 0.0, 1.0],
        rates: [5e-5 * 2.0 * PI * 1.3 * c, 0.0, 0.0],
        acceleration: [0.3 * shake, 0.2 * shake, shake],
    }
}

pub fn grade(t: f64) -> Motion {
    // 15 %, nose up, and a camber of 4 % besides
    let engine = engine(t);
    Motion {
        angles: [engine.angles[0] + 0.04, 0.15f64.atan(), 2.0],
        ..engine
    }
}

/// A road: vertical motion in the 1 s means as on the smoothest motorway, and steering.
pub fn motorway(t: f64) -> Motion {
    let bump = |f: f64, a: f64| a * (2.0 * PI * f * t + 10.0 * f).sin();
    let yaw = 0.004 * (2.0 * PI * 0.11 * t).sin() + 0.02 * (2.0 * PI * 0.013 * t).sin();
    Motion {
        angles: [0.02, 0.01, 0.5],
        rates: [0.0, 0.0, yaw],
        acceleration: [
            bump(0.07, 0.05),
            33.0 * yaw,
            bump(0.31, 0.06) + bump(0.73, 0.06) + bump(0.17, 0.05),
        ],
    }
}

/// 20 s of driving and braking, then 40 s at a red light.
pub fn traffic(t: f64) -> Motion {
    let t = t % 60.0;
    let idle = engine(t);
    let (a, yaw) = match t {
        t if t < 6.0 => (1.8, 0.05),
        t if t < 12.0 => (0.0, -0.05),
        t if t < 20.0 => (-1.35, 0.1),
        _ => return idle,
    };
    Motion {
        rates: [0.0, 0.0, yaw],
        acceleration: [a, 9.0 * yaw, idle.acceleration[2]],
        ..idle
    }
}

/// A ferry in a swell: 8 degrees of roll in 9 s, 2 of pitch in 6 s, heave, and it turns slowly at
/// its mooring, 10 degrees in 240 s.
pub fn ferry(t: f64) -> Motion {
    let wave = |period: f64, a: f64| {
        let (s, c) = (2.0 * PI * t / period).sin_cos();
        (a * s, a * c * 2.0 * PI / period)
    };
    let (roll, roll_rate) = wave(9.0, 8.0 * DEG);
    let (pitch, pitch_rate) = wave(6.0, 2.0 * DEG);
    let (heading, heading_rate) = wave(240.0, 10.0 * DEG);
    Motion {
        angles: [roll, pitch, heading],
        rates: [roll_rate, pitch_rate, heading_rate],
        acceleration: [0.0, 0.0, 0.4 * (2.0 * PI * t / 8.0).sin()],
    }
}

/// The mooring in a calm harbour: only the slow turn.
/// A sensor that is turned on the spot, in the hand.
pub fn in_the_hand(t: f64) -> Motion {
    let (s, c) = (2.0 * PI * t / 20.0).sin_cos();
    Motion {
        angles: [60.0 * DEG * s, 0.0, 0.0],
        rates: [60.0 * DEG * c * 2.0 * PI / 20.0, 0.0, 0.0],
        acceleration: [0.0; 3],
    }
}

/// A sensor that is laid on another side every 12 s.
pub fn side_to_side(t: f64) -> Motion {
    let side = (t / 12.0).floor() % 4.0;
    Motion {
        angles: [90.0 * DEG * side, 0.0, 0.0],
        rates: [0.0; 3],
        acceleration: [0.0; 3],
    }
}

pub fn anchor(t: f64) -> Motion {
    let Motion { angles, rates, .. } = ferry(t);
    Motion {
        angles: [0.0, 0.0, angles[2]],
        rates: [0.0, 0.0, rates[2]],
        acceleration: [0.0; 3],
    }
}

/// A bank of 45 degrees for minutes: 1.41 g along the vertical axis.
pub fn bank(_: f64) -> Motion {
    let g = gravity(0.8);
    Motion {
        angles: [45.0 * DEG, 0.0, 0.0],
        rates: [0.0, 0.0, g / 60.0], // at 60 m/s
        acceleration: [0.0, g, 0.0],
    }
}

/// A railway curve of 600 m at 30 m/s, canted by 6 degrees, perfectly smooth.
pub fn curve(_: f64) -> Motion {
    Motion {
        angles: [6.0 * DEG, 0.0, 0.0],
        rates: [0.0, 0.0, 0.05],
        acceleration: [0.0, 1.5, 0.0],
    }
}

pub fn moves(t: f64) -> (f32, f32) {
    (20.0 + t.sin() as f32, 0.05)
}

pub fn stands(t: f64) -> (f32, f32) {
    (0.05 + 0.05 * t.sin() as f32, 0.05)
}
