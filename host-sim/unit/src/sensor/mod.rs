//! The table `[sensor]`: the format of the sensor's frames, settings that they do not contain, and
//! the serial line.
//!
//! **A new format** is one row of `sensor!` below. A format without such settings has the table
//! [`Plain`]. Another one gets a file here, with a type that implements [`Section`].

mod adis;
mod epson;
mod kvh;
mod mavlink;
mod novatel;
mod stim300;
mod table;
mod vectornav;

pub use adis::{Adis, AdisUart};
pub use epson::Epson;
pub use kvh::{Angle, Kvh, Rotation};
pub use mavlink::Mavlink;
pub use novatel::Novatel;
pub use stim300::{LineEnd, Output, Stim300};
pub use vectornav::VectorNav;

use super::finding::Finding;
use firmware::configuration;
use firmware::wire::{FormatSettings, ImuFormat, Settings};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

table::sensor! {
    /// Safran (Sensonor) STIM300
    Stim300 "stim300" stim300: Stim300,
    /// KVH 1725, 1750, 1775
    Kvh "kvh" kvh: Kvh,
    /// NovAtel RAWIMU, RAWIMUS, RAWIMUX, RAWIMUSX
    Novatel "novatel" novatel: Novatel,
    /// Honeywell HG4930
    Hg4930 "hg4930" hg4930: Plain,
    /// SBG Systems sbgECom
    SbgEcom "sbgecom" sbgecom: Plain,
    /// Seiko Epson M-G320, G354, G364, G365, G366, G370 at a UART
    Epson "epson" epson: Epson,
    /// Analog Devices ADIS bursts in this project's own frame (docs/ICD.md, section 2.1)
    AdisUart "adis-uart" adis_uart: AdisUart,
    /// VectorNav binary messages
    VectorNav "vectornav" vectornav: VectorNav,
    /// MAVLink HIGHRES_IMU
    Mavlink "mavlink" mavlink: Mavlink,
    /// Xsens MTData2
    Xsens "xsens" xsens: Plain,
}

/// What the frames of a format do not contain.
pub trait Section {
    /// Copies the table into the device's settings.
    ///
    /// # Errors
    /// A value that no such sensor has.
    fn apply(&self, sensor: &Sensor, to: &mut Settings) -> Result<(), Finding>;

    /// The table of a device's settings: the reverse of [`Section::apply`].
    fn of(settings: &Settings) -> Self
    where
        Self: Sized;

    /// Sample rate if the file gives none, Hz.
    fn rate_hz(&self, format: ImuFormat) -> f64 {
        let first = format.simulated().first();
        first.map_or(1000.0, |sensor| f64::from(sensor.rate))
    }

    /// Length of the shortest frame, bytes.
    fn frame_len(&self, format: ImuFormat) -> usize {
        let mut buffer = [0; 1024];
        let frames = format.simulated().iter();
        let lengths = frames.filter_map(|s| (s.emit)(&Default::default(), &mut buffer).ok());
        lengths.min().unwrap_or_default()
    }
}

/// A format without settings outside its frames. Its table has no keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plain {}

impl Section for Plain {
    fn of(_: &Settings) -> Self {
        Self {}
    }

    fn apply(&self, _: &Sensor, _: &mut Settings) -> Result<(), Finding> {
        Ok(())
    }
}

/// Parity of the serial line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Parity {
    /// No parity bit.
    #[default]
    None,
    /// Even parity.
    Even,
    /// Odd parity.
    Odd,
}

impl Sensor {
    /// The registered format, unless it is detected or the sensor is at the SPI.
    #[must_use]
    pub fn imu_format(&self) -> Option<ImuFormat> {
        ImuFormat::from_name(self.format.name())
    }

    /// Sample rate, Hz: as given, else as the sensor is delivered, or as a board sets it.
    #[must_use]
    pub fn rate(&self) -> f64 {
        let delivered = || match (self.imu_format(), self.format) {
            (Some(format), _) => self.section().rate_hz(format),
            (None, FormatName::AdisSpi) => self.adis.clone().unwrap_or_default().rate_hz(),
            (None, _) => Settings::DEFAULT.rate,
        };
        self.rate_hz.unwrap_or_else(delivered)
    }

    /// Bits a second that the frames need on the line, at least; `None` where it is not known. The
    /// bursts of an ADIS at the SPI need them on the navigation line alone.
    #[must_use]
    pub fn bits_per_second(&self) -> Option<f64> {
        let bytes = match self.settings() {
            Ok(Some(configuration::Sensor::Spi(adis))) => adis.bytes(),
            _ => self.section().frame_len(self.imu_format()?),
        };
        let bytes = bytes as f64;
        let parity = if self.parity == Parity::None {
            0.0
        } else {
            1.0
        };
        let bits = 9.0 + parity + f64::from(self.stop_bits);
        Some(bytes * bits * self.rate())
    }

    /// The device's settings for the sensor; `None`: detected at start.
    ///
    /// # Errors
    /// A value that no such sensor has.
    pub fn settings(&self) -> Result<Option<configuration::Sensor>, Finding> {
        if self.format == FormatName::AdisSpi {
            let adis = self.adis.clone().unwrap_or_default();
            return Ok(Some(configuration::Sensor::Spi(adis.settings()?)));
        }
        let Some(format) = self.imu_format() else {
            return Ok(None);
        };
        let mut settings = Settings::DEFAULT;
        self.section().apply(self, &mut settings)?;
        let of_format: FormatSettings = format.settings(&settings);
        Ok(Some(configuration::Sensor::Stream(of_format)))
    }

    /// The serial line's parity for the device.
    pub(super) fn line_parity(&self) -> configuration::Parity {
        match self.parity {
            Parity::None => configuration::Parity::None,
            Parity::Even => configuration::Parity::Even,
            Parity::Odd => configuration::Parity::Odd,
        }
    }
}

fn baud() -> u32 {
    921_600
}

fn one() -> u8 {
    1
}

fn silence() -> f64 {
    100.0
}

#[cfg(test)]
mod tests;
