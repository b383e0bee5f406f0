//! The `NovAtel` logs as a wire format: [`ImuProtocol`].

use super::{Frame, Header, ImuType, Log, Repr, scan, seal};
use crate::sample::{Axes, RawSample};
use crate::units::{DEGREE, FOOT, G};
use crate::wire::protocol::{Change, Fields, ImuProtocol, Simulated};
use crate::wire::sequence::{Sequence, Stream};
use crate::wire::{Error, Reading, Scan, power_of_two as two};
use serde::{Deserialize, Serialize};

/// Settings that the logs do not contain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The IMU behind RAWIMU and RAWIMUS.
    pub imu_type: ImuType,
}

/// `NovAtel` raw IMU logs.
#[derive(Debug)]
pub struct Protocol;

/// In [`ImuProtocol::content`]: RAWIMU and RAWIMUS do not state the type of the IMU.
const NOT_STATED: u8 = 0x7E;
/// A type that no document has.
const UNKNOWN: u8 = 0x7F;
/// A log with a long header.
const LONG: u8 = 0x80;

/// Seconds of a GPS week.
const WEEK: f64 = 604_800.0;

impl ImuProtocol for Protocol {
    type Settings = Settings;
    const DEFAULT: Settings = Settings {
        imu_type: ImuType(0),
    };
    const NAME: &'static str = "novatel";
    const SIMULATED: &'static [Simulated] = &SIMULATED;

    #[inline(always)]
    fn scan(bytes: &[u8]) -> Scan {
        scan(bytes)
    }

    /// The IMU type, and in bit 7 whether the header is long: the same sample may come in several
    /// logs. The type is 126 when the log does not state it.
    #[inline(always)]
    fn content(frame: &[u8]) -> u8 {
        Frame::over(frame).map_or(NOT_STATED, |frame| {
            let kind = match frame.info() {
                Some((_, ImuType(kind @ 0..NOT_STATED))) => kind,
                Some(_) => UNKNOWN,
                None => NOT_STATED,
            };
            let long = frame.log().header_len() != Log::Rawimusx.header_len();
            if long { kind | LONG } else { kind }
        })
    }

    fn stream(settings: &Settings, content: u8, rate: f64) -> Option<Stream> {
        let kind = match content & !LONG {
            0 | NOT_STATED => settings.imu_type,
            kind => ImuType(kind),
        };
        let rate = kind.rate().map_or(rate, f64::from);
        Some(Stream {
            units: kind.units()?,
            rate,
            sequence: Sequence::Time { rate, turn: WEEK },
        })
    }

    #[inline(always)]
    fn read(frame: &[u8]) -> Option<Reading> {
        Frame::over(frame).map(|frame| frame.reading())
    }

    #[inline(always)]
    fn change(frame: &mut [u8], change: &Change, _settings: &Settings) -> Option<Axes> {
        let RawSample::Counts { gyro, accel } = *change.sample else {
            return None;
        };
        Frame::over(frame)?.change(gyro, accel, change.mark)?;
        Some(Axes::NONE)
    }

    fn seal(frame: &mut [u8]) {
        seal(frame);
    }
}

/// A week that the simulated drives are in.
const DRIVES: u32 = 2400;

/// HG1700-AG58 at 100 Hz.
const fn simulated(
    name: &'static str,
    has_status: bool,
    emit: fn(&Fields, &mut [u8]) -> Result<usize, Error>,
) -> Simulated {
    let unit = [two(-33), two(-27) * FOOT];
    Simulated {
        name,
        rate: 100,
        count: unit,
        unit,
        bits: 32,
        rest: DRIVES,
        has_accel: true,
        has_status,
        settings: |settings| settings.novatel.imu_type = ImuType(11),
        emit,
        introduction: None,
    }
}

/// An Epson IMU whose counts are rates, of deg/s and mg with 16 bits of fraction.
const fn epson(
    name: &'static str,
    rate: u32,
    [gyro, accel]: [f64; 2],
    emit: fn(&Fields, &mut [u8]) -> Result<usize, Error>,
) -> Simulated {
    let unit = [
        gyro * DEGREE / 65_536.0 / rate as f64,
        accel * G / 1000.0 / 65_536.0 / rate as f64,
    ];
    Simulated {
        rate,
        count: unit,
        unit,
        ..simulated(name, true, emit)
    }
}

const SIMULATED: [Simulated; 8] = [
    // ISA-100C
    Simulated {
        rate: 200,
        count: [1e-9, 2e-8],
        unit: [1e-9, 2e-8],
        settings: |settings| settings.novatel.imu_type = ImuType(26),
        ..simulated("novatel RAWIMUSX of an ISA-100C", true, |fields, buffer| {
            log(Log::Rawimusx, 26, fields, buffer)
        })
    },
    simulated("novatel RAWIMU", false, |fields, buffer| {
        log(Log::Rawimu, 11, fields, buffer)
    }),
    simulated("novatel RAWIMUS", false, |fields, buffer| {
        log(Log::Rawimus, 11, fields, buffer)
    }),
    simulated("novatel RAWIMUX", true, |fields, buffer| {
        log(Log::Rawimux, 11, fields, buffer)
    }),
    simulated("novatel RAWIMUSX", true, |fields, buffer| {
        log(Log::Rawimusx, 11, fields, buffer)
    }),
    epson(
        "novatel RAWIMUSX of an EG320N",
        125,
        [0.008, 0.2],
        |fields, buffer| log(Log::Rawimusx, 41, fields, buffer),
    ),
    epson(
        "novatel RAWIMUSX of an EG370N",
        200,
        [1.0 / 66.0, 0.4],
        |fields, buffer| log(Log::Rawimusx, 61, fields, buffer),
    ),
    epson(
        "novatel RAWIMUSX of an EG320N at 200 Hz",
        200,
        [0.008, 0.2],
        |fields, buffer| log(Log::Rawimusx, 62, fields, buffer),
    ),
];

fn log(log: Log, kind: u8, fields: &Fields, buffer: &mut [u8]) -> Result<usize, Error> {
    let [low, high, ..] = fields.rest.to_le_bytes();
    let repr = Repr {
        log,
        header: Header {
            week: DRIVES as u16,
            millisecond: (fields.time * 1e3) as u32,
            ..Header::default()
        },
        lead: [0, kind, low, high],
        second_of_week: fields.time,
        status: 0,
        gyro: fields.gyro,
        accel: fields.accel,
    };
    repr.emit(buffer)
}
