//! Statistics of the trials of a class.

use super::class::{Class, Goal};
use super::trial::{Attitude, Trial};
use crate::campaign::statistics::quantile;
use host_estimation::learning::rests::Rests;
use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF};
use std::collections::BTreeMap;

/// A share of the trials, with an interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Share {
    /// Number of hits.
    pub k: usize,
    /// Number of trials.
    pub n: usize,
    /// Lower end of the 95 % interval of the probability.
    pub lo95: f64,
    /// Upper end.
    pub hi95: f64,
}

impl Share {
    /// With the interval of Clopper and Pearson (1934), which holds for every number of trials and
    /// every probability. Wilson's (1927) is narrower, but holds on the average of probabilities
    /// only: of 20 trials with a probability of 0.992 it misses in 15 %. Without trials it is 0 to
    /// 1.
    #[must_use]
    pub fn of(k: usize, n: usize) -> Self {
        let quantile = |k: usize, p: f64| {
            let law = Beta::new(k as f64, (n + 1 - k) as f64).ok();
            law.map(|law| law.inverse_cdf(p))
        };
        // the exact ends for none and all
        Self {
            k,
            n,
            lo95: quantile(k, 0.025).unwrap_or(0.0),
            hi95: quantile(k + 1, 0.975).unwrap_or(1.0),
        }
    }
}

/// Median and 95th percentile.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Median.
    pub median: f64,
    /// 95th percentile.
    pub p95: f64,
}

impl Spread {
    /// `None` without values.
    #[must_use]
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        (!values.is_empty()).then(|| Self {
            median: quantile(&values, 0.5),
            p95: quantile(&values, 0.95),
        })
    }
}

/// All trials of one class.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Name of the class.
    pub class: &'static str,
    /// Description.
    pub about: &'static str,
    /// Preset of the sensor.
    pub unit: String,
    /// The expected result.
    pub goal: Goal,
    /// Trials that started.
    pub started: Share,
    /// Trials that started and whose heading was never silently wrong.
    pub right: Share,
    /// Trials whose heading was silently wrong at the start or later.
    pub silently_wrong: usize,
    /// Share of the time of navigation in which the heading was silently wrong.
    pub wrong_share: f64,
    /// How often a navigator was lost or dropped, in all trials together.
    pub lost: u32,
    /// Alignments that were rejected, in all trials together.
    pub refused_alignments: u32,
    /// Number of trials by source of the heading at the start.
    pub ways: BTreeMap<String, usize>,
    /// Time of the start after power-on, s.
    pub start_s: Option<Spread>,
    /// Size of the heading error at the start, after 60 s and after 300 s, deg.
    pub heading_deg: [Option<Spread>; 3],
    /// Standard deviation of the heading that the device claims at the same times, deg.
    pub claimed_deg: [Option<Spread>; 3],
    /// Tilt error at the start, deg.
    pub tilt_deg: Option<Spread>,
    /// Mean of the squared heading errors divided by the claimed variances, at the same times: 1 if
    /// the claims are right.
    pub normalised_square: [Option<f64>; 3],
    /// [`Trial::rests`] of all trials together.
    pub rests: [Option<Rests>; 2],
}

