//! The unit file: one TOML file in datasheet units that describes a sensor, its mounting, its
//! receiver and its vehicle.
//!
//! The device gets it as [`firmware::configuration::Configuration`] ([`Unit::configuration`]), and
//! every command of the desktop reads the same file. The JSON Schema for editors is written from
//! the same types.

#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))]

pub mod around;
pub mod ask;
pub mod mounting;
pub mod networks;
pub mod presets;
pub mod prior;
pub mod scenario;
pub mod schema;
pub mod sensor;
pub mod text;
pub mod triads;
pub mod wheels;

mod convert;
mod doubts;
mod examine;
mod finding;
mod reverse;
mod simulated;
mod sources;

pub use convert::key;
pub use examine::examine;
pub use finding::Finding;
pub use sources::Sources;

use around::{Correction, Receiver, Vehicle};
use host_core::error::Error;
use host_core::simulator::imu::ImuSpec;
use mounting::Mounting;
use networks::Networks;
use schemars::JsonSchema;
use sensor::Sensor;
use serde::{Deserialize, Serialize};
use std::path::Path;
use triads::{Accel, Gyro};
use wheels::Wheels;

/// A sensor and its surroundings.
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
    /// The sensor: the format of its frames, settings that they do not contain, and its line.
    pub sensor: Sensor,
    /// Mounting of the sensor in the vehicle.
    #[serde(default)]
    pub mounting: Mounting,
    /// Errors of the gyros.
    pub gyro: Gyro,
    /// Errors of the accelerometers.
    pub accel: Accel,
    /// The satellite receiver whose fixes the device learns from.
    #[serde(default)]
    pub receiver: Receiver,
    /// The vehicle.
    #[serde(default)]
    pub vehicle: Vehicle,
    /// Wheels whose speed a host reports. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wheels: Option<Wheels>,
    /// How corrections act.
    #[serde(default)]
    pub correction: Correction,
    /// Inputs of the networks.
    #[serde(default)]
    pub networks: Networks,
    /// Prior of the networks from a fleet of the same type of sensor, written by `host-sim fleet`.
    /// Default: derived from the datasheet above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prior: Option<prior::Prior>,
    /// All error terms of the simulated sensor. Default: derived from the datasheet above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub simulation: Option<ImuSpec>,
}

impl Unit {
    /// A preset by its name, or a file (anything that ends in `.toml` or has a path separator).
    ///
    /// # Errors
    /// Unknown name; missing or unreadable file; all that is wrong in the file, with line and key.
    pub fn load(name: &str) -> Result<Self, Error> {
        Self::load_beside(name, Path::new(""))
    }

    /// As [`Unit::load`]; a relative path starts at the directory of the file `from`, which names
    /// the unit.
    ///
    /// # Errors
    /// As [`Unit::load`].
    pub fn load_beside(name: &str, from: &Path) -> Result<Self, Error> {
        if !is_file(name) {
            let preset = Self::preset(name);
            return preset.ok_or_else(|| Error::unknown("unit", name, &presets::names()));
        }
        Self::read(&from.parent().unwrap_or(Path::new("")).join(name))
    }

    /// The unit of a file.
    ///
    /// # Errors
    /// As [`Unit::load`].
    pub fn read(file: &Path) -> Result<Self, Error> {
        let text = std::fs::read_to_string(file).map_err(|e| Error::reading(file, e))?;
        let (unit, found) = examine(&text);
        let faults = found.into_iter().filter(|finding| !finding.doubt);
        unit.ok_or_else(|| Error::Several(faults.map(|fault| fault.error(file)).collect()))
    }

    /// The text of a file with this unit, without comments beside the first one.
    ///
    /// # Errors
    /// Never for a unit that was read.
    pub fn to_text(&self, about: &str) -> Result<String, Error> {
        let table = toml::to_string(self).map_err(|e| Error::Option {
            option: "unit".into(),
            problem: e.to_string(),
            remedy: "report this fault of the program".into(),
        })?;
        Ok(format!("#:schema {}\n# {about}\n{table}", schema::FILE))
    }
}

/// Whether the name of a unit is a file name.
fn is_file(name: &str) -> bool {
    let path = Path::new(name);
    let toml = path
        .extension()
        .is_some_and(|end| end.eq_ignore_ascii_case("toml"));
    toml || path.components().count() > 1
}

impl Default for Unit {
    /// The preset `medium`.
    #[expect(clippy::expect_used, reason = "a test reads every preset")]
    fn default() -> Self {
        Self::preset("medium").expect("a preset")
    }
}

#[cfg(test)]
mod tests;
