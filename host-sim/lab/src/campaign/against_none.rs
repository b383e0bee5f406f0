//! Each scheme against no correction on the same runs, with the harm counted.

use super::memory::without_memory;
use super::{Group, Ratio, Row, Summary};
use crate::experiment::run::TIMES_MIN;
use host_estimation::learning::NONE;
use std::collections::BTreeMap;

/// Comparison of a scheme with [`NONE`] at the end of the judged drive.
#[derive(Debug, Clone, PartialEq)]
pub struct AgainstNone {
    /// Group of errors. `None`: over all groups.
    pub group: Option<Group>,
    /// Earlier drives of each unit.
    pub drives: u32,
    /// Scheme.
    pub scheme: String,
    /// Runs that have both schemes.
    pub runs: usize,
    /// Number of comparisons: runs, or runs times groups over all groups.
    pub compared: usize,
    /// Number of comparisons in which its error is larger.
    pub worse: usize,
    /// Number of comparisons in which its error is smaller. In the others both are equal.
    pub better: usize,
    /// Largest quotient of both errors in one comparison.
    pub worst: f64,
    /// Median of the quotients over runs; over all groups, that of the geometric mean of each run.
    pub ratio: f64,
    /// Its 95 % interval; `None` with too few runs.
    pub interval: Option<(f64, f64)>,
    /// Median error, m; `None` over all groups.
    pub median_m: Option<f64>,
}

/// The decision by an interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decided {
    /// The errors are larger in most runs.
    Worse,
    /// The errors are smaller in most runs.
    Better,
    /// The errors are the same in every run: nothing was corrected.
    Equal,
    /// Neither is shown, or there are too few runs.
    Nothing,
}

impl AgainstNone {
    /// The decision by the interval.
    #[must_use]
    pub fn decided(&self) -> Decided {
        match self.interval {
            _ if self.worse + self.better == 0 => Decided::Equal,
            Some((low, _)) if low > 1.0 => Decided::Worse,
            Some((_, high)) if high < 1.0 => Decided::Better,
            _ => Decided::Nothing,
        }
    }
}

/// Compares at the last of [`TIMES_MIN`]: each number of earlier drives, all groups together, then
/// each group, schemes in the order of the rows. Empty without the scheme [`NONE`]. Schemes with a
/// memory are left out before their first drive, where they equal schemes without one.
#[must_use]
pub fn against_none(rows: &[Row], ratios: &[Ratio], summary: &[Summary]) -> Vec<AgainstNone> {
    let last = TIMES_MIN.len() - 1;
    let key = |row: &Row| (row.drives, row.error_model.rank(), row.run);
    let uncorrected = rows.iter().filter(|row| row.scheme == NONE);
    let uncorrected: BTreeMap<_, f64> = uncorrected
        .map(|row| (key(row), row.horizontal_m[last]))
        .collect();
    let quotients = |of: &Ratio| -> Vec<f64> {
        let same = |row: &&Row| {
            let (scheme, drives) = (&row.scheme, row.drives);
            let group = of.error_model.is_none_or(|group| group == row.error_model);
            *scheme == of.scheme && drives == of.drives && group
        };
        let quotient = |row: &Row| Some(row.horizontal_m[last] / uncorrected.get(&key(row))?);
        rows.iter().filter(same).filter_map(quotient).collect()
    };
    let median = |of: &Ratio| {
        let mut cells = summary.iter();
        let cell = cells.find(|cell| {
            (Some(cell.error_model), cell.drives, cell.t_min)
                == (of.error_model, of.drives, of.t_min)
                && cell.scheme == of.scheme
        });
        cell.map(|cell| cell.median_m)
    };
    let mut out: Vec<AgainstNone> = ratios
        .iter()
        .filter(|r| r.baseline == NONE && r.t_min == TIMES_MIN[last])
        .filter(|r| r.drives > 0 || without_memory(&r.scheme).is_none())
        .map(|of| {
            let quotients = quotients(of);
            let count = |which: fn(&f64) -> bool| quotients.iter().copied().filter(which).count();
            AgainstNone {
                group: of.error_model,
                drives: of.drives,
                scheme: of.scheme.clone(),
                runs: of.n,
                compared: quotients.len(),
                worse: count(|q| *q > 1.0),
                better: count(|q| *q < 1.0),
                worst: quotients.iter().copied().fold(0.0, f64::max),
                ratio: of.ratio,
                interval: of.interval(),
                median_m: median(of),
            }
        })
        .collect();
    out.sort_by_key(|of| (of.drives, of.group.map(Group::rank)));
    out
}

