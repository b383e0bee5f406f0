use super::super::{Limit, State};
use super::*;
use crate::model::Nets;
use crate::sample::{Counts, Lsb};
use std::vec::Vec;

const LSB: Lsb = Lsb {
    rad: 1e-7,
    mps: 1e-5,
};
const PERIOD_S: f64 = 0.01;
const LIMIT: Limit = Limit {
    gyro: 1e-3,
    accel: 0.1,
};
const MAPS: Maps<f32> = [
    [[4e-3, -1e-3, 2e-3], [5e-4, -3e-3, 0.0], [0.0, 1e-3, 2e-3]],
    [[-2e-3, 3e-4, 0.0], [1e-3, 1e-3, -4e-3], [0.0, 0.0, 5e-3]],
];

fn with(maps: Maps<f32>, map_limit: f32, slew: Option<Limit>) -> Compensator {
    let mut made = Compensator::BLANK;
    let nets = Nets { maps, ..Nets::NONE };
    let sum = super::super::of_nets(&nets);
    let timing = (LSB, PERIOD_S, 100);
    made.renew((&nets, sum), timing, (LIMIT, [map_limit; 2]), (None, slew))
        .unwrap();
    made
}

/// Counts that look random, up to 10 000 of either sign, with a mean.
fn samples(n: usize) -> Vec<Counts> {
    let mut state = 7u64;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as i32 % 10_000 + 3_000
    };
    (0..n)
        .map(|_| Counts {
            dtheta: [(); 3].map(|()| next()),
            dv: [(); 3].map(|()| -next()),
        })
        .collect()
}

type Triads = [[f64; 3]; 2];

/// A value that the sensor calls invalid, however large, adds to no other axis: what is owed next
/// is as if it were 0.
#[test]
fn an_invalid_axis_adds_nothing() {
    let compensator = with(MAPS, 0.01, None);
    let owed = |sample: &RawSample, valid: Axes| {
        let mut state = compensator.power_on(false);
        compensator.anticipate(&mut state, 0, sample, valid);
        let floats = matches!(sample, RawSample::Floats { .. });
        state.owed(0, floats).map(|owed| owed.due)
    };
    let counts = |y| RawSample::Counts {
        gyro: [500, y, -300],
        accel: [70, 900, 1000],
    };
    let floats = |y: f32| RawSample::Floats {
        gyro: [500.0, y, -300.0],
        accel: [70.0, 900.0, 1000.0],
    };
    let but_y = Axes::new(0b101, 0b111);
    for (bad, zero) in [
        (counts(-(1 << 23)), counts(0)),
        (floats(1e10), floats(0.0)),
        (floats(f32::NAN), floats(0.0)),
    ] {
        assert_eq!(owed(&bad, but_y), owed(&zero, Axes::ALL), "{bad:?}");
        assert_ne!(owed(&bad, Axes::ALL), owed(&zero, Axes::ALL), "{bad:?}");
    }
}

/// The sum of what is taken off, from samples before and after, is the map of the sum of all
/// samples but the last.
fn add_up(all: &[(Triads, Triads)], tolerance: f64) {
    let (_, mapped) = all.split_last().unwrap();
    for (k, map) in MAPS.iter().enumerate() {
        for (i, row) in map.iter().enumerate() {
            let off: f64 = all.iter().map(|(from, to)| from[k][i] - to[k][i]).sum();
            let felt = |j: usize| -> f64 { mapped.iter().map(|(from, _)| from[k][j]).sum() };
            let right: f64 = (0..3).map(|j| f64::from(row[j]) * felt(j)).sum();
            assert!((off - right).abs() < tolerance, "{k} {i}: {off} {right}");
            assert!(right == 0.0 || right.abs() > 1000.0 * tolerance);
        }
    }
}

fn flat(counts: &Counts) -> [[i32; 3]; 2] {
    [counts.dtheta, counts.dv]
}

fn wide<T: Into<f64>>(triads: [[T; 3]; 2]) -> Triads {
    triads.map(|triad| triad.map(Into::into))
}

/// To half a count and the rounding of the elements.
#[test]
fn corrections_add_up_to_the_map_of_the_sum() {
    let compensator = with(MAPS, 1.0, None);
    let mut state = compensator.power_on(false);
    let pairs: Vec<_> = samples(5000)
        .iter()
        .map(|sample| {
            let (out, _) = compensator.process(&mut state, *sample);
            (wide(flat(sample)), wide(flat(&out)))
        })
        .collect();
    add_up(&pairs, 0.52);
}

