//! Messages of the two kinds, and what of their status counts.

use super::*;
use crate::wire::examples::made;
use crate::wire::field::hex;
use crate::wire::sequence::{Gap, Last};
use crate::wire::{Checked, ImuFormat, Settings};
use std::vec::Vec;

/// SBG's own library reads 0.1, -0.2, 9.80665 m/s^2, 0.01, -0.02, 0.03 rad/s and 25.5 degrees.
const SHORT: [u8; 41] =
    hex("ff5a2c00200000000000ff039a990100cdccfcff0ae89c00713d0a001f85ebff52b81e0080197bd833");
/// Status good, 0.125, -0.25, 9.75 m/s^2, 2^-6, -2^-5, 2^-4 rad/s, 25.5 degrees.
const DATA: [u8; 67] = hex(
    "ff5a03003a0015cd5b07ff03cdcccc3dcdcc4cbe0ae81c410ad7233c0ad7a3bc8fc2f53c0000cc410000003e000080be00001c410000803c000000bd0000803d0c7933",
);

#[test]
fn golden_messages_read_and_are_made_again() {
    let frame = Frame::new_checked(SHORT).unwrap();
    let RawSample::Counts { gyro, accel } = frame.sample() else {
        panic!("integers");
    };
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} {b}");
    let stream = |id| {
        let stream = ImuFormat::SbgEcom.stream(&Settings::DEFAULT, id);
        stream.unwrap().units
    };
    let units = stream(44);
    for (counts, lsb, si) in [
        (accel, units.accel.lsb, [0.1, -0.2, 9.80665]),
        (gyro, units.gyro.lsb, [0.01, -0.02, 0.03]),
    ] {
        let pairs = counts.into_iter().zip(si);
        pairs.for_each(|(count, si)| close(f64::from(count) * lsb, si));
    }
    assert!((frame.temperature() - 25.5).abs() < 1e-6);
    assert_eq!(frame.reading().valid, Axes::ALL);

    let frame = Frame::new_checked(DATA).unwrap();
    let sample = RawSample::Floats {
        gyro: [0.015625, -0.03125, 0.0625],
        accel: [0.125, -0.25, 9.75],
    };
    assert_eq!((frame.sample(), frame.time_us()), (sample, 123_456_789));
    assert_eq!(frame.reading().valid, Axes::ALL);
    assert_eq!((stream(3).gyro.lsb, stream(3).accel.lsb), (1.0, 1.0));
    for golden in [&SHORT[..], &DATA] {
        assert_eq!(scan(golden), Scan::Frame(golden.len()));
        assert_eq!(remade(golden).unwrap(), golden);
    }
    // acceleration and rate of IMU_DATA, which are not the values for navigation
    let repr = Repr::parse(&frame);
    assert_eq!(repr.acceleration, [0.1, -0.2, 9.80665]);
    assert_eq!(repr.rate, [0.01, -0.02, 0.03]);
}

/// A count of the gyros is worth more in the high range, 2^31 counts for 10000 deg/s.
#[test]
fn the_high_range_has_a_scale_of_its_own() {
    let mut repr = Repr::parse(&Frame::new_checked(SHORT).unwrap());
    repr.status |= status::HIGH_RANGE;
    let mut bytes = made(|buffer| repr.emit(buffer)).unwrap();
    let checked = Checked::new(ImuFormat::SbgEcom, &mut bytes).unwrap();
    let stream = checked
        .source()
        .stream(&Settings::DEFAULT, checked.content());
    let full = stream.unwrap().units.gyro.lsb * 2_147_483_647.0;
    assert!((full.to_degrees() - 10_000.0).abs() < 0.01, "{full}");
}

