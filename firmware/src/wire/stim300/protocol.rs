//! The STIM300 as a wire format: [`ImuProtocol`].

use super::config::{self, Config};
use super::words::{change_words, read};
use super::{Cluster, Contents, Extra, Frame, Repr, Temperatures, scan, seal, status, usual};
use crate::sample::{Axes, RawSample};
use crate::units::{DEGREE, G};
use crate::wire::protocol::{Change, Fields, ImuProtocol, Simulated};
use crate::wire::sequence::{Rule, Sequence, Stream};
use crate::wire::{Error, Reading, Scan, power_of_two as two};
use serde::{Deserialize, Serialize};

/// Configuration of a STIM300.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The sensor's configuration, until it sends it. With `answer_us`, also what `C` is answered
    /// from.
    pub config: Config,
    /// Before the first correction, ask the sensor once for its configuration unless it has sent
    /// it. This costs one measurement; without it the corrections rest on `config`.
    pub ask: bool,
    /// Answer requests that the sensor leaves unanswered for so long, microseconds; `None`: never.
    pub answer_us: Option<u32>,
    /// The family of identifiers sent on, whichever comes in; `None`: as it came.
    pub family: Option<Extra>,
}

/// Safran STIM300.
#[derive(Debug)]
pub struct Protocol;

impl ImuProtocol for Protocol {
    type Settings = Settings;
    const DEFAULT: Settings = Settings {
        config: Config::DEFAULT,
        ask: true,
        answer_us: Some(50_000),
        family: None,
    };
    const NAME: &'static str = "stim300";
    /// The identifier is one byte, which any data byte may equal.
    const HAS_START_MARK: bool = false;
    const SIMULATED: &'static [Simulated] = &SIMULATED;

    #[inline(always)]
    fn scan(bytes: &[u8]) -> Scan {
        scan(bytes)
    }

    #[inline(always)]
    fn usual(bytes: &[u8]) -> Option<usize> {
        usual(bytes)
    }

    /// Whether there are accelerometers: bit 0 of the identifier. Nothing else in it changes how
    /// the values are corrected.
    #[inline(always)]
    fn content(frame: &[u8]) -> u8 {
        frame.first().copied().unwrap_or_default() & 1
    }

    /// The counter counts internal samples at 2000 Hz. With an external trigger it shows no gaps.
    fn stream(settings: &Settings, _content: u8, rate: f64) -> Option<Stream> {
        let config = &settings.config;
        Some(Stream {
            units: config.units().ok()?,
            rate: config.sample_rate().ok()?.map_or(rate, f64::from),
            sequence: config.counter_step().map_or(Sequence::None, |step| {
                Sequence::Counter(Rule::new(256, step.into()))
            }),
        })
    }

    #[inline(always)]
    fn read(frame: &[u8]) -> Option<Reading> {
        read(frame)
    }

    #[inline(always)]
    fn change(frame: &mut [u8], change: &Change, settings: &Settings) -> Option<Axes> {
        let RawSample::Counts { gyro, accel } = change.sample else {
            return None;
        };
        if settings.family.is_none() && Protocol::content(frame) != 0 {
            return change_words(frame, gyro, accel);
        }
        change_otherwise(frame, *gyro, *accel, settings.family)
    }

    #[inline(always)]
    fn always_changes(settings: &Settings) -> bool {
        settings.family.is_some()
    }

    /// The start-up bit of the gyros' status. What the sensor sends before its first frame has its
    /// own identifiers, which may also be an answer: see `app::reverse`.
    fn starts_up(message: &[u8]) -> bool {
        Frame::over(message).is_some_and(|frame| frame.gyro().status & status::START_UP != 0)
    }

    /// Whether the datagram that the sensor is set up to send has a temperature.
    fn has_thermometer(settings: &Settings) -> bool {
        settings.config.contents().temperature
    }

    fn seal(frame: &mut [u8]) {
        seal(frame);
    }
}

/// Changes a frame byte by byte: frames without accelerometers, and those whose identifier changes.
#[inline(never)]
fn change_otherwise(
    frame: &mut [u8],
    gyro: [i32; 3],
    accel: [i32; 3],
    family: Option<Extra>,
) -> Option<Axes> {
    Frame::over(frame)?.change(gyro, accel, family)
}

