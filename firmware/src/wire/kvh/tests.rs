//! Recorded and published KVH messages.

use super::*;
use crate::wire::examples::made;
use crate::wire::field::hex;
use std::vec::Vec;

/// Recorded: gyros flagged invalid, 29 degrees, sequence 31.
const START_UP: [u8; 36] =
    hex("FE81FF553B041F78B9B96613BA234B38BB7C0410B8DEF4803F7F4B7B701F001DF12FB6EE");
/// Recorded: all good, sequence 104.
const GOOD: [u8; 36] =
    hex("FE81FF55B3D0BBE732193EF430AC19A5BA8F78D63A2905943F7ECBD47768001DADC5F651");
/// Recorded with a wrong CRC: must be rejected.
const WRONG: [u8; 36] =
    hex("FE81FF55B46B86C6B44F5B83B4106D09BB713CB7BBABD9143F7E319A7769001D95BBDB4F");

#[test]
fn recorded_frames() {
    let frame = Frame::new_checked(START_UP).unwrap();
    assert_eq!(frame.status(), 0x70);
    assert_eq!(frame.reading().valid, Axes::new(0, 7));
    assert_eq!((frame.sequence(), frame.temperature()), (31, Some(29)));
    assert!((frame.accel()[2] - 0.997_25).abs() < 1e-5);

    let frame = Frame::new_checked(GOOD).unwrap();
    assert_eq!(frame.reading().valid, Axes::ALL);
    assert_eq!((frame.sequence(), frame.temperature()), (104, Some(29)));
    assert!((frame.gyro()[0] + 9.72e-8).abs() < 1e-10);

    assert_eq!(Frame::new_checked(WRONG).err(), Some(Error::Checksum));
    assert_eq!(scan(&WRONG), Scan::BadChecksum);
    let mut mended = WRONG;
    seal(&mut mended);
    assert_eq!(mended[32..], [0x14, 0xDC, 0x0D, 0x3A]);
}

#[test]
fn recorded_frames_are_made_again() {
    for golden in [START_UP, GOOD] {
        let repr = Repr::parse(&Frame::new_checked(golden).unwrap());
        let mut made = [0; 36];
        assert_eq!(repr.emit(&mut made), Ok(36));
        assert_eq!(made, golden);
        assert_eq!(repr.emit(&mut made[1..]), Err(Error::Length));
    }
}

#[test]
fn formats_b_and_c() {
    let a = Repr::parse(&Frame::new_checked(GOOD).unwrap());
    for (layout, len, crc_at) in [(Layout::B, 40, 36), (Layout::C, 38, 34)] {
        let mut bytes = [0; MAX_LEN];
        let repr = Repr {
            layout,
            extra: [1, 2, 3, 4],
            temperature: if layout == Layout::B { -5 } else { 0 },
            ..a
        };
        assert_eq!(repr.emit(&mut bytes), Ok(len));
        assert_eq!(scan(&bytes), Scan::Frame(len));
        assert_eq!(bytes[28..34], [1, 2, 3, 4, 0x77, 104]);
        let crc = crc32_mpeg2(&bytes[..crc_at]).to_be_bytes();
        assert_eq!(bytes[crc_at..len], crc);
        let frame = Frame::new_checked(&bytes[..len]).unwrap();
        assert_eq!(Repr::parse(&frame), repr);
    }
}

/// Examples of the 1775 manual (pages 25, 26 of its trouble-shooting, and ICD 5.3.2). The ICD's
/// third example, `FE8100AA777F7B7F7F7F1E`, does not add up (17, not 1E): a misprint.
#[test]
fn bit_messages_are_passed_on() {
    let good: [u8; 11] = hex("FE8100AA7F7F7F7F7F7F23");
    assert_eq!(scan(&good), Scan::Other(11));
    let long: [u8; 13] = hex("FE8100AB7F7F7F7F7F7F377FDA");
    assert_eq!(scan(&long), Scan::Other(13));
    assert_eq!(scan(&long[..12]), Scan::Partial(13));
    let misprint: [u8; 11] = hex("FE8100AA777F7B7F7F7F1E");
    assert_eq!(scan(&misprint), Scan::BadChecksum);
}

#[test]
fn a_word_that_is_no_number_is_not_valid() {
    let mut bytes = GOOD;
    let mut frame = Frame::new_checked(&mut bytes).unwrap();
    let (gyro, accel) = ([0.0, f32::NAN, 0.0], [f32::INFINITY, 0.0, 1.0]);
    frame.change(gyro, accel, false).unwrap();
    assert_eq!(frame.reading().valid, Axes::new(0b101, 0b110));
}

#[test]
fn headers() {
    assert_eq!(scan(&[]), Scan::Partial(1));
    assert_eq!(scan(&[0xFE, 0x81]), Scan::Partial(3));
    assert_eq!(scan(&[0xFE, 0x81, 0x00]), Scan::Partial(4));
    assert_eq!(scan(&[0xFE, 0x82]), Scan::Garbage);
    assert_eq!(scan(&[0xFE, 0x81, 0x01]), Scan::Garbage);
    assert_eq!(scan(&[0xFE, 0x81, 0xFF, 0x58]), Scan::Garbage);
}

/// An example with a start mark in its data.
pub(in crate::wire) fn example(n: u8) -> Vec<u8> {
    let repr = Repr {
        layout: Layout::A,
        gyro: [1e-6, f32::from_bits(0xFE81_FF55), f32::from(n)],
        accel: [0.0, 0.0, 1.0],
        extra: [0; 4],
        status: 0x77,
        sequence: n & 0x7F,
        temperature: 29,
    };
    made(|buffer| repr.emit(buffer)).unwrap()
}

/// See [`crate::wire::examples::Examples::remade`].
pub(in crate::wire) fn remade(frame: &[u8]) -> Result<Vec<u8>, Error> {
    let repr = Repr::parse(&Frame::new_checked(frame)?);
    made(|buffer| repr.emit(buffer))
}
