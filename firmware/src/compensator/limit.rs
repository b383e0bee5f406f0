//! The limits of a correction, and what a compensator refuses.

use serde::{Deserialize, Serialize};

/// Largest correction, per axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    /// Gyros, rad/s, >= 0.
    pub gyro: f32,
    /// Accelerometers, m/s2, >= 0.
    pub accel: f32,
}

/// Why a [`Compensator`](super::Compensator) cannot be built; names the parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ConfigError {
    /// A count's value is not a positive finite number.
    Lsb,
    /// The sample period is not a positive finite number.
    SamplePeriod,
    /// A block has no sample.
    BlockSamples,
    /// A limit is negative or not a number.
    Limit,
    /// There are only [`OUTPUT_STREAMS`](super::OUTPUT_STREAMS) output streams.
    OutputStream,
}

impl core::fmt::Display for ConfigError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Lsb => "lsb: must be positive and finite",
            Self::SamplePeriod => "sample period: must be positive and finite",
            Self::BlockSamples => "block_samples: must be at least 1",
            Self::Limit => "limit: must be a number >= 0",
            Self::OutputStream => "stream: must be less than OUTPUT_STREAMS",
        })
    }
}

impl core::error::Error for ConfigError {}
