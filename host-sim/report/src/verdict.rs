//! The verdict of a comparison of schemes, in sentences, harm first.
//!
//! A scheme is worse than no correction if its horizontal error is larger by more than 2 % and by
//! more than 1 m, and better if it is smaller by as much. Smaller differences are ignored. No
//! correction is `raw`, or `none` for a scheme whose start also comes from an aided filter: the
//! effect of that start is no merit of a correction.

use super::figures::length;
use super::table::BASELINE;
use host_lab::campaign::NONE;
use host_lab::experiment::outcome::Outcome;
use host_lab::experiment::results::Results;

/// Smallest differences that count.
const SHARE: f64 = 0.02;
const METRES: f64 = 1.0;
const NO_RESULTS: &str = "There are no results.";

/// The error of one scheme at one time.
#[derive(Debug, Clone, Copy)]
struct Ended<'a> {
    /// Duration of free-inertial navigation, in the unit of [`sentences`].
    after: u32,
    /// Name of the scheme.
    scheme: &'a str,
    /// Horizontal error, m.
    metres: f64,
}

/// The verdict on a run.
#[must_use]
pub fn of_results(results: &Results) -> Vec<String> {
    let ended = results.rows.iter().map(|row| Ended {
        after: row.t_s / 60,
        scheme: &row.scheme,
        metres: row.horizontal_m,
    });
    sentences(&ended.collect::<Vec<_>>(), "min")
}

/// The verdict on one case of a replay.
#[must_use]
pub fn of_outcome(outcome: &Outcome) -> Vec<String> {
    let ended = outcome.rows.iter().map(|row| Ended {
        after: row.t_s,
        scheme: &row.scheme,
        metres: row.horizontal_m,
    });
    sentences(&ended.collect::<Vec<_>>(), "s")
}

/// The verdict on several cases of a replay.
#[derive(Debug, Clone)]
pub(super) struct Compared {
    /// The shortest answer.
    pub headline: String,
    /// The device's results.
    pub device: Option<String>,
    /// Sentences on each case.
    pub others: Vec<String>,
}

/// The name of the device among the schemes.
pub(super) const DEVICE: &str = "device";
/// The schemes that start from an aided filter, as [`NONE`]. They are compared with it if it is
/// among the rows.
const AIDED: [&str; 4] = [DEVICE, "ekf6", "ekf12", "ekf24"];

/// Horizontal errors without a correction at one time, m.
#[derive(Debug, Clone, Copy)]
struct Uncorrected {
    raw: f64,
    aided_start: Option<f64>,
}

impl Uncorrected {
    /// `metres`: the error of a scheme, if it is among the rows.
    fn of(metres: impl Fn(&str) -> Option<f64>) -> Option<Self> {
        Some(Self {
            raw: metres(BASELINE)?,
            aided_start: metres(NONE),
        })
    }

