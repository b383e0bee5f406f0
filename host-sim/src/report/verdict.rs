//! What a comparison of schemes says, in sentences: harm first.
//!
//! A scheme is worse than no correction if its horizontal error is larger by more than 2 % and by
//! more than 1 m, and better if it is smaller by as much. Smaller differences say nothing.

use super::figures::length;
use super::table::BASELINE;
use crate::experiment::outcome::Outcome;
use crate::experiment::results::Results;

/// Differences below these say nothing.
const SHARE: f64 = 0.02;
const METRES: f64 = 1.0;
const NO_RESULTS: &str = "There are no results.";

/// One error of one scheme.
#[derive(Debug, Clone, Copy)]
struct Ended<'a> {
    /// How long the navigation was free inertial, in the unit of [`sentences`].
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
        after: row.t_min,
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
    /// What the device did.
    pub device: Option<String>,
    /// What is said of each case.
    pub others: Vec<String>,
}

/// The name of the device among the schemes.
const DEVICE: &str = "rnn-kalman";

/// The verdict on all cases of a replay: in how many of them a correction did harm, and what the
/// device did.
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

/// How a scheme ends in a case; `None` where it has no row beside that of no correction.
fn ends(outcome: &Outcome, scheme: &str) -> Option<Against> {
    let last = outcome.rows.last()?.t_s;
    let raw = outcome.horizontal(BASELINE, last)?;
    Some(against(outcome.horizontal(scheme, last)?, raw))
}

/// Whether a scheme ends like this.
fn has(outcome: &Outcome, how: Against) -> bool {
    let schemes = outcome.rows.iter().map(|row| row.scheme.as_str());
    let mut others = schemes.filter(|scheme| *scheme != BASELINE);
    others.any(|scheme| ends(outcome, scheme) == Some(how))
}

/// What the device did, apart from the schemes that only the desktop has.
fn of_device(outcomes: &[Outcome]) -> Option<String> {
    let ended: Vec<Against> = outcomes.iter().filter_map(|o| ends(o, DEVICE)).collect();
    let count = |how| ended.iter().filter(|is| **is == how).count();
    let [worse, better, same] = [Against::Worse, Against::Better, Against::Same].map(count);
    (!ended.is_empty()).then(|| {
        format!(
            "The device itself ({DEVICE}) ends worse than no correction in {worse}, better in \
             {better} and no different in {same} of {} case(s).",
            ended.len()
        )
    })
}

/// How a scheme compares with no correction at the same time.
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
    let Some((raw, after)) = baseline(last).map(|raw| (raw, last[0].after)) else {
        return Vec::new();
    };
    let of = |wanted| named(last, raw, wanted);
    let (worse, same, better) = (of(Against::Worse), of(Against::Same), of(Against::Better));
    if worse.is_empty() && same.is_empty() && better.is_empty() {
        return Vec::new();
    }
    let mut out = vec![headline(&worse, &better).to_owned()];
    out.push(format!(
        "After {after} {unit} without fixes the uncorrected samples ({BASELINE}) end {} off.",
        metres(raw)
    ));
    for (named, what) in [
        (&worse, "Worse than that"),
        (&better, "Better than that"),
        (&same, "No better and no worse (within 1 m or 2 %)"),
    ] {
        if !named.is_empty() {
            out.push(format!("{what}: {}.", named.join(", ")));
        }
    }
    out.extend(earlier(rows, last, raw, unit));
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