/// The corrections of float samples, too, add up to the map of the samples' sum.
#[test]
fn floats_are_corrected_in_proportion() {
    let compensator = with(MAPS, 1.0, None);
    let mut state = compensator.power_on(false);
    let pairs: Vec<_> = samples(2000)
        .iter()
        .map(|sample| {
            let [gyro, accel] =
                [sample.dtheta, sample.dv].map(|triad| triad.map(|count| count as f32 * 1e-5));
            let mut after = RawSample::Floats { gyro, accel };
            compensator.correct(&mut state, 0, &mut after);
            let RawSample::Floats { gyro: g, accel: a } = after else {
                panic!("floats stay floats");
            };
            (wide([gyro, accel]), wide([g, a]))
        })
        .collect();
    add_up(&pairs, 1e-5);
}

/// A correction does not depend on the sample that it corrects: the frame's first bytes may leave
/// before its last ones come.
#[test]
fn a_correction_is_known_before_its_sample() {
    let compensator = with(MAPS, 1.0, None);
    let mut state = compensator.power_on(false);
    let all = samples(20);
    for pair in all.windows(2) {
        compensator.process(&mut state, pair[0]);
        let owed = state.owed(0, false);
        let mut other = state.clone();
        let (out, _) = compensator.process(&mut state.clone(), pair[1]);
        let zero = Counts::default();
        let (of_zero, _) = compensator.process(&mut other, zero);
        for (i, owed) in owed.iter().enumerate() {
            let at = |counts: &Counts| flat(counts)[i / 3][i % 3];
            let taken = at(&pair[1]) - at(&out);
            assert_eq!(taken, -at(&of_zero));
            let whole = (owed.due.cast_signed() as f64) / 4_294_967_296.0;
            assert!((f64::from(taken) - whole).abs() <= 1.0, "{taken} {whole}");
        }
    }
}

#[test]
fn each_element_stays_within_its_limit() {
    let compensator = with([[[0.1; 3]; 3], [[-0.1; 3]; 3]], 2e-3, None);
    let state = compensator.power_on(false);
    assert_eq!(*state.maps(), [[[2e-3; 3]; 3], [[-2e-3; 3]; 3]]);
    let wild = with([[[f32::NAN; 3]; 3], [[f32::INFINITY; 3]; 3]], 2e-3, None);
    assert_eq!(
        *wild.power_on(false).maps(),
        [[[0.0; 3]; 3], [[2e-3; 3]; 3]]
    );
    assert!(with(MAPS, 0.0, None).power_on(false).is_zero());
}

/// Whatever number the networks and each element of the maps are: what is owed to a sample is at
/// most the limit and the maps' limit of the three values before it.
fn bias_and_map_are_bounded(stride: usize) {
    const MAP_LIMIT: f32 = 5e-3;
    let felt = [[0; 3], [i32::MAX, i32::MIN, -12_345], [i32::MIN; 3]];
    let limits = [LIMIT.gyro, LIMIT.accel].map(f64::from);
    let limits = [
        limits[0] * PERIOD_S / LSB.rad,
        limits[1] * PERIOD_S / LSB.mps,
    ];
    let mut compensator = with(Nets::NONE.maps, MAP_LIMIT, None);
    let mut state = compensator.power_on(false);
    for bits in (0..=u32::MAX).step_by(stride) {
        let any = f32::from_bits(bits);
        compensator.set_maps(&[[[any; 3]; 3]; 2], [MAP_LIMIT; 2]);
        compensator.force(&mut state, &[[any; 3]; 2]);
        for [gyro, accel] in felt.map(|felt| [felt; 2]) {
            let sample = RawSample::Counts { gyro, accel };
            compensator.anticipate(&mut state, 0, &sample, Axes::ALL);
            let sum: f64 = gyro.iter().map(|x| f64::from(*x).abs()).sum();
            for (i, owed) in state.owed(0, false).iter().enumerate() {
                let counts = owed.due.cast_signed() as f64 / f64::from(COUNT);
                let most = limits[i / 3] + f64::from(MAP_LIMIT) * sum;
                assert!(
                    counts.abs() <= most * (1.0 + 1e-6),
                    "{any:e}: {counts} of {most}"
                );
            }
        }
    }
}

#[test]
fn bias_and_map_are_bounded_for_some_numbers() {
    bias_and_map_are_bounded(65_521);
}

/// Every f32; a quarter of an hour.
#[test]
#[ignore = "long: cargo test -p firmware --lib --release -- --ignored at_every"]
fn bias_and_map_are_bounded_at_every_number() {
    bias_and_map_are_bounded(1);
}

