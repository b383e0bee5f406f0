//! VectorNav's binary messages as a wire format: [`ImuProtocol`] and [`LaidOut`].

use super::checksum::seal;
use super::layout::{self, Layout, Quantity, Values};
use super::{Frame, Repr, scan};
use crate::sample::{self, Axes, RawSample, Unit, Units};
use crate::units::DEGREE;
use crate::wire::protocol::{Change, Fields, ImuProtocol, LaidOut, Simulated};
use crate::wire::sequence::{Sequence, Stream};
use crate::wire::{Error, Reading, Scan, power_of_two};
use serde::{Deserialize, Serialize};

/// VectorNav's binary messages.
#[derive(Debug)]
pub struct Protocol;

/// The time stamps have 64 bits of nanoseconds.
const TURN: f64 = power_of_two(64) * 1e-9;
/// In [`ImuProtocol::content`], instead of the accelerometers' quantity: there are none.
const NONE: u8 = 3;
/// Instead of the gyros' [`Quantity::Increments`]: the message has no time stamp.
const UNTIMED: u8 = 3;

/// Settings that the messages do not contain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Values that are to be corrected.
    pub values: Values,
}

impl ImuProtocol for Protocol {
    type Settings = Settings;
    const DEFAULT: Settings = Settings {
        values: Values::USUAL,
    };
    const NAME: &'static str = "vectornav";
    /// The start mark is one byte, which any data byte may equal.
    const HAS_START_MARK: bool = false;
    const SIMULATED: &'static [Simulated] = &SIMULATED;

    fn scan(bytes: &[u8]) -> Scan {
        scan(Values::USUAL, bytes)
    }

    /// The quantity of the gyros in bits 0 and 1, that of the accelerometers in bits 2 and 3, if
    /// they are [`Values::Sensors`]. In the others the time of the gyros' increments
    /// ([`Layout::period`]); without increments, 1 if the message has a time stamp.
    #[inline(never)] // not in the code of all formats
    fn content(frame: &[u8]) -> u8 {
        Layout::of(frame).map_or(0, |layout| {
            let timed = layout.time() != 0;
            let quantity = |accel| {
                let triad = layout.best(Values::Sensors, accel);
                triad.map(|triad| triad.quantity)
            };
            let (gyro, high) = match quantity(false) {
                Some(Quantity::Increments) => {
                    let gyro = if timed {
                        Quantity::Increments as u8
                    } else {
                        UNTIMED
                    };
                    (gyro, layout.period(frame))
                }
                other => (other.unwrap_or(Quantity::Compensated) as u8, timed.into()),
            };
            gyro | quantity(true).map_or(NONE, |accel| accel as u8) << 2 | high << 4
        })
    }

    /// The rate is the configured one, unless the message has the time of its increments.
    fn stream(settings: &Settings, content: u8, rate: f64) -> Option<Stream> {
        let (gyro, timed, period) = match (content & 3, content >> 4) {
            (UNTIMED, period) => (Quantity::Increments as u8, false, period),
            (0, period) => (Quantity::Increments as u8, true, period),
            (gyro, timed) => (gyro, timed != 0, 0),
        };
        let unit = |quantity: u8, increment: f64| {
            let increments =
                settings.values == Values::Sensors && quantity == Quantity::Increments as u8;
            Unit {
                quantity: if increments {
                    sample::Quantity::Increment
                } else {
                    sample::Quantity::Rate
                },
                lsb: if increments { increment } else { 1.0 },
            }
        };
        let rate = match settings.values {
            Values::Sensors => layout::rate(period, rate),
            Values::Filtered => rate,
        };
        Some(Stream {
            units: Units {
                gyro: unit(gyro, DEGREE),
                accel: unit(content >> 2 & 3, 1.0),
            },
            rate,
            sequence: if timed {
                Sequence::Time { rate, turn: TURN }
            } else {
                Sequence::None
            },
        })
    }

    fn read(frame: &[u8]) -> Option<Reading> {
        <Protocol as LaidOut>::read(Values::USUAL, frame)
    }