#[test]
fn the_status_names_good_axes() {
    let valid = |status: u16| {
        let repr = Repr {
            status,
            ..Repr::parse(&Frame::new_checked(SHORT).unwrap())
        };
        let bytes = made(|buffer| repr.emit(buffer)).unwrap();
        Frame::new_checked(bytes).unwrap().reading().valid
    };
    assert_eq!(valid(status::GOOD | OWN_FAULT), Axes::ALL);
    for whole in [status::COMMUNICATION, status::IMU] {
        assert_eq!(valid(status::GOOD & !whole), Axes::NONE);
    }
    let without = |bit: u16| valid(status::GOOD & !bit);
    assert_eq!(without(status::ACCEL_X << 1), Axes::new(7, 0b101));
    assert_eq!(without(status::GYRO_X << 2), Axes::new(0b011, 7));
    assert_eq!(without(status::ACCELS_IN_RANGE), Axes::new(7, 0));
    assert_eq!(without(status::GYROS_IN_RANGE), Axes::new(0, 7));
    let mut bytes = DATA;
    bytes[6 + 46..][..4].copy_from_slice(&f32::NAN.to_le_bytes()); // delta angle x
    seal(&mut bytes);
    let frame = Frame::new_checked(bytes).unwrap();
    assert_eq!(frame.reading().valid, Axes::new(0b110, 7));
}

/// 71 minutes after its start the time stamp wraps.
#[test]
fn a_turn_of_the_time_stamp_is_no_gap() {
    let stream = ImuFormat::SbgEcom.stream(&Settings::DEFAULT, 44).unwrap();
    let mut last = Last::default();
    let mut at = |time_us: u32| {
        let repr = Repr {
            time_us,
            ..Repr::parse(&Frame::new_checked(SHORT).unwrap())
        };
        let bytes = made(|buffer| repr.emit(buffer)).unwrap();
        stream.gap(&mut last, &Frame::new_checked(bytes).unwrap().reading())
    };
    assert_eq!(at(u32::MAX - 1500), Gap::None);
    assert_eq!(at(u32::MAX - 500), Gap::None);
    assert_eq!(at(499), Gap::None);
    assert_eq!(at(499), Gap::Duplicate);
    assert_eq!(at(4499), Gap::Missed(3));
    assert_eq!(at(1000), Gap::Jump);
}

#[test]
fn others_pass_and_damage_does_not() {
    let other: [u8; 13] = hex("ff5a060004000102030452c833"); // a log of four bytes
    assert_eq!(scan(&other), Scan::Other(13));
    assert_eq!(Frame::new_checked(other).err(), Some(Error::Header));
    // the same message number in another class is another message
    let mut command = SHORT;
    command[3] = 0x10;
    seal(&mut command);
    assert_eq!(scan(&command), Scan::Other(41));
    let mut short = SHORT;
    short[4] = 31;
    assert_eq!(scan(&short[..6]), Scan::BadChecksum);
    for bit in 16..8 * SHORT.len() {
        let mut damaged = SHORT;
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(Frame::new_checked(damaged).is_err(), "bit {bit}");
    }
    // a length that no message has is not waited for
    let [low, high] = 4086_u16.to_le_bytes();
    let longest = [0xFF, 0x5A, 6, 0, low, high];
    assert_eq!(scan(&longest), Scan::Partial(4095));
    let longer = [0xFF, 0x5A, 6, 0, low + 1, high];
    assert_eq!(scan(&longer), Scan::BadChecksum);
    assert_eq!(scan(&[0xFF]), Scan::Partial(2));
    assert_eq!(scan(&SHORT[..5]), Scan::Partial(6));
    assert_eq!(scan(&[0xFF, 0x5B]), Scan::Garbage);
}

/// An example with start marks in its data.
pub(in crate::wire) fn example(n: u8) -> Vec<u8> {
    let repr = Repr {
        message: Message::Short,
        time_us: 1000 * u32::from(n),
        status: status::GOOD,
        acceleration: [0.0; 3],
        rate: [0.0; 3],
        sample: RawSample::Counts {
            gyro: [0x5AFF_5AFF, i32::from(n), 0x002C_5AFF],
            accel: [1, 2, 0x2C5A_FF33],
        },
        temperature: 20.0,
    };
    made(|buffer| repr.emit(buffer)).unwrap()
}

/// See [`crate::wire::examples::Examples::remade`].
pub(in crate::wire) fn remade(frame: &[u8]) -> Result<Vec<u8>, Error> {
    let repr = Repr::parse(&Frame::new_checked(frame)?);
    made(|buffer| repr.emit(buffer))
}
