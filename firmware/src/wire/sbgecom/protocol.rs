//! sbgECom as a wire format: [`ImuProtocol`].

use super::{Frame, Message, Repr, scan, seal, status};
use crate::sample::{Axes, Quantity, RawSample, Unit, Units};
use crate::wire::protocol::{Change, Fields, ImuProtocol, Simulated};
use crate::wire::sequence::{Sequence, Stream};
use crate::wire::{Error, Reading, Scan};

/// SBG Systems sbgECom.
#[derive(Debug)]
pub struct Protocol;

/// Counts of `IMU_SHORT` for 1 m/s^2, and for 1 rad/s in the standard and in the high range.
const ACCEL: f64 = 1_048_576.0;
const GYRO: f64 = 67_108_864.0;
const GYRO_HIGH: f64 = 12_304_174.0;
/// The time stamp has 32 bits of microseconds.
const TURN: f64 = 4_294.967_296;
/// In [`ImuProtocol::content`]: the high range. Message numbers are less.
const HIGH_RANGE: u8 = 0x80;

impl ImuProtocol for Protocol {
    type Settings = ();
    const DEFAULT: () = ();
    const NAME: &'static str = "sbgecom";
    const SIMULATED: &'static [Simulated] = &SIMULATED;

    #[inline(always)]
    fn scan(bytes: &[u8]) -> Scan {
        scan(bytes)
    }

    /// The message, and whether an `IMU_SHORT` has the scale of the high range.
    #[inline(always)]
    fn content(frame: &[u8]) -> u8 {
        Frame::over(frame).map_or(0, |frame| {
            let high =
                frame.message() == Message::Short && frame.status() & status::HIGH_RANGE != 0;
            frame.message().id() | if high { HIGH_RANGE } else { 0 }
        })
    }

    /// The rate is the configured one: the messages do not contain it.
    fn stream(_: &(), content: u8, rate: f64) -> Option<Stream> {
        let (gyro, accel) = if content == Message::Data.id() {
            (1.0, 1.0)
        } else if content & HIGH_RANGE != 0 {
            (1.0 / GYRO_HIGH, 1.0 / ACCEL)
        } else {
            (1.0 / GYRO, 1.0 / ACCEL)
        };
        let unit = |lsb| Unit {
            quantity: Quantity::Average,
            lsb,
        };
        Some(Stream {
            units: Units {
                gyro: unit(gyro),
                accel: unit(accel),
            },
            rate,
            sequence: Sequence::Time { rate, turn: TURN },
        })
    }

    #[inline(always)]
    fn read(frame: &[u8]) -> Option<Reading> {
        Frame::over(frame).map(|frame| frame.reading())
    }

    #[inline(never)] // not in the code of all formats
    fn change(frame: &mut [u8], change: &Change, _settings: &()) -> Option<Axes> {
        Frame::over(frame)?.change(change)?;
        Some(Axes::NONE)
    }

    fn has_thermometer(_: &()) -> bool {
        true
    }

    fn seal(frame: &mut [u8]) {
        seal(frame);
    }
}

const fn simulated(
    name: &'static str,
    rate: u32,
    [gyro, accel]: [f64; 2],
    emit: fn(&Fields, &mut [u8]) -> Result<usize, Error>,
) -> Simulated {
    let unit = [gyro / rate as f64, accel / rate as f64];
    Simulated {
        name,
        rate,
        count: unit,
        unit,
        bits: 32,
        rest: 25 * 256,
        has_accel: true,
        has_status: true,
        settings: |_| {},
        emit,
        introduction: None,
    }
}

/// Unit of the fields in `IMU_DATA`: 2^-20 m/s^2 and rad/s.
const FLOAT: f32 = 9.536_743e-7;

const SIMULATED: [Simulated; 3] = [
    simulated(
        "sbgecom IMU_SHORT",
        1000,
        [1.0 / GYRO, 1.0 / ACCEL],
        |fields, buffer| message(Message::Short, status::GOOD, fields, buffer),
    ),
    simulated(
        "sbgecom IMU_SHORT, high range",
        500,
        [1.0 / GYRO_HIGH, 1.0 / ACCEL],
        |fields, buffer| {
            let status = status::GOOD | status::HIGH_RANGE;
            message(Message::Short, status, fields, buffer)
        },
    ),
    Simulated {
        count: [FLOAT as f64 / 200.0; 2],
        ..simulated("sbgecom IMU_DATA", 200, [1.0; 2], |fields, buffer| {
            message(Message::Data, status::GOOD, fields, buffer)
        })
    },
];

fn message(
    message: Message,
    status: u16,
    fields: &Fields,
    buffer: &mut [u8],
) -> Result<usize, Error> {
    let float = |triad: [i32; 3]| triad.map(|count| count as f32 * FLOAT);
    let sample = match message {
        Message::Data => RawSample::Floats {
            gyro: float(fields.gyro),
            accel: float(fields.accel),
        },
        Message::Short => RawSample::Counts {
            gyro: fields.gyro,
            accel: fields.accel,
        },
    };
    let repr = Repr {
        message,
        time_us: (fields.time * 1e6 + 0.5) as u64 as u32,
        status,
        acceleration: [1.0, fields.rest as f32, -9.75],
        rate: [0.5, 0.25, fields.rest as f32],
        sample,
        temperature: f32::from(fields.rest as i16) / 256.0,
    };
    repr.emit(buffer)
}
