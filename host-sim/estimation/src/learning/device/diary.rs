//! The course of the device's learner in a drive: which hypothesis had proved itself when, the
//! estimated sensor errors, and the results of the rehearsals. It only observes.

use firmware::app::App;
use firmware::learn::bank::{HYPOTHESES, SIX_BIASES, ZERO_CORRECTION};
use firmware::learn::{Report, Trial, Trials};
use host_device::device::proof::{self, Proofs};
use std::ops::Range;

/// Seconds between two entries.
pub const EVERY_S: usize = 10;

/// The learner at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Time since the first sample, s.
    pub t_s: usize,
    /// The candidate with the greatest evidence; where that is the one without any correction, the
    /// biases.
    pub candidate: usize,
    /// Sensor errors by the hypothesis that its navigator follows: rates, rad/s, then specific
    /// forces, m/s2.
    pub estimate: [f32; 6],
    /// Standard deviations of its biases, in the same units.
    pub sigma: [f32; 6],
    /// Largest capital of each candidate's bets that it is useful, in stakes.
    pub proof: [f32; HYPOTHESES],
    /// Smallest capital of its bets that it does no harm, in stakes.
    pub check: [f32; HYPOTHESES],
}

/// A candidate of the learner at the end of the drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Whether it takes part.
    pub enabled: bool,
    /// Whether its rehearsals have proven that it is useful.
    pub proved: bool,
    /// Whether its rehearsals have found that it does harm.
    pub harms: bool,
    /// Log-likelihood of the fixes with it, relative to that without any correction.
    pub evidence: f64,
}

/// The diary of a drive; see the module.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Diary {
    /// One entry every [`EVERY_S`] seconds from the start of navigation on.
    pub entries: Vec<Entry>,
    /// Time since the first sample, s, and the candidate that has proved itself from then on; the
    /// zero correction where none has.
    pub changes: Vec<(usize, usize)>,
    /// The candidates, in the order of `firmware::learn::bank::NAMES`. Empty where it never
    /// navigated.
    pub candidates: Vec<Candidate>,
    /// Rehearsals of each length of `firmware::learn::rehearsal::HORIZONS_S` that have ended.
    pub rehearsals: Vec<u16>,
    /// Fixes that were compared with the navigator, and how many of them were rejected as outliers.
    pub fixes: [u32; 2],
    /// Fixes that arrived too late to be used.
    pub late: u32,
    /// How the proofs went on, in s after the first sample.
    pub proofs: Proofs,
}

/// A gap explains an interruption that was seen so soon after its end, s.
const EXPLAINS_S: f64 = 3.0;

impl Diary {
    /// Records second `t_s`. `gap`: the last missing samples so far, s.
    pub(super) fn second(&mut self, t_s: usize, app: &App<'_>, gap: Option<Range<f64>>) {
        let report = app.learning();
        self.watches(t_s, app, report.navigates, gap);
        if !report.navigates {
            return;
        }
        let running = usize::from(report.winner);
        let before = self.changes.last().map_or(ZERO_CORRECTION, |of| of.1);
        if running != before {
            self.changes.push((t_s, running));
        }
        if !t_s.is_multiple_of(EVERY_S) {
            return;
        }
        let (Some(trials), Some(solution)) = (app.trials(), app.solution()) else {
            return;
        };
        let six = |[[a, b, c], [d, e, f]]: [[f32; 3]; 2]| [a, b, c, d, e, f];
        self.entries.push(Entry {
            t_s,
            candidate: match trials.leading {
                ZERO_CORRECTION => SIX_BIASES,
                other => other,
            },
            estimate: six(solution.estimate),
            sigma: six(solution.sigma),
            proof: trials.each.map(|trial| trial.standing.proof),
            check: trials.each.map(|trial| trial.standing.check),
        });
    }

    /// Notes the proofs and interruptions of the navigation.
    fn watches(&mut self, t_s: usize, app: &App<'_>, navigates: bool, gap: Option<Range<f64>>) {
        let t_s = t_s as f64;
        let candidates = app.trials().map(|trials| {
            trials.each.map(|trial| proof::Candidate {
                enabled: trial.enabled,
                proved: trial.proved,
                capital: trial.standing.proof,
            })
        });
        self.proofs.note(t_s, navigates, candidates, || {
            let gap = gap.filter(|gap| t_s - gap.end <= EXPLAINS_S)?;
            let time = gap.end - gap.start;
            Some(format!("a gap of {time:.2} s at {:.1} s", gap.start))
        });
    }

    /// The diary with the state at the end.
    pub(super) fn closed(self, report: &Report, trials: Option<&Trials>) -> Self {
        let candidate = |trial: &Trial| Candidate {
            enabled: trial.enabled,
            proved: trial.proved,
            harms: trial.standing.harms(),
            evidence: trial.evidence,
        };
        let each = trials.map_or(&[][..], |trials| &trials.each);
        Self {
            candidates: each.iter().map(candidate).collect(),
            rehearsals: trials.map_or(Vec::new(), |trials| trials.ended.to_vec()),
            fixes: [report.fixes, report.refused],
            late: report.late,
            ..self
        }
    }

    /// The hypothesis that has proved itself at the end, and since when, s. `None`: none.
    #[must_use]
    pub fn proved(&self) -> Option<(usize, usize)> {
        let last = self.changes.last().copied();
        last.filter(|(_, candidate)| *candidate != ZERO_CORRECTION)
    }
}
