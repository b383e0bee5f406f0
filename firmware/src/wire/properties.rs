//! Properties that hold for every protocol, over generated frames, streams and damage.

use super::examples::{Any, Examples, all};
use super::framer::Kind;
use super::framer::tests::{events, frames};
use super::{
    Change, Checked, Fields, Framer, Framing, ImuFormat, ReceiverFormat, Scan, Settings, Simulated,
    checksum,
};
use crate::sample::{Axes, RawSample};
use proptest::prelude::*;
use std::vec::Vec;

/// A good frame of any IMU format with any bytes in its fields: a simulated frame, filled with
/// random bytes wherever it then still is one.
fn any_imu_frame() -> impl Strategy<Value = (ImuFormat, &'static Simulated, Vec<u8>)> {
    let body = prop::collection::vec(any::<u8>(), 256);
    (0..ImuFormat::ALL.len(), any::<usize>(), body).prop_map(|(which, kind, body)| {
        let format = ImuFormat::ALL[which];
        let sensors = format.simulated();
        let sensor = &sensors[kind % sensors.len()];
        let format = format.configured(&sensor.settings());
        let mut frame = std::vec![0; 256];
        let len = (sensor.emit)(&Fields::default(), &mut frame).unwrap();
        frame.truncate(len);
        for (at, byte) in body.into_iter().take(len).enumerate() {
            let mut other = frame.clone();
            other[at] = !frame[at];
            format.seal(&mut other);
            if format.scan(&other) == Scan::Frame(len) {
                frame[at] = byte;
            }
        }
        format.seal(&mut frame);
        (format, sensor, frame)
    })
}

/// Any frame, of receivers too: an example with any bytes in its fields.
fn any_frame() -> impl Strategy<Value = (Any, Vec<u8>)> {
    let imu = any_imu_frame().prop_map(|(format, _, bytes)| (Any::Imu(format), bytes));
    let body = prop::collection::vec(any::<u8>(), 128);
    let receiver =
        (0..ReceiverFormat::ALL.len(), any::<u8>(), body).prop_map(|(which, n, body)| {
            let format = ReceiverFormat::ALL[which];
            let mut frame = format.example(n);
            let end = frame.len();
            match format {
                ReceiverFormat::Ubx => {
                    frame[6..end - 2].copy_from_slice(&body[..end - 8]);
                    let sum = checksum::fletcher8(&frame[2..end - 2]);
                    frame[end - 2..].copy_from_slice(&sum);
                }
                ReceiverFormat::Nmea => {
                    let digits = frame[17..end - 5]
                        .iter_mut()
                        .filter(|byte| byte.is_ascii_digit());
                    for (digit, byte) in digits.zip(body) {
                        *digit = b"0123456789.-N,"[usize::from(byte) % 14];
                    }
                    let text = core::str::from_utf8(&frame[1..end - 5]).unwrap();
                    frame = super::nmea::tests::sentence(text);
                }
                ReceiverFormat::Novatel => {
                    frame[28..end - 4].copy_from_slice(&body[..end - 32]);
                    let sum = checksum::crc32_novatel(&frame[..end - 4]);
                    frame[end - 4..].copy_from_slice(&sum.to_le_bytes());
                }
                ReceiverFormat::Sbf => {
                    frame[12..].copy_from_slice(&body[..end - 12]);
                    let sum = checksum::xmodem(&frame[4..]);
                    frame[2..4].copy_from_slice(&sum.to_le_bytes());
                }
            }
            (Any::Receiver(format), frame)
        });
    prop_oneof![4 => imu, 2 => receiver]
}

/// Values in place of those of a frame, and what the frame then holds: counts saturate at its
/// field.
fn replaced(sample: RawSample, new: [i32; 6], bits: u32) -> (RawSample, RawSample) {
    let [a, b, c, d, e, f] = new;
    let range = (-(1i64 << (bits - 1)), (1i64 << (bits - 1)) - 1);
    let saturated = |triad: [i32; 3]| triad.map(|v| i64::from(v).clamp(range.0, range.1) as i32);
    match sample {
        RawSample::Counts { .. } => {
            let (gyro, accel) = ([a, b, c], [d, e, f]);
            let expected = RawSample::Counts {
                gyro: saturated(gyro),
                accel: saturated(accel),
            };
            (RawSample::Counts { gyro, accel }, expected)
        }
        RawSample::Floats { .. } => {
            let sample = RawSample::Floats {
                gyro: [a, b, c].map(|v| v as f32),
                accel: [d, e, f].map(|v| v as f32),
            };
            (sample, sample)
        }
    }
}

/// The values of a frame that has accelerometers, or not.
fn present(sample: RawSample, axes: Axes) -> RawSample {
    match sample {
        RawSample::Counts { gyro, .. } if axes.accel() == 0 => RawSample::Counts {
            gyro,
            accel: [0; 3],
        },
        RawSample::Floats { gyro, .. } if axes.accel() == 0 => RawSample::Floats {
            gyro,
            accel: [0.0; 3],
        },
        sample => sample,
    }
}

