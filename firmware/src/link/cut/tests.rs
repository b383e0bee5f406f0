//! Output with cut-through, compared with the output without.

use super::*;
use crate::compensator::{Compensator, Limit, State};
use crate::wire::cut::{in_order, owed_in_order};
use crate::wire::{Change, Checked, Fields, Framing, ImuFormat, Scan, Settings, Simulated};
use lrnn_nostd::{Net, Normalisation, Weights};
use proptest::prelude::*;
use std::vec::Vec;

const CAN: [ImuFormat; 3] = [ImuFormat::Stim300, ImuFormat::Kvh, ImuFormat::Novatel];

fn sensors() -> Vec<(ImuFormat, &'static Simulated)> {
    let of = |format: ImuFormat| format.simulated().iter().map(move |s| (format, s));
    CAN.into_iter().flat_map(of).collect()
}

/// Counts of a correction a sample, of six values.
fn correction(sensor: &Simulated, counts: [f32; 6]) -> (Compensator, State) {
    let net = |error: [f32; 3]| {
        let mut weights = Weights::zero();
        weights.layers[2].b = error;
        let one = Normalisation {
            input_offset: [0.0; 3],
            input_scale: [1.0; 3],
            output_scale: [1.0; 3],
        };
        Net::new(weights, one)
    };
    let period = 1.0 / f64::from(sensor.rate);
    let lsb = crate::sample::Lsb {
        rad: sensor.unit[0],
        mps: sensor.unit[1],
    };
    let rate = lsb.rad / period;
    let force = lsb.mps / period;
    let [a, b, c, d, e, f] = counts;
    let gyro = [a, b, c].map(|n| (f64::from(n) * rate) as f32);
    let accel = [d, e, f].map(|n| (f64::from(n) * force) as f32);
    let limit = Limit {
        gyro: f32::MAX,
        accel: f32::MAX,
    };
    let made = Compensator::new(net(gyro), net(accel), lsb, period, 60_000, limit).unwrap();
    let state = made.power_on(false);
    (made, state)
}

fn made(sensor: &Simulated, index: u32, [a, b, c, d, e, f]: [i32; 6], rest: u32) -> Vec<u8> {
    let fields = Fields {
        index,
        time: f64::from(index) / f64::from(sensor.rate),
        gyro: [a, b, c],
        accel: [d, e, f],
        rest,
    };
    let mut buffer = [0; 256];
    let len = (sensor.emit)(&fields, &mut buffer).unwrap();
    buffer[..len].to_vec()
}

/// Output without cut-through.
fn whole(
    format: ImuFormat,
    (compensator, state): &mut (Compensator, State),
    frame: &[u8],
    mark: bool,
    settings: &Settings,
) -> Vec<u8> {
    let mut frame = frame.to_vec();
    let mut checked = Checked::new(format, &mut frame).unwrap();
    let came = checked.read().unwrap().sample;
    let (sample, _) = compensator.corrected(state, 0, &came, true);
    let change = Change {
        sample: &sample,
        mark,
        settings,
    };
    checked.change(&change).unwrap();
    frame
}

/// Cuts from the first byte on.
fn armed(format: ImuFormat, frame: &[u8], state: &State, mark: bool, settings: &Settings) -> Cut {
    let plan = format.plan(frame, mark, settings).unwrap();
    let mut cut = Cut::new();
    let owed = state.owed(0, plan.word == Word::F32);
    cut.arm(&plan, owed_in_order(plan.word, Some(owed)), 0);
    cut
}

/// Output for a stream.
fn through(cut: &mut Cut, from: u32, bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    for (n, byte) in (from..).zip(bytes) {
        let leaving = cut.came(n, *byte, 256);
        leaving.each(|byte| out.push(byte));
    }
    out
}

fn value() -> impl Strategy<Value = i32> {
    let ends = [i32::MIN, i32::MAX, 0x007F_FFFF, -0x0080_0000, 0];
    prop_oneof![4 => any::<i32>(), 2 => -2000..2000, 1 => prop::sample::select(ends.to_vec())]
}

fn counts() -> impl Strategy<Value = f32> {
    prop_oneof![2 => -0.4f32..0.4, 2 => -3e3f32..3e3, 1 => Just(0.0), 1 => -1e9f32..1e9]
}

