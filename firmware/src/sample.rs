//! One inertial sample: three angle increments and three velocity increments.
//!
//! A sample comes as integer counts or as single-precision numbers ([`RawSample`]). [`Units`] gives
//! what its six values measure, and [`StreamScale`] how a stream of samples is scaled and timed.
//!
//! Corrections are made in counts and never in an f32 increment. At 100 deg/s and 100 Hz one unit
//! in the last place of an f32 increment is worth 0.04 deg/h, several times the correction.

use serde::{Deserialize, Serialize};

/// The six increments of one sample, in counts of the sensor. Axes and signs are the stream's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Delta-theta, counts.
    pub dtheta: [i32; 3],
    /// Delta-v, counts.
    pub dv: [i32; 3],
}

/// The value of one count. It is f64 because only setup code uses it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lsb {
    /// Angle of one gyro count, rad, > 0.
    pub rad: f64,
    /// Velocity of one accelerometer count, m/s, > 0.
    pub mps: f64,
}

/// The six values of a sample as the frame carries them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RawSample {
    /// Integer counts.
    Counts {
        /// Gyro x, y, z.
        gyro: [i32; 3],
        /// Accelerometer x, y, z.
        accel: [i32; 3],
    },
    /// Single-precision numbers (KVH).
    Floats {
        /// Gyro x, y, z.
        gyro: [f32; 3],
        /// Accelerometer x, y, z.
        accel: [f32; 3],
    },
}

impl RawSample {
    /// The sample with 0 for all other axes.
    #[must_use]
    pub fn only(mut self, axes: Axes) -> RawSample {
        fn keep<T: Default>(values: &mut [T; 3], axes: u8) {
            for (axis, value) in values.iter_mut().enumerate() {
                if axes >> axis & 1 == 0 {
                    *value = T::default();
                }
            }
        }
        match &mut self {
            RawSample::Counts { gyro, accel } => {
                keep(gyro, axes.gyro());
                keep(accel, axes.accel());
            }
            RawSample::Floats { gyro, accel } => {
                keep(gyro, axes.gyro());
                keep(accel, axes.accel());
            }
        }
        self
    }
}

/// A set of the six axes: gyro x, y, z in bits 0 to 2, accelerometer x, y, z in bits 3 to 5.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Axes(pub u8);

impl Axes {
    /// No axis.
    pub const NONE: Axes = Axes(0);
    /// All six axes.
    pub const ALL: Axes = Axes(0x3F);

    /// Axes by three bits a triad, x lowest.
    pub fn new(gyro: u8, accel: u8) -> Axes {
        Axes((gyro & 7) | (accel & 7) << 3)
    }

    /// The gyros' three bits, x lowest.
    pub fn gyro(self) -> u8 {
        self.0 & 7
    }

    /// The accelerometers' three bits, x lowest.
    pub fn accel(self) -> u8 {
        self.0 >> 3 & 7
    }
}

/// Quantity of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Quantity {
    /// Angle or velocity gained since the last sample.
    Increment,
    /// Rate or acceleration at one instant.
    Rate,
    /// Rate or acceleration averaged since the last sample.
    Average,
    /// Angle or velocity since power-on; wraps without notice.
    Integrated,
}

/// Quantity and unit of one triad's values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Unit {
    /// Quantity that is measured.
    pub quantity: Quantity,
    /// One count (or 1.0 of a float) in rad or rad/s, m/s or m/s^2.
    pub lsb: f64,
}

impl Unit {
    /// The value of one count as an increment, rad or m/s, when a sample comes every `period_s`
    /// seconds. `None` for integrated values, whose increments are differences of two samples.
    pub fn increment(self, period_s: f64) -> Option<f64> {
        match self.quantity {
            Quantity::Increment => Some(self.lsb),
            Quantity::Rate | Quantity::Average => Some(self.lsb * period_s),
            Quantity::Integrated => None,
        }
    }
}

/// Quantities and units of all six values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Units {
    /// Gyro triad.
    pub gyro: Unit,
    /// Accelerometer triad.
    pub accel: Unit,
}

/// The scale and the timing of a stream of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StreamScale {
    /// Value of a count (of 1.0, for float samples) as an increment.
    pub lsb: Lsb,
    /// Time between samples, s.
    pub period_s: f64,
    /// Samples in a block.
    pub block_samples: u16,
}

impl StreamScale {
    /// Time of a block, s.
    pub fn block_s(&self) -> f32 {
        (self.period_s * f64::from(self.block_samples)) as f32
    }
}
