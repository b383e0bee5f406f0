//! Gaps, silence, a full output, failures: no frame is made up, and the networks do not step over a
//! gap.

use crate::damage::stamp;
use crate::device::{Device, broken, nets};
use crate::frames::{Fields, Kind, frames_in, stim300_units, values};
use firmware::app::{Config, Phase, phase::Cause};
use firmware::control::Mode;
use firmware::link::faulty::{Chances, Faulty};
use firmware::model::Nets;
use firmware::wire::command::{Request, fault};
use firmware::wire::{ImuFormat, stim300};

const STIM: Kind = Kind::STIM;
const KVH: Kind = Kind::KVH;

/// Gaps in the sensor's counter leave as gaps. The estimate is held, and the block restarts.
#[test]
fn gaps_are_passed_on_and_not_stepped_over() {
    for kind in [STIM, KVH, Kind::RAWIMUSX] {
        let mut device = Device::new(Config {
            mode: Mode::Frozen,
            nets: nets([2e-5, 0.0, 0.0], [0.0; 3]),
            block: 10.0 / kind.rate(),
            ..kind.config()
        });
        let frame = |n| kind.frame(n, Fields::default());
        let all = |device: &mut Device, range: std::ops::Range<u32>| {
            range.for_each(|n| device.feed(&frame(n)));
        };
        all(&mut device, 0..15);
        assert_eq!(
            (device.counters().blocks, device.counters().given_up),
            (1, 0)
        );
        all(&mut device, 18..27); // 3 missing; 9 of a new block
        let counters = device.counters();
        assert_eq!(
            (counters.missed, counters.blocks, counters.given_up),
            (3, 1, 1),
            "{kind:?}"
        );
        assert_eq!(device.lines.navigation.sent.len(), 24);
        let last = device.lines.navigation.sent.last().expect("a frame");
        assert!(values(kind.format, last)[0] < 0.0); // corrected by the estimate held
        all(&mut device, 27..28);
        assert_eq!(device.counters().blocks, 2);
        // a repeated frame is sent on and does not count in a block
        device.feed(&frame(27));
        assert_eq!(device.counters().duplicates, 1);
        all(&mut device, 28..37);
        assert_eq!(device.counters().blocks, 2);
        all(&mut device, 37..38);
        assert_eq!(
            (device.counters().blocks, device.counters().given_up),
            (3, 1)
        );
        assert_eq!(
            stamp(kind, device.lines.navigation.sent.last().expect("one")),
            stamp(kind, &frame(37))
        );
    }
}

/// Values that the sensor marks invalid do not reach the networks; their frames and status bits
/// leave unchanged.
#[test]
fn invalid_words_are_not_learned_from() {
    let contents = stim300::Contents::from_id(0x91).expect("an identifier");
    let frame = |n: u8, status: u8| {
        let cluster = |values, status| stim300::Cluster { values, status };
        let repr = stim300::Repr {
            contents,
            gyro: cluster([100, 0, 0], status),
            accel: cluster([0, 0, 41_000], status),
            incl: stim300::Cluster::default(),
            temperatures: [stim300::Temperatures::default(); 3],
            extra: (0, 0),
            counter: n.wrapping_mul(2),
            latency_us: 120,
        };
        let mut buffer = [0; 63];
        let len = repr.emit(&mut buffer).expect("room");
        buffer[..len].to_vec()
    };
    let mut device = Device::new(Config {
        mode: Mode::Frozen,
        nets: nets([1e-3, 0.0, 0.0], [0.0; 3]),
        limit: firmware::compensator::Limit {
            gyro: 1.0,
            accel: 1.0,
        },
        block: 0.01,
        ..STIM.config()
    });
    (0..20).for_each(|n| device.feed(&frame(n, 0)));
    assert_eq!(device.counters().blocks, 2);
    // no axis is valid, so the sample is not corrected
    (20..40).for_each(|n| device.feed(&frame(n, stim300::status::INTEGRITY)));
    assert_eq!(
        device.lines.navigation.sent[20..],
        (20..40).map(|n| frame(n, 0x80)).collect::<Vec<_>>()
    );
    assert_eq!(device.app.faults(), fault::SENSOR);
    // one axis overloaded: the others still need their correction, the networks wait
    (40..60).for_each(|n| device.feed(&frame(n, stim300::status::OVERLOAD | 1)));
    let last = device.lines.navigation.sent.last().expect("one").clone();
    assert!(values(ImuFormat::Stim300, &last)[0] < 100.0);
    assert_eq!((last[10], last[20]), (0x11, 0x11));
    assert_eq!(device.counters().blocks, 2);
    (60..75).for_each(|n| device.feed(&frame(n, 0)));
    assert_eq!((device.counters().blocks, device.app.faults()), (3, 0));
    // one invalid sample spoils its block: the next one begins after it
    device.feed(&frame(75, stim300::status::CHANNEL | 4));
    assert_eq!(device.counters().given_up, 1);
    (76..85).for_each(|n| device.feed(&frame(n, 0)));
    assert_eq!(device.counters().blocks, 3);
    device.feed(&frame(85, 0));
    assert_eq!(device.counters().blocks, 4);
}

