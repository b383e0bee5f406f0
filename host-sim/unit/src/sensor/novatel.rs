//! The table of NovAtel logs.

use super::{Section, Sensor};
use crate::finding::Finding;
use firmware::wire::novatel::{ImuType, SHORT_LEN};
use firmware::wire::{ImuFormat, Settings};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings that NovAtel's raw logs do not contain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Novatel {
    /// NovAtel's number of the IMU behind RAWIMU and RAWIMUS, which the logs RAWIMUX and RAWIMUSX
    /// contain themselves. Default: 0, not known. Source: OEM7 documentation, log RAWIMUSX.
    #[schemars(range(min = 0, max = 255))]
    pub imu_type: u8,
}

impl Section for Novatel {
    fn of(settings: &Settings) -> Self {
        Self {
            imu_type: settings.novatel.imu_type.0,
        }
    }

    fn apply(&self, _: &Sensor, to: &mut Settings) -> Result<(), Finding> {
        let kind = ImuType(self.imu_type);
        if self.imu_type != 0 && kind.units().is_none() {
            return Err(Finding::wrong(
                "sensor.novatel.imu_type",
                format!("is {}, whose scale is not known", self.imu_type),
                "give the number of an IMU of the list in docs/ICD.md, or 0 for RAWIMUX and \
                 RAWIMUSX",
            ));
        }
        to.novatel.imu_type = kind;
        Ok(())
    }

    fn rate_hz(&self, _: ImuFormat) -> f64 {
        ImuType(self.imu_type).rate().map_or(100.0, f64::from)
    }

    fn frame_len(&self, _: ImuFormat) -> usize {
        SHORT_LEN
    }
}
