//! Frames around bursts. Their CRC was made by Python's `zlib.crc32`, and `docs/ICD.md` has one of
//! them as its example.

use super::*;
use crate::sample::RawSample;
use crate::wire::examples::made;
use crate::wire::field::hex;
use crate::wire::{Checked, ImuFormat, Settings};
use std::vec::Vec;

/// The 20-byte burst of [`super::super`]'s tests, fetched at 0x12345678 us.
const NARROW: [u8; 32] = hex("ad1514007856341200000001fffe00030064ff38032000fa000704c008c49346");
/// The 32-byte one, as increments.
const WIDE: [u8; 44] =
    hex("ad152001785634120000000000010000fffe00010003000000640000ff380000032000fa000704c163475935");

#[test]
fn golden_frames_read_and_are_made_again() {
    for (frame, form, flags) in [
        (&NARROW[..], Form::Narrow, 0),
        (&WIDE, Form::Wide, INCREMENTS),
    ] {
        assert_eq!(scan(frame), Scan::Frame(frame.len()));
        let repr = Repr::parse(frame).unwrap();
        assert_eq!(
            (repr.form, repr.flags, repr.time_us),
            (form, flags, 0x1234_5678)
        );
        assert_eq!(remade(frame).unwrap(), frame);
    }
    let RawSample::Counts { gyro, accel } = read(&NARROW).unwrap().sample else {
        panic!("integers");
    };
    assert_eq!((gyro, accel), ([1, -2, 3], [100, -200, 800]));
    assert_eq!(read(&WIDE).unwrap().counter, Some(7));
}

/// A burst that was damaged between the sensor and the sender: its own checksum shows it.
#[test]
fn a_damaged_burst_in_a_good_frame_passes() {
    let mut frame = NARROW;
    frame[HEADER + 3] ^= 1;
    assert_eq!(scan(&frame), Scan::BadChecksum);
    seal_frame(&mut frame);
    assert_eq!(scan(&frame), Scan::Other(32));
    assert_eq!(
        Checked::new(ImuFormat::AdisUart, &mut frame),
        Err(Error::Content)
    );
    assert_eq!(Repr::parse(&frame), Err(Error::Content));
}

#[test]
fn units_follow_the_frame_and_the_model() {
    let units = |frame: &[u8], model| {
        let mut settings = Settings::DEFAULT;
        settings.adis_uart.model = model;
        let mut frame = frame.to_vec();
        let checked = Checked::new(ImuFormat::AdisUart, &mut frame).unwrap();
        let stream = checked.source().stream(&settings, checked.content());
        stream.map(|stream| stream.units)
    };
    use crate::wire::adis::Model;
    let model = Model::Adis16505(2);
    assert_eq!(units(&NARROW, model), model.units(false));
    assert_eq!(units(&WIDE, model), model.increments(true));
    assert_eq!(units(&WIDE, Model::Adis16470), None, "no increments");
    assert_eq!(units(&NARROW, Model::Adis16495(1)), None, "another burst");
}

#[test]
fn a_length_that_no_burst_has_is_known_at_once() {
    let mut frame = NARROW;
    for length in 0..=255u8 {
        frame[2] = length;
        let expected = match length {
            20 => Scan::Frame(32),
            32 => Scan::Partial(44),
            40 => Scan::Partial(52),
            _ => Scan::BadChecksum,
        };
        assert_eq!(scan(&frame), expected, "{length}");
    }
    assert_eq!(scan(&[]), Scan::Partial(2));
    assert_eq!(scan(&[0xAD]), Scan::Partial(2));
    assert_eq!(scan(&[0xAD, 0x15]), Scan::Partial(8));
    assert_eq!(scan(&[0xAD, 0x16]), Scan::Garbage);
    let mut buffer = [0; LONGEST];
    let short = wrap(Form::Wide, 0, 0, &NARROW[8..28], &mut buffer);
    assert_eq!(short, Err(Error::Length));
}

/// An example with start marks in its data.
pub(in crate::wire) fn example(n: u8) -> Vec<u8> {
    let burst = crate::wire::adis::Burst {
        gyro: [0x15AD_15AD, n.into(), 0x0020_15AD],
        accel: [0x14AD_1514, 2, -3],
        counter: n.into(),
        ..Default::default()
    };
    let mut frame = [0; LONGEST];
    let time_us = 1000 * u32::from(n);
    wrap(Form::Wide, 0, time_us, &burst.emit32(), &mut frame)
        .unwrap()
        .to_vec()
}

/// See [`crate::wire::examples::Examples::remade`].
pub(in crate::wire) fn remade(frame: &[u8]) -> Result<Vec<u8>, Error> {
    let repr = Repr::parse(frame)?;
    made(|buffer| repr.emit(buffer))
}
