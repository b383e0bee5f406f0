//! What a datasheet says of an IMU, in the datasheet's units. A preset is a commented TOML file; a scenario may give its own.
//!
//! A cause whose field is not in the file is off: a number that is left out is zero. In names `p` stands for `per`.

use super::lock_in;
use crate::inertial::units::{ARCSEC, DEG_PER_H, DEG_PER_SQRT_H};
use serde::{Deserialize, Serialize};

/// Statistics of a gyro triad. Values are standard deviations per axis unless a field says otherwise; all >= 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GyroSpec {
    /// Bias of the unit, the same at every turn-on, deg/h.
    pub bias_unit_dph: f64,
    /// Bias that is new at every turn-on, deg/h.
    pub bias_turn_on_dph: f64,
    /// In-run bias instability (first-order Gauss-Markov), deg/h.
    pub bias_drift_dph: f64,
    /// Its time constant, s, > 0.
    pub bias_drift_time_s: f64,
    /// Rate random walk K, deg/h/sqrt(h); a plain value.
    #[serde(default)]
    pub rate_random_walk_dphpsqrth: f64,
    /// Angle random walk but for the part that lock-in makes (see [`DitherSpec`]), deg/sqrt(h); a plain value.
    pub angle_random_walk_dpsqrth: f64,
    /// Scale factor error, ppm.
    pub scale_ppm: f64,
    /// Scale factor asymmetry: error `a |rate|`, ppm.
    pub scale_asymmetry_ppm: f64,
    /// Scale factor non-linearity: error `n rate (rate / nonlinearity_rate)^2`, ppm.
    #[serde(default)]
    pub nonlinearity_ppm: f64,
    /// Rate at which the non-linearity is given, deg/s, > 0; a plain value.
    #[serde(default = "hundred")]
    pub nonlinearity_rate_dps: f64,
    /// Each off-diagonal element of the misalignment matrix, arcsec.
    pub misalignment_arcsec: f64,
    /// Warm-up: bias at power-on that decays, deg/h; repeats at every turn-on to 10 %.
    pub warm_up_dph: f64,
    /// Its time constant, s, > 0; a plain value.
    pub warm_up_time_s: f64,
    /// Bias per kelvin of the block off its calibration temperature, deg/h/K.
    #[serde(default)]
    pub temperature_dphpk: f64,
    /// The same, quadratic, deg/h/K^2.
    #[serde(default)]
    pub temperature_dphpk2: f64,
    /// Bias per heating rate of the block, deg/h/(K/min).
    #[serde(default)]
    pub heating_dphpkpmin: f64,
    /// Bias per product of heating rate and temperature, deg/h/(K^2/min).
    #[serde(default)]
    pub heating_temperature_dphpk2pmin: f64,
    /// Bias per temperature difference across the block, deg/h/K.
    #[serde(default)]
    pub gradient_dphpk: f64,
    /// Bias per magnetic field: each element of the matrix from the field in body axes to the bias, deg/h/gauss.
    #[serde(default)]
    pub magnetic_dphpgauss: f64,
    /// Angle of one output pulse, arcsec, > 0; a plain value.
    pub pulse_arcsec: f64,
    /// Dither and lock-in.
    #[serde(default)]
    pub dither: DitherSpec,
}

/// Sinusoidal dither of random amplitude, and the lock-in that is left of it. Plain values, the same for the three gyros.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DitherSpec {
    /// Lock-in threshold: below this input rate an undithered gyro stands still, deg/h; 0 switches lock-in off.
    pub lock_in_dph: f64,
    /// Frequency, Hz, > 0.
    pub frequency_hz: f64,
    /// Amplitude (zero to peak), arcsec, > 0.
    pub amplitude_arcsec: f64,
    /// Standard deviation of the amplitude from half period to half period, arcsec; at least half a fringe with lock-in on,
    /// because it is what makes the lock-in error of one reversal independent of the next one's.
    pub amplitude_noise_arcsec: f64,
    /// Angle of one whole fringe, arcsec, > 0: `lambda L / 4A` of the ring.
    pub fringe_arcsec: f64,
    /// Amplitude of the dither that is left in the output after stripping, arcsec; 0 switches it off.
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

