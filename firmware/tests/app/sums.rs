//! The corrections arrive: over 10^5 samples their sum is right to one count, or to the last
//! float's rounding.

use crate::device::{Device, nets};
use crate::frames::{Fields, Kind, kinds, values};
use firmware::app::Config;
use firmware::compensator::Limit;
use firmware::control::Mode;
use firmware::wire::ImuFormat;

const SAMPLES: u32 = 100_000;
// 0.01 and -0.33 deg/h; 30 and -220 ug
const ERROR: [f32; 6] = [4.848e-8, -1.6e-6, 0.0, 3.0e-4, 0.0, -2.2e-3];

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
    let (mut sum, mut largest, mut is_float) = ([0.0f64; 6], [0.0f64; 6], false);
    // the first frame shows the units; the correction begins with the second
    for n in 0..SAMPLES {
        let fields = Fields {
            gyro: [5, -3, n as i32 % 7],
            accel: [1, 1, 1000],
            rest: n,
            ..Fields::default()
        };
        let frame = kind.frame(n, fields);
        device.feed(&frame);
        let sent = device.lines.navigation.sent.pop().expect("a frame");
        assert_eq!(sent.len(), frame.len());
        let (before, after) = (values(kind.format, &frame), values(kind.format, &sent));
        for (s, (b, a)) in sum.iter_mut().zip(before.iter().zip(after)) {
            *s += b - a;
        }
        for (largest, after) in largest.iter_mut().zip(after) {
            *largest = largest.max(after.abs());
        }
        is_float |= before.iter().any(|value| value.fract() != 0.0);
    }
    // by the documents of the formats and not by the code under test
    let unit = kind.sensor.unit;
    for axis in 0..6 {
        if axis >= 3 && !kind.sensor.has_accel {
            assert!(sum[axis] == 0.0);
            continue;
        }
        let exact = f64::from(SAMPLES) * f64::from(ERROR[axis]) / kind.rate() / unit[axis / 3];
        // the last remainder, and the seven digits of the correction itself
        let rounding = if is_float {
            1.01 * largest[axis] * f64::from(f32::EPSILON) / 2.0 // half an ulp of the largest value
        } else {
            0.5 + 1e-9
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
fn of_every_kind() {
    std::thread::scope(|scope| {
        for kind in kinds() {
            scope.spawn(move || check(kind));
        }
    });
}

/// A network's output for one axis changes that axis only, with its sign: x, y, z of the sensor,
/// wherever they stand on the wire.
#[test]
fn axes_and_signs() {
    for kind in kinds() {
        for axis in 0..if kind.sensor.has_accel { 6 } else { 3 } {
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
                values(kind.format, &frame(last)),
                values(kind.format, &sent),
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
            // all other bytes than the value of this axis and the checksum are unchanged
            let same = sent
                .iter()
                .zip(frame(last))
                .filter(|(a, b)| **a != *b)
                .count();
            // an ADIS burst has a checksum of its own inside its frame
            let inner = if kind.format == ImuFormat::AdisUart {
                4
            } else {
                0
            };
            assert!(same <= 4 + 4 + inner, "{kind:?}");
        }
    }
}

/// `NovAtel`'s wire order z, -y, x: an error of +y makes the word on the wire greater.
#[test]
fn novatel_wire_order() {
    let kind = Kind::RAWIMUSX;
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

/// Values at the end of their field saturate and are counted, never wrapped: at both ends, on every
/// axis, of every width.
#[test]
fn ends_of_fields_hold() {
    for kind in kinds() {
        let bits = kind.sensor.bits;
        let ends = [
            (-1.0, i32::MAX >> (32 - bits)),
            (1.0, i32::MIN >> (32 - bits)),
        ];
        for (sign, end) in ends {
            let [gyro, accel] = [0.3, 30.0].map(|error| [sign * error; 3]);
            let mut device = Device::new(Config {
                mode: Mode::Frozen,
                nets: nets(gyro, accel),
                block: 0.05,
                limit: Limit {
                    gyro: 1.0,
                    accel: 100.0,
                },
                ..kind.config()
            });
            // the other axes change, so that the sensor does not seem stuck
            let fields = |n: u32, axis: usize| {
                let mut values = [n as i32 % 3; 6];
                values[axis] = end;
                let [a, b, c, d, e, f] = values;
                Fields {
                    gyro: [a, b, c],
                    accel: [d, e, f],
                    ..Fields::default()
                }
            };
            for axis in 0..if kind.sensor.has_accel { 6 } else { 3 } {
                let before = device.counters().saturated;
                let mut n = 300 * axis as u32;
                let mut sent = Vec::new();
                for _ in 0..300 {
                    device.feed(&kind.frame(n, fields(n, axis)));
                    sent = device.lines.navigation.sent.pop().expect("a frame");
                    n += 1;
                }
                let frame = kind.frame(n - 1, fields(n - 1, axis));
                let came = values(kind.format, &frame)[axis];
                let left = values(kind.format, &sent)[axis];
                if came.fract() != 0.0 || bits == 32 && came != f64::from(end) {
                    continue; // floats have no end here
                }
                assert_eq!(left, came, "{kind:?} {axis} {end}");
                let counted = device.counters().saturated - before;
                assert!(counted > 100, "{kind:?} {axis} {end}: {counted}");
                let saturated = firmware::wire::command::fault::SATURATED;
                assert_ne!(device.app.faults() & saturated, 0);
            }
        }
    }
}
