//! Detection of standstill, second by second, from the means of the samples.
//!
//! A second passes when two conditions hold. Its mean rate and specific force differ from those of
//! the standstill so far by no more than noise and sway explain (5 sigma an axis). And, biases
//! allowed for, the rate is at most the Earth's and the force is gravity's. A vehicle that moves
//! straight and evenly can pass too: a caller that knows a velocity reports motion by
//! [`Standstill::moves`].

use crate::nav::vector::{V32, add, dot, scale};

/// Datasheet of the sensors, for the detector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensors {
    /// White noise of the gyros, rad/sqrt(s), and of the accelerometers, m/s/sqrt(s).
    pub noise: [f32; 2],
    /// Standard deviation of the biases, rad/s and m/s2.
    pub bias: [f32; 2],
}

/// Sway of a standing vehicle by people and wind: standard deviations of angle (rad) and velocity
/// (m/s). Assumed, the velocity as in `host_sim::learning::teacher`.
const SWAY: [f32; 2] = [1e-4, 0.01];
/// Largest deviation, in standard deviations.
const GATE: f32 = 5.0;
/// Earth rate, rad/s.
const EARTH: f32 = 7.292e-5;
/// Gravity on Earth from 9 km high at the equator to the pole, m/s2.
const GRAVITY: [f32; 2] = [9.752, 9.833];

/// The detector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standstill {
    /// Largest difference of a component from the mean so far, rad/s and m/s2.
    step: [f32; 2],
    /// Largest rate, and largest distance of the force from gravity's range.
    rate: f32,
    force: f32,
    mean: [V32; 2],
    seconds: u32,
    /// Difference of the last second's force from the mean before it, m/s2.
    change: f32,
}

impl Standstill {
    /// A detector with thresholds from the sensors' noise and biases.
    #[must_use]
    pub fn new(sensors: &Sensors) -> Self {
        let [gyro, accel] = [0, 1].map(|i| {
            let (noise, sway) = (sensors.noise[i], SWAY[i]);
            // the mean over a second has the noise once; sway is the difference of two ends
            libm::sqrtf(noise * noise + 2.0 * sway * sway)
        });
        let root2 = core::f32::consts::SQRT_2;
        Self {
            step: [GATE * root2 * gyro, GATE * root2 * accel],
            rate: EARTH + GATE * (gyro + sensors.bias[0]),
            force: GATE * (accel + sensors.bias[1]),
            mean: [[0.0; 3]; 2],
            seconds: 0,
            change: 0.0,
        }
    }

    /// Takes the mean rate (rad/s) and specific force (m/s2) of a second. True: it passed.
    pub fn second(&mut self, rate: V32, force: V32) -> bool {
        let now = [rate, force];
        let difference = add(force, scale(self.mean[1], -1.0));
        self.change = libm::sqrtf(dot(difference, difference));
        let within = |i: usize| {
            let pairs = now[i].iter().zip(&self.mean[i]);
            pairs.fold(true, |all, (a, b)| all & ((a - b).abs() <= self.step[i]))
        };
        let steady = self.seconds == 0 || (within(0) & within(1));
        let size = libm::sqrtf(dot(force, force));
        let slow = dot(rate, rate) <= self.rate * self.rate;
        let level = size >= GRAVITY[0] - self.force && size <= GRAVITY[1] + self.force;
        if slow && level {
            // a second that ends a standstill may begin another one
            self.seconds = if steady {
                self.seconds.saturating_add(1)
            } else {
                1
            };
            let share = 1.0 / self.seconds as f32;
            for (mean, now) in self.mean.iter_mut().zip(&now) {
                for (mean, now) in mean.iter_mut().zip(now) {
                    *mean += (now - *mean) * share;
                }
            }
        } else {
            self.seconds = 0;
        }
        steady && self.seconds > 0
    }

    /// Another source shows that the vehicle moves.
    pub fn moves(&mut self) {
        self.seconds = 0;
    }

    /// The velocity that a vehicle may have gained in the last second although it passed, m/s: a
    /// smooth departure begins below the thresholds.
    #[must_use]
    pub fn gain_mps(&self) -> f32 {
        self.change // over one second
    }

    /// Seconds in a row that the vehicle has stood.
    #[must_use]
    pub fn seconds(&self) -> u32 {
        self.seconds
    }
}
