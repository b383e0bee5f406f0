//! Ratios of the errors of two schemes, run by run.

use super::statistics::{RESAMPLINGS, percentiles95};
use super::{Group, Row};
use crate::experiment::run::TIMES_MIN;
use crate::simulator::imu::world::StartName;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// How a scheme compares with another on the same runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ratio {
    /// Group of errors. `None` (in files `null`) for the geometric mean over all groups.
    pub error_model: Option<Group>,
    /// Scheme.
    pub scheme: String,
    /// What it is compared with.
    pub baseline: String,
    /// Minutes of free-inertial navigation.
    pub t_min: u32,
    /// Runs that have both.
    pub n: usize,
    /// Of them those with the smaller error.
    pub better: usize,
    /// Geometric mean of (error of the scheme / error of the baseline).
    pub ratio: f64,
    /// Lower end of its 95 % bootstrap interval over runs.
    pub lo95: f64,
    /// Upper end.
    pub hi95: f64,
    /// Earlier drives of each unit, the same for both.
    pub drives: u32,
    /// How warm the units were at power-on: the campaign's setting.
    pub start: StartName,
}

/// Logarithms of the errors: by group, scheme, run, at each of [`TIMES_MIN`].
type Logs<'a> = BTreeMap<&'a str, BTreeMap<u32, [f64; TIMES_MIN.len()]>>;

/// Every scheme against every other at every time, by group of errors and over all groups, in the
/// order of the rows, each number of earlier drives by itself. `start` is the campaign's setting.
#[must_use]
pub fn ratios(rows: &[Row], start: StartName) -> Vec<Ratio> {
    let drives: BTreeSet<u32> = rows.iter().map(|row| row.drives).collect();
    let of = |drives| {
        let same: Vec<&Row> = rows.iter().filter(|row| row.drives == drives).collect();
        paired(&same, drives, start)
    };
    drives.into_iter().flat_map(of).collect()
}

/// The ratios of rows with one number of earlier drives.
fn paired(rows: &[&Row], drives: u32, start: StartName) -> Vec<Ratio> {
    let groups = Group::present(rows.iter().map(|row| row.error_model));
    let mut schemes: Vec<&str> = Vec::new();
    for row in rows {
        if !schemes.contains(&row.scheme.as_str()) {
            schemes.push(&row.scheme);
        }
    }
    let logs: Vec<Logs<'_>> = groups.iter().map(|g| logs_of(rows, *g)).collect();
    let n = logs
        .iter()
        .flat_map(|l| l.values())
        .map(BTreeMap::len)
        .max();
    // each pair once: the other way round, all logarithms have the other sign
    let mut pairs = Vec::new();
    let mut cells = Vec::new();
    let each = groups.iter().copied().map(Some).chain([None]);
    for (g, group) in each.enumerate() {
        let of = group.map_or(&logs[..], |_| &logs[g..=g]);
        for (i, scheme) in schemes.iter().enumerate() {
            for (j, baseline) in schemes.iter().enumerate() {
                if i < j {
                    pairs.push((of, *scheme, *baseline));
                }
                if i != j {
                    cells.push((group, g, i, j));
                }
            }
        }
    }
    let compared = compared(pairs, n.unwrap_or(0));
    let count = schemes.len();
    let place = |g: usize, i: usize, j: usize| {
        let before = i * (2 * count - i - 1) / 2;
        g * (count * count.saturating_sub(1) / 2) + before + j - i - 1
    };
    let each = cells.into_iter().filter_map(|(error_model, g, i, j)| {
        let of = match i < j {
            true => compared[place(g, i, j)]?,
            false => compared[place(g, j, i)]?.map(Compared::reversed),
        };
        let ratio = move |(of, t_min): (Compared, u32)| (error_model, i, j, t_min, of);
        Some(of.into_iter().zip(TIMES_MIN).map(ratio))
    });
    each.flatten()
        .map(|(error_model, i, j, t_min, of)| Ratio {
            error_model,
            scheme: schemes[i].into(),
            baseline: schemes[j].into(),
            t_min,
            n: of.n,
            better: of.better,
            ratio: of.mean.exp(),
            lo95: of.interval.0.exp(),
            hi95: of.interval.1.exp(),
            drives,
            start,
        })
        .collect()
}

/// Compares pairs of schemes; `runs`: how many a pair usually has.
fn compared(
    pairs: Vec<(&[Logs<'_>], &str, &str)>,
    runs: usize,
) -> Vec<Option<[Compared; TIMES_MIN.len()]>> {
    let picks = resamples(runs);
    let each = pairs.into_par_iter().map(|(logs, scheme, baseline)| {
        let x = differences(logs, scheme, baseline);
        match x.len() == runs {
            true => geometric(&x, &picks),
            false => geometric(&x, &resamples(x.len())),
        }
    });
    each.collect()
}

/// How two schemes compare at one time, in logarithms.
#[derive(Debug, Clone, Copy)]
struct Compared {
    n: usize,
    /// Runs with the smaller error, and with the larger one.
    better: usize,
    worse: usize,
    mean: f64,
    interval: (f64, f64),
}

impl Compared {
    /// The other way round.
    fn reversed(self) -> Self {
        let (low, high) = self.interval;
        Self {
            better: self.worse,
            worse: self.better,
            mean: -self.mean,
            interval: (-high, -low),
            ..self
        }
    }
}

fn logs_of<'a>(rows: &[&'a Row], group: Group) -> Logs<'a> {
    let mut out = Logs::new();
    for row in rows.iter().filter(|r| r.error_model == group) {
        out.entry(&row.scheme)
            .or_default()
            .insert(row.run, row.horizontal_m.map(f64::ln));
    }
    out
}

