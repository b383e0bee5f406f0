//! What a datasheet says of an IMU, in the datasheet's units. A preset is a commented TOML file; a scenario may give its own.

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
    /// Angle random walk, deg/sqrt(h); a plain value.
    pub angle_random_walk_dpsqrth: f64,
    /// Scale factor error, ppm.
    pub scale_ppm: f64,
    /// Scale factor asymmetry: error `a |rate|`, ppm.
    pub scale_asymmetry_ppm: f64,
    /// Each off-diagonal element of the misalignment matrix, arcsec.
    pub misalignment_arcsec: f64,
    /// Warm-up: bias at power-on that decays, deg/h; repeats at every turn-on to 10 %.
    pub warm_up_dph: f64,
    /// Its time constant, s, > 0; a plain value.
    pub warm_up_time_s: f64,
    /// Angle of one output pulse, arcsec, > 0; a plain value.
    pub pulse_arcsec: f64,
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
    /// Velocity random walk, ug/sqrt(Hz); a plain value.
    pub velocity_random_walk_ugpsqrthz: f64,
    /// Scale factor error, ppm.
    pub scale_ppm: f64,
    /// Scale factor asymmetry: error `a |f|`, ppm.
    pub scale_asymmetry_ppm: f64,
    /// Second-order non-linearity K2, ug/g^2.
    pub k2_ugpg2: f64,
    /// Each off-diagonal element of the misalignment matrix, arcsec.
    pub misalignment_arcsec: f64,
    /// Warm-up: bias at power-on that decays, ug; repeats at every turn-on to 10 %.
    pub warm_up_ug: f64,
    /// Its time constant, s, > 0; a plain value.
    pub warm_up_time_s: f64,
    /// Velocity of one output pulse, ug s (1 ug s = 9.80665e-6 m/s), > 0; a plain value.
    pub pulse_ugs: f64,
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
}

/// Names and texts of the presets.
pub const PRESETS: [(&str, &str); 3] = [
    ("medium", include_str!("../../assets/presets/medium.toml")),
    ("nav", include_str!("../../assets/presets/nav.toml")),
    (
        "tactical",
        include_str!("../../assets/presets/tactical.toml"),
    ),
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
        // every number of a spec is finite and not negative; times and pulses are positive
        let table = toml::Table::try_from(self).map_err(|e| e.to_string())?;
        for (triad, fields) in table.iter().filter_map(|(k, v)| Some((k, v.as_table()?))) {
            for (field, value) in fields {
                let x = value.as_float().unwrap_or(f64::NAN);
                let positive = field.ends_with("_time_s") || field.starts_with("pulse");
                if !(x.is_finite() && x >= 0.0 && (x > 0.0 || !positive)) {
                    let range = if positive { "> 0" } else { ">= 0" };
                    return Err(format!(
                        "{triad}.{field} = {x}: must be a finite number {range}"
                    ));
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_parses_passes_its_check_and_explains_every_number() {
        for (name, text) in PRESETS {
            let spec: ImuSpec = toml::from_str(text).unwrap_or_else(|e| panic!("{name}: {e}"));
            spec.check().unwrap();
            for line in text.lines().filter(|l| l.contains(" = ")) {
                let why = line.split_once('#').map_or("", |(_, c)| c.trim());
                assert!(why.len() > 5, "{name}: no source for: {line}");
            }
        }
        assert!(ImuSpec::preset("no such").is_none());
    }

    #[test]
    fn out_of_range_is_named() {
        let mut spec = ImuSpec::preset("nav").unwrap();
        spec.gyro.pulse_arcsec = 0.0;
        assert!(spec.check().unwrap_err().contains("gyro.pulse_arcsec"));
        let mut spec = ImuSpec::preset("nav").unwrap();
        spec.accel.k2_ugpg2 = f64::NAN;
        assert!(spec.check().unwrap_err().contains("accel.k2_ugpg2"));
        spec.rate_hz = 0;
        assert!(spec.check().unwrap_err().contains("rate_hz"));
    }
}