/// Whether a frame differs from what leaves without in values at the end of their range only, by at
/// most 255 counts, and in the checksum. Only where the lowest byte of a value comes first.
fn is_near(plan: &Plan, came: &[u8], left: &[u8], expected: &[u8]) -> bool {
    if plan.word != Word::I32 {
        return false;
    }
    let (mut left, end) = (left.to_vec(), expected.len() - 4);
    for at in plan.at.map(usize::from) {
        let of = |frame: &[u8]| i32::from_le_bytes(frame[at..at + 4].try_into().unwrap());
        let (cut, whole) = (of(&left), of(expected));
        let ends = [i32::MIN, i32::MIN + 1, i32::MAX];
        // where the smallest number is negated without, it becomes the greatest
        let smallest = of(came) == i32::MIN && cut.abs_diff(whole) == 1;
        if smallest || ends.contains(&whole) && cut.abs_diff(whole) <= 255 {
            left[at..at + 4].copy_from_slice(&whole.to_le_bytes());
        }
    }
    left[..end] == expected[..end]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    /// Bit for bit, for every sensor of the formats, whatever its values and the correction, but
    /// for the lowest byte of a value that saturates where that byte comes first.
    #[test]
    fn what_leaves_is_what_leaves_without(
        which in any::<prop::sample::Index>(),
        frames in prop::collection::vec((prop::array::uniform6(value()), any::<u32>()), 1..40),
        counts in prop::array::uniform6(counts()),
        mark in any::<bool>(),
        family in prop::sample::select(std::vec![
            None,
            Some(crate::wire::stim300::Extra::Aux),
            Some(crate::wire::stim300::Extra::Pps),
            Some(crate::wire::stim300::Extra::None),
        ]),
    ) {
        let sensors = sensors();
        let (format, sensor) = sensors[which.index(sensors.len())];
        let mut settings = sensor.settings();
        settings.stim300.family = family;
        let mut correction = correction(sensor, counts);
        let stream: Vec<_> = (0..)
            .zip(&frames)
            .map(|(n, (values, rest))| made(sensor, n, *values, *rest))
            .collect();
        let mut cut = armed(format, &stream[0], &correction.1, mark, &settings);
        let out = through(&mut cut, 0, &stream.concat());
        let expected: Vec<_> = stream
            .iter()
            .flat_map(|frame| whole(format, &mut correction, frame, mark, &settings))
            .collect();
        let ends = expected.len() as u32;
        prop_assert_eq!(out.len(), expected.len());
        let mut at = 0;
        for (frame, came) in expected.chunks(cut.plan.len.into()).zip(&stream) {
            let left = &out[at..at + frame.len()];
            let near = left == frame || is_near(&cut.plan, came, left, frame);
            prop_assert!(near, "{left:?} {frame:?}");
            prop_assert!(format.scan(left) == format.scan(frame));
            at += frame.len();
        }
        prop_assert_eq!(at as u32, ends);
        prop_assert!(cut.is_on());
        // and the carried remainders are the same
        let word = cut.plan.word;
        let owed = correction.1.owed(0, word == Word::F32).map(|owed| owed.left);
        let end = stream.concat().len() as u32;
        let plan = cut.plan;
        let due = cut.due.map(|due| Owed { due, left: 0 });
        let left = cut.renew(&plan, due, end).unwrap();
        let six = in_order(word, left);
        let has = if sensor.has_accel { 6 } else { 3 };
        prop_assert_eq!(&six[..has], &owed[..has]);
    }

    /// A frame that came damaged leaves damaged, and what follows is the loop's.
    #[test]
    fn damage_stays(
        which in any::<prop::sample::Index>(),
        values in prop::array::uniform6(value()),
        counts in prop::array::uniform6(counts()),
        flips in prop::collection::vec((any::<prop::sample::Index>(), 1..=255u8), 1..6),
    ) {
        let sensors = sensors();
        let (format, sensor) = sensors[which.index(sensors.len())];
        let settings = sensor.settings();
        let correction = correction(sensor, counts);
        let good = made(sensor, 0, values, 7);
        let mut bad = good.clone();
        for (at, bits) in flips {
            let at = at.index(bad.len());
            bad[at] ^= bits;
        }
        prop_assume!(!matches!(format.scan(&bad), Scan::Frame(_) | Scan::Other(_)));
        let mut cut = armed(format, &good, &correction.1, true, &settings);
        let mut out = through(&mut cut, 0, &bad);
        prop_assert!(!cut.is_on());
        let gone = cut.claim(0, bad.len() as u32) as usize;
        prop_assert_eq!(gone, out.len());
        out.extend_from_slice(&bad[gone..]);
        prop_assert!(!matches!(format.scan(&out), Scan::Frame(_) | Scan::Other(_)));
        let six = cut.carried;
        let word = cut.plan.word;
        let owed = owed_in_order(word, Some(correction.1.owed(0, word == Word::F32)));
        prop_assert_eq!(six, owed.map(|owed| owed.left));
    }
}

