//! The table of a VectorNav.

use super::{Section, Sensor};
use crate::finding::Finding;
use firmware::wire::Settings;
use firmware::wire::vectornav::Values;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings that VectorNav's binary messages do not contain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct VectorNav {
    /// Which values are corrected, where a message has both. Default: sensors. Source: what the
    /// navigation computer reads.
    pub values: CorrectedValues,
}

/// Which values are corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CorrectedValues {
    /// Values of the sensors: increments, uncompensated rates and accelerations.
    #[default]
    Sensors,
    /// Values that the sensor's own filter has compensated.
    Filtered,
}

impl Section for VectorNav {
    fn of(settings: &Settings) -> Self {
        let values = match settings.vectornav.values {
            Values::Sensors => CorrectedValues::Sensors,
            Values::Filtered => CorrectedValues::Filtered,
        };
        Self { values }
    }

    fn apply(&self, _: &Sensor, to: &mut Settings) -> Result<(), Finding> {
        to.vectornav.values = match self.values {
            CorrectedValues::Sensors => Values::Sensors,
            CorrectedValues::Filtered => Values::Filtered,
        };
        Ok(())
    }
}
