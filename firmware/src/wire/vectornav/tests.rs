//! Messages of many kinds: where their fields are, what is changed, and what of the status counts.

use super::checksum::seal;
use super::*;
use crate::wire::examples::made;
use crate::wire::field::hex;
use crate::wire::sequence::{Gap, Last, Sequence, Stream};
use crate::wire::{Checked, ImuFormat, Settings};
use std::vec::Vec;

/// `TimeStartup`, `MagPres`, `DeltaTheta` with `DeltaVel`, `InsStatus`.
const INCREMENTS: [u8; 64] = hex(
    "fa01011ccb04fb711f0100000000803e000000bf0000003e0000ac410080ca420ad7233b0000803c000000bd0000803d0000003f000080be00001cc146002a92",
);
/// `TimeStartup`; `ImuStatus`, `UncompMag`, `UncompAccel`, `UncompGyro`, `Temp`, `Pres`, `SensSat`.
const UNCOMPENSATED: [u8; 64] = hex(
    "fa0601003f08cb04fb711f01000000000000803e000000bf0000003e0000003f000080be00001cc10000803c000000bd0000803d0000ac410080ca428800f26d",
);
/// `TimeGps`, `YawPitchRoll`, `AngularRate`, `Accel`; `VpeStatus`, `YprU`.
const COMPENSATED: [u8; 66] = hex(
    "fa112a01010115cde72495cc6d13000020410000a0410000f0410000803c000000bd0000803d0000003f000080be00001cc104000000803f0000004000004040a681",
);
/// All fifteen fields of the common group.
const COMMON: [u8; 204] = hex(
    "fa01ff7f0100000000000000020000000000000003000000000000000000803f00000040000040400000000000000000000000000000803f0000003f0000803e0000003e000000000000f03f00000000000000400000000000000840000080400000a0400000c0400000803f00000040000010c10000c03f00002040000018c10000403f0000c03e0000403e0000e04000000041000010410000a0410000c8420ad7233b0000003f0000803e0000003ecdcccc3dcdcc4c3e9a9999be06004d0000000500000000000000c7c4",
);
/// `TimeStartup`, `AngularRate`; of the receiver its week and the strength of two satellites.
const SATELLITES: [u8; 48] = hex(
    "fa092100044009000000000000000000003f0000803e0000003e98080200000102030405060708090a0b0c0d0e0fbd4d",
);

const GYRO: [f32; 3] = [0.015625, -0.03125, 0.0625];
const ACCEL: [f32; 3] = [0.5, -0.25, -9.75];

/// All but these have the sensor's own values.
fn values_of(bytes: &[u8]) -> Values {
    if [&COMPENSATED[..], &SATELLITES].contains(&bytes) {
        Values::Filtered
    } else {
        Values::Sensors
    }
}

fn over(bytes: &[u8]) -> Frame<&[u8]> {
    Frame::new_checked(values_of(bytes), bytes).unwrap()
}

fn stream(bytes: &[u8], values: Values) -> Stream {
    let mut settings = Settings::DEFAULT;
    settings.vectornav.values = values;
    let mut bytes = bytes.to_vec();
    let checked = Checked::new(ImuFormat::VectorNav(values), &mut bytes).unwrap();
    let stream = checked.source().stream(&settings, checked.content());
    stream.unwrap()
}

#[test]
fn golden_messages_read_and_are_made_again() {
    use crate::sample::Quantity::{Increment, Rate};
    let degree = core::f64::consts::PI / 180.0;
    for (golden, quantity, unit, valid) in [
        (&INCREMENTS[..], Increment, degree, Axes::ALL),
        // SensSat: gyro y and accelerometer x
        (&UNCOMPENSATED, Rate, 1.0, Axes::new(0b101, 0b110)),
        // VpeStatus: some gyro
        (&COMPENSATED, Rate, 1.0, Axes::new(0, 7)),
    ] {
        let values = values_of(golden);
        assert_eq!(scan(values, golden), Scan::Frame(golden.len()));
        let frame = over(golden);
        let (gyro, accel) = (GYRO, ACCEL);
        assert_eq!(frame.sample(), RawSample::Floats { gyro, accel });
        let units = stream(golden, values).units;
        assert_eq!(units.gyro.quantity, quantity);
        assert_eq!(units.accel.quantity, quantity);
        assert!((units.gyro.lsb - unit).abs() < 1e-15);
        assert_eq!(units.accel.lsb, 1.0);
        assert_eq!(frame.reading().valid, valid);
        assert_eq!(remade(golden, values).unwrap(), golden);
    }
    let time = |golden: &[u8]| over(golden).time_ns().unwrap();
    assert_eq!(time(&INCREMENTS), 1_234_567_890_123);
    assert_eq!(time(&COMPENSATED), 1_400_000_000_123_456_789);
    let frame = over(&INCREMENTS);
    assert_eq!(frame.reading().temperature, Some([21.5; 3]));
}

