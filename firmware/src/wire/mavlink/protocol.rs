//! What MAVLink's `HIGHRES_IMU` states about itself: [`ImuProtocol`] and [`LaidOut`].

use super::checksum::seal;
use super::{Frame, Header, Imu, Repr, is_signed, scan, updated};
use crate::sample::{Axes, Quantity, RawSample, Unit, Units};
use crate::wire::protocol::{Change, Fields, ImuProtocol, LaidOut, Simulated};
use crate::wire::sequence::{Sequence, Stream};
use crate::wire::{Error, Reading, Scan, power_of_two};
use serde::{Deserialize, Serialize};

/// MAVLink's `HIGHRES_IMU`.
#[derive(Debug)]
pub struct Protocol;

/// The time stamp has 64 bits of microseconds.
const TURN: f64 = power_of_two(64) * 1e-6;

/// Settings that the messages do not contain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The IMU on the line that is corrected.
    pub imu: Imu,
}

impl ImuProtocol for Protocol {
    type Settings = Settings;
    const DEFAULT: Settings = Settings { imu: Imu::USUAL };
    const NAME: &'static str = "mavlink";
    /// The start mark is one byte, which any data byte may equal.
    const HAS_START_MARK: bool = false;
    const SIMULATED: &'static [Simulated] = &SIMULATED;

    fn scan(bytes: &[u8]) -> Scan {
        scan(Imu::USUAL, bytes)
    }

    /// Whether the frame is signed.
    fn content(frame: &[u8]) -> u8 {
        u8::from(is_signed(frame))
    }

    /// The rate is the configured one: the messages do not contain it. A signed frame cannot be
    /// corrected.
    fn stream(_: &Settings, content: u8, rate: f64) -> Option<Stream> {
        let unit = Unit {
            quantity: Quantity::Rate,
            lsb: 1.0,
        };
        (content == 0).then_some(Stream {
            units: Units {
                gyro: unit,
                accel: unit,
            },
            rate,
            sequence: Sequence::Time { rate, turn: TURN },
        })
    }

    #[inline(never)] // not in the code of all formats
    fn read(frame: &[u8]) -> Option<Reading> {
        Frame::over(frame).map(|frame| frame.reading())
    }

    #[inline(never)] // not in the code of all formats
    fn change(frame: &mut [u8], change: &Change, _: &Settings) -> Option<Axes> {
        Frame::over(frame)?.change(change)?;
        Some(Axes::NONE)
    }

    fn has_thermometer(_: &Settings) -> bool {
        true
    }

    fn seal(frame: &mut [u8]) {
        if let Ok(header) = Header::of(frame) {
            seal(frame, &header);
        }
    }
}

impl LaidOut for Protocol {
    type Layout = Imu;

    #[inline(always)]
    fn scan(imu: Imu, bytes: &[u8]) -> Scan {
        scan(imu, bytes)
    }

    #[inline(always)]
    fn read(_: Imu, frame: &[u8]) -> Option<Reading> {
        <Protocol as ImuProtocol>::read(frame)
    }

    #[inline(always)]
    fn change(_: Imu, frame: &mut [u8], change: &Change, settings: &Settings) -> Option<Axes> {
        <Protocol as ImuProtocol>::change(frame, change, settings)
    }
}

/// Unit of the tests' floats: 2^-20, so that sums of them stay exact.
const FLOAT: f32 = 9.536_743e-7;

const fn simulated(
    name: &'static str,
    rate: u32,
    emit: fn(&Fields, &mut [u8]) -> Result<usize, Error>,
) -> Simulated {
    Simulated {
        name,
        rate,
        count: [FLOAT as f64 / rate as f64; 2],
        unit: [1.0 / rate as f64; 2],
        bits: 32,
        rest: 0x41AC_0000, // 21.5 degrees
        has_accel: true,
        has_status: true,
        settings: |_| {},
        emit,
        introduction: None,
    }
}

const SIMULATED: [Simulated; 3] = [
    simulated("mavlink 2", 1000, |fields, buffer| {
        message(true, 62, fields, buffer)
    }),
    Simulated {
        settings: |settings| settings.mavlink.imu.id = 1,
        ..simulated("mavlink 2, second IMU", 200, |fields, buffer| {
            message(true, 63, fields, buffer)
        })
    },
    simulated("mavlink 1", 200, |fields, buffer| {
        message(false, 62, fields, buffer)
    }),
];

fn message(two: bool, length: u8, fields: &Fields, buffer: &mut [u8]) -> Result<usize, Error> {
    let [gyro, accel] =
        [fields.gyro, fields.accel].map(|triad| triad.map(|count| count as f32 * FLOAT));
    let mut rest = [0; 24];
    for (at, byte) in rest.iter_mut().enumerate() {
        *byte = fields.rest.rotate_left(5 * at as u32) as u8;
    }
    let repr = Repr {
        two,
        length,
        compatible: 0,
        sequence: fields.index as u8,
        sender: [1, 1],
        time_us: (fields.time * 1e6 + 0.5) as u64,
        sample: RawSample::Floats { gyro, accel },
        rest,
        temperature: f32::from_bits(fields.rest),
        updated: updated::ALL,
        id: length - 62,
    };
    repr.emit(buffer)
}
