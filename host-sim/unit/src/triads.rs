//! The tables `[gyro]` and `[accel]`: the errors of the sensors by their datasheet.

use firmware::configuration::Triad;
use host_core::inertial::units::{DEG, DEG_PER_H, DEG_PER_SQRT_H, G0, PPM, UG, UG_PER_SQRT_HZ};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One milliradian in rad.
pub const MRAD: f64 = 1e-3;

/// Errors of a gyro. Standard deviations (1 sigma) over units, axes and power-ons, unless a field
/// says otherwise. Source: the sensor's datasheet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Gyro {
    /// Bias at power-on: the part that is new at each power-on, and the remaining error of the
    /// calibration, deg/h, above 0 to 1e6. Required. Source: the rows run-to-run bias, bias
    /// repeatability, or bias over temperature.
    #[schemars(range(min = 1e-9, max = 1e6))]
    pub bias_turn_on_dph: f64,
    /// Bias in run: random walk of the bias in an hour, deg/h, 0 to 1e6. Required. Source: the row
    /// in-run bias stability; bias instability where there is no other.
    #[schemars(range(min = 0, max = 1e6))]
    pub bias_in_run_dph: f64,
    /// Angle random walk, deg/sqrt(h), above 0 to 1000. A plain value. Required. Source: the row
    /// angle random walk; a noise density in deg/h/sqrt(Hz) divided by 60.
    #[schemars(range(min = 1e-9, max = 1000))]
    pub angle_random_walk_dpsqrth: f64,
    /// Scale factor error, ppm (1 % is 10000), 0 to 1e6. Default: 500 (assumed).
    #[serde(default = "scale")]
    #[schemars(range(min = 0, max = 1e6))]
    pub scale_ppm: f64,
    /// Misalignment of the axes, mrad (1 deg is 17.5, 1 arcsec is 0.00485), 0 to 1000. Default: 1
    /// (assumed).
    #[serde(default = "misalignment")]
    #[schemars(range(min = 0, max = 1000))]
    pub misalignment_mrad: f64,
    /// Bias by specific force, deg/h per g, 0 to 1e6. Default: 0. Source: the row linear
    /// acceleration effect, or g-sensitivity.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1e6))]
    pub g_sensitivity_dphpg: f64,
    /// Measurement range, deg/s, above 0 to 1e5. A plain value. Default: 400.
    #[serde(default = "gyro_range")]
    #[schemars(range(min = 1e-3, max = 1e5))]
    pub range_dps: f64,
}

/// Errors of an accelerometer. Standard deviations (1 sigma) over units, axes and power-ons, unless
/// a field says otherwise. Source: the sensor's datasheet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Accel {
    /// Bias at power-on: the part that is new at each power-on, and the remaining error of the
    /// calibration, ug (1 mg is 1000), above 0 to 1e7. Required. Source: the rows run-to-run bias,
    /// bias repeatability, or bias over temperature.
    #[schemars(range(min = 1e-6, max = 1e7))]
    pub bias_turn_on_ug: f64,
    /// Bias in run: random walk of the bias in an hour, ug, 0 to 1e7. Required. Source: the row
    /// in-run bias stability; bias instability where there is no other.
    #[schemars(range(min = 0, max = 1e7))]
    pub bias_in_run_ug: f64,
    /// Velocity random walk, ug/sqrt(Hz), above 0 to 1e6. A plain value. Required. Source: the row
    /// velocity random walk or noise density; 1 m/s/sqrt(h) is 1700 ug/sqrt(Hz).
    #[schemars(range(min = 1e-6, max = 1e6))]
    pub velocity_random_walk_ugpsqrthz: f64,
    /// Scale factor error, ppm (1 % is 10000), 0 to 1e6. Default: 500 (assumed).
    #[serde(default = "scale")]
    #[schemars(range(min = 0, max = 1e6))]
    pub scale_ppm: f64,
    /// Misalignment of the axes, mrad (1 deg is 17.5, 1 arcsec is 0.00485), 0 to 1000. Default: 1
    /// (assumed).
    #[serde(default = "misalignment")]
    #[schemars(range(min = 0, max = 1000))]
    pub misalignment_mrad: f64,
    /// Second-order coefficient: error by the square of the specific force, ug/g^2, 0 to 1e6.
    /// Default: 0. Source: the rows linearity, K2, or vibration rectification.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1e6))]
    pub second_order_ugpg2: f64,
    /// Measurement range, g, above 0 to 1e5. A plain value. Default: 10.
    #[serde(default = "accel_range")]
    #[schemars(range(min = 1e-3, max = 1e5))]
    pub range_g: f64,
}

impl Gyro {
    /// In SI, for the device.
    #[must_use]
    pub fn triad(&self) -> Triad {
        Triad {
            bias_turn_on: (self.bias_turn_on_dph * DEG_PER_H) as f32,
            bias_in_run: (self.bias_in_run_dph * DEG_PER_H) as f32,
            white_noise: (self.angle_random_walk_dpsqrth * DEG_PER_SQRT_H) as f32,
            scale: (self.scale_ppm * PPM) as f32,
            misalignment: (self.misalignment_mrad * MRAD) as f32,
            g_sensitivity: (self.g_sensitivity_dphpg * DEG_PER_H / G0) as f32,
            range: (self.range_dps * DEG) as f32,
        }
    }
}

impl Accel {
    /// In SI, for the device.
    #[must_use]
    pub fn triad(&self) -> Triad {
        Triad {
            bias_turn_on: (self.bias_turn_on_ug * UG) as f32,
            bias_in_run: (self.bias_in_run_ug * UG) as f32,
            white_noise: (self.velocity_random_walk_ugpsqrthz * UG_PER_SQRT_HZ) as f32,
            scale: (self.scale_ppm * PPM) as f32,
            misalignment: (self.misalignment_mrad * MRAD) as f32,
            g_sensitivity: (self.second_order_ugpg2 * UG / (G0 * G0)) as f32,
            range: (self.range_g * G0) as f32,
        }
    }
}

fn scale() -> f64 {
    500.0
}

fn misalignment() -> f64 {
    1.0
}

fn gyro_range() -> f64 {
    400.0
}

fn accel_range() -> f64 {
    10.0
}
