//! Statistics of the runs of a case.

use super::case::Case;
use super::names::{Activation, Computer, Sensor};
use super::run::Judged;
use crate::campaign::median_of;
use serde::Serialize;
use std::collections::BTreeMap;

/// Largest allowed ratio of the corrected to the raw error: in the median, and in the worst run.
pub const LIMITS: [f64; 2] = [1.02, 1.10];
/// Share of the undisturbed gain that must be recovered after the end of a disturbance.
pub const GAIN_KEPT: f64 = 0.8;
/// Smallest error in the ratio of a run, m. Differences of smaller errors do not matter.
const FLOOR_M: f64 = 1.0;
/// Smallest gain that is judged, as a share of the raw error.
const LEAST_GAIN: f64 = 0.05;

/// All runs of a case with one sensor, computer and activation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Name of the case.
    pub case: String,
    /// The sensor.
    pub sensor: Sensor,
    /// The navigation computer.
    pub computer: Computer,
    /// When corrections act.
    pub activation: Activation,
    /// Number of runs.
    pub runs: usize,
    /// Median of the horizontal errors without the device, m.
    pub raw_median_m: f64,
    /// Median of those with its corrections, m.
    pub corrected_median_m: f64,
    /// The second median divided by the first.
    pub ratio_median: f64,
    /// Median of the ratios of the runs.
    pub ratio_of_runs_median: f64,
    /// Largest ratio of a run.
    pub ratio_worst: f64,
    /// Number of that run.
    pub ratio_worst_run: u32,
    /// Number of runs whose ratio exceeds the limit of the worst run.
    pub runs_worse: usize,
    /// Share of the runs in which the device corrected something.
    pub promoted_share: f64,
    /// Share of the runs in which it rolled a correction back.
    pub rolled_back_share: f64,
    /// The gain as a share of that without a disturbance, for a disturbance that ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gain_kept: Option<f64>,
    /// Faults that the device raised in any run: bits of `fault` of the command link.
    pub faults: u32,
}

impl Summary {
    /// Whether correcting harms.
    #[must_use]
    pub fn harms(&self) -> bool {
        let [median, worst] = LIMITS;
        // NaN harms
        !(self.ratio_median <= median && self.ratio_worst <= worst)
    }

    /// Whether correcting gains: the reverse of harm in the median, and no harm.
    #[must_use]
    pub fn gains(&self) -> bool {
        !self.harms() && self.ratio_median < 1.0 / LIMITS[0]
    }

    /// Whether too little of the gain is recovered after the disturbance.
    #[must_use]
    pub fn loses(&self) -> bool {
        self.gain_kept
            .is_some_and(|gain| gain.is_nan() || gain < GAIN_KEPT)
    }
}

/// The ratio of a run, with errors of at least [`FLOOR_M`].
fn ratio(row: &Judged) -> f64 {
    row.corrected_m.max(FLOOR_M) / row.raw_m.max(FLOOR_M)
}

/// The statistics of all rows, in the order of the cases.
#[must_use]
pub fn summarise(rows: &[Judged], cases: &[Case]) -> Vec<Summary> {
    let position = |name: &str| cases.iter().position(|case| case.name() == name);
    let mut groups: BTreeMap<_, Vec<&Judged>> = BTreeMap::new();
    for row in rows {
        let key = (
            row.sensor,
            row.activation,
            row.computer,
            position(&row.case),
            &row.case,
        );
        groups.entry(key).or_default().push(row);
    }
    let mut all: Vec<Summary> = groups.values().map(|rows| of(rows)).collect();
    let clean: Vec<Summary> = all.iter().filter(|of| of.case == "none").cloned().collect();
    for one in &mut all {
        if position(&one.case).is_some_and(|index| cases[index].ends()) {
            let key = |of: &Summary| (of.sensor, of.activation, of.computer);
            let clean = clean.iter().find(|clean| key(clean) == key(one));
            one.gain_kept = clean.and_then(|clean| gain_share(one, clean));
        }
    }
    all
}