    /// Those in a block of rows of one time.
    fn among(block: &[Ended<'_>]) -> Option<Self> {
        Self::of(|scheme| Some(block.iter().find(|row| row.scheme == scheme)?.metres))
    }

    /// The error with which that of a scheme is compared.
    fn beside(&self, scheme: &str) -> f64 {
        let aided = self.aided_start.filter(|_| AIDED.contains(&scheme));
        aided.unwrap_or(self.raw)
    }
}

/// Whether a scheme corrects anything.
fn corrects(scheme: &str) -> bool {
    scheme != BASELINE && scheme != NONE
}

/// The verdict on all cases of a replay: the number of cases in which a correction did harm, and
/// the device's results.
pub(super) fn of_outcomes(outcomes: &[Outcome]) -> Compared {
    if let [only] = outcomes {
        let mut sentences = of_outcome(only).into_iter();
        let headline = sentences.next().unwrap_or_else(|| NO_RESULTS.to_owned());
        return Compared {
            headline,
            device: of_device(outcomes),
            others: sentences.collect(),
        };
    }
    let said: Vec<(String, Vec<String>)> = outcomes
        .iter()
        .map(|o| (format!("{}, {}", o.recording, o.case), of_outcome(o)))
        .collect();
    let harmed = outcomes.iter().filter(|o| has(o, Against::Worse)).count();
    let helped = outcomes.iter().filter(|o| has(o, Against::Better)).count();
    let n = outcomes.len();
    let headline = match (harmed, helped) {
        (0, 0) => "Verdict: in no case a correction makes a difference at the end.".to_owned(),
        (0, _) => format!(
            "Verdict: at the end corrections help in {helped} of {n} cases, and none does harm."
        ),
        (_, 0) => format!(
            "Verdict: harm. At the end corrections make it worse in {harmed} of {n} cases, and \
             none helps in any."
        ),
        _ => format!(
            "Verdict: harm. At the end some corrections make it worse in {harmed} of {n} cases, \
             though some help in {helped}."
        ),
    };
    let each = said
        .into_iter()
        .map(|(case, of)| format!("{case}: {}", of.join(" ")));
    Compared {
        headline,
        device: of_device(outcomes),
        others: each.collect(),
    }
}

/// Comparison of a scheme at the end of a case. `None` if it or no correction has no row.
fn ends(outcome: &Outcome, scheme: &str) -> Option<Against> {
    let last = outcome.rows.last()?.t_s;
    let metres = |scheme: &str| outcome.horizontal(scheme, last);
    let without = Uncorrected::of(metres)?.beside(scheme);
    Some(against(metres(scheme)?, without))
}

/// Whether the comparison of a scheme has this result.
fn has(outcome: &Outcome, how: Against) -> bool {
    let schemes = outcome.rows.iter().map(|row| row.scheme.as_str());
    let mut others = schemes.filter(|scheme| corrects(scheme));
    others.any(|scheme| ends(outcome, scheme) == Some(how))
}

/// The device's results, without those of the schemes that only the desktop has.
fn of_device(outcomes: &[Outcome]) -> Option<String> {
    let ended: Vec<Against> = outcomes.iter().filter_map(|o| ends(o, DEVICE)).collect();
    let count = |how| ended.iter().filter(|is| **is == how).count();
    let [worse, better, same] = [Against::Worse, Against::Better, Against::Same].map(count);
    if let [only] = ended[..] {
        let how = match only {
            Against::Worse => "worse than",
            Against::Same => "no different from",
            Against::Better => "better than",
        };
        return Some(format!("The device ends {how} no correction."));
    }
    (!ended.is_empty()).then(|| {
        format!(
            "The device ends worse than no correction in {worse}, better in \
             {better} and no different in {same} of {} cases.",
            ended.len()
        )
    })
}

/// Comparison of a scheme with no correction at the same time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Against {
    Worse,
    Same,
    Better,
}

fn against(metres: f64, raw: f64) -> Against {
    let least = METRES.max(SHARE * raw);
    match metres - raw {
        more if more > least => Against::Worse,
        more if more < -least => Against::Better,
        _ => Against::Same,
    }
}

/// The verdict on rows with times ascending; `unit` is that of the times. The first sentence is the
/// shortest answer to "does it help?". Empty where nothing was compared with uncorrected samples.
fn sentences(rows: &[Ended<'_>], unit: &str) -> Vec<String> {
    let Some(last) = rows.chunk_by(|a, b| a.after == b.after).next_back() else {
        return vec![NO_RESULTS.to_owned()];
    };
    let (Some(without), after) = (Uncorrected::among(last), last[0].after) else {
        return Vec::new();
    };
    let of = |wanted| named(last, &without, wanted);
    let (worse, same, better) = (of(Against::Worse), of(Against::Same), of(Against::Better));
    if worse.is_empty() && same.is_empty() && better.is_empty() {
        return Vec::new();
    }
    let mut out = vec![headline(&worse, &better).to_owned()];
    out.push(format!(
        "After {after} {unit} without fixes the uncorrected samples ({BASELINE}) end {} off.",
        metres(without.raw)
    ));
    let aided = |row: &&Ended<'_>| AIDED.contains(&row.scheme);
    let aided: Vec<&str> = last.iter().filter(aided).map(|row| row.scheme).collect();
    if let Some(error) = without.aided_start.filter(|_| !aided.is_empty()) {
        out.push(format!(
            "With the start of an aided filter and no correction ({NONE}) they end {} off: \
             {}, which start so, are compared with that.",
            metres(error),
            aided.join(" and ")
        ));
    }
    for (named, what) in [
        (&worse, "Worse than that"),
        (&better, "Better than that"),
        (&same, "No better and no worse (within 1 m or 2 %)"),
    ] {
        if !named.is_empty() {
            out.push(format!("{what}: {}.", named.join(", ")));
        }
    }
    out.extend(earlier(rows, last, &without, unit));
    out
}

fn headline(worse: &[String], better: &[String]) -> &'static str {
    match (worse.is_empty(), better.is_empty()) {
        (true, true) => "Verdict: at the end no correction makes a difference.",
        (true, false) => "Verdict: at the end corrections help, and none does harm.",
        (false, true) => "Verdict: harm. At the end no correction helps, and some make it worse.",
        (false, false) => "Verdict: mixed. At the end some corrections help and some do harm.",
    }
}