/// Messages with a right checksum that nobody sent and that reach into one of the frames sent,
/// which are given with their places.
fn accidents<'e>(
    found: &'e [(Kind, Vec<u8>)],
    sent: &[(usize, Vec<u8>)],
) -> Vec<&'e (Kind, Vec<u8>)> {
    let mut place = 0;
    let reaches = |(kind, bytes): &&(Kind, Vec<u8>)| {
        let at = place;
        place += bytes.len();
        let message = matches!(kind, Kind::Frame | Kind::Other);
        let into = |(from, frame): &(usize, Vec<u8>)| {
            (*from, frame) != (at, bytes) && at < from + frame.len() && *from < place
        };
        message && sent.iter().any(into)
    };
    found.iter().filter(reaches).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// emit(parse(frame)) == frame, and a change to the same values leaves every byte as it was.
    #[test]
    fn frames_are_made_again_byte_for_byte((format, bytes) in any_frame()) {
        prop_assert_eq!(format.scan(&bytes), Scan::Frame(bytes.len()));
        prop_assert_eq!(format.remade(&bytes).unwrap(), &bytes[..]);
        if let Any::Imu(format) = format {
            let mut same = bytes.clone();
            let mut checked = Checked::new(format, &mut same).unwrap();
            let sample = checked.read().unwrap().sample;
            let change = Change { sample: &sample, mark: false, settings: &Settings::DEFAULT };
            prop_assert_eq!(checked.change(&change), Ok(Axes::NONE));
            prop_assert_eq!(same, bytes);
        }
    }

    /// A beginning is never taken for anything else, and never asks for more than the frame has.
    #[test]
    fn beginnings_ask_for_what_is_missing((format, bytes) in any_frame()) {
        for len in 0..bytes.len() {
            match format.scan(&bytes[..len]) {
                Scan::Partial(needed) => prop_assert!(len < needed && needed <= bytes.len()),
                other => prop_assert!(false, "{other:?} of {len} bytes"),
            }
        }
    }

    /// Changed values arrive, saturated where they must. The frame is then one of the same format,
    /// and its changed checksum equals one recomputed from all its bytes. Only values, checksum and
    /// the own fault bit have changed: the old values bring the old frame back.
    #[test]
    fn only_the_values_change((format, sensor, bytes) in any_imu_frame(), new: [i32; 6], narrow: bool, mark: bool) {
        let new = if narrow { new.map(|v| v >> 16) } else { new };
        let mut framer = Framer::new(format);
        framer.push(&bytes);
        let mut checked = framer.next_event().unwrap().frame().unwrap();
        let before = checked.read().unwrap();
        let (sample, expected) = replaced(before.sample, new, sensor.bits);
        let settings = &Settings::DEFAULT;
        let saturated = checked.change(&Change { sample: &sample, mark: false, settings }).unwrap();
        let (expected, there) = (present(expected, before.present), present(sample, before.present));
        prop_assert_eq!(saturated == Axes::NONE, expected == there);
        let after = checked.read().unwrap();
        prop_assert_eq!(after.sample, expected);
        prop_assert_eq!(after.counter, before.counter);
        let mut resealed = checked.bytes().to_vec();
        prop_assert_eq!(format.scan(&resealed), Scan::Frame(bytes.len()));
        format.seal(&mut resealed);
        prop_assert_eq!(&resealed[..], checked.bytes());
        prop_assert_eq!(format.remade(&resealed).unwrap(), &resealed[..]);
        checked.change(&Change { sample: &before.sample, mark: false, settings }).unwrap();
        prop_assert_eq!(checked.bytes(), &bytes[..]);
        checked.change(&Change { sample: &sample, mark, settings }).unwrap();
        prop_assert_eq!(format.scan(checked.bytes()), Scan::Frame(bytes.len()));
        let differences = resealed.iter().zip(checked.bytes()).filter(|(a, b)| a != b).count();
        let allowed = if mark { 5 } else { 0 }; // the mark's byte and the checksum
        prop_assert!(differences <= allowed);
    }

    /// From the arrival of a frame to its departure one checksum is computed over it, and no more.
    #[test]
    fn a_checksum_is_checked_once((format, bytes) in any_frame(), new: [i32; 6]) {
        checksum::count::clear();
        match format {
            Any::Imu(format) => {
                let mut framer = Framer::new(format);
                framer.push(&bytes);
                let mut checked = framer.next_event().unwrap().frame().unwrap();
                let (sample, _) = replaced(checked.read().unwrap().sample, new, 32);
                let change = Change { sample: &sample, mark: true, settings: &Settings::DEFAULT };
                checked.change(&change).unwrap();
            }
            Any::Receiver(format) => {
                let mut framer = Framer::new(format);
                framer.push(&bytes);
                prop_assert!(framer.next_event().unwrap().values().is_some());
            }
        }
        prop_assert_eq!(checksum::count::passes(bytes.len() - 5), 1);
    }

    /// However a stream is cut, with garbage anywhere, the same frames come out and every byte
    /// comes out once, in order.
    #[test]
    fn cutting_changes_nothing(
        which in 0..all().len(), piece in 1..200usize,
        garbage in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..90), 8),
    ) {
        let format = all()[which];
        let mut stream = Vec::new();
        for (n, noise) in (0..).zip(&garbage) {
            stream.extend(format.example(n));
            stream.extend(noise);
        }
        let (whole, cut) = (events(format, &stream, 256), events(format, &stream, piece));
        prop_assert_eq!(frames(&whole), frames(&cut));
        let all: Vec<u8> = cut.iter().flat_map(|(_, bytes)| bytes.clone()).collect();
        prop_assert_eq!(all, stream);
    }

    /// Garbage in front of or between frames costs none of them. Garbage that happens to be a
    /// message with a right checksum is left out: `an_accident_costs_what_it_covers`.
    #[test]
    fn garbage_costs_no_frame(
        which in 0..all().len(), piece in 1..100usize,
        garbage in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..300), 6),
    ) {
        let format = all()[which];
        let mut stream = Vec::new();
        let mut sent = Vec::new();
        for (n, noise) in (0..).zip(&garbage) {
            let bytes = format.example(n);
            stream.extend(noise);
            // the worst noise: a beginning of the same frame
            stream.extend(&bytes[..noise.len() % bytes.len()]);
            sent.push((stream.len(), bytes.clone()));
            stream.extend(bytes);
        }
        stream.extend([0; 300]); // ends the wait of the last false start
        let found = events(format, &stream, piece);
        prop_assume!(accidents(&found, &sent).is_empty());
        let sent: Vec<_> = sent.into_iter().map(|(_, bytes)| bytes).collect();
        prop_assert_eq!(frames(&found), sent);
    }

    /// One wrong bit anywhere: the damaged frame is lost, no other, and no wrong frame appears.
    /// Holds for the sums too: they are weak against two errors, not one.
    #[test]
    fn one_wrong_bit_costs_one_frame((format, bytes) in any_frame(), bit: prop::sample::Index) {
        let neighbours = [format.example(1), format.example(2), format.example(3)];
        let mut damaged = bytes.clone();
        let bit = bit.index(8 * bytes.len());
        damaged[bit / 8] ^= 1 << (bit % 8);
        let [a, b, c] = &neighbours;
        let mut stream = [&a[..], &damaged, b, c].concat();
        stream.extend([0; 300]);
        let found = events(format, &stream, 64);
        prop_assert_eq!(frames(&found), [a, b, c]);
        prop_assert!(format.remade(&damaged).is_err());
    }

    /// Any bytes at all: no panic, nothing lost, nothing that is not checked.
    #[test]
    fn any_bytes_go_through(which in 0..all().len(), piece in 1..256usize, bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        let format = all()[which];
        let found = events(format, &bytes, piece);
        for (kind, frame) in &found {
            if *kind == Kind::Frame {
                prop_assert_eq!(format.scan(frame), Scan::Frame(frame.len()));
            }
            if let Any::Imu(format) = format {
                let _ = Checked::new(format, &mut frame.clone());
            }
        }
        let all: Vec<u8> = found.into_iter().flat_map(|(_, bytes)| bytes).collect();
        prop_assert_eq!(all, bytes);
    }
}

