//! Xsens' `MTData2` as a wire format: [`ImuProtocol`].

use super::layout::Precision;
use super::{Frame, Repr, scan, seal};
use crate::sample::{Axes, Quantity, RawSample, Unit, Units};
use crate::wire::protocol::{Change, Fields, ImuProtocol, Simulated};
use crate::wire::sequence::{Rule, Sequence, Stream};
use crate::wire::{Error, Reading, Scan};

/// Xsens MTi.
#[derive(Debug)]
pub struct Protocol;

/// `SampleTimeFine` has 32 bits of 0.1 ms.
const TURN: f64 = 429_496.729_6;
/// In [`ImuProtocol::content`], from bit 0 on: the packet of the gyros, that of the accelerometers,
/// and these.
const NONE: u8 = 3;
const FIXED: u8 = 1 << 4;
const TIMED: u8 = 1 << 6;
const COUNTED: u8 = 1 << 7;

impl ImuProtocol for Protocol {
    type Settings = ();
    const DEFAULT: () = ();
    const NAME: &'static str = "xsens";
    const SIMULATED: &'static [Simulated] = &SIMULATED;

    #[inline(always)]
    fn scan(bytes: &[u8]) -> Scan {
        scan(bytes)
    }

    #[inline(never)] // not in the code of all formats
    fn content(frame: &[u8]) -> u8 {
        Frame::over(frame).map_or(0, |frame| {
            let (gyro, accel) = frame.packets();
            let precision = match frame.precision() {
                Precision::Single => 0,
                Precision::Fixed => FIXED,
            };
            let timed = frame.time().map_or(0, |_| TIMED);
            let counted = frame.counter().map_or(0, |_| COUNTED);
            let accel = accel.map_or(NONE, |accel| accel as u8);
            gyro as u8 | accel << 2 | precision | timed | counted
        })
    }

    /// The rate is the configured one: the messages do not contain it.
    fn stream(_: &(), content: u8, rate: f64) -> Option<Stream> {
        let count = if content & FIXED == 0 {
            1.0
        } else {
            1.0 / f64::from(super::FIXED)
        };
        let unit = |packet: u8, increment: f64| {
            let (quantity, lsb) = match packet & 3 {
                0 => (Quantity::Increment, increment),
                _ => (Quantity::Rate, 1.0),
            };
            Unit {
                quantity,
                lsb: lsb * count,
            }
        };
        Some(Stream {
            units: Units {
                gyro: unit(content, 2.0), // twice the vector part
                accel: unit(content >> 2, 1.0),
            },
            rate,
            sequence: if content & TIMED != 0 {
                Sequence::Time { rate, turn: TURN }
            } else if content & COUNTED != 0 {
                Sequence::Counter(Rule::new(0x1_0000, 1))
            } else {
                Sequence::None
            },
        })
    }

    #[inline(never)] // not in the code of all formats
    fn read(frame: &[u8]) -> Option<Reading> {
        Frame::over(frame).map(|frame| frame.reading())
    }

    #[inline(never)] // likewise
    fn change(frame: &mut [u8], change: &Change, _: &()) -> Option<Axes> {
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

/// Unit of the tests' floats: 2^-20, so that sums of them stay exact.
const FLOAT: f32 = 9.536_743e-7;

const fn simulated(
    name: &'static str,
    rate: u32,
    unit: [f64; 2],
    emit: fn(&Fields, &mut [u8]) -> Result<usize, Error>,
) -> Simulated {
    Simulated {
        name,
        rate,
        count: [unit[0] * FLOAT as f64, unit[1] * FLOAT as f64],
        unit,
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
        count: [1e-9, 1e-7],
        ..simulated("xsens, increments", 1000, [2.0, 1.0], |fields, buffer| {
            let [gyro, accel] = [(fields.gyro, 0.5e-9), (fields.accel, 1e-7)]
                .map(|(triad, unit)| triad.map(|count| (f64::from(count) * unit) as f32));
            let sample = RawSample::Floats { gyro, accel };
            let packets = [
                (0x1020, 2),
                (0x1060, 4),
                (0x8030, 16),
                (0x4010, 12),
                (0xE020, 4),
            ];
            message(&packets, sample, fields, buffer)
        })
    },
    simulated("xsens, rates", 400, [1.0 / 400.0; 2], |fields, buffer| {
        let float = |triad: [i32; 3]| triad.map(|count| count as f32 * FLOAT);
        let sample = RawSample::Floats {
            gyro: float(fields.gyro),
            accel: float(fields.accel),
        };
        let packets = [
            (0x1060, 4),
            (0x0810, 4),
            (0x4020, 12),
            (0x8020, 12),
            (0xE020, 4),
        ];
        message(&packets, sample, fields, buffer)
    }),
    Simulated {
        unit: [FLOAT as f64 / 100.0; 2],
        ..simulated(
            "xsens, fixed point",
            100,
            [1.0 / 100.0; 2],
            |fields, buffer| {
                let sample = RawSample::Counts {
                    gyro: fields.gyro,
                    accel: fields.accel,
                };
                let packets = [
                    (0x1020, 2),
                    (0x4021, 12),
                    (0x8021, 12),
                    (0x0811, 4),
                    (0xE020, 4),
                ];
                message(&packets, sample, fields, buffer)
            },
        )
    },
];

fn message(
    packets: &[(u16, u8)],
    sample: RawSample,
    fields: &Fields,
    buffer: &mut [u8],
) -> Result<usize, Error> {
    let repr = Repr {
        time: (fields.time * 1e4 + 0.5) as u64 as u32,
        counter: fields.index as u16,
        sample,
        ..Repr::with_packets(packets, fields.rest)?
    };
    repr.emit(buffer)
}
