//! Settings of the learner from fixes.

use super::bank::Gates;
use super::prior::Datasheet;
use crate::align::Sensors;
use crate::nav::Noise;

/// What the learner must know of the sensors and the receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Biases and ranges of the sensors.
    pub sheet: Datasheet,
    /// White noise of the sensors.
    pub noise: Noise,
    /// When an observation is refused and when a hypothesis is promoted.
    pub gates: Gates,
    /// Length of an alignment that is not commanded, s, >= [`crate::align::LEAST_S`].
    pub align_s: f64,
    /// Least age of a fix when it arrives, s, 0 to 1. What a fix is later than the earliest is
    /// measured: see [`super::age`].
    pub fix_age_s: f32,
}

impl Settings {
    /// The medium laser-gyro IMU of `host-sim` (preset `medium`): 0.34 deg/h, 410 ug, 0.005
    /// deg/sqrt(h), 20 ug/sqrt(Hz). A receiver whose messages come after 100 ms, as at 115 200
    /// baud.
    pub const MEDIUM: Settings = Settings {
        sheet: Datasheet::land_vehicle(1.63e-6, 4e-3),
        noise: Noise {
            gyro: 1.46e-6,
            accel: 1.96e-4,
        },
        gates: Gates::USUAL,
        align_s: 100.0,
        fix_age_s: 0.1,
    };

    /// What the alignment and the standstill detector must know.
    #[must_use]
    pub fn sensors(&self) -> Sensors {
        Sensors {
            noise: [self.noise.gyro, self.noise.accel],
            bias: [self.sheet.gyro_bias, self.sheet.accel_bias],
        }
    }
}
