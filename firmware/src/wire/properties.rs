//! Properties that hold for every protocol, over generated frames, streams and damage.

use super::checksum::{crc32_mpeg2, crc32_mpeg2_padded, crc32_novatel, fletcher8, sum16_le};
use super::framer::Kind;
use super::framer::tests::{ALL, events, frame, frames};
use super::{Change, Error, Format, Framer, Scan, hg4930, kvh, novatel, read, stim300, ubx, write};
use crate::sample::{Axes, RawSample};
use proptest::prelude::*;
use std::format;
use std::vec::Vec;

/// A good frame of any format with any bytes in its fields: random bytes under the right header and checksum.
fn any_frame() -> impl Strategy<Value = (Format, Vec<u8>)> {
    let body = prop::collection::vec(any::<u8>(), 100);
    (0..ALL.len(), any::<usize>(), body).prop_map(|(which, kind, mut bytes)| {
        let format = ALL[which];
        let len = begin(format, kind, &mut bytes);
        bytes.truncate(len);
        end(format, &mut bytes);
        (format, bytes)
    })
}

/// Put the header of the `kind`th message of a format in front and return the message's length.
fn begin(format: Format, kind: usize, bytes: &mut [u8]) -> usize {
    match format {
        Format::Stim300 => {
            let ids = (0..=255).filter(|&id| stim300::Contents::from_id(id).is_some());
            bytes[0] = ids.cycle().nth(kind % 24).unwrap();
            stim300::Contents::from_id(bytes[0]).unwrap().len()
        }
        Format::Kvh => {
            let (fourth, len) = [(0x55, 36), (0x56, 40), (0x57, 38)][kind % 3];
            bytes[..4].copy_from_slice(&[0xFE, 0x81, 0xFF, fourth]);
            len
        }
        Format::Novatel if kind.is_multiple_of(2) => {
            let id = [325u16, 1462][kind / 2 % 2];
            bytes[..4].copy_from_slice(&[0xAA, 0x44, 0x13, 40]);
            bytes[4..6].copy_from_slice(&id.to_le_bytes());
            novatel::SHORT_LEN
        }
        Format::Novatel => {
            let id = [268u16, 1461][kind / 2 % 2];
            bytes[..4].copy_from_slice(&[0xAA, 0x44, 0x12, 28]);
            bytes[4..6].copy_from_slice(&id.to_le_bytes());
            bytes[8..10].copy_from_slice(&[40, 0]);
            novatel::LONG_LEN
        }
        Format::Hg4930 => {
            let (id, len) = [(0x02, 44), (0xCA, 20)][kind % 2];
            bytes[..2].copy_from_slice(&[0x0E, id]);
            len
        }
        Format::Ubx => {
            bytes[..6].copy_from_slice(&[0xB5, 0x62, 0x01, 0x07, 92, 0]);
            ubx::PVT_LEN
        }
    }
}

/// Put the checksum behind.
fn end(format: Format, bytes: &mut [u8]) {
    let sum = match format {
        Format::Hg4930 | Format::Ubx => 2,
        _ => 4,
    };
    let (data, end) = bytes.split_at_mut(bytes.len() - sum);
    match format {
        Format::Stim300 => end.copy_from_slice(&crc32_mpeg2_padded(data).to_be_bytes()),
        Format::Kvh => end.copy_from_slice(&crc32_mpeg2(data).to_be_bytes()),
        Format::Novatel => end.copy_from_slice(&crc32_novatel(data).to_le_bytes()),
        Format::Hg4930 => end.copy_from_slice(&sum16_le(data).to_le_bytes()),
        Format::Ubx => end.copy_from_slice(&fletcher8(&data[2..])),
    }
}

