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
                        *digit = b"0123456789.-N"[usize::from(byte) % 13];
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

/// A sentence of NMEA is the same with CR alone at its end, with a tab in place of CR, and with
/// small letters in its checksum.
fn changes_nothing(format: Any, frame: &[u8], bit: usize) -> bool {
    let from_end = frame.len() - bit / 8;
    let letter = frame[bit / 8].is_ascii_alphabetic() && bit % 8 == 5;
    let tab = from_end == 2 && bit % 8 == 2;
    format == Any::Receiver(ReceiverFormat::Nmea)
        && (from_end == 1 || tab || (from_end <= 4 && letter))
}

/// Parts of a stream: what a part is, and random bytes for it.
fn parts() -> impl Strategy<Value = Vec<(u8, u8, Vec<u8>)>> {
    let noise = prop::collection::vec(any::<u8>(), 0..700);
    prop::collection::vec((0..4u8, any::<u8>(), noise), 0..12)
}

/// Frames, and what is not one: noise, a beginning that goes on as noise, and a beginning with a
/// length of its own, in front of as many bytes, more or fewer.
fn mixed(format: Any, parts: &[(u8, u8, Vec<u8>)]) -> Vec<u8> {
    let mut stream = Vec::new();
    for (what, n, noise) in parts {
        let frame = format.example(*n);
        match what {
            0 => stream.extend(&frame),
            1 => stream.extend(noise),
            2 => {
                stream.extend(&frame[..usize::from(*n) % 16]);
                stream.extend(noise);
            }
            _ => {
                let mut beginning = frame[..12].to_vec();
                let wild = beginning[2..].iter_mut().zip(noise);
                wild.filter(|(_, noise)| **noise % 3 == 0)
                    .for_each(|(byte, noise)| *byte = noise / 3 % 16);
                stream.extend(beginning);
                stream.extend(noise);
            }
        }
    }
    stream.truncate(4096);
    stream
}

/// Events of a stream in pieces of these sizes, again and again. What belongs to no message passes
/// at once, so its neighbouring events are one here.
fn pieces(format: impl Framing, stream: &[u8], sizes: &[usize]) -> Vec<(Kind, Vec<u8>)> {
    let mut framer = Framer::new(format);
    let mut found: Vec<(Kind, Vec<u8>)> = Vec::new();
    let mut note = |kind: Kind, bytes: &[u8]| match found.last_mut() {
        Some((last, joined))
            if *last == kind && matches!(kind, Kind::Garbage | Kind::Long | Kind::Unknown) =>
        {
            joined.extend(bytes);
        }
        _ => found.push((kind, bytes.to_vec())),
    };
    let (mut rest, mut sizes) = (stream, sizes.iter().cycle());
    while !rest.is_empty() {
        let (mut piece, after) = rest.split_at((*sizes.next().unwrap()).min(rest.len()));
        rest = after;
        while !piece.is_empty() {
            let taken = framer.push(piece);
            piece = &piece[taken..];
            while let Some(event) = framer.next_event() {
                note(event.kind(), event.bytes());
            }
        }
    }
    if let Some(event) = framer.flush() {
        note(event.kind(), event.bytes());
    }
    found
}

/// What a u-blox receiver sends each second, NAV-PVT, NAV-SAT and NAV-SIG, and a Septentrio with
/// two long blocks: each message is one event, however it is cut.
#[test]
fn long_messages_pass_as_a_whole() {
    let ubx = |n: u8, id, len: usize| {
        let mut message = std::vec![n.wrapping_mul(37); len];
        message[..4].copy_from_slice(&[0xB5, 0x62, 0x01, id]);
        message[4..6].copy_from_slice(&((len - 8) as u16).to_le_bytes());
        let sum = checksum::fletcher8(&message[2..len - 2]);
        message[len - 2..].copy_from_slice(&sum);
        message
    };
    let sbf = |n: u8, id: u16, len: usize| {
        let mut block = std::vec![n.wrapping_mul(37); len];
        block[..2].copy_from_slice(b"$@");
        block[4..6].copy_from_slice(&id.to_le_bytes());
        block[6..8].copy_from_slice(&(len as u16).to_le_bytes());
        let sum = checksum::xmodem(&block[4..]);
        block[2..4].copy_from_slice(&sum.to_le_bytes());
        block
    };
    for (format, length) in [(ReceiverFormat::Ubx, 100), (ReceiverFormat::Sbf, 104)] {
        let (mut stream, mut frames) = (Vec::new(), Vec::new());
        for n in 0..60 {
            let frame = format.example(n);
            stream.extend(&frame);
            frames.push(frame);
            match format {
                ReceiverFormat::Ubx => {
                    stream.extend([ubx(n, 0x35, 408), ubx(n, 0x43, 664)].concat());
                }
                _ => stream.extend([sbf(n, 4027, 920), sbf(n, 4013, 1312)].concat()),
            }
        }
        assert!(frames[0].len() <= length);
        for size in (1..=64).chain([100, 255, 256, 257, 1000, 4096]) {
            let found = pieces(format, &stream, &[size]);
            let kinds = found.iter().map(|(kind, _)| *kind);
            let alternate = kinds
                .enumerate()
                .all(|(at, kind)| kind == [Kind::Frame, Kind::Long][at % 2]);
            assert!(alternate && found.len() == 120, "{format:?} {size}");
            assert_eq!(super::framer::tests::frames(&found), frames);
        }
    }
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

    /// However a stream is cut, the same events come out and every byte comes out once, in order:
    /// frames, garbage, and beginnings with wild lengths, in all formats.
    #[test]
    fn cutting_changes_nothing(
        which in 0..all().len(), parts in parts(), sizes in prop::collection::vec(1..=4096usize, 1..6),
    ) {
        let format = all()[which];
        let stream = mixed(format, &parts);
        let whole = pieces(format, &stream, &[4096]);
        for sizes in [&[1], &sizes[..], &[sizes[0] % 64 + 1]] {
            prop_assert_eq!(&pieces(format, &stream, sizes), &whole, "{:?}", sizes);
        }
        let all: Vec<u8> = whole.iter().flat_map(|(_, bytes)| bytes.clone()).collect();
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
            // the worst noise: a beginning of the same frame, without the last two bytes, as a line
            // may end in CR alone
            stream.extend(&bytes[..noise.len() % (bytes.len() - 1)]);
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
        prop_assume!(!changes_nothing(format, &bytes, bit));
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
