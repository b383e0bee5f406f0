//! Median, mean, worst, and the interval of the median.

use super::{Group, Row};
use crate::experiment::run::TIMES_MIN;
use host_core::simulator::imu::world::StartName;
use serde::Serialize;
use statrs::distribution::{Binomial, DiscreteCDF};
use std::collections::BTreeMap;

/// One cell of the results.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Group of errors.
    pub error_model: Group,
    /// Scheme.
    pub scheme: String,
    /// Minutes of free-inertial navigation.
    pub t_min: u32,
    /// Number of runs.
    pub n: usize,
    /// Median horizontal error, m.
    pub median_m: f64,
    /// Mean, m.
    pub mean_m: f64,
    /// Worst, m.
    pub max_m: f64,
    /// Lower end of the 95 % interval of the median, m; `None` with fewer than [`FEWEST`] runs.
    pub lo95_m: Option<f64>,
    /// Upper end, m.
    pub hi95_m: Option<f64>,
    /// Earlier drives of each unit.
    pub drives: u32,
    /// Temperature of the units at power-on (the campaign's setting): cold, warm or hot.
    pub start: StartName,
}

/// The statistics by error group, number of earlier drives, scheme and time, in the order of first
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
    let (lo95_m, hi95_m) = interval(&x).unzip();
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

/// The value below which the share `q` of sorted values lies, interpolated linearly between the two
/// nearest values. There must be a value.
pub(super) fn quantile(sorted: &[f64], q: f64) -> f64 {
    let at = q * (sorted.len() - 1) as f64;
    let (low, share) = (at.floor() as usize, at.fract());
    let high = (low + 1).min(sorted.len() - 1);
    sorted[low] + share * (sorted[high] - sorted[low])
}

/// Smallest number of runs for a 95 % interval: five runs agree by chance in one case of sixteen,
/// which is more than 5 %.
pub const FEWEST: usize = 6;

/// Probability of each tail of a 95 % interval.
const TAIL: f64 = 0.025;

/// The 95 % interval of the median of the distribution of sorted values: from the value of a rank
/// to that of the same rank from above, by the sign test. `None` with fewer than [`FEWEST`].
///
/// It holds for every distribution and every number of values, with ties too. None of the narrower
/// ones does. The table has the number of 100 intervals, of the median or of the mean, that miss,
/// with 6, 10, 20 and 50 values:
///
/// | interval | normal | log-normal | 80 % at -0.5, 20 % at 2 |
/// |---|---|---|---|
/// | this one | 3, 2, 4, 3 | 3, 2, 4, 4 | 3, 2, 4, 3 |
/// | Student's t | 5, 5, 5, 5 | 18, 16, 13, 10 | 26, 11, 8, 6 |
/// | Wilcoxon's | 3, 5, 5, 5 | 3, 7, 12, 24 | 3, 6, 7, 13 |
/// | percentile bootstrap of the mean | 14, 10, 7, 6 | 26, 20, 14, 10 | 28, 12, 8, 6 |
///
/// For normal values it is 1.3 to 1.8 times as wide as Student's.
pub(super) fn interval(sorted: &[f64]) -> Option<(f64, f64)> {
    let n = sorted.len();
    let below = Binomial::new(0.5, n as u64).ok()?.inverse_cdf(TAIL);
    // number of values outside at each end
    let outside = (below as usize).checked_sub(1)?;
    Some((sorted[outside], sorted[n - 1 - outside]))
}

/// An interval in words, its ends by `shown`.
pub fn between(interval: Option<(f64, f64)>, shown: impl Fn(f64) -> String) -> String {
    interval.map_or_else(
        || "too few runs".to_owned(),
        |(low, high)| format!("{} .. {}", shown(low), shown(high)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::simulator::imu::ErrorModelName;

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
        // the ranks of 101 by a table of the sign test
        assert_eq!((last.lo95_m, last.hi95_m), (Some(41.0), Some(61.0)));
    }
}