/// Lost and damaged bytes are a gap also where no counter shows it.
#[test]
fn holes_without_a_counter() {
    let mut device = Device::on(
        Config {
            mode: Mode::Frozen,
            block: 0.1,
            ..Kind::HG4930.config()
        },
        Faulty::new(crate::device::Mock::default(), Chances::default(), 1),
    );
    let feed = |device: &mut Device<Faulty<crate::device::Mock>>, bytes: &[u8]| {
        device.lines.sensor.inner().input.extend(bytes);
        device.settle();
    };
    let frames = Kind::HG4930.stream(0, 40);
    feed(&mut device, &frames[..15].concat());
    device.lines.sensor.chances.lost = u16::MAX;
    device.app.poll(&mut device.lines, &device.time);
    device.lines.sensor.chances.lost = 0;
    assert_eq!((device.counters().lost, device.counters().given_up), (1, 1));
    feed(&mut device, &frames[15..24].concat());
    assert_eq!(device.counters().blocks, 1);
    feed(&mut device, &frames[24]);
    assert_eq!(device.counters().blocks, 2);
    let mut damaged = frames[25].clone();
    damaged[20] ^= 1;
    feed(
        &mut device,
        &[&frames[26][..], &damaged, &frames[27]].concat(),
    );
    assert_eq!(
        (device.counters().bad_checksums, device.counters().given_up),
        (1, 2)
    );
}

#[test]
fn silence_is_reported_and_nothing_is_invented() {
    for kind in [STIM, KVH] {
        let mut device = Device::new(kind.config());
        let frames = kind.stream(0, 40);
        device.feed(&frames[..20].concat());
        device.feed(&frames[20][..9]); // stops in the middle
        device.wait_ms(99);
        assert_eq!(device.app.faults(), 0);
        device.wait_ms(500);
        assert_eq!(device.app.faults(), fault::SILENT);
        // the beginning of the frame passes, and no more
        assert_eq!(device.lines.navigation.sent[..20], frames[..20]);
        assert_eq!(device.lines.navigation.sent[20..], [&frames[20][..9]]);
        assert_eq!(
            (device.counters().silences, device.counters().garbage),
            (1, 9)
        );
        device.feed(&frames[30..].concat());
        assert_eq!(device.app.faults(), 0);
        assert_eq!(device.lines.navigation.sent[21..], frames[30..]);
        assert_eq!(device.counters().missed, 10);
    }
}

/// A wrong bit rate gives bytes without a frame. They are counted and flagged, and they pass.
/// Without a configured format the format is then detected again.
#[test]
fn unknown_format_is_distinguished_from_damage() {
    let noise: Vec<u8> = (0..6000u32)
        .map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect();
    let frames = KVH.stream(0, 20);
    let mut device = Device::new(KVH.config());
    device.feed(&frames.concat());
    let mut damaged = frames[5].clone();
    damaged[20] ^= 1;
    device.feed(&damaged);
    device.feed(&frames[6]);
    let came = [frames.concat(), damaged, frames[6].clone()].concat();
    assert_eq!(
        (device.counters().bad_checksums, device.app.faults()),
        (1, 0)
    );
    device.feed(&noise);
    assert_eq!(device.app.faults(), fault::UNKNOWN_FORMAT);
    assert_eq!(device.app.phase(), Phase::Run(Mode::Bypass));
    let came = [&came[..], &noise].concat();
    assert!(device.lines.navigation.bytes().len() + 40 > came.len());
    device.wait_ms(100);
    assert_eq!(device.lines.navigation.bytes(), came);
    assert!(device.counters().garbage >= 6000);

    let mut device = Device::new(Config {
        format: None,
        ..KVH.config()
    });
    device.feed(&frames.concat());
    assert_eq!(device.app.phase(), Phase::Run(Mode::Bypass));
    device.feed(&noise);
    assert_eq!(device.app.phase(), Phase::Detect);
    // every byte is accounted for, also the beginning of an unfinished frame
    let mut stim = Device::new(Config {
        format: None,
        ..STIM.config()
    });
    let stream = [STIM.stream(0, 20).concat(), noise].concat();
    stim.feed(&stream);
    assert_eq!(stim.app.phase(), Phase::Detect);
    let counters = stim.counters();
    let all = 28 * counters.frames + counters.raw + counters.garbage + counters.bad_checksums;
    assert_eq!((all as usize, counters.others), (stream.len(), 0));
    // another sensor is plugged in
    let other = STIM.stream(0, 30).concat();
    device.feed(&other);
    assert_eq!(device.app.phase(), Phase::Run(Mode::Bypass));
    assert!(device.lines.navigation.bytes().ends_with(&other));
    assert_eq!(device.counters().entered, [2, 2, 0]);
}