/// The sensor of simulated drives: 250 Hz, increments, 10 g range.
fn quarter() -> Config {
    Config::DEFAULT.with_sample_rate_code(1)
}

/// A simulated sensor at 1000 Hz, with these unit codes.
const fn simulated(
    name: &'static str,
    unit: [f64; 2],
    settings: fn(&mut crate::wire::Settings),
    emit: fn(&Fields, &mut [u8]) -> Result<usize, Error>,
) -> Simulated {
    Simulated {
        name,
        rate: 1000,
        count: unit,
        unit,
        bits: 24,
        rest: 120,
        has_accel: true,
        has_status: true,
        settings,
        emit,
        introduction: Some(|settings, buffer| {
            let place = buffer.get_mut(..config::LEN).ok_or(Error::Length)?;
            place.copy_from_slice(&settings.stim300.config.emit());
            Ok(config::LEN)
        }),
    }
}

/// Increments, rad and m/s, and rates over 1 ms.
const INCREMENTS: [f64; 2] = [DEGREE * two(-21), two(-22)];
const RATES: [f64; 2] = [DEGREE * two(-14) * 1e-3, G * two(-19) * 1e-3];

const SIMULATED: [Simulated; 7] = [
    Simulated {
        rate: 250,
        ..simulated(
            "stim300 at 250 Hz",
            INCREMENTS,
            |settings| settings.stim300.config = quarter(),
            |fields, buffer| datagram(0x91, 8, fields, buffer),
        )
    },
    simulated(
        "stim300 0x91",
        INCREMENTS,
        |settings| set_units(settings, 0x91, 1, 1),
        |fields, buffer| datagram(0x91, 2, fields, buffer),
    ),
    Simulated {
        has_accel: false,
        ..simulated(
            "stim300 0x90",
            INCREMENTS,
            |settings| set_units(settings, 0x90, 1, 1),
            |fields, buffer| datagram(0x90, 2, fields, buffer),
        )
    },
    simulated(
        "stim300 0xA7, rates",
        RATES,
        |settings| set_units(settings, 0xA7, 0, 0),
        |fields, buffer| datagram(0xA7, 2, fields, buffer),
    ),
    simulated(
        "stim300 0xF7, averages",
        RATES,
        |settings| set_units(settings, 0xF7, 2, 2),
        |fields, buffer| datagram(0xF7, 2, fields, buffer),
    ),
    simulated(
        "stim300 0xAF, increments and accelerations",
        [INCREMENTS[0], RATES[1]],
        |settings| set_units(settings, 0xAF, 1, 0),
        |fields, buffer| datagram(0xAF, 2, fields, buffer),
    ),
    Simulated {
        rate: 2000,
        ..simulated(
            "stim300 at 2000 Hz",
            INCREMENTS,
            |settings| settings.stim300.config = Config::DEFAULT.with_sample_rate_code(4),
            |fields, buffer| datagram(0x91, 1, fields, buffer),
        )
    },
];

fn set_units(settings: &mut crate::wire::Settings, id: u8, gyro: u8, accel: u8) {
    let config = Config::DEFAULT.with_unit_codes(gyro, accel);
    let contents = Contents::from_id(id).unwrap_or(config.contents());
    settings.stim300.config = config.with_contents(contents);
}

/// A measurement whose counter advances by `step`. Values keep their low 24 bits.
fn datagram(id: u8, step: u32, fields: &Fields, buffer: &mut [u8]) -> Result<usize, Error> {
    let contents = Contents::from_id(id).ok_or(Error::Header)?;
    let rest = fields.rest;
    let cluster = |values| Cluster { values, status: 0 };
    let repr = Repr {
        contents,
        gyro: cluster(fields.gyro),
        accel: cluster(fields.accel),
        incl: Cluster {
            values: [5, 6, 7],
            status: rest as u8,
        },
        temperatures: [Temperatures {
            values: [rest as i16, -1, 2],
            status: (rest >> 16) as u8,
        }; 3],
        extra: (rest >> 8, rest as u8),
        counter: fields.index.wrapping_mul(step) as u8,
        latency_us: (rest % 1000) as u16,
    };
    repr.emit(buffer)
}