/// Runs that are missing between run 0 and the last one.
#[must_use]
pub fn missing(rows: &[Row]) -> Vec<u32> {
    let runs: std::collections::BTreeSet<u32> = rows.iter().map(|row| row.run).collect();
    let last = runs.last().copied().unwrap_or(0);
    (0..last).filter(|run| !runs.contains(run)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::{ratios, summarise};
    use host_core::simulator::imu::ErrorModelName;
    use host_core::simulator::imu::world::StartName;

    fn compared(rows: &[Row]) -> Vec<AgainstNone> {
        let cold = StartName::Cold;
        against_none(rows, &ratios(rows, cold), &summarise(rows, cold))
    }

    /// Ten runs of a group: `uncorrected` errs by 100 m, another scheme by these.
    fn rows(group: ErrorModelName, errors: [f64; 10]) -> Vec<Row> {
        let pair = |(run, m): (u32, f64)| {
            let none = Row::north(group, run, NONE, 100.0);
            [none, Row::north(group, run, "ekf6", m)]
        };
        (0..).zip(errors).flat_map(pair).collect()
    }

    #[test]
    fn harm_is_counted_run_by_run_and_over_all_groups() {
        let mut all = rows(ErrorModelName::Noise, [200.0; 10]);
        let [half, equal, worst] = [50.0, 100.0, 700.0];
        let mixed = [half, half, half, half, half, half, half, half, equal, worst];
        all.extend(rows(ErrorModelName::Linear, mixed));
        let of = compared(&all);
        let counts = |k: usize| (of[k].compared, of[k].worse, of[k].better, of[k].worst);
        let groups: Vec<_> = of
            .iter()
            .map(|of| of.group.map(|g| g.to_string()))
            .collect();
        assert_eq!(groups, [None, Some("noise".into()), Some("linear".into())]);
        assert_eq!(counts(0), (20, 11, 8, 7.0));
        assert_eq!(counts(1), (10, 10, 0, 2.0));
        assert_eq!(counts(2), (10, 1, 8, 7.0));
        assert_eq!(of[1].decided(), Decided::Worse);
        assert_eq!(of[2].median_m, Some(50.0));
        assert!((of[1].ratio - 2.0).abs() < 1e-12 && of[1].runs == 10);
    }

    #[test]
    fn few_runs_decide_nothing() {
        let all = rows(ErrorModelName::All, [50.0; 10]);
        assert_eq!(compared(&all)[1].decided(), Decided::Better);
        let below = |runs: u32| -> Vec<Row> {
            let few = all.iter().filter(|row| row.run < runs);
            few.cloned().collect()
        };
        assert_eq!(compared(&below(6))[1].decided(), Decided::Better);
        assert_eq!(compared(&below(5))[1].decided(), Decided::Nothing);
    }

    #[test]
    fn without_no_correction_there_is_nothing_to_compare_and_gaps_are_named() {
        let mut all = rows(ErrorModelName::All, [50.0; 10]);
        all.retain(|row| row.scheme != NONE && row.run != 4);
        assert_eq!(compared(&all), []);
        let same = rows(ErrorModelName::All, [100.0; 10]);
        assert_eq!(compared(&same)[0].decided(), Decided::Equal);
        assert_eq!(missing(&all), [4]);
    }
}
