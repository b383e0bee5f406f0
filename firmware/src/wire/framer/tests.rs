//! The framer on hand-made streams; `wire::properties` has the generated ones.

use super::*;
use crate::wire::examples::{Any, Examples, all};
use crate::wire::stim300;
use std::vec::Vec;

/// All events of a stream that arrives in pieces of `piece` bytes, flushed at the end.
pub(crate) fn events(format: impl Framing, stream: &[u8], piece: usize) -> Vec<(Kind, Vec<u8>)> {
    let mut framer = Framer::new(format);
    let mut found = Vec::new();
    for chunk in stream.chunks(piece) {
        assert_eq!(framer.push(chunk), chunk.len());
        while let Some(event) = framer.next_event() {
            found.push((event.kind(), event.bytes().to_vec()));
        }
        assert!(framer.pending() < LONGEST);
    }
    found.extend(
        framer
            .flush()
            .map(|event| (event.kind(), event.bytes().to_vec())),
    );
    found
}

pub(crate) fn frames(events: &[(Kind, Vec<u8>)]) -> Vec<&[u8]> {
    let frames = events.iter().filter(|(kind, _)| *kind == Kind::Frame);
    frames.map(|(_, bytes)| &bytes[..]).collect()
}

#[test]
fn a_clean_stream_comes_out_frame_by_frame() {
    for format in all() {
        let sent: Vec<_> = (0..20).map(|n| format.example(n)).collect();
        let found = events(format, &sent.concat(), 7);
        assert_eq!(frames(&found), sent, "{format:?}");
        assert_eq!(found.len(), 20);
    }
}

#[test]
fn a_frame_comes_out_with_its_last_byte() {
    for format in all() {
        let mut framer = Framer::new(format);
        let bytes = format.example(1);
        let (last, rest) = bytes.split_last().unwrap();
        framer.push(rest);
        assert_eq!(framer.next_event(), None, "{format:?}");
        framer.push(&[*last]);
        assert_eq!(framer.next_event().map(|e| e.kind()), Some(Kind::Frame));
    }
}

#[test]
fn one_damaged_frame_costs_one_frame_and_is_named() {
    for format in all() {
        let mut sent: Vec<_> = (0..9).map(|n| format.example(n)).collect();
        let middle = sent[4].len() / 2;
        sent[4][middle] ^= 0x10;
        let found = events(format, &sent.concat(), 11);
        sent.remove(4);
        assert_eq!(frames(&found), sent, "{format:?}");
        assert_eq!(found[4].0, Kind::BadChecksum, "{format:?}");
        assert!(found.iter().all(|(kind, _)| *kind != Kind::Unknown));
    }
}

/// Another format is not a line of bad checksums.
#[test]
fn an_unknown_format_is_distinguished_from_damage() {
    for format in all() {
        for other in all().into_iter().filter(|other| *other != format) {
            let stream: Vec<_> = (0..=255).flat_map(|n| other.example(n)).collect();
            let found = events(format, &stream, 32);
            let count = |kind| found.iter().filter(|(k, _)| *k == kind).count();
            assert_eq!(count(Kind::Frame), 0);
            assert_eq!(count(Kind::BadChecksum), 0, "{other:?} as {format:?}");
            // the end of a line of text is a message of a STIM300, and a log is one of either
            // NovAtel
            let nmea = Any::Receiver(ReceiverFormat::Nmea);
            let novatel = [
                Any::Imu(ImuFormat::Novatel),
                Any::Receiver(ReceiverFormat::Novatel),
            ];
            let known = (format, other) == (Any::Imu(ImuFormat::Stim300), nmea)
                || [format, other].iter().all(|one| novatel.contains(one));
            assert!(known || count(Kind::Unknown) > 0, "{other:?} as {format:?}");
        }
        // damage in every frame of the right format is damage
        let damaged = (0..=255).flat_map(|n| {
            let mut bytes = format.example(n);
            bytes[12] ^= 1; // in no header
            bytes
        });
        let stream: Vec<_> = damaged.collect();
        let found = events(format, &stream, 32);
        let unknown = found.iter().any(|(kind, _)| *kind == Kind::Unknown);
        assert_eq!(unknown, !format.has_start_mark(), "{format:?}");
    }
}

