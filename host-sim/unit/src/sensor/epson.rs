//! The table of an Epson IMU.

use super::{Section, Sensor};
use crate::finding::Finding;
use firmware::wire::epson::{Layout, Model, Protocol, Refused, Settings as Configured};
use firmware::wire::{ImuFormat, ImuProtocol, Settings};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings that the bursts of an Epson IMU do not contain. Source of all values: the registers of
/// the sensor, as `esensorlib` or the data sheet names them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Epson {
    /// Product (PROD_ID), such as G366PDG0. Default: G366PDG0, which is right for a G330PDG0 too.
    pub model: String,
    /// Register BURST_CTRL1: which fields a burst has. Bit 0, the checksum, must be set. Default:
    /// 0xF003 (flags, temperature, gyros, accelerometers, counter, checksum).
    pub burst_ctrl1: u16,
    /// Register BURST_CTRL2: which numbers have 32 bits. Default: 0x7000 (temperature, gyros,
    /// accelerometers).
    pub burst_ctrl2: u16,
    /// The larger accelerometer range is on (A_RANGE_CTRL), where the model has two. Default:
    /// false.
    pub high_range: bool,
    /// Register DLT_CTRL, range of the delta angle, 0 to 15. Default: 12.
    #[schemars(range(min = 0, max = 15))]
    pub angle_range: u8,
    /// Register DLT_CTRL, range of the delta velocity, 0 to 15. Default: 12.
    #[schemars(range(min = 0, max = 15))]
    pub velocity_range: u8,
    /// Increment of COUNT from one burst to the next; 0: not known, or reset by the EXT pin.
    /// Default: 0. Source: two bursts in a row.
    pub count_step: u16,
}

impl Default for Epson {
    fn default() -> Self {
        Self::of_settings(&Protocol::DEFAULT)
    }
}

impl Epson {
    /// The table of a device's settings.
    fn of_settings(settings: &Configured) -> Self {
        let [burst_ctrl1, burst_ctrl2] = settings.layout.registers();
        Self {
            model: settings.model.name().to_owned(),
            burst_ctrl1,
            burst_ctrl2,
            high_range: settings.high_range,
            angle_range: settings.angle_range,
            velocity_range: settings.velocity_range,
            count_step: settings.count_step,
        }
    }
}

impl Epson {
    fn layout(&self) -> Result<Layout, Refused> {
        Layout::new(self.burst_ctrl1, self.burst_ctrl2)
    }
}

impl Section for Epson {
    fn of(settings: &Settings) -> Self {
        Self::of_settings(&settings.epson)
    }

    fn apply(&self, sensor: &Sensor, to: &mut Settings) -> Result<(), Finding> {
        let model = Model::ALL.into_iter().find(|m| m.name() == self.model);
        let Some(model) = model else {
            let names: Vec<&str> = Model::ALL.iter().map(|m| m.name()).collect();
            return Err(Finding::wrong(
                "sensor.epson.model",
                format!("is '{}', whose scales are not known", self.model),
                format!("give one of {}", names.join(", ")),
            ));
        };
        let layout = self.layout().map_err(|refused| {
            Finding::wrong(
                "sensor.epson.burst_ctrl1",
                format!("is {:#06X}: {refused}", self.burst_ctrl1),
                "0xF003 has all that is needed",
            )
        })?;
        to.epson = Configured {
            layout,
            model,
            high_range: self.high_range,
            angle_range: self.angle_range,
            velocity_range: self.velocity_range,
            count_step: self.count_step,
        };
        if Protocol::stream(&to.epson, 0, sensor.rate()).is_none() {
            return Err(Finding::wrong(
                "sensor.epson.model",
                format!(
                    "is '{}', which has no such range or no delta angle and velocity",
                    self.model
                ),
                "look at high_range, angle_range, velocity_range (0 to 15) and bits 11 and 10 of \
                 burst_ctrl1",
            ));
        }
        Ok(())
    }

    fn frame_len(&self, _: ImuFormat) -> usize {
        self.layout().map_or(0, Layout::bytes)
    }
}
