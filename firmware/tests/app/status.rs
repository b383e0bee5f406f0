//! Every bit of a frame that belongs neither to the sample nor to the checksum leaves unchanged:
//! status bits, counters, times, temperatures. Axes that the sensor marks invalid set the fault
//! flag, and a frame without a valid axis is not corrected.

use crate::device::{Device, nets};
use crate::frames::{Fields, Kind, kinds, values};
use firmware::app::Config;
use firmware::compensator::Limit;
use firmware::control::Mode;
use firmware::sample::{Axes, RawSample};
use firmware::wire::command::fault;
use firmware::wire::{Change, Checked, Error, Reading, Settings};

/// Frames before the one that is looked at: some blocks, so that there is a correction.
const BEFORE: u32 = 200;

fn device(kind: Kind) -> Device {
    let mut device = Device::new(Config {
        mode: Mode::Frozen,
        block: 0.02,
        limit: Limit {
            gyro: 10.0,
            accel: 10.0,
        },
        nets: nets([0.5, -0.5, 0.5], [5.0, -5.0, 5.0]),
        ..kind.config()
    });
    device.feed(&kind.stream(0, BEFORE).concat());
    device.lines.navigation.sent.clear();
    device
}

fn frame(kind: Kind) -> Vec<u8> {
    let fields = Fields {
        gyro: [100, -200, 300],
        accel: [-400, 500, 600],
        ..Fields::default()
    };
    kind.frame(BEFORE, fields)
}

fn read(kind: Kind, frame: &[u8]) -> Result<Reading, Error> {
    Checked::new(kind.format, &mut frame.to_vec())?.read()
}

/// A bit belongs neither to the sample nor to the checksum when no sample changes it.
fn beside_words(kind: Kind, frame: &[u8]) -> Vec<u8> {
    let mut changed = vec![0; frame.len()];
    // the checksum is restored by sealing
    for at in 0..frame.len() {
        let mut other = frame.to_vec();
        other[at] ^= 0xFF;
        kind.format.seal(&mut other);
        if other == frame {
            changed[at] = 0xFF;
        }
    }
    for n in 0..64u32 {
        let pattern = n.wrapping_mul(2_654_435_761);
        // values of 16 bits saturate: half of the patterns are small
        let value = |axis: u32| pattern.rotate_left(5 * axis).cast_signed() >> (n % 2 * 17);
        let sample = match read(kind, frame).expect("a frame").sample {
            RawSample::Counts { .. } => RawSample::Counts {
                gyro: [0, 1, 2].map(value),
                accel: [3, 4, 5].map(value),
            },
            RawSample::Floats { .. } => RawSample::Floats {
                gyro: [0, 1, 2].map(|axis| f32::from_bits(value(axis).cast_unsigned())),
                accel: [3, 4, 5].map(|axis| f32::from_bits(value(axis).cast_unsigned())),
            },
        };
        let mut other = frame.to_vec();
        let mut checked = Checked::new(kind.format, &mut other).expect("a frame");
        let change = Change {
            sample: &sample,
            mark: false,
            settings: &Settings::DEFAULT,
        };
        checked.change(&change).expect("room");
        for (changed, (a, b)) in changed.iter_mut().zip(frame.iter().zip(&other)) {
            *changed |= a ^ b;
        }
    }
    changed.iter().map(|changed| !changed).collect()
}

#[test]
fn every_bit_beside_the_words_leaves_as_it_came() {
    for kind in kinds() {
        let frame = frame(kind);
        let beside = beside_words(kind, &frame);
        let (mut bits, mut corrected, mut invalid) = (0, 0, 0);
        for (byte, bit) in (0..frame.len()).flat_map(|byte| (0..8).map(move |bit| (byte, 1 << bit)))
        {
            let mut came = frame.clone();
            came[byte] ^= bit;
            kind.format.seal(&mut came);
            let Ok(reading) = read(kind, &came) else {
                continue; // the start, the length or the identifier: no such frame any more
            };
            if beside[byte] & bit == 0 {
                continue;
            }
            let what = format!("{kind:?}, byte {byte}, bit {bit:#04x}");
            let mut device = device(kind);
            device.feed(&came);
            let [left] = &device.lines.navigation.sent[..] else {
                panic!("{what}: {} messages", device.lines.navigation.sent.len());
            };
            assert_eq!(left.len(), came.len(), "{what}");
            for (at, (came, left)) in came.iter().zip(left).enumerate() {
                assert_eq!(came & beside[at], left & beside[at], "{what}: byte {at}");
            }
            let after = read(kind, left).expect("a good frame");
            assert_eq!(after.valid, reading.valid, "{what}");
            let bad = reading.present.0 & !reading.valid.0 != 0;
            assert_eq!(device.app.faults() & fault::SENSOR != 0, bad, "{what}");
            let same = values(kind.format, left) == values(kind.format, &came);
            assert!(
                same || reading.valid != Axes::NONE,
                "{what}: changed though invalid"
            );
            bits += 1;
            corrected += u32::from(!same);
            invalid += u32::from(bad);
        }
        let what = format!("{kind:?}: {bits} bits, {corrected} corrected, {invalid} invalid");
        let has_status = kind.sensor.has_status;
        assert!(bits > 30 && corrected > bits / 2, "{what}");
        assert_eq!(invalid > 0, has_status, "{what}");
    }
}
