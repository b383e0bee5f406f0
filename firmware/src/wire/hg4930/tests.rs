//! No recorded HG4930 message is public: the bytes here are laid out by hand from the manual's
//! tables.

use super::*;
use crate::wire::examples::made;
use std::vec::Vec;

/// 0x02, rates 1, 2, 3, accelerations 4, 5, 6, counter 2, temperature 25, angle 0x01020304, -1, 0,
/// velocity 7, 8, 9. The sum was added up by hand over the 21 words.
const INERTIAL_FRAME: [u8; 44] = [
    0x0E, 0x02, 1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 6, 0, 0x02, 0x00, 0x19,
    0x80, // header to status 2
    0x04, 0x03, 0x02, 0x01, 0xFF, 0xFF, 0xFF, 0xFF, 0, 0, 0, 0, // angle
    7, 0, 0, 0, 8, 0, 0, 0, 9, 0, 0, 0, // velocity
    // 020E + 1+2+3+4+5+6 + 2 + 8019 + 0304 + 0102 + FFFF + FFFF + 7+8+9 = 2865A
    0x5A, 0x86,
];

#[test]
fn an_inertial_message_reads_and_is_made_again() {
    assert_eq!(scan(&INERTIAL_FRAME), Scan::Frame(44));
    let frame = Frame::new_checked(INERTIAL_FRAME).unwrap();
    assert_eq!((frame.rate(), frame.accel()), ([1, 2, 3], [4, 5, 6]));
    assert_eq!(frame.angle(), Some([0x0102_0304, -1, 0]));
    assert_eq!(frame.velocity(), Some([7, 8, 9]));
    let reading = frame.reading().unwrap();
    assert_eq!((reading.counter, reading.valid), (Some(2), Axes::ALL));
    assert_eq!(reading.temperature, Some([25.0; 3]));
    let mut repr = Repr::parse(&frame);
    for (status, temperature) in [(0x80D8, Some(-40)), (0x8055, Some(85)), (0x0019, None)] {
        repr.status_2 = status;
        let mut bytes = [0; 44];
        assert_eq!(repr.emit(&mut bytes), Ok(44));
        let frame = Frame::new_checked(bytes).unwrap();
        assert_eq!(frame.temperature(), temperature);
    }
    let mut made = [0; 44];
    assert_eq!(Repr::parse(&frame).emit(&mut made), Ok(44));
    assert_eq!(made, INERTIAL_FRAME);
    assert_eq!(Repr::parse(&frame).emit(&mut [0; 43]), Err(Error::Length));
}

/// 2^-27 x 0.3048 m/s; a client that forgets the foot prints 0.0082021 for this 0.0025 m/s.
#[test]
fn a_velocity_count_is_in_feet() {
    let counts = (0.0025 / INERTIAL.accel.lsb + 0.5) as i32;
    assert!((f64::from(counts) / 134_217_728.0 - 0.008_202_1).abs() < 1e-7);
}

#[test]
fn control_messages_pass_and_s_class_rates_are_words() {
    let mut repr = Repr::parse(&Frame::new_checked(INERTIAL_FRAME).unwrap());
    let mut bytes = [0; 44];
    repr.message = Message::Control;
    assert_eq!(repr.emit(&mut bytes), Ok(20));
    assert_eq!(scan(&bytes[..20]), Scan::Other(20));
    let before = bytes;
    let mut frame = Frame::new_checked(&mut bytes[..20]).unwrap();
    assert_eq!(frame.reading(), Err(Error::Content));
    assert_eq!(frame.change([9; 3], [9; 3], true), None);
    assert_eq!(bytes, before);

    repr.message = Message::SClass;
    assert_eq!(repr.emit(&mut bytes), Ok(20));
    assert_eq!(scan(&bytes), Scan::Frame(20));
    let mut frame = Frame::new_checked(&mut bytes[..20]).unwrap();
    let saturated = frame
        .change([40_000, -1, 5], [0, 0, -40_000], false)
        .unwrap();
    assert_eq!(saturated, Axes(0b10_0001));
    assert_eq!(
        (frame.rate(), frame.accel()),
        ([i16::MAX, -1, 5], [0, 0, i16::MIN])
    );
}

#[test]
fn status_says_failed_with_ones() {
    let golden = Repr::parse(&Frame::new_checked(INERTIAL_FRAME).unwrap());
    let valid = |status_1, status_2, angle| {
        let mut bytes = [0; 44];
        let repr = Repr {
            status_1,
            status_2,
            angle,
            ..golden
        };
        repr.emit(&mut bytes).unwrap();
        Frame::new_checked(bytes).unwrap().reading().unwrap().valid
    };
    assert_eq!(valid(0x000F, 0x00FF, [0; 3]), Axes::ALL); // counter, test mode, version
    assert_eq!(valid(0x0200, 0, [0; 3]), Axes::new(0b101, 7)); // gyro y
    assert_eq!(valid(0x0040, 0, [0; 3]), Axes::new(7, 0));
    assert_eq!(valid(0x0020, 0, [0; 3]), Axes::new(0, 7));
    for gyro_health in [0x0100, 0x2000] {
        assert_eq!(valid(0, gyro_health, [0; 3]), Axes::new(0, 7));
    }
    assert_eq!(valid(0, 0x4000, [0; 3]), Axes::new(7, 0));
    for imu in [0x0010, 0x0080, 0x8000] {
        assert_eq!(valid(imu, 0, [0; 3]), Axes::NONE);
    }
    for process_memory_electronics_pattern in [0x0400, 0x0800, 0x1000, 0x0200] {
        let valid = valid(0, process_memory_electronics_pattern, [0; 3]);
        assert_eq!(valid, Axes::NONE);
    }
    assert_eq!(valid(0, 0, [PATTERN; 3]), Axes::NONE);
}

/// Damage that the sum cannot detect.
#[test]
fn exchanged_words_pass_the_sum() {
    let mut bytes = INERTIAL_FRAME;
    bytes.swap(30, 34); // velocity x and y
    assert_eq!(scan(&bytes), Scan::Frame(44));
    bytes = INERTIAL_FRAME;
    bytes[30] ^= 1;
    assert_eq!(scan(&bytes), Scan::BadChecksum);
}

/// An example with headers in its data.
pub(in crate::wire) fn example(n: u8) -> Vec<u8> {
    let repr = Repr {
        message: Message::Inertial,
        rate: [0x020E, 2, 3],
        accel: [4, 5, 6],
        status_1: u16::from(n & 3),
        status_2: 0,
        angle: [i32::from(n), 0, 0x020E_020E],
        velocity: [0, 0, 1],
    };
    made(|buffer| repr.emit(buffer)).unwrap()
}

/// See [`crate::wire::examples::Examples::remade`].
pub(in crate::wire) fn remade(frame: &[u8]) -> Result<Vec<u8>, Error> {
    let repr = Repr::parse(&Frame::new_checked(frame)?);
    made(|buffer| repr.emit(buffer))
}
