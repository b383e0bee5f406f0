//! Configuration of a device.

use crate::compensator::Limit;
use crate::control::Mode;
use crate::error_bound::ErrorBound;
use crate::model::Nets;
use crate::units::{DEGREE, G};
use crate::wire::{ImuFormat, Settings};

/// When, in mode learn, a promoted hypothesis comes into force.
///
/// A navigation computer that has aligned itself with uncorrected samples has compensated the
/// sensors' errors by its tilt and heading. To correct the samples afterwards is worse than to
/// leave them (680 m in 22 min for 100 ug).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activation {
    /// When the navigation computer reports that its alignment begins.
    Commanded,
    /// Also when the vehicle has come to a standstill: for a navigation computer that then aligns
    /// itself without a report.
    Standstill,
    /// At once, and from then on with all that is learnt, no faster than the slew limit: for an
    /// aided navigation computer, whose own filter follows.
    Faded,
}

/// The configuration of an application.
#[derive(Debug, Clone)]
pub struct Config {
    /// Format of the sensor; `None`: detected at start. Not used for an ADIS, whose bursts come by
    /// [`super::App::burst`].
    pub format: Option<ImuFormat>,
    /// What the sensor's frames do not tell.
    pub sensor: Settings,
    /// Mode from the first good frame on.
    pub mode: Mode,
    /// Networks at start.
    pub nets: Nets,
    /// Time between network steps, s, > 0; rounded to whole samples.
    pub block: f64,
    /// Largest correction.
    pub limit: Limit,
    /// Fastest change of a correction after the alignment: rad/s per s, m/s2 per s.
    pub slew: Limit,
    /// Largest speed of the vehicle over ground, m/s; only for the error bound
    /// ([`crate::error_bound`]).
    pub speed: f32,
    /// In mode learn: when what was learnt comes into force.
    pub activation: Activation,
    /// The sensor counts as silent when no byte has come for this time, microseconds.
    pub silence_us: u32,
    /// The board stores weights: see [`super::App::to_store`].
    pub store: bool,
    /// Mark a frame whose correction must not be trusted, in a spare bit of the frame (interface
    /// control document, "Our own faults").
    pub mark: bool,
}

impl Config {
    /// The effect of the corrections at worst.
    pub fn error_bound(&self) -> ErrorBound {
        ErrorBound {
            limit: self.limit,
            speed: self.speed,
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
            slew: Limit {
                gyro: limit.gyro * 1e-3,
                accel: limit.accel * 1e-3,
            },
            speed: 50.0,
            activation: Activation::Commanded,
            silence_us: 100_000,
            store: false,
            mark: true,
        }
    }
}