/// The schemes with this result of the comparison, the largest difference first.
fn named(block: &[Ended<'_>], without: &Uncorrected, wanted: Against) -> Vec<String> {
    let rows = block.iter().filter(|row| corrects(row.scheme));
    let mut rows: Vec<_> = rows
        .map(|row| (row, without.beside(row.scheme)))
        .filter(|(row, without)| against(row.metres, *without) == wanted)
        .collect();
    let difference = |(row, without): &(&Ended<'_>, f64)| (row.metres - without).abs();
    rows.sort_by(|a, b| difference(b).total_cmp(&difference(a)));
    let text = |(row, without): &(&Ended<'_>, f64)| {
        format!("{} {}", row.scheme, compared(row.metres, *without, wanted))
    };
    rows.iter().map(text).collect()
}

fn compared(error: f64, raw: f64, how: Against) -> String {
    match how {
        Against::Same => metres(error),
        _ if error > 2.0 * raw && raw > 0.0 => {
            format!("{} ({:.1} times)", metres(error), error / raw)
        }
        _ => format!("{} ({:+.0} %)", metres(error), 100.0 * (error / raw - 1.0)),
    }
}

/// Schemes that were worse before the `last` block and are not in it, and the time of the largest
/// difference.
fn earlier(
    rows: &[Ended<'_>],
    last: &[Ended<'_>],
    at_last: &Uncorrected,
    unit: &str,
) -> Option<String> {
    let remains = |scheme: &str| {
        let mut ends = last.iter().filter(|row| row.scheme == scheme);
        ends.any(|row| against(row.metres, at_last.beside(scheme)) == Against::Worse)
    };
    let mut worst: Vec<(Ended<'_>, f64)> = Vec::new();
    for block in rows.chunk_by(|a, b| a.after == b.after) {
        let Some(without) = Uncorrected::among(block).filter(|_| block[0].after != last[0].after)
        else {
            continue;
        };
        for row in block.iter().filter(|row| corrects(row.scheme)) {
            let raw = without.beside(row.scheme);
            if against(row.metres, raw) != Against::Worse || remains(row.scheme) {
                continue;
            }
            match worst
                .iter_mut()
                .find(|(known, _)| known.scheme == row.scheme)
            {
                Some(known) if row.metres - raw > known.0.metres - known.1 => *known = (*row, raw),
                Some(_) => {}
                None => worst.push((*row, raw)),
            }
        }
    }
    let text = |(row, raw): &(Ended<'_>, f64)| {
        let (scheme, after) = (row.scheme, row.after);
        let (error, raw) = (metres(row.metres), metres(*raw));
        format!("{scheme} at {after} {unit} ({error} against {raw})")
    };
    let list: Vec<String> = worst.iter().map(text).collect();
    (!list.is_empty()).then(|| format!("Worse before the end: {}.", list.join(", ")))
}

/// A length for a terminal, without non-breaking spaces.
fn metres(value: f64) -> String {
    length(value, value).replace('\u{a0}', " ")
}

#[cfg(test)]
mod tests;
