//! Bytes that are no frame pass at once and are no gap: answers in text, other logs of any length.

use crate::bypass::log;
use crate::device::{Device, nets};
use crate::frames::{Kind, kinds};
use firmware::app::{Config, Phase};
use firmware::control::Mode;
use firmware::wire::ImuFormat;
use firmware::wire::command::fault;

fn config(kind: Kind) -> Config {
    Config {
        mode: Mode::Frozen,
        nets: nets([1e-6, 0.0, 0.0], [0.0; 3]),
        block: 20.0 / kind.rate(),
        ..kind.config()
    }
}

/// A driver asks its sensor and waits for the answer before it goes on. Nothing comes behind the
/// answer, and it must not wait for anything.
#[test]
fn an_answer_leaves_at_once() {
    for kind in kinds() {
        for text in [
            "CONFIG,1\r\n",
            "<OK\r\n",
            "$PASHR,130533.620,0.311,T*5D\r\n",
            "?",
        ] {
            let mut device = Device::new(config(kind));
            device.feed(&kind.stream(0, 30).concat());
            device.lines.navigation.sent.clear();
            device.feed(text.as_bytes());
            let left = device.lines.navigation.bytes();
            assert_eq!(left, text.as_bytes(), "{kind:?}");
        }
    }
}

/// Text between frames takes nothing from the networks where a counter or a time shows that no
/// sample is missing. Where there is neither, the block is given up.
#[test]
fn text_is_no_gap() {
    for kind in kinds() {
        let mut device = Device::new(config(kind));
        let mut came = Vec::new();
        for (n, frame) in kind.stream(0, 200).into_iter().enumerate() {
            if n % 30 == 7 {
                came.extend(b"#RAWIMUA,COM1 and other text\r\n");
            }
            came.extend(frame);
        }
        device.feed(&came);
        let counters = device.counters();
        assert_eq!(counters.frames, 200, "{kind:?}");
        assert_eq!(device.lines.navigation.bytes().len(), came.len());
        let has_sequence = !matches!(kind.format, ImuFormat::Hg4930);
        if has_sequence && counters.given_up == 0 {
            assert_eq!(counters.blocks, 10, "{kind:?}");
        }
        let shows_gaps = Kind::STIM.format == kind.format || Kind::KVH.format == kind.format;
        let shows_gaps = shows_gaps || Kind::RAWIMUSX.format == kind.format;
        assert!(!shows_gaps || counters.given_up == 0, "{kind:?}");
        assert!(has_sequence || counters.given_up > 0, "{kind:?}");
    }
}

/// A gap that a counter cannot show, because the counter has wrapped, is reported all the same.
#[test]
fn as_much_as_a_turn_of_the_counter_is_a_gap() {
    for (bytes, gap) in [(4000, 0), (36 * 128, 1)] {
        let mut device = Device::new(config(Kind::KVH));
        device.feed(&Kind::KVH.stream(0, 30).concat());
        device.feed(&vec![0x11; bytes]);
        device.feed(&Kind::KVH.stream(30, 40).concat());
        let counters = device.counters();
        assert_eq!((counters.missed, counters.given_up), (0, gap), "{bytes}");
    }
}

/// Other logs of a receiver, of any length, with anything in them.
#[test]
fn logs_of_any_length_pass() {
    let kind = Kind::RAWIMUSX;
    for format in [None, Some(kind.format)] {
        let mut device = Device::new(Config {
            format,
            ..config(kind)
        });
        let mut came = kind.stream(0, 10).concat();
        for (n, len) in (10..).zip([0, 100, 220, 230, 300, 700, 5000, 40_000, 65_000, 255]) {
            came.extend(log(
                len,
                b"\xAA\x44\x13\x28\xB6\x05 \xAA\x44\x12\x1C\x00\x00",
            ));
            came.extend(kind.stream(n, n + 1).concat());
        }
        came.extend(kind.stream(20, 101).concat());
        device.feed(&came);
        let counters = device.counters();
        assert_eq!(device.lines.navigation.bytes().len(), came.len());
        // without a format the first three frames find it, and one more shows the units
        let raw = if format.is_none() { 3 } else { 0 };
        assert_eq!(counters.frames, 101 - raw);
        assert_eq!((counters.garbage, counters.bad_checksums), (0, 0));
        assert_eq!((counters.missed, counters.given_up), (0, 0));
        assert_eq!(counters.blocks, (101 - raw) / 20);
        assert_eq!(device.app.faults(), 0);
        assert_eq!(device.app.phase(), Phase::Run(Mode::Frozen));
    }
}

