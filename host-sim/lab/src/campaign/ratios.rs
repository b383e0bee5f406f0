//! Ratios of the errors of two schemes, run by run.

use super::statistics::{interval, median};
use super::{Group, Row};
use crate::experiment::run::TIMES_MIN;
use host_core::simulator::imu::world::StartName;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Comparison of a scheme with another on the same runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ratio {
    /// Group of errors. `None` (in files `null`) for the geometric mean over all groups.
    pub error_model: Option<Group>,
    /// Scheme.
    pub scheme: String,
    /// The scheme with which it is compared.
    pub baseline: String,
    /// Minutes of free-inertial navigation.
    pub t_min: u32,
    /// Number of runs with both.
    pub n: usize,
    /// Number of runs in which its error is smaller.
    pub better: usize,
    /// Median over the runs of (error of the scheme / error of the baseline); over all groups, of a
    /// run's geometric mean over them.
    pub ratio: f64,
    /// Lower end of its 95 % interval; `None` with fewer than [`FEWEST`](super::FEWEST) runs.
    pub lo95: Option<f64>,
    /// Upper end.
    pub hi95: Option<f64>,
    /// Earlier drives of each unit, the same for both.
    pub drives: u32,
    /// Temperature of the units at power-on (the campaign's setting): cold, warm or hot.
    pub start: StartName,
}

impl Ratio {
    /// The 95 % interval.
    #[must_use]
    pub fn interval(&self) -> Option<(f64, f64)> {
        self.lo95.zip(self.hi95)
    }
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
    // each pair once: with exchanged schemes, all logarithms have the other sign
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
    let each = pairs.into_par_iter();
    let each = each.map(|(logs, scheme, baseline)| compared(&differences(logs, scheme, baseline)));
    let compared: Vec<Option<[Compared; TIMES_MIN.len()]>> = each.collect();
    let count = schemes.len();
    let index = |g: usize, i: usize, j: usize| {
        let before = i * (2 * count - i - 1) / 2;
        g * (count * count.saturating_sub(1) / 2) + before + j - i - 1
    };
    let each = cells.into_iter().filter_map(|(error_model, g, i, j)| {
        let of = match i < j {
            true => compared[index(g, i, j)]?,
            false => compared[index(g, j, i)]?.map(Compared::reversed),
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
            ratio: of.median.exp(),
            lo95: of.interval.map(|(low, _)| low.exp()),
            hi95: of.interval.map(|(_, high)| high.exp()),
            drives,
            start,
        })
        .collect()
}

/// Comparison of two schemes at one time, in logarithms.
#[derive(Debug, Clone, Copy)]
struct Compared {
    n: usize,
    /// Number of runs with the smaller error, and with the larger one.
    better: usize,
    worse: usize,
    median: f64,
    interval: Option<(f64, f64)>,
}

impl Compared {
    /// The same comparison with both schemes exchanged.
    fn reversed(self) -> Self {
        Self {
            better: self.worse,
            worse: self.better,
            median: -self.median,
            interval: self.interval.map(|(low, high)| (-high, -low)),
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

/// Medians of logarithms and their intervals, at all times.
fn compared(x: &[[f64; TIMES_MIN.len()]]) -> Option<[Compared; TIMES_MIN.len()]> {
    let at = |i: usize| {
        let mut of: Vec<f64> = x.iter().map(|d| d[i]).collect();
        Compared {
            n: of.len(),
            better: of.iter().filter(|d| **d < 0.0).count(),
            worse: of.iter().filter(|d| **d > 0.0).count(),
            median: median(&mut of),
            interval: interval(&of),
        }
    };
    (!x.is_empty()).then(|| std::array::from_fn(at))
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::simulator::imu::ErrorModelName;

    /// Pairing leaves no spread where errors differ much from run to run, but have a constant ratio
    /// in each group.
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
            let (low, high) = r.interval().unwrap();
            assert!((r.ratio - ratio).abs() < 1e-12 && (low - high).abs() < 1e-12);
            assert_eq!((r.n, r.better), (20, if ratio < 1.0 { 20 } else { 0 }));
        }
        assert!((find(None).ratio - 1.0).abs() < 1e-12);
    }

    /// 100 different ratios: the interval is from the 40th to the 61st, by a table of the sign
    /// test. With exchanged schemes it is mirrored.
    #[test]
    fn the_interval_has_the_ranks_of_the_sign_test() {
        let rows: Vec<Row> = (1..=100)
            .flat_map(|k| {
                let ratio = f64::from(k) / 50.5;
                [
                    Row::north(ErrorModelName::All, k, "a", ratio),
                    Row::north(ErrorModelName::All, k, "b", 1.0),
                ]
            })
            .collect();
        let all = ratios(&rows, StartName::Cold);
        let of = |scheme| all.iter().find(|r| r.scheme == scheme).unwrap();
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
        let (low, high) = of("a").interval().unwrap();
        assert!(near(low, 40.0 / 50.5) && near(high, 61.0 / 50.5));
        assert!(near(of("a").ratio, (50.0_f64 * 51.0).sqrt() / 50.5) && of("a").better == 50);
        let (low, high) = of("b").interval().unwrap();
        assert!(near(low, 50.5 / 61.0) && near(high, 50.5 / 40.0));
    }
}
