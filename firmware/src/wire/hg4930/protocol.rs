//! The HG4930 as a wire format: [`ImuProtocol`].

use super::{Frame, INERTIAL, Message, Repr, S_CLASS, scan, seal};
use crate::sample::{Axes, RawSample};
use crate::units::{DEGREE, FOOT};
use crate::wire::field::take;
use crate::wire::protocol::{Change, Fields, ImuProtocol, Simulated};
use crate::wire::sequence::{Sequence, Stream};
use crate::wire::{Error, Reading, Scan, power_of_two as two};

/// Honeywell HG4930.
#[derive(Debug)]
pub struct Protocol;

impl ImuProtocol for Protocol {
    type Settings = ();
    const DEFAULT: () = ();
    const NAME: &'static str = "hg4930";
    const SIMULATED: &'static [Simulated] = &SIMULATED;

    #[inline(always)]
    fn scan(bytes: &[u8]) -> Scan {
        scan(bytes)
    }

    /// The message.
    #[inline(always)]
    fn content(frame: &[u8]) -> u8 {
        let [message] = take(frame, 1);
        message
    }

    /// The two bits of the counter count messages of all kinds, so gaps do not show.
    fn stream(_settings: &(), content: u8, _rate: f64) -> Option<Stream> {
        let (units, rate) = match content {
            0xCA => (S_CLASS, 3600.0),
            _ => (INERTIAL, 100.0),
        };
        Some(Stream {
            units,
            rate,
            sequence: Sequence::None,
        })
    }

    #[inline(always)]
    fn read(frame: &[u8]) -> Option<Reading> {
        Frame::over(frame).and_then(|frame| frame.reading().ok())
    }

    #[inline(always)]
    fn change(frame: &mut [u8], change: &Change, _settings: &()) -> Option<Axes> {
        let RawSample::Counts { gyro, accel } = *change.sample else {
            return None;
        };
        Frame::over(frame)?.change(gyro, accel, change.mark)
    }

    /// The start-up pattern.
    fn starts_up(message: &[u8]) -> bool {
        Frame::over(message).is_some_and(|frame| frame.is_pattern())
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
    unit: [f64; 2],
    emit: fn(&Fields, &mut [u8]) -> Result<usize, Error>,
) -> Simulated {
    Simulated {
        name,
        rate,
        count: unit,
        unit,
        bits: 32,
        rest: 25,
        has_accel: true,
        has_status: true,
        settings: |_| {},
        emit,
        introduction: None,
    }
}

const SIMULATED: [Simulated; 2] = [
    simulated(
        "hg4930 0x02",
        100,
        [two(-33), two(-27) * FOOT],
        |fields, buffer| message(Message::Inertial, fields, buffer),
    ),
    Simulated {
        bits: 16,
        ..simulated(
            "hg4930 0xCA",
            3600,
            [
                499.0 * DEGREE / 32_768.0 / 3600.0,
                21.0 * 9.805_989_024 / 32_768.0 / 3600.0,
            ],
            |fields, buffer| message(Message::SClass, fields, buffer),
        )
    },
];

/// S-class values keep their low 16 bits.
fn message(message: Message, fields: &Fields, buffer: &mut [u8]) -> Result<usize, Error> {
    let narrow = |triad: [i32; 3]| triad.map(|count| count as i16);
    let repr = Repr {
        message,
        rate: narrow(fields.gyro),
        accel: narrow(fields.accel),
        status_1: (fields.index & 3) as u16,
        status_2: 0x8000 | (fields.rest & 0x3F) as u16,
        angle: fields.gyro,
        velocity: fields.accel,
    };
    repr.emit(buffer)
}
