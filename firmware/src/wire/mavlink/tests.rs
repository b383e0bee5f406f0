//! Messages that pymavlink 2.4.50 has packed, and what of them is changed.

use super::*;
use crate::wire::examples::made;
use crate::wire::field::hex;
use crate::wire::sequence::{Gap, Last};
use crate::wire::{Checked, ImuFormat, Settings};
use std::vec::Vec;

// 0.5, -0.25, -9.75 m/s^2; 2^-6, -2^-5, 2^-4 rad/s; magnetic 0.25, -0.5, 0.125; 1013.25, 0.5, 12.5;
// 21.5 degrees; all updated; from system 7, component 11; 123456789012 us.

/// IMU 2.
const SECOND: [u8; 75] = hex(
    "fd3f000000070b690000141a99be1c0000000000003f000080be00001cc10000803c000000bd0000803d0000803e000000bf0000003e00507d440000003f000048410000ac41ff1f02b35c",
);
/// IMU 0, a zero that is left out at the end.
const FIRST: [u8; 74] = hex(
    "fd3e000001070b690000141a99be1c0000000000003f000080be00001cc10000803c000000bd0000803d0000803e000000bf0000003e00507d440000003f000048410000ac41ff1f8f2f",
);
/// The message of `SECOND` in MAVLink 1.
const ONE: [u8; 71] = hex(
    "fe3f02070b69141a99be1c0000000000003f000080be00001cc10000803c000000bd0000803d0000803e000000bf0000003e00507d440000003f000048410000ac41ff1f0227d2",
);
/// Values alone, the rest is zero and left out; at 5 us.
const VALUES: [u8; 44] =
    hex("fd20000002070b69000005000000000000000000003f000080be00001cc10000803c000000bd0000803d9f9b");
/// The last rate is zero, too, and left out.
const SHORT: [u8; 40] =
    hex("fd1c000002070b69000005000000000000000000003f000080be00001cc10000803c000000bd0ec9");
/// The message of `SECOND`, signed.
const SIGNED: [u8; 88] = hex(
    "fd3f010004070b690000141a99be1c0000000000003f000080be00001cc10000803c000000bd0000803d0000803e000000bf0000003e00507d440000003f000048410000ac41ff1f025b240140e2010000000623359926d3",
);
/// `HEARTBEAT`, of MAVLink 2 and 1.
const HEARTBEAT: [u8; 21] = hex("fd09000003070b00000000000000020c5104036044");
const HEARTBEAT_ONE: [u8; 17] = hex("fe0903070b0000000000020c5104030621");

/// `SECOND` with the values of the test.
const CORRECTED: [u8; 75] = hex(
    "fd3f000000070b690000141a99be1c0000005c8f023fb81e85becdcc1cc18fc2753cb6f3fdbc24977f3d0000803e000000bf0000003e00507d440000003f000048410000ac41ff1f024277",
);
/// The message with bit 15 of `fields_updated`.
const MARKED: [u8; 75] = hex(
    "fd3f000000070b690000141a99be1c0000005c8f023fb81e85becdcc1cc18fc2753cb6f3fdbc24977f3d0000803e000000bf0000003e00507d440000003f000048410000ac41ff9f02ae7b",
);
/// `WIFI_CONFIG_AP`.
const ACCESS_POINT: [u8; 45] = hex(
    "fd21000009070b2b01006162630000000000000000000000000000000000000000000000000000000000648892",
);

const ANY_SECOND: Imu = Imu {
    id: 2,
    ..Imu::USUAL
};

const GYRO: [f32; 3] = [0.015625, -0.03125, 0.0625];
const ACCEL: [f32; 3] = [0.5, -0.25, -9.75];

#[test]
fn golden_messages_read_and_are_made_again() {
    let (gyro, accel) = (GYRO, ACCEL);
    for (golden, time, sender, temperature) in [
        (&SECOND[..], 123_456_789_012, [7, 11, 2], Some(21.5)),
        (&FIRST, 123_456_789_012, [7, 11, 0], Some(21.5)),
        (&ONE, 123_456_789_012, [7, 11, 2], Some(21.5)),
        (&VALUES, 5, [7, 11, 0], None), // it does not say that its zero is one
    ] {
        let imu = Imu {
            id: sender[2],
            ..Imu::USUAL
        };
        assert_eq!(scan(imu, golden), Scan::Frame(golden.len()));
        let frame = Frame::new_checked(imu, golden).unwrap();
        assert_eq!(frame.sample(), RawSample::Floats { gyro, accel });
        assert_eq!((frame.time_us(), frame.sender()), (time, sender));
        assert_eq!(frame.reading().temperature, temperature.map(|t| [t; 3]));
        assert_eq!(frame.reading().valid, Axes::ALL);
        assert_eq!(remade(golden, imu).unwrap(), golden);
    }
}

