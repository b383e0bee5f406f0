//! Configuration of a device.

use super::hardware::Hardware;
use crate::compensator::Limit;
pub use crate::configuration::Activation;
use crate::configuration::{Configuration, ReceiverProtocol, Sensor, SerialLines, VehicleKind};
use crate::control::Mode;
use crate::error_bound::{ErrorBound, LATITUDE};
use crate::learn::usual;
use crate::model::Nets;
use crate::units::{DEGREE, G};
use crate::wire::{ImuFormat, ReceiverFormat, Settings};

/// The configuration of an application.
#[derive(Debug, Clone)]
pub struct Config {
    /// Format of the sensor; `None`: detected at start. Not used for an ADIS, whose bursts come by
    /// [`super::App::burst`].
    pub format: Option<ImuFormat>,
    /// Settings that the sensor's frames do not contain.
    pub sensor: Settings,
    /// Mode from the first good frame on.
    pub mode: Mode,
    /// Networks at start.
    pub nets: Nets,
    /// Time between network steps, s, > 0; rounded to whole samples.
    pub block: f64,
    /// Largest correction beside that of the maps.
    pub limit: Limit,
    /// Largest element of a map of gyros and accelerometers; 0: samples are not corrected in
    /// proportion.
    pub map_limit: [f32; 2],
    /// Fastest change of a correction after the alignment: rad/s per s, m/s2 per s.
    pub slew: Limit,
    /// Largest speed of the vehicle over ground, m/s; only for the error bound
    /// ([`crate::error_bound`]).
    pub speed: f32,
    /// In mode learn: condition under which learnt networks come into force.
    pub activation: Activation,
    /// The sensor counts as silent when no byte has come for this time, microseconds.
    pub silence_us: u32,
    /// The board stores weights and configuration: see [`super::App::store`].
    pub store: bool,
    /// Faults found in the content of the store.
    pub store_faults: StoreFaults,
    /// Mark a frame whose correction must not be trusted, in a spare bit of the frame (interface
    /// control document, "Our own faults").
    pub mark: bool,
    /// The configuration that all this follows from, if there is one.
    pub configuration: Option<Configuration>,
    /// The device may correct. Without a configuration it only passes bytes.
    pub configured: bool,
    /// The board.
    pub hardware: Hardware,
}

/// Largest element of the maps: three standard deviations by the datasheet, as a bias.
fn map_limit(configuration: &Configuration) -> [f32; 2] {
    [&configuration.gyro, &configuration.accel]
        .map(|triad| MAP_LIMIT * triad.scale.max(triad.misalignment))
}

/// Mean rate of a vehicle over some minutes, as a share of its usual largest rate (assumed): 1
/// deg/s on land.
const MEAN_TURN: f32 = 0.1;
/// Standard deviations that an element of a map may have.
const MAP_LIMIT: f32 = 3.0;
/// A row of a map adds at most its largest element times this and the length of what is felt.
const SQRT_3: f32 = 1.732_051;

/// Faults of the store's content.
#[derive(Debug, Clone, Copy, Default)]
pub struct StoreFaults {
    /// Something of a newer firmware, whose version this is. It stays.
    pub newer: Option<u16>,
    /// Something that cannot be read.
    pub unread: bool,
    /// Weights of another unit, which are not used.
    pub other_unit: bool,
    /// A record with another key than the one in use.
    pub other_key: bool,
}

impl Config {
    /// The application's settings by a unit's configuration. Networks, store and hardware are the
    /// board's.
    #[must_use]
    pub fn of(configuration: &Configuration) -> Config {
        let correction = &configuration.correction;
        Config {
            format: match configuration.sensor {
                Some(Sensor::Stream(format)) => Some(format.format()),
                Some(Sensor::Spi(_)) | None => None,
            },
            sensor: configuration.wire_settings(),
            mode: correction.mode,
            nets: Nets::NONE,
            block: f64::from(correction.block),
            limit: correction.limit,
            map_limit: map_limit(configuration),
            slew: correction.slew,
            speed: configuration.vehicle.speed,
            activation: correction.activation,
            silence_us: correction.silence_us,
            store: false,
            store_faults: StoreFaults::default(),
            mark: correction.mark,
            configuration: Some(configuration.clone()),
            configured: true,
            hardware: Hardware::DESKTOP,
        }
    }