/// The best of three quantities is the sample, and the length of every field is known.
#[test]
fn fields_are_found_by_the_header() {
    let frame = over(&COMMON);
    let sample = RawSample::Floats {
        gyro: [0.5, 0.25, 0.125],
        accel: [0.1, 0.2, -0.3],
    };
    assert_eq!(frame.sample(), sample);
    assert_eq!(frame.time_ns(), Some(1));
    assert_eq!(
        frame.quantities(),
        (Quantity::Increments, Some(Quantity::Increments))
    );
    let frame = over(&SATELLITES);
    assert_eq!(frame.quantities(), (Quantity::Compensated, None));
    assert_eq!(frame.reading().present, Axes::new(7, 0));
    assert_eq!(frame.reading().valid, Axes::new(7, 0));
    assert_eq!(scan(Values::Filtered, &SATELLITES[..28]), Scan::Partial(29));
    assert_eq!(scan(Values::Filtered, &SATELLITES[..29]), Scan::Partial(48));
}

/// With increments, rates with the same errors change by as much; those of the sensor's own filter
/// stay.
#[test]
fn increments_and_uncompensated_rates_change_together() {
    let mut bytes = COMMON;
    let mut checked = Checked::new(ImuFormat::VectorNav(Values::Sensors), &mut bytes).unwrap();
    let sample = RawSample::Floats {
        gyro: [0.5 - 0.0625, 0.25, 0.125],
        accel: [0.1, 0.2 + 0.25, -0.3],
    };
    let settings = Settings {
        rate: 400.0,
        ..Settings::DEFAULT
    };
    let change = Change {
        sample: &sample,
        mark: true, // there is no room
        settings: &settings,
    };
    assert_eq!(checked.change(&change), Ok(Axes::NONE));
    assert_eq!(checked.read().unwrap().sample, sample);
    assert_eq!(scan(Values::Sensors, &bytes), Scan::Frame(204));
    let at = |at| floats(take(&bytes, at));
    let before = |at| floats(take(&COMMON, at));
    assert_eq!((at(56), at(104)), (before(56), before(104))); // AngularRate, Accel
    let [x, y, z] = at(128); // UncompGyro of the field Imu
    assert!(
        (x - (0.75 - 0.0625 * 400.0 / 57.295_78)).abs() < 1e-6,
        "{x}"
    );
    assert_eq!([y, z], [0.375, 0.1875]);
    let [x, y, z] = at(116); // UncompAccel
    assert!((y - (2.5 + 0.25 * 400.0)).abs() < 1e-4, "{y}");
    assert_eq!([x, z], [1.5, -9.5]);
    let differs = |at: &usize| bytes.get(*at) != COMMON.get(*at);
    let changed: Vec<_> = (0..204).filter(differs).collect();
    let imu_and_deltas = |at: &usize| (116..188).contains(at) || *at >= 202;
    assert!(changed.iter().all(imu_and_deltas), "{changed:?}");
}

/// Increments are of the time that the message says, and without one that is known of the
/// configured period.
#[test]
fn the_time_of_increments_is_their_period() {
    let sample = RawSample::Floats {
        gyro: [0.4375, 0.25, 0.125],
        accel: [0.1, 0.2, -0.3],
    };
    let settings = Settings {
        rate: 130.0,
        ..Settings::DEFAULT
    };
    let change = Change {
        sample: &sample,
        mark: false,
        settings: &settings,
    };
    for (time, rate) in [
        (0.001_25_f32, 800.0),
        (0.002_5, 400.0),
        (0.005, 200.0),
        (0.02, 50.0),
        (0.2, 5.0),
        (0.005_05, 200.0),
        (0.005_3, 130.0),
        (0.0, 130.0),
        (-0.005, 130.0),
        (f32::NAN, 130.0),
        (f32::INFINITY, 130.0),
    ] {
        let mut bytes = COMMON;
        put(&mut bytes, 160, time.to_le_bytes());
        seal(&mut bytes);
        let mut checked = Checked::new(ImuFormat::VectorNav(Values::Sensors), &mut bytes).unwrap();
        let stream = checked.source().stream(&settings, checked.content());
        assert_eq!(stream.map(|stream| stream.rate), Some(rate), "{time}");
        checked.change(&change).unwrap();
        assert_eq!(checked.read().unwrap().sample, sample);
        assert_eq!(bytes[160..164], time.to_le_bytes());
        // UncompGyro changes by as much a second
        let [x, ..] = floats(take(&bytes, 128));
        let want = 0.75 - 0.0625 * rate as f32 / 57.295_78;
        assert!((x - want).abs() < 1e-6, "{time}: {x}");
    }
    // the values of the sensor's filter are rates
    let mut bytes = COMMON;
    let checked = Checked::new(ImuFormat::VectorNav(Values::Filtered), &mut bytes).unwrap();
    let mut settings = settings;
    settings.vectornav.values = Values::Filtered;
    let stream = checked.source().stream(&settings, checked.content());
    assert_eq!(stream.map(|stream| stream.rate), Some(130.0));
}