/// The gain as a share of that of the undisturbed case, if that is at least [`LEAST_GAIN`]; to two
/// digits, as rows are written, so that a page counts what its rows say.
fn gain_share(of: &Summary, clean: &Summary) -> Option<f64> {
    let gain = |of: &Summary| 1.0 - of.ratio_median;
    (gain(clean) > LEAST_GAIN).then(|| (100.0 * gain(of) / gain(clean)).round() / 100.0)
}

fn of(rows: &[&Judged]) -> Summary {
    let first = rows[0];
    let median = |value: fn(&Judged) -> f64| {
        median_of(&mut rows.iter().map(|row| value(row)).collect::<Vec<f64>>())
    };
    let share = |is: fn(&Judged) -> bool| {
        rows.iter().filter(|row| is(row)).count() as f64 / rows.len() as f64
    };
    let worst = rows.iter().max_by(|a, b| ratio(a).total_cmp(&ratio(b)));
    let worst = worst.copied().unwrap_or(first);
    let [raw, corrected] = [median(|row| row.raw_m), median(|row| row.corrected_m)];
    Summary {
        case: first.case.clone(),
        sensor: first.sensor,
        computer: first.computer,
        activation: first.activation,
        runs: rows.len(),
        raw_median_m: raw,
        corrected_median_m: corrected,
        ratio_median: corrected.max(FLOOR_M) / raw.max(FLOOR_M),
        ratio_of_runs_median: median(ratio),
        ratio_worst: ratio(worst),
        ratio_worst_run: worst.run,
        runs_worse: rows.iter().filter(|row| ratio(row) > LIMITS[1]).count(),
        promoted_share: share(|row| row.promoted),
        rolled_back_share: share(|row| row.rolled_back),
        gain_kept: None,
        faults: rows.iter().fold(0, |all, row| all | row.faults),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(case: &str, run: u32, raw_m: f64, corrected_m: f64) -> Judged {
        Judged {
            case: case.into(),
            sensor: Sensor::Errors,
            computer: Computer::Plain,
            activation: Activation::Live,
            run,
            raw_m,
            corrected_m,
            promoted: run == 0,
            rolled_back: false,
            faults: 1 << run,
        }
    }

    #[test]
    fn harm_is_in_the_median_or_in_the_worst_run() {
        let cases: Vec<Case> = ["none", "late-0.5:ended"]
            .map(|name| name.parse().unwrap())
            .into();
        let rows = [
            row("none", 0, 100.0, 50.0),
            row("none", 1, 200.0, 100.0),
            row("none", 2, 400.0, 300.0),
            row("late-0.5:ended", 0, 100.0, 120.0),
            row("late-0.5:ended", 1, 200.0, 150.0),
            row("late-0.5:ended", 2, 400.0, 300.0),
        ];
        let [clean, late] = &summarise(&rows, &cases)[..] else {
            panic!("two groups");
        };
        assert_eq!((clean.ratio_median, clean.ratio_worst), (0.5, 0.75));
        assert!(!clean.harms() && clean.gain_kept.is_none());
        assert_eq!((late.ratio_median, late.ratio_worst), (0.75, 1.2));
        assert_eq!((late.ratio_worst_run, late.faults), (0, 7));
        assert_eq!((late.gain_kept, late.loses()), (Some(0.5), true));
        assert!(late.harms());
        // the median alone
        let rows = [row("none", 0, 100.0, 103.0), row("none", 1, 100.0, 103.0)];
        assert!(summarise(&rows, &cases)[0].harms());
        // errors below the floor do not harm, and NaN does
        assert!(!summarise(&[row("none", 0, 0.1, 0.9)], &cases)[0].harms());
        assert!(summarise(&[row("none", 0, 100.0, f64::INFINITY)], &cases)[0].harms());
    }
}
