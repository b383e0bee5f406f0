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
    let mut cells = Vec::new();
    let each = groups.iter().copied().map(Some).chain([None]);
    for (g, group) in each.enumerate() {
        let of = group.map_or(&logs[..], |_| &logs[g..=g]);
        for scheme in &schemes {
            for baseline in schemes.iter().filter(|b| *b != scheme) {
                for (i, t_min) in TIMES_MIN.into_iter().enumerate() {
                    cells.push((group, of, *scheme, *baseline, i, t_min));
                }
            }
        }
    }
    let n = logs
        .iter()
        .flat_map(|l| l.values())
        .map(BTreeMap::len)
        .max();
    let picks = resamples(n.unwrap_or(0));
    cells
        .into_par_iter()
        .filter_map(|(error_model, logs, scheme, baseline, i, t_min)| {
            let x = differences(logs, scheme, baseline, i);
            let own;
            let picks = if Some(x.len()) == n {
                &picks
            } else {
                own = resamples(x.len());
                &own
            };
            let (ratio, lo95, hi95) = geometric(&x, picks)?;
            Some(Ratio {
                error_model,
                scheme: scheme.into(),
                baseline: baseline.into(),
                t_min,
                n: x.len(),
                better: x.iter().filter(|d| **d < 0.0).count(),
                ratio,
                lo95,
                hi95,
                drives,
                start,
            })
        })
        .collect()
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
fn differences(logs: &[Logs<'_>], scheme: &str, baseline: &str, i: usize) -> Vec<f64> {
    let Some(runs) = logs.first().and_then(|l| l.get(scheme)) else {
        return Vec::new();
    };
    let mean = |run: &u32| -> Option<f64> {
        let mut sum = 0.0;
        for group in logs {
            sum += group.get(scheme)?.get(run)?[i] - group.get(baseline)?.get(run)?[i];
        }
        Some(sum / logs.len() as f64)
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

/// Geometric mean and its 95 % percentile bootstrap interval, from logarithms.
fn geometric(x: &[f64], picks: &[Vec<usize>]) -> Option<(f64, f64, f64)> {
    if x.is_empty() {
        return None;
    }
    let n = x.len() as f64;
    let mut means: Vec<f64> = picks
        .iter()
        .map(|pick| pick.iter().map(|k| x[*k]).sum::<f64>() / n)
        .collect();
    let (low, high) = percentiles95(&mut means);
    Some(((x.iter().sum::<f64>() / n).exp(), low.exp(), high.exp()))
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
