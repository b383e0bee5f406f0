//! Configuration of a navigator.

use super::Noise;
use crate::sample::Lsb;

/// Length of a piece that [`Config::new`] aims at, s.
const PIECE_S: f64 = 0.05;

/// Configuration of a navigator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// Value of a count.
    pub lsb: Lsb,
    /// Time between samples, s, 1e-5 to 1.
    pub sample_s: f64,
    /// Samples in a piece, >= 1. A piece should be short against any change of attitude, and should
    /// divide the time between fixes.
    pub piece_samples: u16,
    /// White noise of the sensors.
    pub noise: Noise,
    /// Lever arm from the sensors to the antenna whose fixes are compared, body axes, m.
    pub lever_arm: [f32; 3],
}

impl Config {
    /// A configuration with pieces of 50 ms, to the nearest whole sample, and the antenna at the
    /// sensors.
    #[must_use]
    pub fn new(lsb: Lsb, sample_s: f64, noise: Noise) -> Self {
        // `as` saturates and makes 0 of NaN
        let piece_samples = (libm::round(PIECE_S / sample_s) as u16).max(1);
        Self {
            lsb,
            sample_s,
            piece_samples,
            noise,
            lever_arm: [0.0; 3],
        }
    }
}

/// Why a [`super::Navigator`] cannot be built; names the parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ConfigError {
    /// A count's value is not a positive finite number.
    Lsb,
    /// The sample period is not within 1e-5 to 1 s.
    SamplePeriod,
    /// A piece has no sample.
    PieceSamples,
    /// A noise is negative or not finite.
    Noise,
    /// The state is not finite, its attitude is no unit quaternion, or it is outside the range of
    /// the equations.
    State,
}

impl core::fmt::Display for ConfigError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Lsb => "lsb: must be positive and finite",
            Self::SamplePeriod => "sample_s: must be within 1e-5 to 1 s",
            Self::PieceSamples => "piece_samples: must be at least 1",
            Self::Noise => "noise: must be finite and >= 0",
            Self::State => {
                "state: must be finite, with a unit quaternion, within 89.99 deg, 100 km, 10 km/s"
            }
        })
    }
}

impl core::error::Error for ConfigError {}