fn baseline(block: &[Ended<'_>]) -> Option<f64> {
    let raw = block.iter().find(|row| row.scheme == BASELINE)?;
    Some(raw.metres)
}

/// The schemes that compare like this, the largest difference first.
fn named(block: &[Ended<'_>], raw: f64, wanted: Against) -> Vec<String> {
    let mut rows: Vec<_> = block
        .iter()
        .filter(|row| row.scheme != BASELINE && against(row.metres, raw) == wanted)
        .collect();
    rows.sort_by(|a, b| (b.metres - raw).abs().total_cmp(&(a.metres - raw).abs()));
    let text = |row: &&Ended<'_>| format!("{} {}", row.scheme, compared(row.metres, raw, wanted));
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

/// Schemes that were worse before the `last` block and are not in it, and when it was worst.
fn earlier(rows: &[Ended<'_>], last: &[Ended<'_>], raw: f64, unit: &str) -> Option<String> {
    let still = |scheme: &str| {
        let mut ends = last.iter().filter(|row| row.scheme == scheme);
        ends.any(|row| against(row.metres, raw) == Against::Worse)
    };
    let mut worst: Vec<(Ended<'_>, f64)> = Vec::new();
    for block in rows.chunk_by(|a, b| a.after == b.after) {
        let Some(raw) = baseline(block).filter(|_| block[0].after != last[0].after) else {
            continue;
        };
        for row in block {
            if against(row.metres, raw) != Against::Worse || still(row.scheme) {
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

/// A length for a terminal, which has no unbroken space.
fn metres(value: f64) -> String {
    length(value, value).replace('\u{a0}', " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(list: &[(u32, &'static str, f64)]) -> Vec<Ended<'static>> {
        let ended = |(after, scheme, metres): &(u32, &'static str, f64)| Ended {
            after: *after,
            scheme,
            metres: *metres,
        };
        list.iter().map(ended).collect()
    }

    fn outcome(case: &str, ends: &[(&str, f64)]) -> Outcome {
        let row = |(scheme, metres): &(&str, f64)| crate::experiment::outcome::Row {
            t_s: 60,
            scheme: (*scheme).to_owned(),
            d_north_m: *metres,
            d_east_m: 0.0,
            d_vn_mps: 0.0,
            d_ve_mps: 0.0,
            horizontal_m: *metres,
        };
        Outcome {
            recording: "r".into(),
            case: case.into(),
            rows: ends.iter().map(row).collect(),
            notes: vec![],
            warnings: vec![],
            curves: Default::default(),
            bench: None,
        }
    }

    #[test]
    fn of_several_cases_harm_in_one_is_harm_and_the_device_is_told_apart() {
        let good = outcome("a", &[("raw", 90.0), ("rnn", 20.0), ("rnn-kalman", 90.0)]);
        let bad = outcome("b", &[("raw", 9.0), ("rnn", 50.0), ("rnn-kalman", 9.0)]);
        let both = of_outcomes(&[good.clone(), bad.clone()]);
        let headline = "Verdict: harm. At the end some corrections make it worse in 1 of 2 cases, \
                        though some help in 1.";
        assert_eq!(both.headline, headline);
        let device = both.device.clone().unwrap();
        assert!(
            device.contains("worse than no correction in 0, better in 0 and no different in 2")
        );
        assert!(
            both.others[1].starts_with("r, b: Verdict: harm."),
            "{both:?}"
        );
        let good = of_outcomes(&[good.clone(), good]).headline;
        assert!(
            good.contains("help in 2 of 2 cases, and none does harm"),
            "{good}"
        );
        let bad = of_outcomes(&[bad.clone(), bad]).headline;
        assert!(
            bad.contains("worse in 2 of 2 cases, and none helps"),
            "{bad}"
        );
        assert_eq!(of_outcomes(&[outcome("c", &[])]).headline, NO_RESULTS);
    }

    #[test]
    fn harm_stands_first_with_the_worst_scheme_before_the_others() {
        let got = sentences(
            &rows(&[
                (40, "raw", 3.5),
                (40, "ekf24", 17.0),
                (50, "raw", 4.4),
                (50, "ls-bias", 26.0),
                (50, "ekf24", 30.0),
                (50, "rnn-kalman", 4.4),
            ]),
            "s",
        );
        assert!(
            got[0].contains("harm. At the end no correction helps"),
            "{got:?}"
        );
        assert!(
            got[1].contains("50 s") && got[1].contains("4.40 m"),
            "{got:?}"
        );
        let worse = "Worse than that: ekf24 30.0 m (6.8 times), ls-bias 26.0 m (5.9 times).";
        assert_eq!(got[2], worse);
        assert!(got[3].ends_with("rnn-kalman 4.40 m."), "{got:?}");
        assert_eq!(got.len(), 4);
    }

    #[test]
    fn harm_at_an_earlier_time_is_told_though_the_end_is_better() {
        let got = sentences(
            &rows(&[
                (5, "raw", 25.0),
                (5, "device", 38.0),
                (10, "raw", 190.0),
                (10, "device", 240.0),
                (22, "raw", 1720.0),
                (22, "device", 830.0),
            ]),
            "min",
        );
        assert!(got[0].contains("help, and none does harm"), "{got:?}");
        assert_eq!(got[2], "Better than that: device 830 m (-52 %).");
        assert_eq!(
            got[3],
            "Worse before the end: device at 10 min (240 m against 190 m)."
        );
    }

    #[test]
    fn what_is_small_says_nothing_and_no_baseline_no_verdict() {
        let small = sentences(&rows(&[(9, "raw", 2.0), (9, "rnn", 2.9)]), "s");
        assert!(
            small[0].contains("no correction makes a difference"),
            "{small:?}"
        );
        let share = sentences(&rows(&[(9, "raw", 900.0), (9, "rnn", 910.0)]), "s");
        assert!(
            share[0].contains("no correction makes a difference"),
            "{share:?}"
        );
        let mixed = sentences(
            &rows(&[(9, "raw", 9.0), (9, "a", 4.0), (9, "b", 12.0)]),
            "s",
        );
        assert!(mixed[0].contains("mixed"), "{mixed:?}");
        assert!(sentences(&rows(&[(9, "none", 2.0), (9, "rnn", 9.0)]), "s").is_empty());
        assert!(sentences(&rows(&[(9, "raw", 2.0)]), "s").is_empty());
        assert_eq!(sentences(&[], "s").len(), 1);
    }
}
