//! Median, mean, worst, and bootstrap intervals.

use super::{Group, Row};
use crate::experiment::run::TIMES_MIN;
use crate::simulator::imu::world::StartName;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use std::collections::BTreeMap;

/// Resamplings of the bootstrap.
pub(super) const RESAMPLINGS: usize = 2000;

/// One cell of the results.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Group of errors.
    pub error_model: Group,
    /// Scheme.
    pub scheme: String,
    /// Minutes of free-inertial navigation.
    pub t_min: u32,
    /// Runs.
    pub n: usize,
    /// Median horizontal error, m.
    pub median_m: f64,
    /// Mean, m.
    pub mean_m: f64,
    /// Worst, m.
    pub max_m: f64,
    /// Lower end of the 95 % bootstrap interval of the median, m.
    pub lo95_m: f64,
    /// Upper end, m.
    pub hi95_m: f64,
    /// Earlier drives of each unit.
    pub drives: u32,
    /// How warm the units were at power-on: the campaign's setting.
    pub start: StartName,
}

/// Sums up by error group, number of earlier drives, scheme and time, in the order of first
/// appearance. `start` is the campaign's setting.
#[must_use]
pub fn summarise(rows: &[Row], start: StartName) -> Vec<Summary> {
    let mut order = Vec::new();
    let mut groups: BTreeMap<_, Vec<&Row>> = BTreeMap::new();
    for row in rows {
        let key = (row.error_model.rank(), row.drives, row.scheme.clone());
        if !groups.contains_key(&key) {
            order.push(key.clone());
        }
        groups.entry(key).or_default().push(row);
    }
    order.sort_by_key(|(rank, drives, _)| (*rank, *drives));
    order
        .iter()
        .flat_map(|key| {
            let rows = &groups[key];
            TIMES_MIN
                .iter()
                .enumerate()
                .map(|(i, t)| cell(rows, i, *t, start))
                .collect::<Vec<_>>()
        })
        .collect()
}

fn cell(rows: &[&Row], i: usize, t_min: u32, start: StartName) -> Summary {
    let mut x: Vec<f64> = rows.iter().map(|r| r.horizontal_m[i]).collect();
    let median_m = median(&mut x);
    let (lo95_m, hi95_m) = interval(&x, u64::from(t_min));
    Summary {
        error_model: rows[0].error_model,
        scheme: rows[0].scheme.clone(),
        t_min,
        n: x.len(),
        median_m,
        mean_m: x.iter().sum::<f64>() / x.len() as f64,
        max_m: x[x.len() - 1],
        lo95_m,
        hi95_m,
        drives: rows[0].drives,
        start,
    }
}

/// Median of at least one value. Sorts the values.
#[must_use]
pub fn median(x: &mut [f64]) -> f64 {
    x.sort_by(f64::total_cmp);
    let n = x.len();
    0.5 * (x[(n - 1) / 2] + x[n / 2])
}

/// The value below which the share `q` of sorted values lies, between the two nearest values on a
/// straight line. There must be a value.
pub(super) fn quantile(sorted: &[f64], q: f64) -> f64 {
    let at = q * (sorted.len() - 1) as f64;
    let (low, share) = (at.floor() as usize, at.fract());
    let high = (low + 1).min(sorted.len() - 1);
    sorted[low] + share * (sorted[high] - sorted[low])
}

/// 95 % percentile bootstrap of the median of sorted values.
fn interval(x: &[f64], seed: u64) -> (f64, f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut medians: Vec<f64> = (0..RESAMPLINGS)
        .map(|_| {
            // the order statistics of a resample come from sorted indices
            let mut pick: Vec<usize> = (0..x.len()).map(|_| rng.random_range(0..x.len())).collect();
            let n = pick.len();
            let (_, high, _) = pick.select_nth_unstable(n / 2);
            let high = x[*high];
            let (_, low, _) = pick.select_nth_unstable((n - 1) / 2);
            0.5 * (x[*low] + high)
        })
        .collect();
    percentiles95(&mut medians)
}

/// Percentiles 2.5 and 97.5 of a statistic over [`RESAMPLINGS`] resamples.
pub(super) fn percentiles95(resampled: &mut [f64]) -> (f64, f64) {
    let at = |q: f64| ((RESAMPLINGS - 1) as f64 * q).round() as usize;
    let (low, high) = (at(0.025), at(0.975));
    let (below, high, _) = resampled.select_nth_unstable_by(high, f64::total_cmp);
    let (_, low, _) = below.select_nth_unstable_by(low, f64::total_cmp);
    (*low, *high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::imu::ErrorModelName;

    #[test]
    fn median_mean_worst_and_interval() {
        let row = |k| Row::north(ErrorModelName::All, k, "ekf6", f64::from(k));
        let rows: Vec<Row> = (1..=101).map(row).collect();
        let s = summarise(&rows, StartName::Cold);
        assert_eq!(s.len(), 5);
        let last = &s[4];
        assert_eq!(
            (last.n, last.median_m, last.mean_m, last.max_m),
            (101, 51.0, 51.0, 101.0)
        );
        // the interval of a median of 101 ranks 41 and 61 (binomial), to a rank or two
        assert!(
            (last.lo95_m - 41.0).abs() <= 2.0 && (last.hi95_m - 61.0).abs() <= 2.0,
            "{last:?}"
        );
    }
}