/// A damaged header that states a length that is not: the next frames are found all the same.
#[test]
fn a_length_that_is_not_costs_no_frame() {
    let kind = Kind::RAWIMUSX;
    let mut device = Device::new(config(kind));
    let mut long = log(60_000, b"");
    long.truncate(40);
    let came = [
        kind.stream(0, 30).concat(),
        long,
        kind.stream(30, 200).concat(),
    ]
    .concat();
    device.feed(&came);
    let counters = device.counters();
    assert_eq!(
        (counters.frames, counters.missed, counters.given_up),
        (200, 0, 0)
    );
    assert_eq!(device.lines.navigation.bytes().len(), came.len());
}

/// A receiver that finds its time, a leap, the end of a week: no frame is missing, and none is made
/// up. The learner's navigation ends, because the time is not known.
#[test]
fn a_clock_that_is_set_is_a_jump() {
    let kind = Kind::RAWIMUSX;
    for offset in [411_000.0, 17.99, -900.0, -0.5] {
        let mut device = Device::new(config(kind));
        let frame = |n: u32| {
            let mut frame = kind.stream(n, n + 1).remove(0);
            let time = 1000.0 + f64::from(n) / 100.0 + if n >= 50 { offset } else { 0.0 };
            frame[12 + 4..12 + 12].copy_from_slice(&time.to_le_bytes());
            kind.format.seal(&mut frame);
            frame
        };
        (0..100).for_each(|n| device.feed(&frame(n)));
        let counters = device.counters();
        assert_eq!((counters.jumps, counters.missed), (1, 0), "{offset}");
        assert_eq!((counters.blocks, counters.given_up), (4, 1), "{offset}");
    }
    // 3 s are a gap
    let mut device = Device::new(config(kind));
    device.feed(&[kind.stream(0, 50).concat(), kind.stream(350, 360).concat()].concat());
    assert_eq!(
        (device.counters().jumps, device.counters().missed),
        (0, 300)
    );
}

/// Bytes without a format are reported, at start and later: after 4096 of them or, where few come,
/// after three seconds.
#[test]
fn a_stream_without_a_format_is_reported() {
    for format in [None, Some(ImuFormat::Kvh), Some(ImuFormat::Novatel)] {
        let config = Config {
            format,
            ..Config::default()
        };
        let mut fast = Device::new(config.clone());
        fast.feed(&[0x11; 4000]);
        assert_eq!(fast.app.faults(), 0, "{format:?}");
        fast.feed(&[0x11; 200]);
        assert_eq!(fast.app.faults(), fault::UNKNOWN_FORMAT, "{format:?}");
        assert_eq!(fast.lines.navigation.bytes(), [0x11; 4200]);

        let mut slow = Device::new(config);
        for n in 0..420 {
            assert!(n >= 290 || slow.app.faults() == 0, "{n} {format:?}");
            slow.feed(b"\r\n");
            slow.wait_ms(10);
        }
        assert_eq!(slow.app.faults(), fault::UNKNOWN_FORMAT, "{format:?}");
        // and no more when frames come
        let kind = Kind {
            format: format.unwrap_or(ImuFormat::Kvh),
            ..Kind::KVH
        };
        if kind.format == ImuFormat::Kvh {
            slow.feed(&Kind::KVH.stream(0, 10).concat());
            assert_eq!(slow.app.faults(), 0);
        }
    }
}

/// Other messages of the right format without a single sample are no frames either.
#[test]
fn messages_without_samples_are_reported() {
    let mut device = Device::new(Kind::RAWIMUSX.config());
    for _ in 0..500 {
        device.feed(&log(60, b""));
        device.wait_ms(10);
    }
    assert_eq!(device.app.faults(), fault::UNKNOWN_FORMAT);
    device.feed(&Kind::RAWIMUSX.stream(0, 2).concat());
    assert_eq!(device.app.faults(), 0);
}
