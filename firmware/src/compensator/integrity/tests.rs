//! Flipped bits, one by one and two at a time.

use super::*;
use crate::compensator::{Block, Limit};
use crate::sample::{Lsb, RawSample};
use lrnn_nostd::{Normalisation, Weights};
use std::vec::Vec;

const LIMIT: f32 = 2e-3;
const LSB: Lsb = Lsb {
    rad: 5e-7,
    mps: 5e-7,
};
const PERIOD: f64 = 0.01;
const BLOCK: u16 = 10;

fn compensator() -> Compensator {
    let weights = Weights::from_fn(|index| ((index * 37 + 11) % 129) as f32 / 128.0 - 0.5);
    let net = Net::new(
        weights,
        Normalisation {
            input_offset: [0.01; 3],
            input_scale: [2.0; 3],
            output_scale: [1e-3; 3],
        },
    );
    let limit = Limit {
        gyro: LIMIT,
        accel: LIMIT,
    };
    let mut made = Compensator::new(net, net, LSB, PERIOD, BLOCK, limit).expect("in range");
    let slew = Limit {
        gyro: 1e-3,
        accel: 1e-3,
    };
    made.set_slew(Some(slew));
    made
}

fn sample(number: i32, floats: bool) -> RawSample {
    let value = |k: i32| (number * 37 + k * 11) % 101 - 50;
    if floats {
        RawSample::Floats {
            gyro: [0, 1, 2].map(|k| value(k) as f32 * 1e-6),
            accel: [3, 4, 5].map(|k| value(k) as f32 * 1e-2),
        }
    } else {
        RawSample::Counts {
            gyro: [0, 1, 2].map(value),
            accel: [3, 4, 5].map(value),
        }
    }
}