impl GyroSpec {
    /// Whole angle random walk, of lock-in and of everything else, deg/sqrt(h): what a filter should expect.
    #[must_use]
    pub fn total_angle_random_walk_dpsqrth(&self) -> f64 {
        let lock_in = self.dither.angle_random_walk() / DEG_PER_SQRT_H;
        self.angle_random_walk_dpsqrth.hypot(lock_in)
    }
}

/// Statistics of an accelerometer triad. Values are standard deviations per axis unless a field says otherwise; all >= 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AccelSpec {
    /// Bias of the unit, the same at every turn-on, ug.
    pub bias_unit_ug: f64,
    /// Bias that is new at every turn-on, ug.
    pub bias_turn_on_ug: f64,
    /// In-run bias instability (first-order Gauss-Markov), ug.
    pub bias_drift_ug: f64,
    /// Its time constant, s, > 0.
    pub bias_drift_time_s: f64,
    /// Acceleration random walk, ug/sqrt(h); a plain value.
    #[serde(default)]
    pub acceleration_random_walk_ugpsqrth: f64,
    /// Velocity random walk, ug/sqrt(Hz); a plain value.
    pub velocity_random_walk_ugpsqrthz: f64,
    /// Scale factor error, ppm.
    pub scale_ppm: f64,
    /// Scale factor asymmetry: error `a |f|`, ppm.
    pub scale_asymmetry_ppm: f64,
    /// Second-order non-linearity K2, ug/g^2. It rectifies by itself the vibration that the words show.
    pub k2_ugpg2: f64,
    /// Cross coupling K_ip: error `k f_i f_p` with the pendulous axis p of x, y, z along y, z, x (IEEE 1293), ug/g^2.
    #[serde(default)]
    pub cross_coupling_ugpg2: f64,
    /// Rectification of the vibration above the word rate, which K2 cannot see, ug/g^2 rms.
    #[serde(default)]
    pub vibration_rectification_ugpg2: f64,
    /// Mean square of the vibration above the word rate over that of the last second's words; a plain value.
    #[serde(default = "one")]
    pub vibration_above_ratio: f64,
    /// Each off-diagonal element of the misalignment matrix, arcsec.
    pub misalignment_arcsec: f64,
    /// Size effect: each component of the place of each accelerometer off the common point, after the maker's own
    /// compensation, mm.
    #[serde(default)]
    pub size_effect_mm: f64,
    /// Delay of the accelerometer words behind the gyro words, s, at most 0.1; a plain value.
    #[serde(default)]
    pub delay_s: f64,
    /// Warm-up: bias at power-on that decays, ug; repeats at every turn-on to 10 %.
    pub warm_up_ug: f64,
    /// Its time constant, s, > 0; a plain value.
    pub warm_up_time_s: f64,
    /// Bias per kelvin of the block off its calibration temperature, ug/K.
    #[serde(default)]
    pub temperature_ugpk: f64,
    /// The same, quadratic, ug/K^2.
    #[serde(default)]
    pub temperature_ugpk2: f64,
    /// Bias per heating rate of the block, ug/(K/min).
    #[serde(default)]
    pub heating_ugpkpmin: f64,
    /// Bias per product of heating rate and temperature, ug/(K^2/min).
    #[serde(default)]
    pub heating_temperature_ugpk2pmin: f64,
    /// Bias per temperature difference across the block, ug/K.
    #[serde(default)]
    pub gradient_ugpk: f64,
    /// Velocity of one output pulse, ug s (1 ug s = 9.80665e-6 m/s), > 0; a plain value.
    pub pulse_ugs: f64,
}

