//! The unit file: one TOML file in datasheet units that tells what is known of a sensor, its
//! mounting, its receiver and its vehicle.
//!
//! The device gets it as [`firmware::configuration::Configuration`] ([`Unit::configuration`]), and
//! every command of the desktop reads the same file. The JSON Schema for editors is written from the
//! same types.

pub mod around;
pub mod mounting;
pub mod sensor;
pub mod triads;

mod convert;
mod finding;
mod reverse;

pub use convert::key;
pub use finding::Finding;

use crate::error::Error;
use crate::simulator::imu::ImuSpec;
use around::{Correction, Receiver, Vehicle};
use mounting::Mounting;
use schemars::JsonSchema;
use sensor::Sensor;
use serde::{Deserialize, Serialize};
use std::path::Path;
use triads::{Accel, Gyro};

/// What is known of one sensor and its surroundings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Unit {
    /// Name of the unit, 1 to 32 characters of ASCII. Required.
    #[schemars(length(min = 1, max = 32))]
    pub name: String,
    /// Serial number of the sensor, at most 24 characters of ASCII. Default: empty. Source: the
    /// label.
    #[serde(default)]
    #[schemars(length(max = 24))]
    pub serial: String,
    /// The sensor: the format of its frames, what they do not tell, and its line.
    pub sensor: Sensor,
    /// How the sensor sits in the vehicle.
    #[serde(default)]
    pub mounting: Mounting,
    /// Errors of the gyros.
    pub gyro: Gyro,
    /// Errors of the accelerometers.
    pub accel: Accel,
    /// The satellite receiver whose fixes teach the device.
    #[serde(default)]
    pub receiver: Receiver,
    /// The vehicle.
    #[serde(default)]
    pub vehicle: Vehicle,
    /// How corrections act.
    #[serde(default)]
    pub correction: Correction,
    /// All error terms of the simulated sensor. Default: derived from the datasheet above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub simulation: Option<ImuSpec>,
}

impl Unit {
    /// The unit of a file.
    ///
    /// # Errors
    /// Missing or unreadable file; unknown key, wrong type or value out of range, with file, line
    /// and key.
    pub fn load(name: &str) -> Result<Self, Error> {
        let path = Path::new(name);
        let text = std::fs::read_to_string(path).map_err(|e| Error::reading(path, e))?;
        let line = |at: usize| text[..at.min(text.len())].matches('\n').count() + 1;
        let bad = |line, key: String, problem: String, remedy: String| Error::Scenario {
            file: path.to_path_buf(),
            line,
            key,
            problem,
            remedy,
        };
        let unit: Self = toml::from_str(&text).map_err(|e| {
            let at = e.span().map(|span| line(span.start));
            let remedy = "see the section on unit files in docs/USING.md";
            bad(
                at,
                "file".into(),
                e.message().replace('\n', " "),
                remedy.into(),
            )
        })?;
        unit.configuration()
            .map_err(|f| bad(None, f.key, f.problem, f.remedy))?;
        Ok(unit)
    }
}

#[cfg(test)]
mod tests;
