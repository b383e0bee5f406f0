//! The course of the device's learner in a drive: which hypothesis had proved itself when, the
//! estimated sensor errors, and the results of the rehearsals. It only observes.

use firmware::app::App;
use firmware::learn::bank::{HYPOTHESES, SIX_BIASES, ZERO_CORRECTION};
use firmware::learn::rehearsal::{PROVED, of_100};
use firmware::learn::{Report, Trial, Trials};
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
    /// Interruptions of the navigation.
    pub interruptions: Vec<Interruption>,
    /// The capital that was nearest to a proof in the last second of navigation, in stakes.
    nearest: Option<f32>,
}

/// The navigator was lost, and with it what its rehearsals had won beyond ten stakes.
#[derive(Debug, Clone, PartialEq)]
pub struct Interruption {
    /// When it was seen, s after the first sample.
    pub t_s: usize,
    /// The samples that were missing just before, if any were: when, and for how long, s.
    pub gap_s: Option<[f64; 2]>,
    /// How near the proof was before, of 100.
    pub proof: u8,
    /// When it navigated again, s after the first sample, and how near the proof was then.
    pub again: Option<(usize, u8)>,
}

/// A gap explains an interruption that was seen so soon after its end, s.
const EXPLAINS_S: f64 = 3.0;
/// The pace of a proof is taken over so long, s.
const PACE_S: usize = 300;

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

    /// Notes interruptions of the navigation.
    fn watches(&mut self, t_s: usize, app: &App<'_>, navigates: bool, gap: Option<Range<f64>>) {
        let each = app.trials().map(|trials| trials.each);
        let tried = each.iter().flatten().skip(1).filter(|trial| trial.enabled);
        let capital = tried.fold(0.0_f32, |most, trial| most.max(trial.standing.proof));
        let before = std::mem::replace(&mut self.nearest, navigates.then_some(capital));
        match (before, navigates) {
            (Some(before), false) => {
                let recent = gap.filter(|gap| t_s as f64 - gap.end <= EXPLAINS_S);
                self.interruptions.push(Interruption {
                    t_s,
                    gap_s: recent.map(|gap| [gap.start, gap.end - gap.start]),
                    proof: of_100(before, false),
                    again: None,
                });
            }
            (None, true) => {
                if let Some(last) = self.interruptions.last_mut() {
                    last.again = Some((t_s, of_100(capital, false)));
                }
            }
            _ => {}
        }
    }

    /// How much longer the proof of a candidate takes at its pace of the last five minutes, or
    /// since the last interruption, s. `None`: it does not come nearer.
    #[must_use]
    pub fn takes_s(&self, candidate: usize) -> Option<f64> {
        let last = self.entries.last()?;
        let again = self.interruptions.iter().filter_map(|of| of.again);
        let since = again.map(|(t_s, _)| t_s).max().unwrap_or(0);
        let since = since.max(last.t_s.saturating_sub(PACE_S));
        let first = self.entries.iter().find(|entry| entry.t_s >= since)?;
        let [from, to] = [first, last].map(|entry| f64::from(entry.proof[candidate]).max(1.0).ln());
        let pace = (to - from) / (last.t_s - first.t_s) as f64;
        (pace > 0.0).then(|| (f64::from(PROVED).ln() - to).max(0.0) / pace)
    }

    /// The diary with the state at the end.
    pub(super) fn closed(self, report: &Report, trials: Option<&Trials>) -> Self {
        let candidate = |trial: &Trial| Candidate {
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
