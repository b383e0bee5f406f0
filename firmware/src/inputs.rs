//! The inputs of the networks: three sources for each triad, from the sums of a block.
//!
//! The paper's networks get their own triad's rates or forces ([`OWN`]). Errors that follow
//! temperature, vibration or the other triad need other inputs. A unit's configuration chooses
//! them.

use crate::sample::RawSample;
use serde::{Deserialize, Serialize};

/// A quantity that may enter a network. The order of the variants is part of the configuration
/// record: new ones go to the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Source {
    /// Rate about x, rad/s.
    RateX = 0,
    /// Rate about y, rad/s.
    RateY,
    /// Rate about z, rad/s.
    RateZ,
    /// Specific force along x, m/s2.
    ForceX,
    /// Specific force along y, m/s2.
    ForceY,
    /// Specific force along z, m/s2.
    ForceZ,
    /// Temperature of the sensor, degrees C.
    Temperature,
    /// Rate of change of the temperature, K/s.
    TemperatureRate,
    /// Vibration, (m/s2)^2: see [`Sources::vibration`].
    Vibration,
    /// Magnitude of the rate, rad/s.
    RateMagnitude,
}

impl Source {
    /// All sources, in the order of their numbers.
    pub const ALL: [Source; 10] = [
        Source::RateX,
        Source::RateY,
        Source::RateZ,
        Source::ForceX,
        Source::ForceY,
        Source::ForceZ,
        Source::Temperature,
        Source::TemperatureRate,
        Source::Vibration,
        Source::RateMagnitude,
    ];

    /// Whether it needs a thermometer in the sensor.
    #[must_use]
    pub const fn needs_thermometer(self) -> bool {
        matches!(self, Source::Temperature | Source::TemperatureRate)
    }
}

/// The inputs of the gyro network, then those of the accelerometer network.
pub type Inputs = [[Source; 3]; 2];

/// Each network sees its own triad.
pub const OWN: Inputs = [
    [Source::RateX, Source::RateY, Source::RateZ],
    [Source::ForceX, Source::ForceY, Source::ForceZ],
];

/// Whether networks with these inputs begin in their steady state ([`lrnn_nostd::Net::settle`]):
/// a temperature was there before power-on.
#[must_use]
pub fn settles(inputs: &Inputs) -> bool {
    let mut all = inputs.as_flattened().iter();
    all.any(|source| *source == Source::Temperature)
}

/// Temperature that stands for an unknown one, degrees C: that of most calibrations.
pub const REFERENCE_DEGC: f32 = 25.0;

/// Sources from a block of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sources {
    /// Mean rate, rad/s.
    pub rate: [f32; 3],
    /// Mean specific force, m/s2.
    pub force: [f32; 3],
    /// Mean of the sensor's temperature, degrees C; [`REFERENCE_DEGC`] before the first reading.
    pub temperature: f32,
    /// Rate of change of the temperature, K/s; 0 while it is not known: see [`Thermometer`].
    pub temperature_rate: f32,
    /// Sum over the axes of the mean square of the specific force about its mean in the block,
    /// (m/s2)^2. 0 unless an input asks for it.
    pub vibration: f32,
}

impl Sources {
    /// Sources of a block with these means, of which no more is known.
    #[must_use]
    pub const fn of(rate: [f32; 3], force: [f32; 3]) -> Sources {
        Sources {
            rate,
            force,
            temperature: REFERENCE_DEGC,
            temperature_rate: 0.0,
            vibration: 0.0,
        }
    }

    /// The inputs of a network.
    #[must_use]
    pub fn select(&self, which: &[Source; 3]) -> [f32; 3] {
        which.map(|source| self.value(source))
    }

    fn value(&self, source: Source) -> f32 {
        let [rate_x, rate_y, rate_z] = self.rate;
        let [force_x, force_y, force_z] = self.force;
        match source {
            Source::RateX => rate_x,
            Source::RateY => rate_y,
            Source::RateZ => rate_z,
            Source::ForceX => force_x,
            Source::ForceY => force_y,
            Source::ForceZ => force_z,
            Source::Temperature => self.temperature,
            Source::TemperatureRate => self.temperature_rate,
            Source::Vibration => self.vibration,
            Source::RateMagnitude => {
                libm::sqrtf(rate_x * rate_x + rate_y * rate_y + rate_z * rate_z)
            }
        }
    }
}

/// Time constant of the low-pass that the temperature's rate of change follows from, s.
const LOW_PASS_S: f32 = 60.0;
/// Time after the first reading in which the rate of change counts as unknown, s.
const UNKNOWN_S: f32 = 10.0;
/// After so long without a reading the low-pass restarts, s.
const GAP_S: f32 = 60.0;
/// Readings outside of these are no temperatures of a sensor that works, degrees C.
const PLAUSIBLE_DEGC: core::ops::RangeInclusive<f32> = -100.0..=200.0;

