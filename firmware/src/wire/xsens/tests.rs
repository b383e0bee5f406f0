//! Messages put together by another program, after the documentation.

use super::*;
use crate::sample::Quantity;
use crate::wire::examples::made;
use crate::wire::field::hex;
use crate::wire::sequence::{Gap, Last, Stream};
use crate::wire::{Checked, ImuFormat, Settings};
use std::vec::Vec;

/// `PacketCounter`, `SampleTimeFine`, `DeltaQ`, `DeltaV`, `StatusWord`.
const INCREMENTS: [u8; 58] = hex(
    "faff363510200212341060040012d6878030103f8000003c000000bc8000003d00000040100c3f000000be800000bdc7ae14e0200400000003e1",
);
/// `SampleTimeFine`, `Temperature`, `Acceleration`, `RateOfTurn`, `StatusWord` with two axes
/// clipped.
const RATES: [u8; 56] = hex(
    "faff36331060040012d68708180441ac000040280c3f000000be800000c11c000080280c3c800000bd0000003d800000e0200400002203c3",
);
/// `PacketCounter`, `Acceleration`, `RateOfTurn`, `Temperature`, `StatusWord`.
const FIXED_POINT: [u8; 54] = hex(
    "faff3631102002123440210c00080000fffc0000ff64000080210c00004000ffff80000001000008110401580000e020040000000366",
);
/// `PacketCounter`, `Quaternion`, `DeltaQ`, `DeltaV`, `Acceleration`, `FreeAcceleration`,
/// `RateOfTurn`,
/// `MagneticField`.
const TOGETHER: [u8; 123] = hex(
    "faff367610200212342010103f8000000000000000000000000000008030103f8000003c000000bc8000003d00000040100c3f000000be800000bdc7ae1440200c42480000c1c80000c11c000040300c3f800000400000004040000080200c3fc80000c048000040c80000c0200c3e800000bf0000003e000000ca",
);
/// `PacketCounter`, `RateOfTurn`, `Acceleration` in double precision.
const DOUBLE: [u8; 64] = hex(
    "faff363b10200212348023183ff0000000000000400000000000000040080000000000004023183ff00000000000004000000000000000400800000000000074",
);

fn stream(bytes: &[u8]) -> Stream {
    let mut bytes = bytes.to_vec();
    let checked = Checked::new(ImuFormat::Xsens, &mut bytes).unwrap();
    let source = checked.source();
    let stream = source.stream(&Settings::DEFAULT, checked.content());
    stream.unwrap()
}

#[test]
fn golden_messages_read_and_are_made_again() {
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-7, "{a} {b}");
    for (golden, quantity, gyro, accel, valid) in [
        (
            &INCREMENTS[..],
            Quantity::Increment,
            [0.015625, -0.03125, 0.0625], // twice the vector part
            [0.5, -0.25, -0.0975],
            Axes::ALL,
        ),
        (
            &RATES,
            Quantity::Rate,
            [0.015625, -0.03125, 0.0625],
            [0.5, -0.25, -9.75],
            Axes::new(0b011, 0b101),
        ),
        (
            &FIXED_POINT,
            Quantity::Rate,
            [0.015625, -0.03125, 0.0625],
            [0.5, -0.25, -9.75],
            Axes::ALL,
        ),
    ] {
        assert_eq!(scan(golden), Scan::Frame(golden.len()));
        let frame = Frame::new_checked(golden).unwrap();
        let units = stream(golden).units;
        assert_eq!(units.gyro.quantity, quantity);
        assert_eq!(units.accel.quantity, quantity);
        let [is_gyro, is_accel] = match frame.sample() {
            RawSample::Counts { gyro, accel } => [gyro, accel].map(|t| t.map(f64::from)),
            RawSample::Floats { gyro, accel } => [gyro, accel].map(|t| t.map(f64::from)),
        };
        for (value, si) in is_gyro.into_iter().zip(gyro) {
            close(value * units.gyro.lsb, si);
        }
        for (value, si) in is_accel.into_iter().zip(accel) {
            close(value * units.accel.lsb, si);
        }
        assert_eq!(frame.reading().valid, valid);
        assert_eq!(remade(golden).unwrap(), golden);
    }
    let frame = Frame::new_checked(INCREMENTS).unwrap();
    assert_eq!(
        (frame.counter(), frame.time()),
        (Some(4660), Some(1_234_567))
    );
    for golden in [&RATES[..], &FIXED_POINT] {
        let reading = Frame::new_checked(golden).unwrap().reading();
        assert_eq!(reading.temperature, Some([21.5; 3]));
    }
}

