//! The table of MAVLink.

use super::{Section, Sensor};
use crate::finding::Finding;
use firmware::wire::Settings;
use firmware::wire::mavlink::Imu;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which of the IMUs on a MAVLink line is corrected. Source: the autopilot's parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Mavlink {
    /// System, 0 to 255; 0 is any. Default: 0.
    #[schemars(range(min = 0, max = 255))]
    pub system: u8,
    /// Component, 0 to 255; 0 is any. Default: 0.
    #[schemars(range(min = 0, max = 255))]
    pub component: u8,
    /// Number of the IMU, field `id` of HIGHRES_IMU, 0 to 255. Default: 0.
    #[schemars(range(min = 0, max = 255))]
    pub id: u8,
}

impl Section for Mavlink {
    fn of(settings: &Settings) -> Self {
        let Imu {
            system,
            component,
            id,
        } = settings.mavlink.imu;
        Self {
            system,
            component,
            id,
        }
    }

    fn apply(&self, _: &Sensor, to: &mut Settings) -> Result<(), Finding> {
        to.mavlink.imu = Imu {
            system: self.system,
            component: self.component,
            id: self.id,
        };
        Ok(())
    }
}