    /// Settings of a board without a configuration: everything passes unchanged.
    #[must_use]
    pub fn unconfigured(hardware: Hardware) -> Config {
        Config {
            configured: false,
            hardware,
            ..Config::default()
        }
    }

    /// Whether the settings that follow from the configuration are as in `made`. Networks, store
    /// and board do not follow from it, nor do settings that the sensor itself reports.
    #[must_use]
    pub fn follows(&self, made: &Config) -> bool {
        let correction = |config: &Config| {
            let Config {
                block,
                limit,
                slew,
                speed,
                activation,
                silence_us,
                mark,
                configured,
                ..
            } = *config;
            (
                block, limit, slew, speed, activation, silence_us, mark, configured,
            )
        };
        correction(self) == correction(made)
    }

    /// Settings of the serial lines.
    #[must_use]
    pub fn lines(&self) -> SerialLines {
        self.configuration
            .as_ref()
            .map_or(SerialLines::DEFAULT, |configuration| configuration.lines)
    }

    /// Format of the receiver; `None`: it is detected.
    #[must_use]
    pub fn receiver(&self) -> Option<ReceiverFormat> {
        let configuration = self
            .configuration
            .as_ref()
            .map(|configuration| configuration.receiver.protocol);
        match configuration.unwrap_or_default() {
            ReceiverProtocol::Ubx => Some(ReceiverFormat::Ubx),
            ReceiverProtocol::Nmea => Some(ReceiverFormat::Nmea),
            ReceiverProtocol::Novatel => Some(ReceiverFormat::Novatel),
            ReceiverProtocol::Sbf => Some(ReceiverFormat::Sbf),
            ReceiverProtocol::Detect => None,
        }
    }

    /// Direction from the receiver's first antenna to its second, clockwise from the vehicle's
    /// forward axis, rad.
    #[must_use]
    pub fn heading_offset(&self) -> f32 {
        let configuration = self.configuration.as_ref();
        configuration.map_or(0.0, |configuration| configuration.receiver.heading_offset)
    }

    /// The largest correction of an axis, the maps' part included, in a vehicle that turns on
    /// average by no more than [`MEAN_TURN`] of its usual largest rate ([`usual`]).
    fn with_maps(&self) -> Limit {
        let kind = self.configuration.as_ref().map(|of| of.vehicle.kind);
        let [rate, force] = usual(kind.unwrap_or(VehicleKind::Land));
        let [gyro, accel] = self.map_limit.map(|most| most * SQRT_3);
        Limit {
            gyro: self.limit.gyro + gyro * MEAN_TURN * rate,
            accel: self.limit.accel + accel * (G as f32 + force),
        }
    }

    /// The effect of the corrections at worst, after an alignment at this latitude (rad), where
    /// samples come `words` times as often as configured. Without a configuration nothing is
    /// corrected.
    pub fn error_bound(&self, latitude: Option<f64>, words: f32) -> ErrorBound {
        let none = Limit {
            gyro: 0.0,
            accel: 0.0,
        };
        ErrorBound {
            limit: if self.configured {
                self.with_maps()
            } else {
                none
            },
            speed: self.speed,
            latitude: latitude.unwrap_or(LATITUDE),
            words,
        }
    }
}

impl Default for Config {
    /// Everything passes unchanged: mode bypass, no networks. Limits 10 deg/h and 1 mg, slew one
    /// thousandth of that a second, speed 50 m/s.
    fn default() -> Config {
        let limit = Limit {
            gyro: (10.0 * DEGREE / 3600.0) as f32,
            accel: (1e-3 * G) as f32,
        };
        Config {
            format: None,
            sensor: Settings::DEFAULT,
            mode: Mode::Bypass,
            nets: Nets::NONE,
            block: 1.0,
            limit,
            map_limit: [MAP_LIMIT * 5e-5, MAP_LIMIT * 1e-4],
            slew: Limit {
                gyro: limit.gyro * 1e-3,
                accel: limit.accel * 1e-3,
            },
            speed: 50.0,
            activation: Activation::NextPowerOn,
            silence_us: 100_000,
            store: false,
            store_faults: StoreFaults::default(),
            mark: true,
            configuration: None,
            configured: true,
            hardware: Hardware::DESKTOP,
        }
    }
}