/// Difference of the logarithms in each run that has both schemes in all groups, averaged over the
/// groups.
fn differences(logs: &[Logs<'_>], scheme: &str, baseline: &str) -> Vec<[f64; TIMES_MIN.len()]> {
    let Some(runs) = logs.first().and_then(|l| l.get(scheme)) else {
        return Vec::new();
    };
    let mean = |run: &u32| {
        let mut sums = [0.0; TIMES_MIN.len()];
        for group in logs {
            let (a, b) = (group.get(scheme)?.get(run)?, group.get(baseline)?.get(run)?);
            for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
                *sum += a - b;
            }
        }
        Some(sums.map(|sum| sum / logs.len() as f64))
    };
    runs.keys().filter_map(mean).collect()
}

/// Indices of the resamples of `n` runs: the same for every cell.
fn resamples(n: usize) -> Vec<Vec<usize>> {
    let mut rng = ChaCha8Rng::seed_from_u64(22);
    (0..RESAMPLINGS)
        .map(|_| (0..n).map(|_| rng.random_range(0..n)).collect())
        .collect()
}

/// Means of logarithms and their 95 % percentile bootstrap intervals, at all times at once.
fn geometric(
    x: &[[f64; TIMES_MIN.len()]],
    picks: &[Vec<usize>],
) -> Option<[Compared; TIMES_MIN.len()]> {
    if x.is_empty() {
        return None;
    }
    let n = x.len() as f64;
    let sum = |of: &mut dyn Iterator<Item = &[f64; TIMES_MIN.len()]>| {
        // as the sum of an iterator begins
        let mut sums = [-0.0; TIMES_MIN.len()];
        for x in of {
            sums.iter_mut().zip(x).for_each(|(sum, x)| *sum += x);
        }
        sums.map(|sum| sum / n)
    };
    let mut means: [Vec<f64>; TIMES_MIN.len()] = Default::default();
    for pick in picks {
        let resampled = sum(&mut pick.iter().map(|k| &x[*k]));
        for (means, mean) in means.iter_mut().zip(resampled) {
            means.push(mean);
        }
    }
    let mean = sum(&mut x.iter());
    Some(std::array::from_fn(|i| Compared {
        n: x.len(),
        better: x.iter().filter(|d| d[i] < 0.0).count(),
        worse: x.iter().filter(|d| d[i] > 0.0).count(),
        mean: mean[i],
        interval: percentiles95(&mut means[i]),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::imu::ErrorModelName;

    /// Errors that differ much from run to run but have a constant ratio in each group: pairing
    /// leaves no spread.
    #[test]
    fn ratios_are_paired_by_run_and_averaged_over_groups() {
        let groups = [(ErrorModelName::Linear, 0.5), (ErrorModelName::All, 2.0)];
        let mut rows = Vec::new();
        for (group, ratio) in groups {
            for k in 0..20 {
                rows.push(Row::north(group, k, "a", ratio * f64::from(k + 1)));
                rows.push(Row::north(group, 19 - k, "b", f64::from(20 - k)));
            }
        }
        let all = ratios(&rows, StartName::Cold);
        assert_eq!(all.len(), 3 * 2 * 5);
        let find = |group: Option<ErrorModelName>| {
            let group = group.map(Group::from);
            let mut found = all.iter();
            found
                .find(|r| r.error_model == group && r.scheme == "a" && r.t_min == 22)
                .unwrap()
        };
        for (group, ratio) in groups {
            let r = find(Some(group));
            assert!((r.ratio - ratio).abs() < 1e-12 && (r.lo95 - r.hi95).abs() < 1e-12);
            assert_eq!((r.n, r.better), (20, if ratio < 1.0 { 20 } else { 0 }));
        }
        assert!((find(None).ratio - 1.0).abs() < 1e-12);
    }

    /// Logarithms with a standard deviation of 1 over 100 runs: the interval is about 2 * 1.96 / 10
    /// wide.
    #[test]
    fn the_interval_is_as_wide_as_the_theory_says() {
        let rows: Vec<Row> = (0..100)
            .flat_map(|k| {
                let z = if k % 2 == 0 { 1.0_f64 } else { -1.0 };
                [
                    Row::north(ErrorModelName::All, k, "a", z.exp()),
                    Row::north(ErrorModelName::All, k, "b", 1.0),
                ]
            })
            .collect();
        let r = &ratios(&rows, StartName::Cold)[0];
        assert!((r.ratio - 1.0).abs() < 1e-12 && r.better == 50);
        let width = (r.hi95 / r.lo95).ln();
        assert!((width - 0.392).abs() < 0.04, "{width}");
    }
}