    fn change(frame: &mut [u8], change: &Change, settings: &Settings) -> Option<Axes> {
        <Protocol as LaidOut>::change(Values::USUAL, frame, change, settings)
    }

    fn has_thermometer(_: &Settings) -> bool {
        true
    }

    fn seal(frame: &mut [u8]) {
        seal(frame);
    }
}

impl LaidOut for Protocol {
    type Layout = Values;

    #[inline(always)]
    fn scan(values: Values, bytes: &[u8]) -> Scan {
        scan(values, bytes)
    }

    #[inline(never)] // not in the code of all formats
    fn read(values: Values, frame: &[u8]) -> Option<Reading> {
        Frame::over(values, frame).map(|frame| frame.reading())
    }

    #[inline(never)] // likewise
    fn change(values: Values, frame: &mut [u8], change: &Change, _: &Settings) -> Option<Axes> {
        Frame::over(values, frame)?.change(change)?;
        Some(Axes::NONE)
    }
}

/// Unit of the tests' floats: 2^-20, so that sums of them stay exact.
const FLOAT: f32 = 9.536_743e-7;

const fn simulated(
    name: &'static str,
    [gyro, accel]: [f64; 2],
    emit: fn(&Fields, &mut [u8]) -> Result<usize, Error>,
) -> Simulated {
    Simulated {
        name,
        rate: 400,
        count: [gyro * FLOAT as f64, accel * FLOAT as f64],
        unit: [gyro, accel],
        bits: 32,
        rest: 0,
        has_accel: true,
        has_status: true,
        settings: |_| {},
        emit,
        introduction: None,
    }
}

const SIMULATED: [Simulated; 3] = [
    // 1000 Hz, as an unconfigured device expects; 1e-9 rad and 1e-7 m/s, which the quantisation of
    // a simulated pulse must not show
    Simulated {
        rate: 1000,
        count: [1e-9, 1e-7],
        ..simulated("vectornav, increments", [DEGREE, 1.0], |fields, buffer| {
            let [gyro, accel] = [(fields.gyro, 1e-9 / DEGREE), (fields.accel, 1e-7)]
                .map(|(triad, unit)| triad.map(|count| (f64::from(count) * unit) as f32));
            // common: TimeStartup, MagPres, DeltaTheta with DeltaVel, InsStatus
            message(
                Values::Sensors,
                &[0x01, 0x01, 0x1C],
                gyro,
                accel,
                fields,
                buffer,
            )
        })
    },
    simulated(
        "vectornav, uncompensated",
        [1.0 / 400.0; 2],
        |fields, buffer| {
            // time: TimeStartup; IMU: ImuStatus, UncompMag, UncompAccel, UncompGyro, Temp, Pres,
            // SensSat
            small(
                Values::Sensors,
                &[0x06, 0x01, 0x00, 0x3F, 0x08],
                fields,
                buffer,
            )
        },
    ),
    Simulated {
        settings: |settings| settings.vectornav.values = Values::Filtered,
        ..simulated(
            "vectornav, compensated",
            [1.0 / 400.0; 2],
            |fields, buffer| {
                // common: TimeGps, YawPitchRoll, AngularRate, Accel; attitude: VpeStatus, YprU
                let header = [0x11, 0x2A, 0x01, 0x01, 0x01];
                small(Values::Filtered, &header, fields, buffer)
            },
        )
    },
];

fn small(
    values: Values,
    header: &[u8],
    fields: &Fields,
    buffer: &mut [u8],
) -> Result<usize, Error> {
    let [gyro, accel] =
        [fields.gyro, fields.accel].map(|triad| triad.map(|count| count as f32 * FLOAT));
    message(values, header, gyro, accel, fields, buffer)
}

fn message(
    values: Values,
    header: &[u8],
    gyro: [f32; 3],
    accel: [f32; 3],
    fields: &Fields,
    buffer: &mut [u8],
) -> Result<usize, Error> {
    let mut repr = Repr::with_header(values, header)?;
    repr.fill(fields.rest);
    repr.time_ns = (fields.time * 1e9 + 0.5) as u64;
    repr.sample = RawSample::Floats { gyro, accel };
    repr.emit(buffer)
}
