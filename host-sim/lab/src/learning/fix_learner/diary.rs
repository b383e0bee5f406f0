//! The course of the device's learner in a drive: the candidates in force with their times, the
//! estimated sensor errors, and the results of the rehearsals of each candidate. It only observes.

use firmware::learn::FixLearner;
use firmware::learn::bank::{HYPOTHESES, SIX_BIASES, ZERO_CORRECTION};

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
    /// Estimated sensor errors: rates, rad/s, then specific forces, m/s2.
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
    /// Time since the first sample, s, and the candidate that is in force from then on.
    pub changes: Vec<(usize, usize)>,
    /// The candidates, in the order of `firmware::learn::bank::NAMES`. Empty before the end.
    pub candidates: Vec<Candidate>,
    /// Rehearsals of each length of `firmware::learn::rehearsal::HORIZONS_S` that have ended.
    pub rehearsals: Vec<u16>,
    /// Fixes that were compared with the navigator, and how many of them were rejected as outliers.
    pub fixes: [u32; 2],
    /// Fixes that arrived too late to be used.
    pub late: u32,
}

impl Diary {
    /// Records second `t_s`.
    pub(super) fn second(&mut self, t_s: usize, learner: &FixLearner<'_>) {
        let running = learner.running();
        let before = self.changes.last().map_or(0, |(_, before)| *before);
        if running != before {
            self.changes.push((t_s, running));
        }
        if !t_s.is_multiple_of(EVERY_S) {
            return;
        }
        let (bank, rehearsal) = (learner.bank(), learner.rehearsal());
        let candidate = match bank.leading() {
            ZERO_CORRECTION => SIX_BIASES,
            other => other,
        };
        self.entries.push(Entry {
            t_s,
            candidate,
            estimate: *bank.estimate_of(candidate),
            sigma: bank.bias_sigma_of(candidate),
            proof: std::array::from_fn(|h| rehearsal.standing(h).proof),
            check: std::array::from_fn(|h| rehearsal.standing(h).check),
        });
    }

    /// Time from which the last candidate is in force, s. `None` if there was no change.
    #[must_use]
    pub fn since(&self) -> Option<usize> {
        self.changes.last().map(|(since, _)| *since)
    }
}
