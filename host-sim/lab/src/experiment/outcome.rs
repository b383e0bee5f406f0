//! Result of a replay: errors of each scheme some seconds into free-inertial navigation.

use crate::experiment::protocol::Judged;
use crate::experiment::results::{Curves, Row};
use firmware::compensator::Limit;
use firmware::model::Nets;
use host_core::inertial::free_inertial::FreeInertial;
use host_core::inertial::session::Session;
use host_estimation::analysis::doubts::Warning;
use host_estimation::analysis::error_bound::error_bound;
use host_estimation::learning::device::{Course, Diary, Entry};
use serde::Serialize;
use std::ops::Range;

/// The device's results on the learning part, and its error bound.
#[derive(Debug, Clone, PartialEq)]
pub struct Bench {
    /// The device's phases on the learning part.
    pub course: Course,
    /// The course of its learning.
    pub diary: Diary,
    /// Standard deviations of six biases after each second of the learning part, rad/s, then m/s2:
    /// what a filter can know of them that does not estimate scale factors, misalignments and
    /// g-sensitivity, by the unit file's sigmas of these.
    pub considered: Vec<[f64; 6]>,
    /// The networks that act from the next power-on.
    pub nets: Nets,
    /// Largest error that corrections within their limits can add 5, 10, 15, 20 and 22 min after an
    /// alignment, m.
    pub bound_m: [u32; 5],
    /// [`Self::bound_m`] in a sentence.
    pub bound: String,
    /// Time of second 0 on the clock of the recording, s.
    pub begin_s: f64,
    /// The learning part, s since power-on.
    pub learn: Range<usize>,
    /// The judged part, s since power-on.
    pub judge: Range<usize>,
    /// Standard deviation of the fixes of the reference, along the worse of north and east, m: the
    /// median over the judged part. `None` if the reference is a better solution.
    pub reference_sigma_m: Option<f64>,
}

impl Bench {
    /// Standard deviation of a bias that the device believed in an entry of its diary: the larger
    /// of what it claims and of [`Self::considered`].
    #[must_use]
    pub fn sigma(&self, entry: &Entry, axis: usize) -> f64 {
        let then = entry
            .t_s
            .checked_sub(1)
            .and_then(|k| self.considered.get(k));
        f64::from(entry.sigma[axis]).max(then.map_or(0.0, |of| of[axis]))
    }

    /// The results of a session that was judged against its fixes.
    #[must_use]
    pub(super) fn of(
        device: &Judged,
        session: &Session,
        limit: Limit,
        learn: Range<usize>,
        judge: Range<usize>,
    ) -> Self {
        let (bound, sentence) = error_bound(session, limit);
        let fixes = session.fixes.get(judge.clone()).unwrap_or_default();
        let sigma = fixes.iter().flatten().filter(|fix| fix.has(0..2));
        let mut sigma: Vec<f64> = sigma.map(|fix| fix.sigmas[0].max(fix.sigmas[1])).collect();
        sigma.sort_by(f64::total_cmp);
        Self {
            course: device.course.clone(),
            diary: device.diary.clone(),
            considered: device.considered.clone(),
            nets: device.nets,
            bound_m: bound.table(),
            bound: sentence,
            begin_s: 0.0,
            learn,
            judge,
            reference_sigma_m: sigma.get(sigma.len() / 2).copied(),
        }
    }
}

/// One case of a replay.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// [`SCHEMA`](crate::experiment::results::SCHEMA).
    pub schema: u32,
    /// Recording, for example `fog-mems` or `kitti-0027`.
    pub recording: String,
    /// The learning part and the judged part.
    pub case: String,
    /// Where the navigators begin the judged part, in a sentence.
    pub start: String,
    /// How far samples and fixes around that state contradict each other, where 1 is expected.
    #[serde(skip)]
    pub residual: Option<f64>,
    /// Rows, times ascending, schemes in display order within a time.
    pub rows: Vec<Row>,
    /// Notes for the reader, in sentences.
    pub notes: Vec<String>,
    /// Contradictions between the recording and its header or unit.
    pub warnings: Vec<Warning>,
    /// The curves of the page.
    #[serde(skip)]
    pub curves: Curves,
    /// The device's results.
    #[serde(skip)]
    pub bench: Option<Box<Bench>>,
}