/// A full output drops whole frames, counts them, and what leaves is whole frames again.
#[test]
fn full_output_drops_whole_frames() {
    let frames = STIM.stream(0, 100);
    let mut device = Device::new(STIM.config());
    for (n, frame) in frames.iter().enumerate() {
        device.lines.navigation.room = if n % 3 == 0 { 27 } else { 28 };
        device.feed(frame);
    }
    assert_eq!(device.counters().dropped, 34);
    assert_eq!(device.app.faults(), fault::OUTPUT_FULL);
    let expected: Vec<_> = frames
        .iter()
        .enumerate()
        .filter(|(n, _)| n % 3 != 0)
        .map(|(_, f)| f.clone())
        .collect();
    assert_eq!(device.lines.navigation.sent, expected);
}

/// Networks that fail: the last estimate is held, and frames with a spare bit are marked. Then raw
/// pass-through follows, which only a command ends.
#[test]
fn failing_networks_end_in_pass_through() {
    let room = [
        (STIM, None),
        (KVH, Some((28, 0x08))),
        (Kind::RAWIMUSX, Some((12, 0x80))),
        (Kind::HG4930, Some((15, 0x40))),
    ];
    for (kind, mark) in room {
        let mut device = Device::new(Config {
            mode: Mode::Frozen,
            nets: Nets {
                gyro: broken(),
                ..Nets::NONE
            },
            block: 5.0 / kind.rate(),
            ..kind.config()
        });
        let frames = kind.stream(0, 80);
        for frame in &frames {
            device.feed(frame);
        }
        assert_eq!(device.app.phase(), Phase::Fault(Cause::Network));
        let sent = &device.lines.navigation.sent;
        assert_eq!(
            (&sent[..5], &sent[50..]),
            (&frames[..5], &frames[50..]),
            "{kind:?}"
        );
        for (out, frame) in sent[5..50].iter().zip(&frames[5..]) {
            match mark {
                None => assert_eq!(out, frame),
                Some((at, bit)) => {
                    assert_eq!(out[at], frame[at] | bit);
                    assert_eq!(frames_in(kind.format, out).len(), 1);
                }
            }
        }
        assert_eq!(device.app.faults(), fault::PASS_THROUGH | fault::NETWORK);
        device.feed(&[1, 2, 3]); // anything
        assert_eq!(
            device.lines.navigation.sent.last().map(Vec::as_slice),
            Some(&[1, 2, 3][..])
        );
        device.order(&Request::SetMode(Mode::Bypass));
        device.feed(&frames.concat());
        assert_eq!(
            (device.app.phase(), device.counters().entered),
            (Phase::Run(Mode::Bypass), [0, 2, 1])
        );
    }
}

/// Values of unknown units are not corrected: the device passes them through.
#[test]
fn unknown_units_end_in_pass_through() {
    let integrated = stim300_units(STIM.config(), 3, 3);
    let mut device = Device::new(Config {
        mode: Mode::Frozen,
        ..integrated.clone()
    });
    let stream = STIM.stream(0, 30).concat();
    device.feed(&stream);
    assert_eq!(device.app.phase(), Phase::Fault(Cause::Units));
    assert_eq!(device.lines.navigation.bytes(), stream);
    assert_eq!(device.app.faults(), fault::PASS_THROUGH | fault::UNITS);
    // and nothing else, however long it lasts
    for n in 0..100 {
        device.feed(&STIM.stream(n, n + 1).concat());
        device.wait_ms(50);
    }
    assert_eq!(device.app.faults(), fault::PASS_THROUGH | fault::UNITS);
    // in bypass no units need to be known
    let mut device = Device::new(integrated);
    device.feed(&stream);
    assert_eq!(
        (device.app.phase(), device.app.faults()),
        (Phase::Run(Mode::Bypass), 0)
    );
}
