//! The KVH as a wire format: [`ImuProtocol`].

use super::{Frame, Layout, Repr, scan, seal, units};
use crate::sample::{Axes, RawSample};
use crate::units::G;
use crate::wire::protocol::{Change, Fields, ImuProtocol, Simulated};
use crate::wire::sequence::{Rule, Sequence, Stream};
use crate::wire::{Error, Reading, Scan};
use serde::{Deserialize, Serialize};

/// Settings that the messages of a KVH do not contain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Gyro values are angle increments (`=ROTFMT,DELTA`), not rates.
    pub delta: bool,
    /// Gyro values are in degrees (`=ROTUNITS,DEG`), not radians.
    pub degrees: bool,
}

/// KVH 1725, 1750, 1775.
#[derive(Debug)]
pub struct Protocol;

impl ImuProtocol for Protocol {
    type Settings = Settings;
    const DEFAULT: Settings = Settings {
        delta: true,
        degrees: false,
    };
    const NAME: &'static str = "kvh";
    const SIMULATED: &'static [Simulated] = &SIMULATED;

    #[inline(always)]
    fn scan(bytes: &[u8]) -> Scan {
        scan(bytes)
    }

    /// The sequence number runs from 0 to 127.
    fn stream(settings: &Settings, _content: u8, rate: f64) -> Option<Stream> {
        Some(Stream {
            units: units(settings.delta, settings.degrees),
            rate,
            sequence: Sequence::Counter(Rule::new(128, 1)),
        })
    }

    #[inline(always)]
    fn read(frame: &[u8]) -> Option<Reading> {
        Frame::over(frame).map(|frame| frame.reading())
    }

    #[inline(always)]
    fn change(frame: &mut [u8], change: &Change, _settings: &Settings) -> Option<Axes> {
        let RawSample::Floats { gyro, accel } = *change.sample else {
            return None;
        };
        Frame::over(frame)?.change(gyro, accel, change.mark)?;
        Some(Axes::NONE)
    }

    /// The built-in test's message of 11 bytes, which is sent once at power-on. It may also be an
    /// answer.
    fn starts_up(message: &[u8]) -> bool {
        message.starts_with(&[0xFE, 0x81, 0x00, 0xAA])
    }

    fn seal(frame: &mut [u8]) {
        seal(frame);
    }
}

/// A second of the frames.
const RATE: u32 = 1000;
const PERIOD: f64 = 1.0 / RATE as f64;
/// Unit of the tests' floats: 2^-20, so that sums of them stay exact.
const FLOAT: f32 = 9.536_743e-7;

/// A sensor of the tests.
const fn simulated(
    name: &'static str,
    gyro: f64,
    settings: fn(&mut crate::wire::Settings),
    emit: fn(&Fields, &mut [u8]) -> Result<usize, Error>,
) -> Simulated {
    Simulated {
        name,
        rate: RATE,
        count: [gyro * FLOAT as f64, G * PERIOD * FLOAT as f64],
        unit: [gyro, G * PERIOD],
        bits: 32,
        rest: 29,
        has_accel: true,
        has_status: true,
        settings,
        emit,
        introduction: None,
    }
}

const SIMULATED: [Simulated; 4] = [
    // 1e-9 rad and 1e-7 m/s, which the quantisation of a simulated pulse must not show
    Simulated {
        count: [1e-9, 1e-7],
        ..simulated(
            "kvh",
            1.0,
            |settings| set_delta(settings, true),
            |fields, buffer| {
                let gyro = fields.gyro.map(|count| (f64::from(count) * 1e-9) as f32);
                let accel = fields
                    .accel
                    .map(|count| (f64::from(count) * 1e-7 / PERIOD / G) as f32);
                message(Layout::A, gyro, accel, fields, buffer)
            },
        )
    },
    simulated(
        "kvh A, increments",
        1.0,
        |settings| set_delta(settings, true),
        |fields, buffer| small(Layout::A, fields, buffer),
    ),
    simulated(
        "kvh B, rates",
        PERIOD,
        |settings| set_delta(settings, false),
        |fields, buffer| small(Layout::B, fields, buffer),
    ),
    simulated(
        "kvh C, increments",
        1.0,
        |settings| set_delta(settings, true),
        |fields, buffer| small(Layout::C, fields, buffer),
    ),
];

fn set_delta(settings: &mut crate::wire::Settings, delta: bool) {
    settings.kvh = Settings {
        delta,
        degrees: false,
    };
}

fn small(layout: Layout, fields: &Fields, buffer: &mut [u8]) -> Result<usize, Error> {
    let [gyro, accel] =
        [fields.gyro, fields.accel].map(|triad| triad.map(|count| count as f32 * FLOAT));
    message(layout, gyro, accel, fields, buffer)
}

fn message(
    layout: Layout,
    gyro: [f32; 3],
    accel: [f32; 3],
    fields: &Fields,
    buffer: &mut [u8],
) -> Result<usize, Error> {
    let repr = Repr {
        layout,
        gyro,
        accel,
        extra: fields.rest.to_be_bytes(),
        status: 0x77,
        sequence: (fields.index % 128) as u8,
        temperature: fields.rest as i16,
    };
    repr.emit(buffer)
}