/// Mean and rate of change of the readings of the sensor's thermometer.
///
/// The rate is that by which the temperature T leads its first-order low-pass L with time constant
/// c = 60 s, started at the first reading: `(T - L) / c / (1 - exp(-t / c))` at time t after that
/// reading. It is exact for a ramp from the first reading on. Between two readings T is taken to be
/// a straight line, so it does not depend on how often the thermometer is read.
#[derive(Debug, Clone, Default)]
pub struct Thermometer {
    /// Readings of the block in progress: the first one, the sum of the differences of the others
    /// to it, and their number. So the mean of equal readings is that reading.
    first: f32,
    sum: f32,
    readings: u16,
    /// Mean of the last block that had a reading, degrees C.
    last: Option<f32>,
    /// T - L, K.
    lead: f32,
    /// Time from the first reading to the last block that had one, s.
    age_s: f32,
    /// Time since then, s.
    silent_s: f32,
}

impl Thermometer {
    /// Takes a reading, degrees C. What cannot be a temperature is ignored.
    #[inline(always)]
    pub fn read(&mut self, celsius: f32) {
        if !PLAUSIBLE_DEGC.contains(&celsius) {
            return;
        }
        if self.readings == 0 {
            (self.first, self.sum) = (celsius, 0.0);
        }
        self.sum += celsius - self.first;
        self.readings = self.readings.saturating_add(1);
    }

    /// Gives up the readings of the block in progress; so many seconds have passed in it.
    pub fn give_up(&mut self, seconds: f32) {
        self.readings = 0;
        self.silent_s += seconds;
    }

    /// A block of this length, s, is over: temperature in degrees C and its rate of change in K/s.
    pub fn end_block(&mut self, block_s: f32) -> [f32; 2] {
        self.silent_s += block_s;
        if self.readings > 0 {
            let mean = self.first + self.sum / f32::from(self.readings);
            self.readings = 0;
            self.follow(mean);
        }
        let known = self.age_s >= UNKNOWN_S && self.silent_s <= GAP_S;
        let rate = if known {
            self.lead / LOW_PASS_S / (1.0 - libm::expf(-self.age_s / LOW_PASS_S))
        } else {
            0.0
        };
        [self.last.unwrap_or(REFERENCE_DEGC), rate]
    }

    fn follow(&mut self, celsius: f32) {
        let time = core::mem::take(&mut self.silent_s);
        match self.last.replace(celsius) {
            Some(last) if time <= GAP_S => {
                let stays = libm::expf(-time / LOW_PASS_S);
                let slope = (celsius - last) / time;
                self.lead = stays * self.lead + slope * LOW_PASS_S * (1.0 - stays);
                self.age_s += time;
            }
            _ => (self.lead, self.age_s) = (0.0, 0.0),
        }
    }
}

/// Sums of a block from which its vibration follows, in counts or in units of a float sample.
#[derive(Debug, Clone, Default)]
pub struct Vibration {
    /// The block's first sample. The others are compared with it: squares of whole counts would
    /// lose what they differ by.
    first: [i32; 3],
    first_float: [f32; 3],
    sum: [f32; 3],
    squares: f32,
}

impl Vibration {
    /// Takes a sample; `begins`: it is the first of a block.
    #[inline(never)] // not in the path of every sample
    pub fn add(&mut self, begins: bool, sample: &RawSample) {
        if begins {
            *self = Vibration::default();
        }
        let difference: [f32; 3] = match *sample {
            RawSample::Counts { accel, .. } => {
                if begins {
                    self.first = accel;
                }
                let [x, y, z] = self.first;
                let [a, b, c] = accel;
                [a.wrapping_sub(x), b.wrapping_sub(y), c.wrapping_sub(z)].map(|d| d as f32)
            }
            RawSample::Floats { accel, .. } => {
                if begins {
                    self.first_float = accel;
                }
                let [x, y, z] = self.first_float;
                let [a, b, c] = accel;
                [a - x, b - y, c - z]
            }
        };
        for (sum, d) in self.sum.iter_mut().zip(difference) {
            *sum += d;
            self.squares += d * d;
        }
    }

    /// Sum over the axes of the mean square about the mean, where a unit is worth `per_unit` m/s2;
    /// 0 where it is no finite number.
    #[must_use]
    pub fn mean_square(&self, samples: u16, per_unit: f32) -> f32 {
        let n = f32::from(samples.max(1));
        let of_mean: f32 = self.sum.iter().map(|sum| sum * (sum / n)).sum();
        let mean = (self.squares - of_mean) / n * per_unit * per_unit;
        if mean.is_finite() { mean.max(0.0) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests;