/// Rows of several solutions of one case. Times after the end of a solution are left out.
#[must_use]
pub fn rows(solutions: &[(&str, FreeInertial)], times_s: &[u32]) -> Vec<Row> {
    times_s
        .iter()
        .flat_map(|t| solutions.iter().filter_map(|(s, c)| Row::of(c, s, *t)))
        .collect()
}

impl Outcome {
    /// Horizontal error of a scheme at a time, m.
    #[must_use]
    pub fn horizontal(&self, scheme: &str, t_s: u32) -> Option<f64> {
        let hit = |r: &&Row| r.scheme == scheme && r.t_s == t_s;
        self.rows.iter().find(hit).map(|r| r.horizontal_m)
    }
}

/// Horizontal errors as a text table, one line a case and scheme, one column a time.
#[must_use]
pub fn table(outcomes: &[Outcome]) -> String {
    let mut times: Vec<u32> = outcomes
        .iter()
        .flat_map(|o| o.rows.iter().map(|r| r.t_s))
        .collect();
    times.sort_unstable();
    times.dedup();
    let mut table = comfy_table::Table::new();
    table.load_preset(comfy_table::presets::ASCII_MARKDOWN);
    let head = ["recording", "case", "scheme"].map(String::from);
    table.set_header(
        head.into_iter()
            .chain(times.iter().map(|t| format!("{t} s, m"))),
    );
    for outcome in outcomes {
        let mut schemes: Vec<&str> = Vec::new();
        for row in &outcome.rows {
            if !schemes.contains(&row.scheme.as_str()) {
                schemes.push(&row.scheme);
            }
        }
        for scheme in schemes {
            let cell = |t: &u32| {
                outcome
                    .horizontal(scheme, *t)
                    .map_or("-".into(), |m| format!("{m:.1}"))
            };
            let start = [
                outcome.recording.clone(),
                outcome.case.clone(),
                scheme.to_owned(),
            ];
            table.add_row(start.into_iter().chain(times.iter().map(cell)));
        }
    }
    table.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::results::SCHEMA;
    use nalgebra::Vector3;

    #[test]
    fn rows_end_with_the_coast_and_the_table_says_so() {
        let free = |n: usize, e: f64| FreeInertial {
            position: (0..n)
                .map(|k| Vector3::new(3.0 * e, 4.0 * e, 9.0) * k as f64)
                .collect(),
            velocity: vec![Vector3::new(1.0, 2.0, 3.0); n],
            track: Vec::new(),
        };
        let rows = rows(&[("raw", free(21, 1.0)), ("rnn", free(11, 0.1))], &[10, 20]);
        let got: Vec<(u32, &str)> = rows.iter().map(|r| (r.t_s, r.scheme.as_str())).collect();
        assert_eq!(got, [(10, "raw"), (10, "rnn"), (20, "raw")]);
        let outcome = Outcome {
            schema: SCHEMA,
            recording: "r".into(),
            case: "c".into(),
            start: String::new(),
            residual: None,
            rows,
            notes: Vec::new(),
            warnings: Vec::new(),
            curves: Curves::default(),
            bench: None,
        };
        assert_eq!(outcome.horizontal("raw", 20), Some(100.0));
        let text = table(&[outcome]);
        assert!(
            text.contains("20 s, m") && text.contains("100.0") && text.contains("5.0"),
            "{text}"
        );
        let rnn = text.lines().find(|l| l.contains("rnn")).unwrap();
        assert!(rnn.trim_end_matches(['|', ' ']).ends_with('-'), "{rnn}");
    }
}
