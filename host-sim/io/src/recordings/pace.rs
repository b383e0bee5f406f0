//! The step from one sample to the next, from the time stamps of a recording.
//!
//! It is the median of the steps, unless the stamps are rounded to a unit that is a noticeable part
//! of it, as those of 800 samples a second to 1 ms: their steps are 1 and 2 ms and never 1.25 ms.
//! Then it is the time of the samples divided by their number, without the gaps.

use crate::recordings::gaps::{BRIDGE_S, gaps, pairs};
use crate::recordings::record::{Kind, median_step};
use host_core::list::{List, median};

/// Units of stamps that are looked for, s.
const UNITS: [f64; 6] = [0.1, 0.01, 1e-3, 1e-4, 1e-5, 1e-6];
/// Stamps are rounded to a unit if so many of the steps are multiples of it.
const ROUNDED: f64 = 0.9;
/// A step that has more units than this is exact enough.
const FINE: f64 = 200.0;
/// Where the usual step is one unit, fewer steps of two than this are samples that are missing.
const LEAST_DOUBLES: f64 = 0.05;
/// So many steps together are the same to one unit if they are rounded.
const TOGETHER: usize = 20;
/// So many together are the same to so many units. Where samples are missing at random, they differ
/// more.
const MANY: usize = 200;
const APART: f64 = 1.75;

/// Step of the samples, and how their stamps show it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// From one sample to the next, s.
    pub step: f64,
    /// Unit to which the stamps are rounded, s, if it is a noticeable part of the step.
    pub unit: Option<f64>,
}

impl Pace {
    /// The pace of samples at `time`. The step is NaN for fewer than two.
    #[must_use]
    pub fn of(time: &List<f64>) -> Self {
        let median = median_step(time);
        let rounded = unit(time, median).and_then(|unit| rounded(time, median, unit));
        let Some(rough) = rounded else {
            return Self {
                step: median,
                unit: None,
            };
        };
        (0..3).fold(rough, |pace, _| pace.refined(time))
    }

    /// Whether the stamps are rounded to more than half of a step.
    pub(super) fn is_coarse(&self) -> bool {
        self.unit.is_some_and(|unit| self.step < 2.0 * unit)
    }

    /// The pace with the step that the span of the samples gives without the gaps that this one
    /// finds.
    fn refined(self, time: &List<f64>) -> Self {
        let (mut seconds, mut steps) = (0.0, time.len() as f64 - 1.0);
        for gap in gaps(time, Kind::Increment, &self) {
            if gap.length > BRIDGE_S {
                seconds -= gap.length + self.step;
                steps -= 1.0;
            } else {
                steps += (gap.length / self.step).round();
            }
        }
        seconds += time.end().unwrap_or_default() - time.start().unwrap_or_default();
        Self {
            step: seconds / steps,
            ..self
        }
    }
}

/// Times in files are rounded: 200.0000003 Hz is 200 Hz.
#[must_use]
pub fn nearly_whole(rate: f64) -> f64 {
    match (rate - rate.round()).abs() < 1e-4 * rate {
        true => rate.round(),
        false => rate,
    }
}

/// The unit to which the stamps are rounded, if a step has few of them.
fn unit(time: &List<f64>, median: f64) -> Option<f64> {
    let usable = |unit: &f64| (0.99..=FINE).contains(&(median / unit));
    UNITS.into_iter().filter(usable).find(|unit| {
        let multiple = |[before, now]: &[f64; 2]| {
            let (step, blur) = (now - before, 4.0 * f64::EPSILON * now.abs());
            (step - (step / unit).round() * unit).abs() <= 1e-3 * unit + blur
        };
        let count = pairs(time).filter(multiple).count();
        count as f64 >= ROUNDED * (time.len() as f64 - 1.0)
    })
}

/// The mean of the usual steps, if they differ because they are rounded to `unit`.
fn rounded(time: &List<f64>, median: f64, unit: f64) -> Option<Pace> {
    let usual = (median / unit).round();
    let (mut count, mut other) = (0.0, 0.0);
    for [before, now] in pairs(time) {
        let step = ((now - before) / unit).round();
        if (step - usual).abs() <= (0.5 * usual).max(1.0) {
            count += 1.0;
            other += f64::from(u8::from(step != usual));
        }
    }
    let missing = usual == 1.0 && (other < LEAST_DOUBLES * count || !regular(time, unit));
    if other == 0.0 || missing {
        return None;
    }
    let whole = median_of(time, TOGETHER);
    let near = lasts(time, TOGETHER).filter(|length| (length - whole).abs() < 1.01 * unit);
    let (count, sum) = near.fold((0.0, 0.0), |(count, sum), length| {
        (count + 1.0, sum + length)
    });
    let step = sum / (count * TOGETHER as f64);
    step.is_finite().then_some(Pace {
        step,
        unit: Some(unit),
    })
}