/// Temperature of the sensor block; see [`super::thermal`]. Without a block in the file it stays at its calibration temperature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BlockSpec {
    /// Ambient temperature at power-on off the calibration temperature, standard deviation over turn-ons, K.
    pub ambient_offset_k: f64,
    /// Change of the ambient temperature, standard deviation over turn-ons, K/h.
    pub ambient_ramp_kph: f64,
    /// Rise of the block over the ambient by its own power in the end; a plain value, K.
    pub self_heating_k: f64,
    /// Time constant of that rise, s, > 0; a plain value.
    pub heating_time_s: f64,
    /// Thickness of the block between the heated and the free face, mm; a plain value.
    pub thickness_mm: f64,
}

impl Default for BlockSpec {
    fn default() -> Self {
        Self {
            ambient_offset_k: 0.0,
            ambient_ramp_kph: 0.0,
            self_heating_k: 0.0,
            heating_time_s: 900.0,
            thickness_mm: 40.0,
        }
    }
}

/// An IMU as its datasheet describes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImuSpec {
    /// Words per second; a whole number.
    pub rate_hz: u32,
    /// Gyro triad.
    pub gyro: GyroSpec,
    /// Accelerometer triad.
    pub accel: AccelSpec,
    /// Temperature of the block.
    #[serde(default)]
    pub block: BlockSpec,
}

fn one() -> f64 {
    1.0
}

fn hundred() -> f64 {
    100.0
}

/// Names and texts of the presets.
pub const PRESETS: [(&str, &str); 3] = [
    (
        "medium",
        include_str!("../../../assets/presets/medium.toml"),
    ),
    ("nav", include_str!("../../../assets/presets/nav.toml")),
    (
        "tactical",
        include_str!("../../../assets/presets/tactical.toml"),
    ),
];

/// Longest delay between the triads, s.
const LONGEST_DELAY_S: f64 = 0.1;
/// Numbers that must be above zero because something is divided by them.
const POSITIVE: [&str; 6] = [
    "pulse_arcsec",
    "pulse_ugs",
    "nonlinearity_rate_dps",
    "frequency_hz",
    "amplitude_arcsec",
    "fringe_arcsec",
];

impl ImuSpec {
    /// A preset by name, if there is one.
    #[must_use]
    pub fn preset(name: &str) -> Option<Self> {
        let (_, text) = PRESETS.iter().find(|(n, _)| *n == name)?;
        toml::from_str(text).ok()
    }

    /// The first field that is out of its range, with what is wrong.
    ///
    /// # Errors
    /// Names the field and its range.
    pub fn check(&self) -> Result<(), String> {
        if !(10..=4000).contains(&self.rate_hz) {
            return Err(format!("rate_hz = {}: must be 10 to 4000", self.rate_hz));
        }
        check_table("", &toml::Table::try_from(self).map_err(|e| e.to_string())?)?;
        if self.accel.delay_s > LONGEST_DELAY_S {
            let delay = self.accel.delay_s;
            return Err(format!(
                "accel.delay_s = {delay}: must be 0 to {LONGEST_DELAY_S}"
            ));
        }
        let dither = &self.gyro.dither;
        if dither.lock_in_dph > 0.0 && dither.amplitude_noise_arcsec < 0.5 * dither.fringe_arcsec {
            return Err(format!(
                "gyro.dither.amplitude_noise_arcsec = {}: must be at least half of fringe_arcsec = {}, or the gyro stays \
                 locked at some rates and no random walk describes it",
                dither.amplitude_noise_arcsec, dither.fringe_arcsec
            ));
        }
        Ok(())
    }
}

/// Every number of a spec is finite and not negative; times and what is divided by are positive.
fn check_table(path: &str, table: &toml::Table) -> Result<(), String> {
    for (field, value) in table {
        match value {
            toml::Value::Table(inner) => check_table(&format!("{path}{field}."), inner)?,
            toml::Value::Float(x) => {
                let positive = field.ends_with("_time_s") || POSITIVE.contains(&field.as_str());
                if !(x.is_finite() && *x >= 0.0 && (*x > 0.0 || !positive)) {
                    let range = if positive { "> 0" } else { ">= 0" };
                    return Err(format!(
                        "{path}{field} = {x}: must be a finite number {range}"
                    ));
                }
            }
            _ => {}
        }
    }
    Ok(())
}
