//! The corrections arrive: over 10^5 words their sum is right to one count, or to the last float's rounding.

use crate::device::{Device, nets};
use crate::frames::{Fields, KINDS, Kind, words};
use firmware::app::Config;
use firmware::compensator::Limit;
use firmware::control::Mode;
use firmware::units::{DEGREE, FOOT, G};
use firmware::wire::novatel;

const WORDS: u32 = 100_000;
const ERROR: [f32; 6] = [4.848e-8, -1.6e-6, 0.0, 3.0e-4, 0.0, -2.2e-3]; // 0.01 and -0.33 deg/h; 30 and -220 ug

/// What one count (or 1.0) is worth as a correction a word, by the formats' own documents and not by the code under test.
fn per_word(kind: Kind) -> [f64; 2] {
    let two = |power: i32| 2f64.powi(power);
    let period = 1.0 / kind.rate();
    match kind {
        Kind::Stim300(_, gyro, accel) => [
            if gyro == 1 {
                two(-21) * DEGREE
            } else {
                two(-14) * DEGREE * period
            },
            if accel == 1 {
                two(-22)
            } else {
                two(-19) * G * period
            },
        ],
        Kind::Kvh(_, delta) => [if delta { 1.0 } else { period }, G * period],
        Kind::Novatel(_) => [two(-33), two(-27) * FOOT],
        Kind::Hg4930 => [two(-33), two(-27) * FOOT],
        Kind::SClass => [
            499.0 * DEGREE / 32_768.0 * period,
            21.0 * 9.805_989_024 / 32_768.0 * period,
        ],
    }
}

fn has_accel(kind: Kind) -> bool {
    !matches!(kind, Kind::Stim300(0x90, ..))
}

fn check(kind: Kind) {
    let [gx, gy, gz, ax, ay, az] = ERROR;
    let mut device = Device::new(Config {
        mode: Mode::Frozen,
        nets: nets([gx, gy, gz], [ax, ay, az]),
        block: 0.1,
        limit: Limit {
            gyro: 1.0,
            accel: 1.0,
        },
        ..kind.config()
    });
    let mut sum = [0.0f64; 6];
    // the first frame tells what the words mean; the correction begins with the second
    for n in 0..WORDS + 1 {
        let fields = Fields {
            gyro: [5, -3, n as i32 % 7],
            accel: [1, 1, 1000],
            rest: n,
        };
        let frame = kind.frame(n, fields);
        device.feed(&frame);
        let sent = device.lines.navigation.sent.pop().expect("a frame");
        assert_eq!(sent.len(), frame.len());
        let (before, after) = (words(kind.format(), &frame), words(kind.format(), &sent));
        for (s, (b, a)) in sum.iter_mut().zip(before.iter().zip(after)) {
            *s += b - a;
        }
    }
    let lsb = per_word(kind);
    for axis in 0..6 {
        if axis >= 3 && !has_accel(kind) {
            assert!(sum[axis] == 0.0);
            continue;
        }
        let exact = f64::from(WORDS) * f64::from(ERROR[axis]) / kind.rate() / lsb[axis / 3];
        // the last remainder, and the seven digits of the correction itself
        let rounding = match kind {
            Kind::Kvh(..) => 1e-10, // an ulp of the largest word
            _ => 0.5 + 1e-9,
        };
        let off = (sum[axis] - exact).abs();
        assert!(
            off <= rounding + exact.abs() * 3e-7,
            "{kind:?} axis {axis}: {} {exact}",
            sum[axis]
        );
    }
    assert!(device.counters().missed == 0 && device.app.faults() == 0);
}

#[test]
fn stim300() {
    KINDS
        .into_iter()
        .filter(|kind| matches!(kind, Kind::Stim300(..)))
        .for_each(check);
}

#[test]
fn kvh() {
    KINDS
        .into_iter()
        .filter(|kind| matches!(kind, Kind::Kvh(..)))
        .for_each(check);
}