/// With a slew limit a map comes and goes in the time in which the estimate crosses its limit.
#[test]
fn a_map_comes_slowly_where_the_estimate_does() {
    let slew = Limit {
        gyro: LIMIT.gyro / 10.0,
        accel: LIMIT.accel / 10.0,
    };
    let map_limit = 5e-3;
    let compensator = with(MAPS, map_limit, Some(slew));
    let mut state = compensator.power_on(true);
    state.off = false;
    let all = samples(100);
    let second = |state: &mut State| {
        for sample in &all {
            compensator.process(state, *sample);
        }
    };
    second(&mut state);
    assert!((state.maps()[0][0][0] - map_limit / 10.0).abs() < 1e-9);
    for _ in 0..10 {
        second(&mut state);
    }
    assert_eq!(*state.maps(), MAPS);
    state.off = true;
    second(&mut state);
    assert!((state.maps()[1][2][2] - (5e-3 - 5e-4)).abs() < 1e-9);
    for _ in 0..10 {
        second(&mut state);
    }
    assert!(state.is_zero());
    let (out, _) = compensator.process(&mut state, all[0]);
    let (again, _) = compensator.process(&mut state, all[0]);
    assert_eq!([out, again], [all[0]; 2]);
}

/// Two streams of one sensor with units of their own get the same correction.
#[test]
fn every_stream_has_its_own_last_sample() {
    let mut compensator = with(MAPS, 1.0, None);
    let mut state = compensator.power_on(false);
    let fine = Lsb {
        rad: LSB.rad / 8.0,
        mps: LSB.mps / 8.0,
    };
    compensator
        .set_output_stream(&mut state, 1, fine, PERIOD_S)
        .unwrap();
    let mut sums = [[0i64; 6]; 2];
    for sample in samples(500) {
        for (stream, factor) in [(0, 1), (1, 8)] {
            let [gyro, accel] = flat(&sample).map(|triad| triad.map(|count| count * factor));
            let before = [gyro, accel];
            let mut after = RawSample::Counts { gyro, accel };
            compensator.correct(&mut state, stream, &mut after);
            let RawSample::Counts { gyro, accel } = after else {
                panic!("counts stay counts");
            };
            for i in 0..6 {
                let to = [gyro, accel][i / 3][i % 3];
                sums[stream][i] += i64::from(before[i / 3][i % 3]) - i64::from(to);
            }
        }
    }
    for (coarse, fine) in sums[0].into_iter().zip(sums[1]) {
        assert!((8 * coarse - fine).abs() <= 9, "{coarse} {fine}");
        assert!(coarse.abs() > 100 || coarse == 0);
    }
}

/// A bit that flips in the maps that correct floats is found at the next sample: then there is no
/// correction rather than a wrong one, until the block ends.
#[test]
fn an_upset_of_the_maps_of_floats_is_found() {
    let compensator = with(MAPS, 1.0, None);
    let mut state = compensator.power_on(false);
    let mut sample = RawSample::Floats {
        gyro: [1.0; 3],
        accel: [1.0; 3],
    };
    compensator.correct(&mut state, 0, &mut sample.clone());
    state.maps[0][1][0] = 0.25;
    compensator.correct(&mut state, 0, &mut sample.clone());
    assert!(state.mended == 1 && state.is_zero());
    let before = sample;
    compensator.correct(&mut state, 0, &mut sample);
    assert_eq!(sample, before);
}

/// A bit that flips in the maps, or in what a stream subtracts, is found at the next sample and
/// changes no correction by more than that one sample's.
#[test]
fn an_upset_changes_one_sample_at_most() {
    let compensator = with(MAPS, 1.0, None);
    let all = samples(40);
    let run = |upset: Option<(usize, u32)>| {
        let mut state = compensator.power_on(false);
        let mut outs = Vec::new();
        for (n, sample) in all.iter().enumerate() {
            if let Some((what, bit)) = upset.filter(|_| n == 20) {
                match what {
                    0 => state.proportional.elements[0][0][1] ^= 1 << bit,
                    1 => state.proportional.elements[1][2][2] ^= 1 << bit,
                    2 => state.streams[0].constant[0][1] ^= 1 << bit,
                    _ => state.streams[0].due[1][0] ^= 1 << bit,
                }
            }
            outs.push(compensator.process(&mut state, *sample).0);
        }
        (outs, state.mended)
    };
    let (right, _) = run(None);
    for what in 0..4 {
        for bit in [0, 13, 30] {
            let (outs, mended) = run(Some((what, bit)));
            assert!(mended > 0, "{what} {bit}");
            for (n, (out, right)) in outs.iter().zip(&right).enumerate() {
                for i in 0..6 {
                    let off = flat(out)[i / 3][i % 3] - flat(right)[i / 3][i % 3];
                    // a stream that is mended has no last sample for once, and no remainder
                    let most = if n == 20 || n == 21 { 200 } else { 1 };
                    assert!(off.abs() <= most, "{what} {bit} {n} {i}: {off}");
                }
            }
        }
    }
}
