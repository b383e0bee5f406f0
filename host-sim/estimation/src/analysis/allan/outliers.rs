//! Single samples far from their neighbours: bit errors, knocks, lost and doubled samples.
//!
//! One of them has the Allan variance of a random walk, so the curve does not show it, and N and
//! its interval would be wrong. A sample is an outlier if it differs from the median of its block
//! and of those around it by more than [`FAR`] root mean squares of the samples that do not.

use serde::Serialize;

/// Samples whose median is that of a block. Odd, so that it is one of them.
const BLOCK: usize = 65;
/// Distance from the median of the block, in root mean squares. Normal noise does not reach it in
/// the life of a sensor, and vibration has a crest of 1.4.
const FAR: f64 = 10.0;
/// Distance that the rounding to pulses explains, in pulses.
const PULSES: f64 = 3.5;
/// Largest share of samples that are left out. More are no errors of single samples, and above one
/// in [`FAR`] squared they would hide each other.
const FEW: f64 = 1e-3;

/// The outliers of a series.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Outliers {
    /// How many.
    pub count: usize,
    /// When the first was sampled, s from the first sample.
    pub first_s: f64,
    /// The farthest from the median of its block, in root mean squares of the others.
    pub farthest: f64,
    /// Whether they are left out. They are if at most one sample in a thousand is one.
    pub left_out: bool,
}

/// Puts the median of its block in place of each outlier of `increments` if they are few. `None` if
/// there is none.
pub(super) fn leave_out(increments: &mut [f64], rate_hz: f64) -> Option<Outliers> {
    let medians: Vec<f64> = increments.chunks(BLOCK).map(median).collect();
    // a step of the bias is none: one of the medians around it is near
    let distance = |(i, value): (usize, &f64)| {
        let around = &medians[(i / BLOCK).saturating_sub(1)..medians.len().min(i / BLOCK + 2)];
        let each = around.iter().map(|median| (value - median).abs());
        each.fold(f64::INFINITY, f64::min)
    };
    let distances = || increments.iter().enumerate().map(distance);
    let pulse = distances().filter(|it| *it > 0.0).min_by(f64::total_cmp)?;
    let mut limit = f64::INFINITY;
    let rms = loop {
        let near = || distances().filter(|it| *it <= limit);
        let rms = (near().map(|it| it * it).sum::<f64>() / near().count().max(1) as f64).sqrt();
        let next = (FAR * rms).max(PULSES * pulse);
        // each round leaves out more than the one before, or nothing more
        if next >= limit || distances().all(|it| it <= next) {
            break rms;
        }
        limit = next;
    };
    let far = distances().enumerate().filter(|(_, it)| *it > limit);
    let (places, far): (Vec<usize>, Vec<f64>) = far.unzip();
    let farthest = far.into_iter().fold(0.0, f64::max) / rms;
    let left_out = places.len() as f64 <= FEW * increments.len() as f64;
    if left_out {
        for place in &places {
            increments[*place] = medians[place / BLOCK];
        }
    }
    Some(Outliers {
        count: places.len(),
        first_s: *places.first()? as f64 / rate_hz,
        farthest,
        left_out,
    })
}

fn median(block: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = block.to_vec();
    let middle = sorted.len() / 2;
    *sorted.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::super::analyse;
    use super::super::tests::gyro;
    use super::*;

    /// White noise of N = 0.15 deg/sqrt(h) at 200 Hz.
    fn noise(seed: u64) -> super::super::Series {
        let si = 0.15 * host_core::inertial::units::DEG_PER_SQRT_H;
        gyro([0.0, si, 0.0, 0.0, 0.0], 200.0, 120_000, seed)
    }

    #[test]
    fn bad_samples_do_not_change_the_noise() {
        // one sample of 1 rad/s; a knock of 0.1 s; a bit error in every two thousandth
        let places: [&[usize]; 3] = [&[60_000], &[3, 4, 5, 6, 7, 9, 11, 20], &[0, 2000, 119_999]];
        for (seed, places) in places.into_iter().enumerate() {
            let mut series = noise(seed as u64);
            for place in places {
                series.increments[*place] += 1.0 / 200.0;
            }
            let found = analyse(series).unwrap();
            let n = &found.coefficients[1];
            assert!(n.low < 0.15 && 0.15 < n.high && n.high < 0.16, "{n:?}");
            let outliers = found.outliers.expect("they are reported");
            assert_eq!(outliers.count, places.len());
            assert!(outliers.left_out && (outliers.farthest / 1620.0 - 1.0).abs() < 0.2);
            assert!((outliers.first_s - places[0] as f64 / 200.0).abs() < 1e-9);
        }
    }

    #[test]
    fn many_are_reported_and_stay() {
        let mut series = noise(9);
        for value in series.increments.iter_mut().step_by(500) {
            *value += 1.0 / 200.0;
        }
        let before = series.increments.clone();
        let outliers = leave_out(&mut series.increments, 200.0).expect("they are reported");
        assert!(!outliers.left_out && outliers.count == 240, "{outliers:?}");
        assert_eq!(series.increments, before);
    }

    #[test]
    fn noise_steps_vibration_and_pulses_have_none() {
        let plain = noise(1).increments;
        let step = plain.iter().enumerate().map(|(i, x)| match i < 70_000 {
            true => *x,
            false => x + 0.01,
        });
        let vibration = (0..100_000).map(|i| (f64::from(i) * 0.7).sin());
        // a pulse in a thousand samples, and none
        let pulses = (0..100_000).map(|i| f64::from(u8::from(i % 1000 == 0)));
        for mut series in [
            plain.clone(),
            step.collect(),
            vibration.collect(),
            pulses.collect(),
            vec![2.5; 1000],
            vec![],
        ] {
            assert_eq!(leave_out(&mut series, 200.0), None);
        }
    }
}