#[test]
fn novatel() {
    KINDS
        .into_iter()
        .filter(|kind| matches!(kind, Kind::Novatel(_)))
        .for_each(check);
}

#[test]
fn hg4930() {
    [Kind::Hg4930, Kind::SClass].into_iter().for_each(check);
}

/// An error said for one axis changes that axis only, with its sign: x, y, z of the sensor, wherever they stand on the wire.
#[test]
fn axes_and_signs() {
    for kind in KINDS {
        for axis in 0..if has_accel(kind) { 6 } else { 3 } {
            let mut error = [0.0; 6];
            error[axis] = if axis < 3 { 0.5 } else { 40.0 };
            let [gx, gy, gz, ax, ay, az] = error;
            let mut device = Device::new(Config {
                mode: Mode::Frozen,
                nets: nets([gx, gy, gz], [ax, ay, az]),
                block: 0.01,
                limit: Limit {
                    gyro: 10.0,
                    accel: 100.0,
                },
                ..kind.config()
            });
            let frame = |n| kind.frame(n, Fields::default());
            let last = 200;
            (0..=last).for_each(|n| device.feed(&frame(n)));
            let sent = device.lines.navigation.sent.pop().expect("a frame");
            let (before, after) = (
                words(kind.format(), &frame(last)),
                words(kind.format(), &sent),
            );
            for other in 0..6 {
                let change = after[other] - before[other];
                assert_eq!(
                    change < 0.0,
                    other == axis,
                    "{kind:?} {axis} {other} {change}"
                );
                assert!(change <= 0.0);
            }
            // everything but the words of this axis and the checksum is as it came
            let same = sent
                .iter()
                .zip(frame(last))
                .filter(|(a, b)| **a != *b)
                .count();
            assert!(same <= 4 + 4, "{kind:?}");
        }
    }
}

/// `NovAtel`'s wire order z, -y, x: an error of +y makes the word on the wire greater.
#[test]
fn novatel_wire_order() {
    let kind = Kind::Novatel(novatel::Log::Rawimusx);
    let mut device = Device::new(Config {
        mode: Mode::Frozen,
        nets: nets([0.0, 1e-6, 0.0], [0.0; 3]),
        block: 0.01,
        ..kind.config()
    });
    for n in 0..10 {
        device.feed(&kind.frame(n, Fields::default()));
    }
    let sent = device.lines.navigation.sent.pop().expect("a frame");
    let word = |at: usize| i32::from_le_bytes(sent[12 + at..12 + at + 4].try_into().expect("4"));
    // 1e-6 rad/s x 0.01 s x 2^33 = 85.9 counts
    assert!((85..=86).contains(&word(32)), "{}", word(32));
    assert_eq!(
        (word(28), word(36), word(16), word(20), word(24)),
        (0, 0, 0, 0, 0)
    );
}

/// Words at the end of their field are held there and counted, never wrapped.
#[test]
fn ends_of_fields_hold() {
    for (kind, end) in [
        (Kind::Stim300(0x91, 1, 1), 0x007F_FFFF),
        (Kind::SClass, 0x7FFF),
    ] {
        let mut device = Device::new(Config {
            mode: Mode::Frozen,
            nets: nets([-0.3, 0.0, 0.0], [0.0; 3]),
            block: 0.01,
            limit: Limit {
                gyro: 1.0,
                accel: 1.0,
            },
            ..kind.config()
        });
        let fields = Fields {
            gyro: [end, 0, 0],
            ..Fields::default()
        };
        (0..100).for_each(|n| device.feed(&kind.frame(n, fields)));
        let sent = device.lines.navigation.sent.pop().expect("a frame");
        assert!(words(kind.format(), &sent)[0] == f64::from(end));
        assert!(device.counters().saturated > 50);
        assert_ne!(
            device.app.faults() & firmware::wire::command::fault::SATURATED,
            0
        );
    }
}