/// All values of a message with the same errors change by as much. Outputs of the sensor's filter
/// stay, and so does the scalar of `DeltaQ`.
#[test]
fn increments_and_rates_change_together() {
    let mut bytes = TOGETHER;
    let mut checked = Checked::new(ImuFormat::Xsens, &mut bytes).unwrap();
    let sample = RawSample::Floats {
        gyro: [0.0078125 - 0.00390625, -0.015625, 0.03125],
        accel: [0.5, -0.25 + 0.125, -0.0975],
    };
    let settings = Settings {
        rate: 100.0,
        ..Settings::DEFAULT
    };
    let change = Change {
        sample: &sample,
        mark: true, // there is no room
        settings: &settings,
    };
    assert_eq!(checked.change(&change), Ok(Axes::NONE));
    assert_eq!(checked.read().unwrap().sample, sample);
    assert_eq!(scan(&bytes), Scan::Frame(123));
    let float = |at| f32::from_be_bytes(take(&bytes, at));
    let differs = |at: &usize| bytes.get(*at) != TOGETHER.get(*at);
    let changed: Vec<usize> = (0..122).filter(differs).map(|at| at / 4).collect();
    // DeltaQ x, DeltaV y, Acceleration y, RateOfTurn x
    let (dq, dv, accel, rate) = (35, 54, 69, 95);
    assert_eq!(float(dq), 0.00390625);
    assert_eq!(float(dv), -0.125);
    assert_eq!(float(accel), -25.0 + 12.5);
    assert_eq!(float(rate), 1.5625 - 0.78125);
    let four = |at: usize| [at / 4, at.div_ceil(4)];
    let allowed = [four(dq), four(dv), four(accel), four(rate)].concat();
    assert!(changed.iter().all(|at| allowed.contains(at)), "{changed:?}");
}

/// A gyro in fixed point changes its other packets in fixed point.
#[test]
fn fixed_point_values_change_in_counts() {
    let mut bytes = FIXED_POINT;
    let mut checked = Checked::new(ImuFormat::Xsens, &mut bytes).unwrap();
    let sample = RawSample::Counts {
        gyro: [1, -2, 3],
        accel: [-4, 5, i32::MIN],
    };
    let change = Change {
        sample: &sample,
        mark: false,
        settings: &Settings::DEFAULT,
    };
    assert_eq!(checked.change(&change), Ok(Axes::NONE));
    assert_eq!(checked.read().unwrap().sample, sample);
    assert_eq!(scan(&bytes), Scan::Frame(54));
    let counts = |value: i32| value.to_be_bytes();
    let [old, new] = [counts(100), counts(90)];
    let added = |value, scale| added(Precision::Fixed, counts(value), old, new, scale);
    assert_eq!(added(1000, 1.0), counts(990));
    assert_eq!(added(1000, 0.25), counts(997)); // -2.5, rounded away from zero
    assert_eq!(added(i32::MIN + 3, 1.0), counts(i32::MIN));
}

/// Double precision, and two precisions in one message.
#[test]
fn other_precisions_pass() {
    assert_eq!(scan(&DOUBLE), Scan::Other(64));
    let mut mixed = FIXED_POINT;
    mixed[10] = 0x20; // Acceleration in single precision
    seal(&mut mixed);
    assert_eq!(scan(&mixed), Scan::Other(54));
}

