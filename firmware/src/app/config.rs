//! What a device is told before it starts.

use crate::compensator::Limit;
use crate::control::Mode;
use crate::error_bound::ErrorBound;
use crate::model::Nets;
use crate::sample::Units;
use crate::units::{DEGREE, G};
use crate::wire::Format;
use crate::wire::adis::Form;
use crate::wire::novatel::ImuType;
use crate::wire::stim300::{self, Extra};

/// KVH settings that its messages do not tell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kvh {
    /// Gyro words are angle increments (`=ROTFMT,DELTA`), not rates.
    pub delta: bool,
    /// Gyro words are in degrees (`=ROTUNITS,DEG`), not radians.
    pub degrees: bool,
}

/// An ADIS; its bursts tell neither.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adis {
    /// Form of its bursts.
    pub form: Form,
    /// What a count means: [`crate::wire::adis::Model::units`].
    pub units: Units,
}

/// When, in mode learn, what has proved itself comes into force. A navigation computer that has aligned itself with the words as they
/// were has made up for the sensors' errors by its tilt and heading; to take them out afterwards is worse than to leave them (680 m
/// in 22 min for 100 ug).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activation {
    /// When the navigation computer tells that its alignment begins.
    Commanded,
    /// Also when the vehicle has come to stand: for a navigation computer that then aligns itself, and does not tell.
    Standstill,
    /// At once and from then on with all that is learnt, no faster than the slew limit: for a navigation computer that is aided, and
    /// whose own filter follows.
    Faded,
}

/// The configuration of an application.
#[derive(Debug, Clone)]
pub struct Config {
    /// What the sensor speaks; `None`: found out at start.
    pub format: Option<Format>,
    /// Mode from the first good frame on.
    pub mode: Mode,
    /// Networks at start.
    pub nets: Nets,
    /// Time between network steps, s, > 0; rounded to whole words.
    pub block: f64,
    /// Largest correction.
    pub limit: Limit,
    /// Fastest change of a correction after the alignment: rad/s per s, m/s2 per s.
    pub slew: Limit,
    /// Largest speed of the vehicle over ground, m/s: for the bound on harm alone ([`crate::error_bound`]).
    pub speed: f32,
    /// In mode learn: when what was learnt comes into force.
    pub activation: Activation,
    /// The sensor is silent when nothing has come for so long, microseconds.
    pub silence_us: u32,
    /// Words a second where the stream does not tell: KVH, ADIS, STIM300 with external trigger, `NovAtel` with an IMU type unknown
    /// here. Hz, > 0.
    pub rate: f64,
    /// STIM300: its configuration, until the sensor sends it. With `answer_us`, also what `C` is answered from.
    pub stim300: stim300::config::Config,
    /// STIM300: before the first correction, ask the sensor once for its configuration unless it has sent it. Costs one
    /// measurement; without it the corrections rest on `stim300`.
    pub ask: bool,
    /// STIM300: answer requests that the sensor leaves unanswered for so long, microseconds; `None`: never.
    pub answer_us: Option<u32>,
    /// STIM300: the family of identifiers sent on, whichever comes in; `None`: as it came.
    pub family: Option<Extra>,
    /// KVH: what its messages do not tell.
    pub kvh: Kvh,
    /// The sensor is an ADIS whose bursts come by [`super::App::burst`]; `format` then has no meaning.
    pub adis: Option<Adis>,
    /// `NovAtel`: the IMU behind RAWIMU and RAWIMUS, which do not tell.
    pub imu_type: ImuType,
    /// The board stores weights: see [`super::App::to_store`].
    pub store: bool,
    /// Say in a frame's spare bit that its correction is not to be trusted (interface control document, "Our own faults").
    pub mark: bool,
}

impl Config {
    /// What the corrections can do at worst.
    pub fn error_bound(&self) -> ErrorBound {
        ErrorBound {
            limit: self.limit,
            speed: self.speed,
        }
    }
}

impl Default for Config {
    /// Everything passes unchanged: mode bypass, no networks. Limits 10 deg/h and 1 mg, slew one thousandth of it a second, speed 50 m/s.
    fn default() -> Config {
        let limit = Limit {
            gyro: (10.0 * DEGREE / 3600.0) as f32,
            accel: (1e-3 * G) as f32,
        };
        Config {
            format: None,
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
            rate: 1000.0,
            stim300: stim300::config::Config::DEFAULT,
            ask: true,
            answer_us: Some(50_000),
            family: None,
            kvh: Kvh {
                delta: true,
                degrees: false,
            },
            adis: None,
            imu_type: ImuType(0),
            store: false,
            mark: true,
        }
    }
}