/// pymavlink packs the corrected values into these bytes.
#[test]
fn corrected_messages_are_those_of_pymavlink() {
    let mut bytes = SECOND;
    let mut checked = Checked::new(ImuFormat::Mavlink(ANY_SECOND), &mut bytes).unwrap();
    let sample = RawSample::Floats {
        gyro: [0.015, -0.031, 0.0624],
        accel: [0.51, -0.26, -9.8],
    };
    let mut change = Change {
        sample: &sample,
        mark: false,
        settings: &Settings::DEFAULT,
    };
    checked.change(&change).unwrap();
    assert_eq!(checked.bytes(), CORRECTED);
    change.mark = true;
    checked.change(&change).unwrap();
    assert_eq!(checked.bytes(), MARKED);
}

/// Without room for all values, or with a signature, a message passes unchanged.
#[test]
fn what_cannot_be_changed_is_not() {
    assert_eq!(scan(Imu::USUAL, &SHORT), Scan::Other(40));
    let mut bytes = SIGNED;
    let mut checked = Checked::new(ImuFormat::Mavlink(ANY_SECOND), &mut bytes).unwrap();
    let source = checked.source();
    // no units: the device reports it by a fault
    assert_eq!(source.stream(&Settings::DEFAULT, checked.content()), None);
    let sample = RawSample::Floats {
        gyro: [0.0; 3],
        accel: [0.0; 3],
    };
    let change = Change {
        sample: &sample,
        mark: true,
        settings: &Settings::DEFAULT,
    };
    assert_eq!(checked.change(&change), Err(Error::Content));
    assert_eq!(bytes, SIGNED);
}

/// Of several IMUs on a line the configured one is corrected.
#[test]
fn others_imus_pass() {
    let configured = |system, component, id| Imu {
        system,
        component,
        id,
    };
    for (imu, is_frame) in [
        (configured(0, 0, 2), true),
        (configured(7, 0, 2), true),
        (configured(0, 11, 2), true),
        (configured(7, 11, 2), true),
        (configured(0, 0, 0), false),
        (configured(0, 0, 1), false),
        (configured(6, 0, 2), false),
        (configured(0, 12, 2), false),
    ] {
        let expected = match is_frame {
            true => Scan::Frame(75),
            false => Scan::Other(75),
        };
        assert_eq!(scan(imu, &SECOND), expected, "{imu:?}");
        assert_eq!(Frame::new_checked(imu, SECOND).is_ok(), is_frame, "{imu:?}");
    }
}

/// Only bit 12 makes the field of the temperature one.
#[test]
fn a_temperature_counts_only_where_it_is_new() {
    for (updated, temperature) in [
        (0x1FFF, Some([21.5; 3])),
        (0x1000, Some([21.5; 3])),
        (0xFFFF, Some([21.5; 3])),
        (0x0FFF, None),
        (0x003F, None),
        (0, None),
    ] {
        let repr = Repr {
            updated,
            ..Repr::parse(&Frame::new_checked(ANY_SECOND, SECOND).unwrap())
        };
        let bytes = made(|buffer| repr.emit(buffer)).unwrap();
        let frame = Frame::new_checked(ANY_SECOND, bytes).unwrap();
        assert_eq!(frame.reading().temperature, temperature, "{updated:#06x}");
    }
}