/// Configured so, the device reads and changes the values of the sensor's filter, and no others.
#[test]
fn compensated_rates_change_alone() {
    assert_eq!(scan(Values::Sensors, &COMPENSATED), Scan::Other(66));
    assert_eq!(scan(Values::Filtered, &UNCOMPENSATED), Scan::Other(64));
    let mut bytes = COMMON;
    let mut checked = Checked::new(ImuFormat::VectorNav(Values::Filtered), &mut bytes).unwrap();
    let before = checked.read().unwrap().sample;
    let (gyro, accel) = ([0.5, 0.25, 0.125], [1.0, 2.0, -9.0]);
    assert_eq!(before, RawSample::Floats { gyro, accel });
    let units = stream(&COMMON, Values::Filtered).units;
    assert_eq!(units.gyro.quantity, crate::sample::Quantity::Rate);
    let sample = RawSample::Floats {
        gyro: accel,
        accel: gyro,
    };
    let change = Change {
        sample: &sample,
        mark: false,
        settings: &Settings::DEFAULT,
    };
    checked.change(&change).unwrap();
    assert_eq!(scan(Values::Filtered, &bytes), Scan::Frame(204));
    let differs = |at: &usize| bytes.get(*at) != COMMON.get(*at);
    let rate_and_accel =
        |at: &usize| (56..68).contains(at) || (104..116).contains(at) || *at >= 202;
    assert!((0..204).filter(differs).all(|at| rate_and_accel(&at)));
    assert_eq!(floats(take(&bytes, 56)), accel);
    assert_eq!(floats(take(&bytes, 104)), gyro);
}

#[test]
fn our_own_fault_has_room_in_the_imu_status() {
    let mut bytes = UNCOMPENSATED;
    let mut checked = Checked::new(ImuFormat::VectorNav(Values::Sensors), &mut bytes).unwrap();
    let sample = checked.read().unwrap().sample;
    let change = Change {
        sample: &sample,
        mark: true,
        settings: &Settings::DEFAULT,
    };
    checked.change(&change).unwrap();
    assert_eq!(bytes[14..16], OWN_FAULT.to_le_bytes());
    assert_eq!(scan(Values::Sensors, &bytes), Scan::Frame(64));
}

#[test]
fn an_imu_that_is_not_heard_is_not_valid_nor_is_a_value_that_is_no_number() {
    let mut bytes = INCREMENTS;
    bytes[60] |= status::IMU_ERROR as u8;
    seal(&mut bytes);
    let frame = over(&bytes);
    assert_eq!(frame.reading().valid, Axes::NONE);
    let mut bytes = INCREMENTS;
    bytes[40..44].copy_from_slice(&f32::NAN.to_le_bytes()); // DeltaTheta y
    seal(&mut bytes);
    let frame = over(&bytes);
    assert_eq!(frame.reading().valid, Axes::new(0b101, 7));
}

/// Whether messages are timed or the clock has to find lost ones.
#[test]
fn only_messages_with_a_time_stamp_are_timed() {
    // each with TimeStartup, with TimeGps, and with neither
    let headers: [(Values, [&[u8]; 3]); 3] = [
        (
            Values::Sensors, // DeltaTheta
            [
                &[0x01, 0x01, 0x08],
                &[0x01, 0x02, 0x08],
                &[0x01, 0x00, 0x08],
            ],
        ),
        (
            Values::Sensors, // UncompAccel, UncompGyro
            [
                &[0x06, 0x01, 0x00, 0x0C, 0x00],
                &[0x06, 0x02, 0x00, 0x0C, 0x00],
                &[0x04, 0x0C, 0x00],
            ],
        ),
        (
            Values::Filtered, // AngularRate, Accel
            [
                &[0x01, 0x21, 0x01],
                &[0x01, 0x22, 0x01],
                &[0x01, 0x20, 0x01],
            ],
        ),
    ];
    for (values, of) in headers {
        let [startup, gps, none] = of.map(|header| {
            let mut repr = Repr::with_header(values, header).unwrap();
            let (gyro, accel) = (GYRO, ACCEL);
            repr.sample = RawSample::Floats { gyro, accel };
            let bytes = made(|buffer| repr.emit(buffer)).unwrap();
            stream(&bytes, values)
        });
        let untimed = Stream {
            sequence: Sequence::None,
            ..startup
        };
        assert!(startup.turn().is_some(), "{of:?}");
        assert_eq!((gps, none), (startup, untimed), "{of:?}");
    }
}