/// Through `Repr` and back.
fn remade(format: Format, bytes: &[u8]) -> Result<Vec<u8>, Error> {
    let mut made = std::vec![0xEE; 100];
    let len = match format {
        Format::Stim300 => {
            stim300::Repr::parse(&stim300::Frame::new_checked(bytes)?).emit(&mut made)
        }
        Format::Kvh => kvh::Repr::parse(&kvh::Frame::new_checked(bytes)?).emit(&mut made),
        Format::Novatel => {
            novatel::Repr::parse(&novatel::Frame::new_checked(bytes)?).emit(&mut made)
        }
        Format::Hg4930 => hg4930::Repr::parse(&hg4930::Frame::new_checked(bytes)?).emit(&mut made),
        Format::Ubx => return ubx::Pvt::parse(bytes).map(|pvt| pvt.emit().to_vec()),
    }?;
    made.truncate(len);
    Ok(made)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// emit(parse(frame)) == frame, and write(read(frame)) leaves every byte as it was.
    #[test]
    fn frames_are_made_again_byte_for_byte((format, bytes) in any_frame()) {
        prop_assert_eq!(format.scan(&bytes), Scan::Frame(bytes.len()));
        prop_assert_eq!(remade(format, &bytes).unwrap(), &bytes[..]);
        if format != Format::Ubx {
            let mut same = bytes.clone();
            let words = read(format, &bytes).unwrap().words;
            prop_assert_eq!(write(format, &mut same, &words), Ok(Axes::NONE));
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

    /// Changed words arrive, and nothing but words and checksum has changed.
    #[test]
    fn only_the_words_change((format, bytes) in any_frame(), new: [i16; 6]) {
        if format == Format::Ubx {
            return Ok(()); // has no words
        }
        let [a, b, c, d, e, f] = new.map(i32::from);
        let has_accel = format != Format::Stim300
            || stim300::Contents::from_id(bytes[0]).unwrap().accel;
        let words = match format {
            Format::Kvh => RawSample::Floats {
                gyro: [a, b, c].map(|w| w as f32),
                accel: [d, e, f].map(|w| w as f32),
            },
            _ => RawSample::Counts {
                gyro: [a, b, c],
                accel: if has_accel { [d, e, f] } else { [0; 3] },
            },
        };
        let mut changed = bytes.clone();
        prop_assert_eq!(write(format, &mut changed, &words), Ok(Axes::NONE));
        let (before, after) = (read(format, &bytes).unwrap(), read(format, &changed).unwrap());
        prop_assert_eq!(after.words, words);
        // what is not a word: the same, also after the old words are put back
        prop_assert_eq!(after.counter, before.counter);
        write(format, &mut changed, &before.words).unwrap();
        prop_assert_eq!(changed, bytes);
    }

    /// The checked frame of a framer changes exactly as [`write`] does, and so does its checksum.
    #[test]
    fn checked_frames_change_alike((format, bytes) in any_frame(), words: [i32; 6], mark: bool) {
        if format == Format::Ubx {
            return Ok(());
        }
        let [a, b, c, d, e, f] = words;
        let words = match format {
            Format::Kvh => RawSample::Floats {
                gyro: [a, b, c].map(|w| w as f32),
                accel: [d, e, f].map(|w| w as f32),
            },
            _ => RawSample::Counts { gyro: [a, b, c], accel: [d, e, f] },
        };
        let mut framer = Framer::new(format);
        framer.push(&bytes);
        let mut checked = framer.next_event().unwrap().frame().unwrap();
        // KVH words may be NaN, which are equal to nothing
        let (read_again, again) = (format!("{:?}", checked.read()), format!("{:?}", read(format, &bytes)));
        prop_assert_eq!(read_again, again);
        let change = Change { words: &words, mark, family: None };
        let held = checked.change(&change).unwrap();
        prop_assert_eq!(format.scan(checked.bytes()), Scan::Frame(bytes.len()));
        let mut written = bytes.clone();
        prop_assert_eq!(write(format, &mut written, &words), Ok(held));
        let differences = written.iter().zip(checked.bytes()).filter(|(a, b)| a != b).count();
        let allowed = if mark { 5 } else { 0 }; // the mark's byte and the checksum
        prop_assert!(differences <= allowed);
    }

    /// However a stream is cut, with garbage anywhere, the same frames come out and every byte comes out once, in order.
    #[test]
    fn cutting_changes_nothing(
        which in 0..ALL.len(), piece in 1..200usize,
        garbage in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..90), 8),
    ) {
        let format = ALL[which];
        let mut stream = Vec::new();
        for (n, noise) in (0..).zip(&garbage) {
            stream.extend(frame(format, n));
            stream.extend(noise);
        }
        let (whole, cut) = (events(format, &stream, 256), events(format, &stream, piece));
        prop_assert_eq!(frames(&whole), frames(&cut));
        let all: Vec<u8> = cut.iter().flat_map(|(_, bytes)| bytes.clone()).collect();
        prop_assert_eq!(all, stream);
    }

    /// Garbage in front of or between frames costs none of them (an HG4930 false start may by chance have a right sum:
    /// 2^-32 a place).
    #[test]
    fn garbage_costs_no_frame(
        which in 0..ALL.len(), piece in 1..100usize,
        garbage in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..300), 6),
    ) {
        let format = ALL[which];
        let sent: Vec<_> = (0..6).map(|n| frame(format, n)).collect();
        let mut stream = Vec::new();
        for (noise, bytes) in garbage.iter().zip(&sent) {
            stream.extend(noise);
            // the worst noise: a beginning of the same frame
            stream.extend(&bytes[..noise.len() % bytes.len()]);
            stream.extend(bytes);
        }
        stream.extend([0; 300]); // ends the wait of the last false start
        let found = events(format, &stream, piece);
        prop_assert_eq!(frames(&found), sent);
    }

    /// One wrong bit anywhere: the damaged frame is lost, no other, and no wrong frame appears. Holds for the sums too:
    /// they are weak against two errors, not one.
    #[test]
    fn one_wrong_bit_costs_one_frame((format, bytes) in any_frame(), bit: prop::sample::Index) {
        let neighbours = [frame(format, 1), frame(format, 2), frame(format, 3)];
        let mut damaged = bytes.clone();
        let bit = bit.index(8 * bytes.len());
        damaged[bit / 8] ^= 1 << (bit % 8);
        let [a, b, c] = &neighbours;
        let mut stream = [&a[..], &damaged, b, c].concat();
        stream.extend([0; 300]);
        let found = events(format, &stream, 64);
        prop_assert_eq!(frames(&found), [a, b, c]);
        prop_assert!(remade(format, &damaged).is_err());
    }

    /// Any bytes at all: no panic, nothing lost, nothing that is not checked.
    #[test]
    fn any_bytes_go_through(which in 0..ALL.len(), piece in 1..256usize, bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        let format = ALL[which];
        let found = events(format, &bytes, piece);
        for (kind, frame) in &found {
            if *kind == Kind::Frame {
                prop_assert_eq!(format.scan(frame), Scan::Frame(frame.len()));
            }
            let _ = read(format, frame);
        }
        let all: Vec<u8> = found.into_iter().flat_map(|(_, bytes)| bytes).collect();
        prop_assert_eq!(all, bytes);
    }
}
