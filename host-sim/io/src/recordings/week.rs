//! The end of a GPS week, where seconds of week begin anew.

use crate::recordings::WEEK_S;
use crate::recordings::record::Record;

/// Longest gap over the end of a week, s. A longer step back is no end of a week.
const MOST_GAP_S: f64 = 600.0;
/// Least overlap of samples and fixes for which nothing is moved, s.
const OVERLAP_S: f64 = 1.0;

/// Seconds of week that continue over the end of a week.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Unwrapped {
    last: Option<f64>,
    weeks: f64,
}

impl Unwrapped {
    /// The next time of a list, s.
    pub(super) fn on(&mut self, second: f64) -> f64 {
        let passed = self.last.map(|last| second + WEEK_S - last);
        let ended = passed.is_some_and(|s| s > 0.0 && s < MOST_GAP_S);
        if ended && (0.0..MOST_GAP_S).contains(&second) {
            self.weeks += WEEK_S;
        }
        self.last = Some(second);
        second + self.weeks
    }

    /// The note on `what`, if a week has ended.
    pub(super) fn note(&self, what: &str) -> Option<String> {
        (self.weeks > 0.0).then(|| {
            format!("The seconds of week of the {what} begin anew; they are taken to continue.")
        })
    }
}

/// Moves fixes and wheels by a week where the samples are of the other side of a week's end.
pub(super) fn join(record: &mut Record) {
    let ends = record.time.start().zip(record.time.end());
    let Some((from, to)) = ends else {
        return;
    };
    let week = |first: f64, last: f64| {
        let overlap = |by: f64| (last + by).min(to) - (first + by).max(from);
        let mut weeks = [0.0, WEEK_S, -WEEK_S].into_iter();
        weeks.find(|by| overlap(*by) > OVERLAP_S)
    };
    let wheels = record.wheels.first().zip(record.wheels.last());
    if let Some(by) = wheels.and_then(|([first, _], [last, _])| week(*first, *last)) {
        record.wheels.iter_mut().for_each(|[time, _]| *time += by);
    }
    let fixes = record.fixes.first().zip(record.fixes.last());
    let fixes = fixes.filter(|_| record.fixes.len() > 1);
    let by = fixes.and_then(|(first, last)| week(first.time, last.time));
    if let Some(by) = by.filter(|by| *by != 0.0) {
        record.move_fixes(by);
        let note = "The fixes are moved by a week, because samples and fixes lie on both sides of \
                    its end.";
        record.notes.push(note.to_owned());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_end_of_a_week_continues() {
        let mut time = Unwrapped::default();
        let all = [604_799.0, 604_799.99, 0.01, 1.0, 604_799.9, 0.0];
        let want = [
            604_799.0,
            604_799.99,
            604_800.01,
            604_801.0,
            1_209_599.9,
            1_209_600.0,
        ];
        for (second, want) in all.iter().zip(want) {
            assert!((time.on(*second) - want).abs() < 1e-6, "{second}");
        }
        assert!(time.note("samples").is_some());
        // a step back in the middle of a week, or into it, is a fault of the file
        for all in [[1000.0, 3.0], [604_799.0, 1000.0], [604_000.0, 5.0]] {
            let mut time = Unwrapped::default();
            for second in all {
                assert_eq!(time.on(second), second);
            }
            assert_eq!(time.note("samples"), None);
        }
    }
}