#[test]
fn messages_too_long_to_hold_pass_through() {
    let mut stream = ReceiverFormat::Ubx.example(1);
    stream.extend([0xB5, 0x62, 0x01, 0x35, 0x00, 0x04]); // NAV-SAT, 1024 bytes
    stream.extend([0x11; 1026]);
    stream.extend(ReceiverFormat::Ubx.example(2));
    for piece in [1, 100, LONGEST] {
        let found = events(ReceiverFormat::Ubx, &stream, piece);
        assert_eq!(frames(&found).len(), 2);
        let all: Vec<u8> = found.into_iter().flat_map(|(_, bytes)| bytes).collect();
        assert_eq!(all, stream);
    }
}

/// A message that would fit into the buffer but is longer than what is waited for is garbage
/// however it arrives.
#[test]
fn what_is_found_does_not_depend_on_how_much_has_come() {
    let mut long = std::vec![0x11; 300];
    long[..6].copy_from_slice(&[0xB5, 0x62, 0x01, 0x35, 0x24, 0x01]); // 292 bytes of payload
    let sum = crate::wire::checksum::fletcher8(&long[2..298]);
    long[298..].copy_from_slice(&sum);
    assert_eq!(ReceiverFormat::Ubx.scan(&long), Scan::Other(300));
    long.extend(ReceiverFormat::Ubx.example(1));
    for piece in 1..=LONGEST {
        let found = events(ReceiverFormat::Ubx, &long, piece);
        assert!(found.iter().all(|(kind, _)| *kind != Kind::Other));
        assert_eq!(frames(&found).len(), 1);
    }
}

/// The worst position of a byte that looks like an identifier: where one is expected.
#[test]
fn a_stray_identifier_between_frames_costs_none() {
    let (a, b) = (ImuFormat::Stim300.example(1), ImuFormat::Stim300.example(2));
    for id in [0x91, 0xA5, 0xF7, 0xBC] {
        let stream = [&a[..], &[id], &b, &a].concat();
        let found = events(ImuFormat::Stim300, &stream, 5);
        assert_eq!(frames(&found), [&a, &b, &a], "{id:#x}");
    }
}

#[test]
fn cr_lf_and_special_datagrams_pass_between_frames() {
    let mut stream = ImuFormat::Stim300.example(1);
    stream.extend(b"\r\n");
    stream.extend(stim300::config::Config::DEFAULT.emit());
    stream.extend(b"\r\n");
    stream.extend(ImuFormat::Stim300.example(2));
    let kinds: Vec<_> = events(ImuFormat::Stim300, &stream, 1)
        .iter()
        .map(|e| e.0)
        .collect();
    let expected = [
        Kind::Frame,
        Kind::Other,
        Kind::Other,
        Kind::Other,
        Kind::Frame,
    ];
    assert_eq!(kinds, expected);
}

#[test]
fn a_full_buffer_takes_no_more() {
    let mut framer = Framer::new(ImuFormat::Kvh);
    assert_eq!(framer.push(&[0; CAPACITY + 5]), CAPACITY);
    assert_eq!(framer.push(&[0]), 0);
    assert_eq!(framer.next_event().map(|e| e.bytes().len()), Some(CAPACITY));
    assert_eq!(framer.push(&[0]), 1);
}

/// After an upset of memory.
#[test]
fn a_flipped_format_or_length_is_seen() {
    let mut framer = Framer::new(ImuFormat::Stim300);
    framer.push(&ImuFormat::Stim300.example(1));
    while framer.next_event().is_some() {}
    assert!(framer.is_intact());
    assert_eq!(framer.certain_format(), Some(ImuFormat::Stim300));
    for copy in [false, true] {
        let mut upset = Framer {
            finder: Finder { ..framer.finder },
            bytes: Unread::new(),
        };
        let format = if copy {
            &mut upset.finder.again
        } else {
            &mut upset.finder.format
        };
        *format = ImuFormat::Kvh;
        assert!(!upset.is_intact());
        assert_eq!(upset.certain_format(), None);
    }
    framer.finder.usual ^= 1;
    assert!(!framer.is_intact());
    assert_eq!(framer.certain_format(), Some(ImuFormat::Stim300));
}
