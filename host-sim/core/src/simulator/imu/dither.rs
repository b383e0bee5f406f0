//! The dither of a laser gyro by its datasheet.

use super::lock_in;
use crate::inertial::units::{ARCSEC, DEG_PER_H};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Sinusoidal dither of random amplitude, and the lock-in that remains. The values are the same for
/// the three gyros.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DitherSpec {
    /// Lock-in threshold, deg/h: below this input rate a gyro without dither gives no output. 0
    /// switches lock-in off.
    pub lock_in_dph: f64,
    /// Frequency, Hz, > 0.
    pub frequency_hz: f64,
    /// Amplitude (zero to peak), arcsec, > 0.
    pub amplitude_arcsec: f64,
    /// Standard deviation of the amplitude from half period to half period, arcsec. With lock-in on
    /// it must be at least half a fringe, because it makes the lock-in errors of successive
    /// reversals independent.
    pub amplitude_noise_arcsec: f64,
    /// Angle of one whole fringe, arcsec, > 0: `lambda L / 4A` of the ring.
    pub fringe_arcsec: f64,
    /// Amplitude of the dither that remains in the output after stripping, arcsec. 0 switches it
    /// off.
    pub strip_residual_arcsec: f64,
}

impl Default for DitherSpec {
    fn default() -> Self {
        Self {
            lock_in_dph: 0.0,
            frequency_hz: 400.0,
            amplitude_arcsec: 150.0,
            amplitude_noise_arcsec: 5.0,
            fringe_arcsec: 2.42,
            strip_residual_arcsec: 0.0,
        }
    }
}

impl DitherSpec {
    /// Angle random walk that lock-in makes, rad/sqrt(s); see [`lock_in::angle_random_walk`].
    #[must_use]
    pub fn angle_random_walk(&self) -> f64 {
        lock_in::angle_random_walk(
            self.lock_in_dph * DEG_PER_H,
            self.fringe_arcsec * ARCSEC,
            self.amplitude_arcsec * ARCSEC,
            self.frequency_hz,
        )
    }
}