#[test]
fn time_or_counter_tell_gaps() {
    fn gap(golden: &[u8], time: u32, counter: u16, last: &mut Last) -> Gap {
        let mut repr = Repr::parse(&Frame::new_checked(golden).unwrap());
        (repr.time, repr.counter) = (time, counter);
        let bytes = made(|buffer| repr.emit(buffer)).unwrap();
        let reading = Frame::new_checked(bytes).unwrap().reading();
        stream(golden).gap(last, &reading)
    }
    let mut last = Last::default();
    let mut at = |time| gap(&INCREMENTS, time, 0, &mut last); // at 1000 Hz
    assert_eq!(at(u32::MAX - 4), Gap::None);
    assert_eq!(at(5), Gap::None); // it has restarted
    assert_eq!(at(5), Gap::Duplicate);
    assert_eq!(at(45), Gap::Missed(3));
    let mut last = Last::default();
    let mut at = |counter| gap(&FIXED_POINT, 0, counter, &mut last);
    assert_eq!(at(0xFFFF), Gap::None);
    assert_eq!(at(0), Gap::None);
    assert_eq!(at(3), Gap::Missed(2));
}

#[test]
fn others_pass_and_damage_does_not() {
    let wake_up: [u8; 5] = hex("faff3e00c3");
    assert_eq!(scan(&wake_up), Scan::Other(5));
    assert_eq!(Frame::new_checked(wake_up).err(), Some(Error::Header));
    for bit in 16..8 * INCREMENTS.len() {
        let mut damaged = INCREMENTS;
        damaged[bit / 8] ^= 1 << (bit % 8);
        let good = scan(&damaged) == Scan::Frame(58);
        assert!(!good, "bit {bit}");
    }
    // packets that do not add up, and a message with the longer header
    let mut torn = INCREMENTS;
    torn[6] = 3;
    seal(&mut torn);
    assert_eq!(scan(&torn), Scan::BadChecksum);
    let mut long = std::vec![0xFA, 0xFF, 0x36, 0xFF, 0, 53];
    long.extend(&INCREMENTS[4..]);
    seal(&mut long);
    assert_eq!(scan(&long), Scan::Frame(60));
    assert_eq!(remade(&long).unwrap(), long);
    for (bytes, expected) in [
        (&[][..], Scan::Partial(2)),
        (&[0xFA, 0xFF, 0x36], Scan::Partial(4)),
        (&[0xFA, 0x01], Scan::Garbage),
        (&[0xFA, 0xFF, 0x36, 0xFF], Scan::Partial(6)),
        (&[0xFA, 0xFF, 0x36, 0xFF, 1, 0], Scan::Partial(263)),
    ] {
        assert_eq!(scan(bytes), expected, "{bytes:02x?}");
    }
}

/// An example with start marks in its data.
pub(in crate::wire) fn example(n: u8) -> Vec<u8> {
    let packets = [
        (0x1020, 2),
        (0x1060, 4),
        (0x8030, 16),
        (0x4010, 12),
        (0xE020, 4),
    ];
    let repr = Repr {
        time: 10 * u32::from(n),
        counter: u16::from(n),
        sample: RawSample::Floats {
            gyro: [f32::from_bits(0xFAFF_3600), f32::from(n), 0.25],
            accel: [0.0, f32::from_bits(0x36FA_FF36), -0.098],
        },
        ..Repr::with_packets(&packets, 0).unwrap()
    };
    made(|buffer| repr.emit(buffer)).unwrap()
}

/// See [`crate::wire::examples::Examples::remade`].
pub(in crate::wire) fn remade(frame: &[u8]) -> Result<Vec<u8>, Error> {
    let repr = Repr::parse(&Frame::new_checked(frame)?);
    made(|buffer| repr.emit(buffer))
}
