//! Every bit of every frame that is no word and no checksum leaves as it came, whatever it says: status bits, counters, times, temperatures.
//! What the sensor calls invalid is told by the fault flag, and a frame without a valid axis is not corrected.

use crate::device::{Device, nets};
use crate::frames::{Fields, KINDS, Kind, words};
use firmware::app::Config;
use firmware::compensator::Limit;
use firmware::control::Mode;
use firmware::sample::{Axes, RawSample};
use firmware::wire::checksum::{crc32_mpeg2, crc32_mpeg2_padded, crc32_novatel, sum16_le};
use firmware::wire::command::fault;
use firmware::wire::novatel::Log;
use firmware::wire::{Format, read, write};

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
        rest: 0,
    };
    kind.frame(BEFORE, fields)
}

/// A bit that is not in a word or in the checksum is one that no words change.
fn beside_words(kind: Kind, frame: &[u8]) -> Vec<u8> {
    let mut changed = vec![0; frame.len()];
    let checksum = frame.len() - checksum_len(kind);
    changed[checksum..].fill(0xFF);
    for n in 0..64u32 {
        let pattern = n.wrapping_mul(2_654_435_761);
        // words of 16 bits are held within them: half of the patterns are small
        let word = |axis: u32| pattern.rotate_left(5 * axis).cast_signed() >> (n % 2 * 17);
        let words = match read(kind.format(), frame).expect("a frame").words {
            RawSample::Counts { .. } => RawSample::Counts {
                gyro: [0, 1, 2].map(word),
                accel: [3, 4, 5].map(word),
            },
            RawSample::Floats { .. } => RawSample::Floats {
                gyro: [0, 1, 2].map(|axis| f32::from_bits(word(axis).cast_unsigned())),
                accel: [3, 4, 5].map(|axis| f32::from_bits(word(axis).cast_unsigned())),
            },
        };
        let mut other = frame.to_vec();
        write(kind.format(), &mut other, &words).expect("room");
        for (changed, (a, b)) in changed.iter_mut().zip(frame.iter().zip(&other)) {
            *changed |= a ^ b;
        }
    }
    changed.iter().map(|changed| !changed).collect()
}

fn checksum_len(kind: Kind) -> usize {
    if kind.format() == Format::Hg4930 {
        2
    } else {
        4
    }
}

/// The checksum made anew over whatever is there.
fn seal(kind: Kind, frame: &mut [u8]) {
    let (data, sum) = frame.split_at_mut(frame.len() - checksum_len(kind));
    match kind.format() {
        Format::Stim300 => sum.copy_from_slice(&crc32_mpeg2_padded(data).to_be_bytes()),
        Format::Kvh => sum.copy_from_slice(&crc32_mpeg2(data).to_be_bytes()),
        Format::Novatel => sum.copy_from_slice(&crc32_novatel(data).to_le_bytes()),
        Format::Hg4930 => sum.copy_from_slice(&sum16_le(data).to_le_bytes()),
        Format::Ubx => unreachable!("no inertial words"),
    }
}

#[test]
fn every_bit_beside_the_words_leaves_as_it_came() {
    for kind in KINDS {
        let frame = frame(kind);
        let beside = beside_words(kind, &frame);
        let (mut bits, mut corrected, mut invalid) = (0, 0, 0);
        for (byte, bit) in (0..frame.len()).flat_map(|byte| (0..8).map(move |bit| (byte, 1 << bit)))
        {
            let mut came = frame.clone();
            came[byte] ^= bit;
            seal(kind, &mut came);
            let Ok(reading) = read(kind.format(), &came) else {
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
            let after = read(kind.format(), left).expect("a good frame");
            assert_eq!(after.valid, reading.valid, "{what}");
            let bad = reading.present.0 & !reading.valid.0 != 0;
            assert_eq!(device.app.faults() & fault::SENSOR != 0, bad, "{what}");
            let same = words(kind.format(), left) == words(kind.format(), &came);
            assert!(
                same || reading.valid != Axes::NONE,
                "{what}: changed though invalid"
            );
            bits += 1;
            corrected += u32::from(!same);
            invalid += u32::from(bad);
        }
        let what = format!("{kind:?}: {bits} bits, {corrected} corrected, {invalid} invalid");
        let has_status = !matches!(kind, Kind::Novatel(Log::Rawimu | Log::Rawimus));
        assert!(bits > 30 && corrected > bits / 2, "{what}");
        assert_eq!(invalid > 0, has_status, "{what}");
    }
}