#[test]
fn time_stamps_tell_gaps_and_a_restart() {
    let stream = Stream {
        rate: 400.0,
        ..ImuFormat::VectorNav(Values::Sensors)
            .stream(
                &Settings {
                    rate: 400.0,
                    ..Settings::DEFAULT
                },
                0,
            )
            .unwrap()
    };
    let mut last = Last::default();
    let mut at = |time_ns: u64| {
        let repr = Repr {
            time_ns,
            ..Repr::parse(&over(&INCREMENTS))
        };
        let bytes = made(|buffer| repr.emit(buffer)).unwrap();
        stream.gap(&mut last, &over(&bytes).reading())
    };
    let start = 1_400_000_000_000_000_000;
    assert_eq!(at(start), Gap::None);
    assert_eq!(at(start + 2_500_000), Gap::None);
    assert_eq!(at(start + 2_500_000), Gap::Duplicate);
    assert_eq!(at(start + 10_000_000), Gap::Missed(2));
    assert_eq!(at(1_000_000), Gap::Jump);
}

#[test]
fn others_pass_and_damage_does_not() {
    // the first receiver's time alone, with a right CRC
    let mut other = [0; 4 + 8 + 2];
    other[..4].copy_from_slice(&[0xFA, 0x08, 0x01, 0x00]);
    seal(&mut other);
    assert_eq!(scan(Values::Sensors, &other), Scan::Other(14));
    assert_eq!(
        Frame::new_checked(Values::USUAL, other).err(),
        Some(Error::Header)
    );
    for bit in 8..8 * INCREMENTS.len() {
        let mut damaged = INCREMENTS;
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(
            Frame::new_checked(Values::USUAL, damaged).is_err(),
            "bit {bit}"
        );
    }
    for (bytes, expected) in [
        (&[][..], Scan::Partial(4)),
        (&[0xFA], Scan::Partial(4)),
        (&[0xFB], Scan::Garbage),
        (&[0xFA, 0x00, 1, 0], Scan::Garbage),    // no group
        (&[0xFA, 0x01, 0, 0], Scan::Garbage),    // no field
        (&[0xFA, 0x02, 0, 0x40], Scan::Garbage), // not a field of the time group
        (&[0xFA, 0x81, 0x01, 1], Scan::Garbage), // not a group
        (&[0xFA, 0x80, 0x10, 1, 0], Scan::Partial(15)), // the third receiver's time
        (&[0xFA, 0x08, 1, 0x80], Scan::Partial(6)), // a second word
        (&[0xFA, 0x08, 1, 0x80, 6, 0], Scan::Partial(26)), // time, status, height
        (&[0xFA, 0x01, 1, 0x80, 1, 0], Scan::Garbage), // which the common group has not
    ] {
        assert_eq!(scan(Values::Sensors, bytes), expected, "{bytes:02x?}");
    }
}

/// A message longer than a framer holds has no sample, even where its CRC is right.
#[test]
fn a_long_message_has_no_sample() {
    let mut bytes = std::vec![0; 400];
    bytes[..6].copy_from_slice(&[0xFA, 0x05, 0xFF, 0x7F, 0xFF, 0x0F]);
    let Scan::Partial(len) = scan(Values::Sensors, &bytes[..6]) else {
        panic!("a header");
    };
    assert_eq!(len, 6 + 198 + 112 + 2);
    bytes.truncate(len);
    seal(&mut bytes);
    assert_eq!(scan(Values::Sensors, &bytes), Scan::Other(len));
}

/// An example with start marks in its data.
pub(in crate::wire) fn example(n: u8, values: Values) -> Vec<u8> {
    let header = match values {
        Values::Sensors => [0x01, 0x01, 0x1C],
        Values::Filtered => [0x01, 0x39, 0x11], // also YawPitchRoll and Quaternion
    };
    let mut repr = Repr::with_header(values, &header).unwrap();
    repr.time_ns = 2_500_000 * u64::from(n);
    repr.sample = RawSample::Floats {
        gyro: [f32::from_bits(0x0001_01FA), f32::from(n), 0.25],
        accel: [0.0, f32::from_bits(0x1C01_01FA), -0.0245],
    };
    made(|buffer| repr.emit(buffer)).unwrap()
}

/// See [`crate::wire::examples::Examples::remade`].
pub(in crate::wire) fn remade(frame: &[u8], values: Values) -> Result<Vec<u8>, Error> {
    let mut repr = Repr::parse(&Frame::new_checked(values, frame)?);
    // the sample is to come from its numbers
    let layout = Layout::of(&repr.message).map_err(|_| Error::Header)?;
    for triad in [false, true]
        .map(|accel| layout.best(values, accel))
        .into_iter()
        .flatten()
    {
        let at = layout.at(triad);
        repr.message[at..at + 12].fill(0xEE);
    }
    made(|buffer| repr.emit(buffer))
}
