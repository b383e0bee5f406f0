//! The table of a STIM300.

use super::{Section, Sensor};
use crate::finding::Finding;
use firmware::sample::{Quantity, Unit};
use firmware::wire::stim300::config::{Config, Range};
use firmware::wire::stim300::{Contents, Extra};
use firmware::wire::{ImuFormat, Settings};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings that the measurements of a STIM300 do not contain. The sensor sends them in its
/// configuration datagram; until then the device uses this table. Source of all values: datasheet
/// TS1524.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Stim300 {
    /// Identifier of the datagram, two hexadecimal digits, such as 0x91 for rates and
    /// accelerations or 0xA7 for all clusters with temperatures. Default: 0x91.
    #[schemars(regex(pattern = "^0x[0-9A-Fa-f]{2}$"))]
    pub datagram: String,
    /// Quantity of the gyro values. Default: increment.
    pub gyro_output: Output,
    /// Quantity of the accelerometer values. Default: increment.
    pub accel_output: Output,
    /// Measurement range of the accelerometers, g: 5, 10, 30 or 80. Default: 10.
    pub accel_range_g: u8,
    /// End of a datagram. Default: none.
    pub line_end: LineEnd,
    /// Ask the sensor once for its configuration before the first correction, unless it has sent
    /// it. This costs one measurement. Default: true.
    pub ask: bool,
    /// Answer requests of the navigation computer that the sensor leaves unanswered for this time,
    /// ms, 0 to 1000; 0 is never. Default: 50.
    #[schemars(range(min = 0, max = 1000))]
    pub answer_ms: f64,
    /// Identifiers of the datagrams that the device sends: plain, pps or aux. Default: as received.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub family: Option<Family>,
}

/// Quantity of a value of a STIM300.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Output {
    /// Angular rate, or acceleration.
    Rate,
    /// Incremental angle, or incremental velocity, since the last sample.
    Increment,
    /// Average rate, or average acceleration, since the last sample.
    Average,
    /// Angle or velocity integrated since the start.
    Integrated,
}

/// End of a datagram.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LineEnd {
    /// Nothing.
    None,
    /// Carriage return and line feed.
    Crlf,
}

/// The three families of identifiers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// Without an extra value.
    Plain,
    /// With the time of a pulse per second.
    Pps,
    /// With the auxiliary input.
    Aux,
}

impl Default for Stim300 {
    fn default() -> Self {
        Self {
            datagram: "0x91".into(),
            gyro_output: Output::Increment,
            accel_output: Output::Increment,
            accel_range_g: 10,
            line_end: LineEnd::None,
            ask: true,
            answer_ms: 50.0,
            family: None,
        }
    }
}

/// Samples a second that a STIM300 can send, Hz, in the order of their codes.
const RATES_HZ: [f64; 5] = [125.0, 250.0, 500.0, 1000.0, 2000.0];

impl Stim300 {
    fn contents(&self) -> Option<Contents> {
        let digits = self.datagram.strip_prefix("0x")?;
        Contents::from_id(u8::from_str_radix(digits, 16).ok()?)
    }

    /// The configuration datagram that the sensor would send.
    fn config(&self, rate_hz: f64, bit_rate: u32) -> Result<Config, Finding> {
        let contents = self.contents().ok_or_else(|| {
            Finding::wrong(
                "sensor.stim300.datagram",
                format!(
                    "is '{}', which is not the identifier of a measurement",
                    self.datagram
                ),
                "use one of table 5-21 of the datasheet, such as \"0x91\", \"0x93\" or \"0xA7\"",
            )
        })?;
        let code = RATES_HZ
            .iter()
            .position(|rate| *rate == rate_hz)
            .ok_or_else(|| {
                Finding::wrong(
                    "sensor.rate_hz",
                    format!("is {rate_hz}, which a STIM300 does not have"),
                    "give 125, 250, 500, 1000 or 2000",
                )
            })?;
        let range = match self.accel_range_g {
            5 => Range::G5,
            10 => Range::G10,
            30 => Range::G30,
            80 => Range::G80,
            other => {
                return Err(Finding::wrong(
                    "sensor.stim300.accel_range_g",
                    format!("is {other}, which a STIM300 does not have"),
                    "give 5, 10, 30 or 80",
                ));
            }
        };
        let unit = |output| match output {
            Output::Rate => 0,
            Output::Increment => 1,
            Output::Average => 2,
            Output::Integrated => 3,
        };
        Ok(Config::DEFAULT
            .with_sample_rate_code(code as u8) // 0 to 4
            .with_contents(contents)
            .with_unit_codes(unit(self.gyro_output), unit(self.accel_output))
            .with_accel_range(range)
            .with_crlf(self.line_end == LineEnd::Crlf)
            .with_bit_rate(bit_rate))
    }
}

impl Section for Stim300 {
    fn of(settings: &Settings) -> Self {
        let settings = &settings.stim300;
        let config = &settings.config;
        let output = |unit: Option<Unit>| match unit.map(|unit| unit.quantity) {
            Some(Quantity::Rate) => Output::Rate,
            Some(Quantity::Average) => Output::Average,
            Some(Quantity::Integrated) => Output::Integrated,
            Some(Quantity::Increment) | None => Output::Increment,
        };
        let units = config.units().ok();
        Self {
            datagram: format!("0x{:02X}", config.contents().id()),
            gyro_output: output(units.map(|units| units.gyro)),
            accel_output: output(units.map(|units| units.accel)),
            accel_range_g: match config.ranges() {
                Ok([Range::G5, ..]) => 5,
                Ok([Range::G30, ..]) => 30,
                Ok([Range::G80, ..]) => 80,
                _ => 10,
            },
            line_end: if config.crlf() {
                LineEnd::Crlf
            } else {
                LineEnd::None
            },
            ask: settings.ask,
            answer_ms: settings.answer_us.map_or(0.0, |us| f64::from(us) / 1e3),
            family: settings.family.map(|family| match family {
                Extra::None => Family::Plain,
                Extra::Pps => Family::Pps,
                Extra::Aux => Family::Aux,
            }),
        }
    }

    fn apply(&self, sensor: &Sensor, to: &mut Settings) -> Result<(), Finding> {
        to.stim300.config = self.config(sensor.rate(), sensor.baud)?;
        to.stim300.ask = self.ask;
        let answer = (self.answer_ms * 1e3).round() as u32; // at most 10^6, by the range
        to.stim300.answer_us = (answer > 0).then_some(answer);
        to.stim300.family = self.family.map(|family| match family {
            Family::Plain => Extra::None,
            Family::Pps => Extra::Pps,
            Family::Aux => Extra::Aux,
        });
        Ok(())
    }

    fn rate_hz(&self, _: ImuFormat) -> f64 {
        1000.0 // of the default configuration
    }

    fn frame_len(&self, _: ImuFormat) -> usize {
        let end = if self.line_end == LineEnd::Crlf { 2 } else { 0 };
        self.contents().map_or(0, Contents::len) + end
    }
}
