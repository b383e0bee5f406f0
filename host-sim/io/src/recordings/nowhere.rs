//! Lines and messages of a receiver that hold no fix.
//!
//! A receiver without a fix fills the position with zeros, with its last value, or with `nan`, and
//! says so in another field. Off the coast of Africa, at latitude and longitude 0, there is nothing
//! that drives; and nothing passes both zeros to the last digit.

use host_core::words::{agrees, counted};

/// Whether a position is the one that receivers give when they have none.
#[must_use]
pub(super) fn is_nowhere(lat_deg: f64, lon_deg: f64) -> bool {
    let is_zero = |degrees: f64| degrees.abs() < 1e-9;
    is_zero(lat_deg) && is_zero(lon_deg) || lat_deg.is_nan() || lon_deg.is_nan()
}

/// Fixes that were left out, by their reason, for a note.
#[derive(Debug, Clone, Default)]
pub(super) struct LeftOut {
    reasons: Vec<(String, usize, [f64; 2])>,
}

impl LeftOut {
    /// Counts a fix of this time, s.
    pub(super) fn count(&mut self, reason: &str, time: f64) {
        match self.reasons.iter_mut().find(|(known, ..)| known == reason) {
            Some((_, count, [_, last])) => {
                *count += 1;
                *last = time;
            }
            None => self.reasons.push((reason.to_owned(), 1, [time; 2])),
        }
    }

    /// Number of all.
    pub(super) fn all(&self) -> usize {
        self.reasons.iter().map(|(_, count, _)| count).sum()
    }

    /// A note for each reason. `source` names the file or topic.
    pub(super) fn notes(&self, source: &str) -> Vec<String> {
        let note = |(reason, count, [first, last]): &(String, usize, [f64; 2])| {
            format!(
                "{source}: {} from {first} to {last} s {} no fix: {reason}.",
                counted(count, "line"),
                agrees(*count, "holds", "hold")
            )
        };
        self.reasons.iter().map(note).collect()
    }

    /// The reasons, for an error.
    pub(super) fn reasons(&self) -> String {
        let all: Vec<&str> = self
            .reasons
            .iter()
            .map(|(reason, ..)| reason.as_str())
            .collect();
        all.join(", and ")
    }
}