/// A start mark of one byte and a checksum of 16 bits: random bytes are a message of MAVLink 1 now
/// and then, once in 65 536 false starts. Its checksum is right, so it is a message. It costs the
/// frames that it covers, and no other.
#[test]
fn an_accident_costs_what_it_covers() {
    let format = Any::Imu(ImuFormat::from_name("mavlink").unwrap());
    let sent: Vec<_> = (0..6).map(|n| format.example(n)).collect();
    // the header of a HEARTBEAT of MAVLink 1 that claims the next frame as its payload
    let long = sent[2].len() as u8 + 2;
    let noise = (0..=u16::MAX).find_map(|chance| {
        let [a, b] = chance.to_le_bytes();
        let mut noise = std::vec![0xFE, long, 0, a, b, 0];
        noise.extend(&sent[2]);
        noise.extend(&sent[3][..4]);
        matches!(format.scan(&noise), Scan::Other(_)).then(|| noise[..6].to_vec())
    });
    let noise = noise.expect("one of 65 536 has a right checksum");
    let stream = [
        &sent[0][..],
        &sent[1],
        &noise,
        &sent[2..].concat(),
        &[0; 300],
    ]
    .concat();
    let found = events(format, &stream, 7);
    assert_eq!(frames(&found), [&sent[0], &sent[1], &sent[4], &sent[5]]);
    let places = (0..).zip(&sent).map(|(n, frame)| {
        let shift = if n < 2 { 0 } else { noise.len() };
        (n * frame.len() + shift, frame.clone())
    });
    assert_eq!(accidents(&found, &places.collect::<Vec<_>>()).len(), 1);
}