/// Difference of two samples' values.
fn off(a: &RawSample, b: &RawSample) -> f64 {
    let values = |sample: &RawSample| match sample {
        RawSample::Counts { gyro, accel } => [*gyro, *accel]
            .as_flattened()
            .iter()
            .map(|v| f64::from(*v))
            .collect(),
        RawSample::Floats { gyro, accel } => {
            let all = [*gyro, *accel];
            let all = all.as_flattened().iter();
            all.map(|v| f64::from(*v)).collect::<Vec<_>>()
        }
    };
    let pairs = values(a).into_iter().zip(values(b));
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn step(made: &Compensator, state: &mut State, sample: &RawSample) -> (RawSample, Option<Block>) {
    let (out, _) = made.corrected(state, 0, sample, false);
    (out, made.accumulate(state, sample))
}

/// Any bit of what a sample is corrected by flips in the middle of a block: no value is off by
/// more than the limit, and later the correction is what it would have been.
#[test]
fn any_bit_of_what_is_subtracted() {
    let made = compensator();
    for floats in [false, true] {
        let mut middle = made.power_on(false);
        for number in 0..45 {
            step(&made, &mut middle, &sample(number, floats));
        }
        let bound = f64::from(LIMIT) * PERIOD / LSB.rad + 1.0;
        for bit in 0..(6 * 32 + 6 * 64 + 6 * 32 + 6 * 32) {
            let (mut state, mut other) = (middle.clone(), middle.clone());
            flip(&mut state, bit);
            for number in 45..200 {
                let sample = sample(number, floats);
                let (out, _) = step(&made, &mut state, &sample);
                let (without, _) = step(&made, &mut other, &sample);
                assert!(
                    off(&out, &sample) <= bound,
                    "{floats} {bit}: {out:?} {sample:?}"
                );
                let late = off(&out, &without);
                assert!(number < 100 || late <= 1.0, "{floats} {bit}: {late}");
            }
            assert_eq!(state.estimate(), other.estimate(), "{floats} {bit}");
        }
    }
}

fn flip(state: &mut State, bit: usize) {
    let float = |value: &mut f32, bit: usize| *value = f32::from_bits(value.to_bits() ^ 1 << bit);
    let stream = &mut state.streams[0];
    match bit {
        0..192 => float(&mut state.estimate.as_flattened_mut()[bit / 32], bit % 32),
        192..576 => stream.due.as_flattened_mut()[(bit - 192) / 64] ^= 1 << (bit % 64),
        576..768 => {
            float(
                &mut stream.due_float.as_flattened_mut()[(bit - 576) / 32],
                bit % 32,
            );
        }
        _ => {
            let left = stream.remainder_float.as_flattened_mut();
            float(&mut left[(bit - 768) / 32], bit % 32);
        }
    }
}

/// An upset is mended once, and the next one as well.
#[test]
fn a_second_upset_is_mended_like_the_first() {
    let made = compensator();
    for (floats, bits) in [(false, 0..576), (true, 0..192), (true, 576..960)] {
        for bit in bits {
            let mut state = made.power_on(false);
            let mut other = state.clone();
            for number in 0..600 {
                if number == 145 || number == 345 {
                    flip(&mut state, bit);
                }
                let sample = sample(number, floats);
                let (out, _) = step(&made, &mut state, &sample);
                let (without, _) = step(&made, &mut other, &sample);
                let late = off(&out, &without);
                let calm = !(145..200).contains(&number) && !(345..400).contains(&number);
                assert!(!calm || late <= 1.0, "{floats} {bit} {number}: {late}");
                if [144, 344, 599].contains(&number) {
                    assert_eq!(state.mended, (number as u32) / 200, "{floats} {bit}");
                }
            }
        }
    }
}

/// Two upsets at the same time, of the correction of a sample and of the constants that it is made
/// from: no correction beyond the limit leaves, and the right one comes back.
#[test]
fn two_upsets_at_the_same_time_correct_nothing_wrong() {
    let made = compensator();
    let bound = f64::from(LIMIT) * PERIOD / LSB.rad + 1.0;
    let mut middle = made.power_on(false);
    for number in 0..345 {
        step(&made, &mut middle, &sample(number, false));
    }
    for bit in 0..32 {
        for constant in [false, true] {
            let (mut state, mut other) = (middle.clone(), middle.clone());
            let mut upset = made.clone();
            flip(&mut state, 192 + 20);
            if constant {
                let of = &mut upset.counts_per_error[0][0];
                *of = f32::from_bits(of.to_bits() ^ 1 << bit);
            } else {
                flip(&mut state, bit);
            }
            for number in 345..900 {
                let sample = sample(number, false);
                // a block later the constants are rebuilt
                let with = if number < 349 { &upset } else { &made };
                let (out, _) = step(with, &mut state, &sample);
                step(&made, &mut other, &sample);
                let off = off(&out, &sample);
                assert!(off <= bound, "{constant} {bit} {number}: {off}");
                assert!(number > 345 || off == 0.0, "{constant} {bit}: {off}");
            }
            assert_eq!(state.estimate(), other.estimate(), "{constant} {bit}");
        }
    }
}

/// Where the correction has gone to zero, floats are owed nothing any more: a value with a finer
/// last digit leaves unchanged.
#[test]
fn floats_are_owed_nothing_at_zero_correction() {
    let made = compensator();
    let mut state = made.power_on(false);
    made.force(&mut state, &[[1.2345e-3; 3]; 2]);
    let coarse = RawSample::Floats {
        gyro: [16_384.3; 3],
        accel: [-16_384.3; 3],
    };
    made.corrected(&mut state, 0, &coarse, false);
    let left = state.streams[0].remainder_float;
    assert!(
        left.as_flattened().iter().all(|left| *left != 0.0),
        "{left:?}"
    );
    made.force(&mut state, &[[0.0; 3]; 2]);
    let fine = RawSample::Floats {
        gyro: [1e-7; 3],
        accel: [-1e-9; 3],
    };
    assert_eq!(made.corrected(&mut state, 0, &fine, false).0, fine);
}

/// Any bit of the constants flips: the block does not end, nothing changes, and another
/// compensator ends it as if nothing had been.
#[test]
fn any_bit_of_the_constants() {
    let made = compensator();
    let mut middle = made.power_on(false);
    for number in 0..45 {
        step(&made, &mut middle, &sample(number, false));
    }
    let mut tried = 0;
    let mut with = |change: &dyn Fn(&mut Compensator)| {
        let mut upset = made.clone();
        change(&mut upset);
        assert!(made.is_intact() && !upset.is_intact());
        let (mut state, mut other) = (middle.clone(), middle.clone());
        for number in 45..50 {
            let sample = sample(number, false);
            let (out, block) = step(&upset, &mut state, &sample);
            let (without, ended) = step(&made, &mut other, &sample);
            assert_eq!(out, without);
            assert_eq!((block.is_some(), state.corrupted), (false, number == 49));
            if state.corrupted {
                assert_eq!(made.end_in_place(&mut state, &sample), ended);
            }
        }
        assert_eq!(state.estimate(), other.estimate());
        tried += 1;
    };
    for bit in 0..32 {
        let flip = |value: &mut f32| *value = f32::from_bits(value.to_bits() ^ 1 << bit);
        for weight in 0..63 {
            let nth = |net: &mut Net| {
                net.weights
                    .iter_mut()
                    .nth(weight)
                    .into_iter()
                    .for_each(flip)
            };
            with(&|upset| nth(&mut upset.gyro));
            with(&|upset| nth(&mut upset.accel));
        }
        for k in 0..3 {
            with(&|upset| flip(&mut upset.gyro.normalisation.output_scale[k]));
            with(&|upset| flip(&mut upset.accel.normalisation.input_offset[k]));
            with(&|upset| flip(&mut upset.gyro.normalisation.input_scale[k]));
        }
        with(&|upset| flip(&mut upset.limit.gyro));
        with(&|upset| flip(&mut upset.limit.accel));
        with(&|upset| upset.slew.iter_mut().for_each(|slew| flip(&mut slew.gyro)));
        with(&|upset| flip(&mut upset.block_s));
        with(&|upset| flip(&mut upset.input_per_count[1]));
        with(&|upset| flip(&mut upset.counts_per_error[3][0]));
        with(&|upset| upset.streams ^= 1 << (bit % 4));
        with(&|upset| {
            upset.scale.period_s = f64::from_bits(upset.scale.period_s.to_bits() ^ 1 << bit);
        });
    }
    assert_eq!(tried, 32 * (2 * 63 + 9 + 8));
}