/// How long each so many steps last, s.
fn lasts(time: &List<f64>, steps: usize) -> impl Iterator<Item = f64> {
    let later = time.each().step_by(steps).skip(1);
    let all = time.each().step_by(steps).zip(later);
    all.map(|(before, now)| now - before)
}

fn median_of(time: &List<f64>, steps: usize) -> f64 {
    median(|| lasts(time, steps))
}

/// Whether equal numbers of samples take equal times, but for what rounding makes.
fn regular(time: &List<f64>, unit: f64) -> bool {
    let usual = median_of(time, MANY);
    median(|| lasts(time, MANY).map(|length| (length - usual).abs())) <= APART * unit
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stamps of `count` samples at `rate`, with so many decimals, without those in `missing`.
    fn stamps(rate: f64, decimals: usize, count: usize, missing: &[usize]) -> List<f64> {
        let kept = (1..=count).filter(|k| !missing.contains(k));
        let text = |k: usize| format!("{:.decimals$}", 345_600.0 + k as f64 / rate);
        kept.map(|k| text(k).parse().unwrap()).collect()
    }

    /// One sample in a hundred, at places without order.
    fn hundredth(count: usize) -> Vec<usize> {
        let mut state = 1_u64;
        let mut hit = |_: &usize| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33).is_multiple_of(100)
        };
        (60..count - 60).filter(|k| hit(k)).collect()
    }

    /// Rounded stamps of these rates show steps that look like gaps.
    const ROUGH: [(f64, usize); 9] = [
        (800.0, 3),
        (700.0, 3),
        (600.0, 3),
        (512.0, 3),
        (666.667, 3),
        (75.0, 2),
        (66.67, 2),
        (400.0, 3),
        (128.0, 3),
    ];

    #[test]
    fn rounded_stamps_are_no_gaps() {
        for (rate, decimals) in ROUGH {
            let time = stamps(rate, decimals, 60_000, &[]);
            let pace = Pace::of(&time);
            assert!((pace.step * rate - 1.0).abs() < 2e-5, "{rate} {pace:?}");
            assert_eq!(gaps(&time, Kind::Increment, &pace), [], "{rate}");
        }
    }

    /// The number of missing samples comes out, at the places where they are missing.
    #[test]
    fn missing_samples_among_rounded_stamps_are_found() {
        for (rate, decimals) in ROUGH {
            let missing = hundredth(60_000);
            let time = stamps(rate, decimals, 60_000, &missing);
            let pace = Pace::of(&time);
            assert!((pace.step * rate - 1.0).abs() < 1e-4, "{rate} {pace:?}");
            let found = gaps(&time, Kind::Increment, &pace);
            let count: f64 = found.iter().map(|gap| gap.length / pace.step).sum();
            assert!(
                (count / missing.len() as f64 - 1.0).abs() < 0.01,
                "{rate}: {count} of {}",
                missing.len()
            );
            let place = |gap: &crate::recordings::gaps::Gap| {
                let away = missing
                    .iter()
                    .map(|k| (345_600.0 + *k as f64 / rate - gap.to).abs());
                away.fold(f64::INFINITY, f64::min)
            };
            assert!(found.iter().all(|gap| place(gap) < 40.0 / rate), "{rate}");
        }
    }

    /// A stamp that is exact keeps the median, to the last bit.
    #[test]
    fn exact_stamps_have_the_median_step() {
        let lost = hundredth(20_000);
        let every: Vec<usize> = (100..20_000).step_by(100).collect();
        for (rate, decimals) in [(100.0, 2), (125.0, 3), (1000.0, 3), (400.0, 4), (300.0, 9)] {
            for missing in [&[][..], &lost, &every] {
                let time = stamps(rate, decimals, 20_000, missing);
                let pace = Pace::of(&time);
                assert_eq!((pace.step, pace.unit), (median_step(&time), None), "{rate}");
                let found = gaps(&time, Kind::Increment, &pace);
                let count: f64 = found.iter().map(|gap| gap.length * rate).sum();
                assert!(
                    (count - missing.len() as f64).abs() < 1e-2,
                    "{rate}: {count}"
                );
            }
        }
        // a tenth is missing at random: no rounding leaves out so many without order
        let tenth: Vec<usize> = hundredth(200_000).iter().map(|k| k / 10).collect();
        let time = stamps(100.0, 2, 20_000, &tenth);
        assert_eq!(Pace::of(&time).unit, None);
    }
}