#[test]
fn fields_that_are_not_new_are_not_valid() {
    let valid = |updated: u16| {
        let repr = Repr {
            updated,
            ..Repr::parse(&Frame::new_checked(ANY_SECOND, SECOND).unwrap())
        };
        let bytes = made(|buffer| repr.emit(buffer)).unwrap();
        Frame::new_checked(ANY_SECOND, bytes)
            .unwrap()
            .reading()
            .valid
    };
    assert_eq!(valid(updated::ALL), Axes::ALL);
    assert_eq!(valid(0), Axes::ALL); // not stated
    assert_eq!(valid(OWN_FAULT), Axes::ALL);
    assert_eq!(
        valid(updated::ALL & !(updated::GYRO_X << 1)),
        Axes::new(0b101, 7)
    );
    assert_eq!(valid(updated::ALL & !updated::ACCEL_X), Axes::new(7, 0b110));
    let mut bytes = SECOND;
    bytes[30..34].copy_from_slice(&f32::NAN.to_le_bytes()); // rate x
    checksum::seal(&mut bytes, &Header::of(&SECOND).unwrap());
    let frame = Frame::new_checked(ANY_SECOND, bytes).unwrap();
    assert_eq!(frame.reading().valid, Axes::new(0b110, 7));
}

#[test]
fn the_time_tells_gaps() {
    let settings = Settings {
        rate: 200.0,
        ..Settings::DEFAULT
    };
    let stream = ImuFormat::Mavlink(ANY_SECOND).stream(&settings, 0).unwrap();
    let mut last = Last::default();
    let mut at = |time_us: u64| {
        let repr = Repr {
            time_us,
            ..Repr::parse(&Frame::new_checked(ANY_SECOND, SECOND).unwrap())
        };
        let bytes = made(|buffer| repr.emit(buffer)).unwrap();
        stream.gap(
            &mut last,
            &Frame::new_checked(ANY_SECOND, bytes).unwrap().reading(),
        )
    };
    let start = 1_700_000_000_000_000; // since 1970
    assert_eq!(at(start), Gap::None);
    assert_eq!(at(start + 5_000), Gap::None);
    assert_eq!(at(start + 5_000), Gap::Duplicate);
    assert_eq!(at(start + 20_000), Gap::Missed(2));
    assert_eq!(at(1_000), Gap::Jump);
}

#[test]
fn others_pass_and_damage_does_not() {
    assert_eq!(scan(Imu::USUAL, &HEARTBEAT), Scan::Other(21));
    assert_eq!(scan(Imu::USUAL, &HEARTBEAT_ONE), Scan::Other(17));
    assert_eq!(scan(Imu::USUAL, &ACCESS_POINT), Scan::Other(45));
    assert_eq!(
        Frame::new_checked(ANY_SECOND, HEARTBEAT).err(),
        Some(Error::Header)
    );
    for bit in 8..8 * SECOND.len() {
        let mut damaged = SECOND;
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(
            Frame::new_checked(ANY_SECOND, damaged).is_err(),
            "bit {bit}"
        );
    }
    for (bytes, expected) in [
        (&[][..], Scan::Partial(6)),
        (&[0xFE], Scan::Partial(6)),
        (&[0xFD], Scan::Partial(10)),
        (&[0xFC], Scan::Garbage),
        (&[0xFD, 9, 2, 0, 0, 1, 1, 0, 0, 0], Scan::Garbage), // incompatible flags
        (&[0xFD, 9, 0, 0, 0, 1, 1, 0, 0, 1], Scan::Garbage), // a message of no dialect known
        (&[0xFE, 9, 0, 1, 1, 3], Scan::Garbage),
        (&[0xFD, 9, 1, 0, 0, 1, 1, 0, 0, 0], Scan::Partial(34)), // signed
        (&[0xFE, 9, 0, 1, 1, 0], Scan::Partial(17)),
    ] {
        assert_eq!(scan(Imu::USUAL, bytes), expected, "{bytes:02x?}");
    }
}

/// An example with start marks in its data.
pub(in crate::wire) fn example(n: u8, imu: Imu) -> Vec<u8> {
    let repr = Repr {
        two: true,
        length: 63,
        compatible: 0,
        sequence: n,
        sender: [7, 11],
        time_us: 5_000 * u64::from(n),
        sample: RawSample::Floats {
            gyro: [f32::from_bits(0x0000_3FFD), f32::from(n), 0.25],
            accel: [0.0, f32::from_bits(0x0101_3FFE), -9.75],
        },
        rest: [0xFD; 24],
        temperature: 21.5,
        updated: updated::ALL,
        id: imu.id,
    };
    made(|buffer| repr.emit(buffer)).unwrap()
}

/// See [`crate::wire::examples::Examples::remade`].
pub(in crate::wire) fn remade(frame: &[u8], imu: Imu) -> Result<Vec<u8>, Error> {
    let repr = Repr::parse(&Frame::new_checked(imu, frame)?);
    made(|buffer| repr.emit(buffer))
}