/// A byte leaves with the second that comes behind it, and the last ones with the frame's end:
/// the line spaces them.
#[test]
fn every_byte_waits_for_as_many() {
    for (format, sensor) in sensors() {
        let settings = sensor.settings();
        let correction = correction(sensor, [0.3; 6]);
        let frame = made(sensor, 0, [5; 6], 7);
        let mut cut = armed(format, &frame, &correction.1, false, &settings);
        for (n, byte) in frame.iter().enumerate() {
            let expected = match n {
                n if n + 1 == frame.len() => 3,
                n if n < 2 => 0,
                _ => 1,
            };
            assert_eq!(cut.came(n as u32, *byte, 256).len(), expected, "{n}");
        }
    }
}

/// Without room for a whole frame, behind a byte that is missing, and behind another kind of frame
/// nothing is cut, and all that has not left is the loop's.
#[test]
fn what_is_not_as_planned_is_the_loops() {
    let (format, sensor) = sensors()[0];
    let settings = sensor.settings();
    let correction = correction(sensor, [0.3; 6]);
    let frame = made(sensor, 0, [5; 6], 7);
    let begin = || armed(format, &frame, &correction.1, false, &settings);
    let mut cut = begin();
    assert!(cut.came(0, frame[0], frame.len() - 1).is_empty() && !cut.is_on());
    let mut cut = begin();
    assert!(cut.came(1, frame[0], 256).is_empty() && !cut.is_on());
    let mut cut = begin();
    assert!(cut.came(0, 0x90, 256).is_empty() && !cut.is_on());
    let mut cut = begin();
    let out = through(&mut cut, 0, &frame[..10]);
    assert!(cut.is_within() && !cut.stop());
    assert_eq!(cut.claim(0, frame.len() as u32), out.len() as u32);
    assert!(!cut.is_on() && out.len() == 8);
    assert_eq!(cut.claim(frame.len() as u32, 4), 0);
    let mut cut = begin();
    cut.due[2] ^= 1 << 17;
    assert!(cut.came(0, frame[0], 256).is_empty() && !cut.is_on());
}

/// A value that saturates leaves with its own lowest byte and the rest of the greatest or smallest
/// number.
#[test]
fn a_value_with_its_lowest_byte_first_saturates_but_for_that() {
    let sensors = sensors();
    let (format, sensor) = *sensors
        .iter()
        .find(|(format, _)| *format == ImuFormat::Novatel)
        .unwrap();
    let settings = sensor.settings();
    let correction = correction(sensor, [-5.0, -5.0, 5.0, 0.0, 0.0, 0.0]);
    let gyro = [i32::MAX - 1, i32::MAX - 1, i32::MIN + 1];
    let frame = made(sensor, 0, [gyro[0], gyro[1], gyro[2], 0, 0, 0], 7);
    let mut cut = armed(format, &frame, &correction.1, false, &settings);
    let at = cut.plan.at;
    let out = through(&mut cut, 0, &frame);
    let [x, y, z] = [at[5], at[4], at[3]].map(|at| {
        let bytes = &out[usize::from(at)..][..4];
        i32::from_le_bytes(bytes.try_into().unwrap())
    });
    // x + 5 and z - 5 leave the range; y comes negated
    assert_eq!((x, y, z), (0x7FFF_FF03, -0x7FFF_FF03, -0x7FFF_FF04));
    assert!(matches!(format.scan(&out), Scan::Frame(_)));
}

/// The tables are those of the library's checksums.
#[test]
fn the_crcs_are_the_formats() {
    let text = b"123456789";
    let of = |crc: Crc| {
        text.iter()
            .fold(crc.start(), |sum, byte| crc.next(sum, *byte))
    };
    assert_eq!(of(Crc::Mpeg2), crate::wire::checksum::crc32_mpeg2(text));
    assert_eq!(of(Crc::Novatel), crate::wire::checksum::crc32_novatel(text));
}