impl Summary {
    /// The statistics of trials of `class` with the unit of that name.
    #[must_use]
    pub fn of(class: &Class, unit: &str, trials: &[Trial]) -> Self {
        let n = trials.len();
        let started: Vec<_> = trials.iter().filter_map(|t| t.started.as_ref()).collect();
        let wrong = trials.iter().filter(|t| t.wrong_at_s.is_some()).count();
        let mut ways = BTreeMap::new();
        for start in &started {
            *ways.entry(start.way.clone()).or_default() += 1;
        }
        let at = |i: usize| -> Vec<Attitude> {
            let of = started.iter().map(|start| match i {
                0 => Some(start.attitude),
                _ => start.later[i - 1],
            });
            of.flatten().collect()
        };
        let mean = |values: Vec<Attitude>| {
            let n = values.len() as f64;
            let sum: f64 = values.iter().map(Attitude::normalised_square).sum();
            (n > 0.0).then_some(sum / n)
        };
        let times = [0, 1, 2];
        let sum = |of: fn(&Trial) -> u32| trials.iter().map(of).sum::<u32>();
        Self {
            class: class.name,
            about: class.about,
            unit: unit.to_owned(),
            goal: class.goal,
            started: Share::of(started.len(), n),
            right: Share::of(started.len() - wrong, n),
            silently_wrong: wrong,
            wrong_share: f64::from(sum(|t| t.wrong_s)) / f64::from(sum(|t| t.navigated_s).max(1)),
            lost: sum(|t| t.lost),
            refused_alignments: sum(|t| t.refused_alignments),
            ways,
            start_s: Spread::of(started.iter().map(|s| f64::from(s.at_s))),
            heading_deg: times.map(|i| Spread::of(at(i).iter().map(|a| a.heading_deg.abs()))),
            claimed_deg: times.map(|i| Spread::of(at(i).iter().map(|a| a.sigma_deg))),
            tilt_deg: Spread::of(at(0).iter().map(|a| a.tilt_deg)),
            normalised_square: times.map(|i| mean(at(i))),
            rests: [0, 1].map(|k| {
                let each = trials.iter().filter_map(|trial| trial.rests[k]);
                each.reduce(|sum, of| sum.and(&of))
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::class::CLASSES;
    use super::super::trial::Started;
    use super::*;

    /// Compares with intervals from Newcombe, Statistics in Medicine 17 (1998), table I, method 5.
    #[test]
    fn the_interval_is_that_of_the_literature() {
        for (k, n, lo, hi) in [
            (81, 263, 0.2527, 0.3676),
            (15, 148, 0.0578, 0.1617),
            (0, 20, 0.0000, 0.1684),
            (1, 29, 0.0009, 0.1776),
        ] {
            let share = Share::of(k, n);
            assert!((share.lo95 - lo).abs() < 6e-5, "{share:?}");
            assert!((share.hi95 - hi).abs() < 6e-5, "{share:?}");
        }
        assert_eq!((Share::of(50, 50).hi95, Share::of(0, 0).lo95), (1.0, 0.0));
        assert_eq!(Share::of(0, 0).hi95, 1.0);
    }

    /// Sums the probability of each number of successes whose interval misses the true probability.
    #[test]
    fn the_interval_of_a_share_misses_at_most_one_in_twenty() {
        for n in [1, 2, 5, 10, 20, 50] {
            let all: Vec<Share> = (0..=n).map(|k| Share::of(k, n)).collect();
            for per_mille in 0..=1000 {
                let p = f64::from(per_mille) / 1000.0;
                let mut chances = vec![1.0];
                for _ in 0..n {
                    let mut next = vec![0.0; chances.len() + 1];
                    for (k, chance) in chances.iter().enumerate() {
                        next[k] += chance * (1.0 - p);
                        next[k + 1] += chance * p;
                    }
                    chances = next;
                }
                let missed = all.iter().filter(|of| p < of.lo95 || p > of.hi95);
                let missed: f64 = missed.map(|of| chances[of.k]).sum();
                assert!(missed <= 0.05, "{n} trials, {p}: {missed}");
            }
        }
    }

    #[test]
    fn median_and_percentile_lie_between_the_values() {
        let spread = Spread::of((1..=21).rev().map(f64::from)).unwrap();
        assert_eq!((spread.median, spread.p95), (11.0, 20.0));
        let spread = Spread::of([3.0, 1.0]).unwrap();
        assert_eq!(spread.median, 2.0);
        assert!((spread.p95 - 2.9).abs() < 1e-12);
        assert_eq!(Spread::of([]), None);
    }

    #[test]
    fn a_class_is_summed_up() {
        let attitude = |heading_deg: f64| Attitude {
            heading_deg,
            sigma_deg: 0.5,
            tilt_deg: 0.1,
        };
        let trial = |seed, started: Option<(f64, Option<f64>)>, wrong_at_s| Trial {
            class: "laser-0".into(),
            seed,
            started: started.map(|(at, later)| Started {
                at_s: 100 + seed,
                way: "gyrocompass".into(),
                residual: 0.0,
                attitude: attitude(at),
                later: [later.map(attitude), None],
            }),
            wrong_at_s,
            wrong_s: if wrong_at_s.is_some() { 30 } else { 0 },
            navigated_s: 100,
            lost: seed,
            refused_alignments: 10,
            fixes: 0,
            refused: 0,
            late: 0,
            rests: [
                Some(Rests {
                    standing_s: 10,
                    ..Rests::default()
                }),
                None,
            ],
        };
        let trials = [
            trial(0, Some((-0.5, Some(0.25))), None),
            trial(1, Some((1.0, None)), None),
            trial(2, Some((-20.0, None)), Some(130)),
            trial(3, None, None),
        ];
        let summary = Summary::of(&CLASSES[0], "medium", &trials);
        assert_eq!((summary.started.k, summary.started.n), (3, 4));
        assert_eq!((summary.right.k, summary.silently_wrong), (2, 1));
        assert_eq!(summary.wrong_share, 0.075);
        assert_eq!(summary.claimed_deg[0].unwrap().median, 0.5);
        assert_eq!((summary.lost, summary.refused_alignments), (6, 40));
        assert_eq!(summary.start_s.unwrap().median, 101.0);
        assert_eq!(summary.heading_deg[0].unwrap().median, 1.0);
        assert_eq!(summary.heading_deg[1].unwrap().p95, 0.25);
        assert_eq!(summary.heading_deg[2], None);
        // squares of errors over sigma: 1, 4, 1600
        assert_eq!(summary.normalised_square[0], Some(535.0));
        assert_eq!(summary.normalised_square[1], Some(0.25));
        assert_eq!(summary.ways["gyrocompass"], 3);
        assert_eq!(summary.rests[0].map(|of| of.standing_s), Some(40));
        assert_eq!(summary.rests[1], None);
    }
}
