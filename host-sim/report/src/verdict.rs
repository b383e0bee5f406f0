//! The verdict of a comparison of schemes, in sentences: the device first, then all schemes.
//!
//! A scheme is worse than no correction if its horizontal error is larger by more than 2 % and by
//! more than 1 m, and better if it is smaller by as much. Smaller differences are ignored. No
//! correction is `raw`, or `uncorrected` for a scheme whose start also comes from an aided filter:
//! the effect of that start is no merit of a correction.

mod device;

pub(crate) use device::{Device, Effect, Several, times, waits};

use super::figures::length;
use super::table::BASELINE;
use super::text::{counted, signed};
use host_estimation::learning::device::Course;
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

/// The verdict on a run. The first sentence is that on the device.
#[must_use]
pub fn of_results(results: &Results) -> Vec<String> {
    sentences(&ended_of(results), "min", results.device.as_ref())
}

/// The verdict on one case of a replay. The first sentence is that on the device.
#[must_use]
pub fn of_outcome(outcome: &Outcome) -> Vec<String> {
    sentences(&ends_of(outcome), "s", course(outcome))
}

/// What the device did in a run, if it takes part.
pub(super) fn device_of_results(results: &Results) -> Option<Device> {
    device(&ended_of(results), "min", results.device.as_ref())
}

/// What the device did in a case of a replay, if it takes part.
pub(super) fn device_of_outcome(outcome: &Outcome) -> Option<Device> {
    device(&ends_of(outcome), "s", course(outcome))
}

fn ended_of(results: &Results) -> Vec<Ended<'_>> {
    let ended = results.rows.iter().map(|row| Ended {
        after: row.t_s / 60,
        scheme: &row.scheme,
        metres: row.horizontal_m,
    });
    ended.collect()
}

fn ends_of(outcome: &Outcome) -> Vec<Ended<'_>> {
    let ended = outcome.rows.iter().map(|row| Ended {
        after: row.t_s,
        scheme: &row.scheme,
        metres: row.horizontal_m,
    });
    ended.collect()
}

fn course(outcome: &Outcome) -> Option<&Course> {
    outcome.bench.as_deref().map(|bench| &bench.course)
}

/// The verdict on several cases of a replay.
#[derive(Debug, Clone)]
pub(super) struct Compared {
    /// The sentence on the device.
    pub headline: String,
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

    /// The errors in a block of rows of one time.
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

/// Whether a scheme is the device: `device`, or `device-N` after N earlier drives.
pub(super) fn is_device(scheme: &str) -> bool {
    scheme == DEVICE || scheme.starts_with("device-")
}

/// The scheme of no correction beside which a scheme is judged, of those that are there.
pub(super) fn beside<'a>(scheme: &str, mut names: impl Iterator<Item = &'a str>) -> &'static str {
    let aided = AIDED.contains(&scheme) && names.any(|name| name == NONE);
    if aided { NONE } else { BASELINE }
}

/// The device beside no correction. `None`: one of them is not among the rows.
fn device(rows: &[Ended<'_>], unit: &str, course: Option<&Course>) -> Option<Device> {
    let last = rows.last()?.after;
    let name = rows.iter().rfind(|row| is_device(row.scheme))?.scheme;
    let both = |block: &[Ended<'_>]| {
        let with = block.iter().find(|row| row.scheme == name)?.metres;
        Some([with, Uncorrected::among(block)?.beside(name)])
    };
    let blocks = rows.chunk_by(|a, b| a.after == b.after);
    let all: Vec<(u32, [f64; 2])> = blocks
        .filter_map(|block| Some((block.first()?.after, both(block)?)))
        .collect();
    let (_, metres) = *all.last().filter(|(after, _)| *after == last)?;
    let equal = |of: &(u32, [f64; 2])| (of.1[0] - of.1[1]).abs() <= 1e-6 * of.1[1];
    let worse = |of: &&(u32, [f64; 2])| of.0 != last && against(of.1[0], of.1[1]) == Against::Worse;
    let earlier = all.iter().filter(worse);
    Some(Device {
        after: format!("after {last} {unit} without fixes"),
        metres,
        several: None,
        waits: all.iter().all(equal).then(|| waits(course)),
        earlier: earlier
            .filter(|_| against(metres[0], metres[1]) != Against::Worse)
            .map(|(after, both)| (format!("{after} {unit}"), *both))
            .collect(),
    })
}

/// The sentence on the device in all cases of a replay.
#[must_use]
pub fn headline(outcomes: &[Outcome]) -> String {
    of_outcomes(outcomes).headline
}

/// The verdict on all cases of a replay.
pub(super) fn of_outcomes(outcomes: &[Outcome]) -> Compared {
    if let [only] = outcomes {
        let mut sentences = of_outcome(only).into_iter();
        return Compared {
            headline: sentences.next().unwrap_or_else(|| NO_RESULTS.to_owned()),
            others: sentences.collect(),
        };
    }
    let each = outcomes.iter().map(|of| {
        let said = of_outcome(of).join(" ");
        format!("{}, {}: {said}", of.recording, of.case)
    });
    Compared {
        headline: of_cases(outcomes),
        others: each.collect(),
    }
}

/// The sentence on the device in several cases: in how many it harms, helps and does nothing.
fn of_cases(outcomes: &[Outcome]) -> String {
    let each = outcomes.iter();
    let devices: Vec<(&Outcome, Device)> = each
        .filter_map(|of| Some((of, device_of_outcome(of)?)))
        .collect();
    let n = devices.len();
    if n == 0 {
        return format!(
            "Verdict: the device takes part in none of {}.",
            counted(outcomes.len(), "case")
        );
    }
    let acts: Vec<_> = devices
        .iter()
        .filter(|(_, of)| of.waits.is_none())
        .collect();
    let with = |effect| acts.iter().filter(move |(_, of)| of.effect() == effect);
    let harmed: Vec<String> = with(Effect::Harms)
        .map(|(case, of)| {
            let [with, without] = of.metres.map(metres);
            format!(
                "{}, {}: {with} instead of {without}",
                case.recording, case.case
            )
        })
        .collect();
    let (helped, open) = (with(Effect::Helps).count(), with(Effect::Open).count());
    let idle = n - acts.len();
    if idle == n {
        let why = devices
            .iter()
            .filter_map(|(_, of)| of.waits.as_deref())
            .next_back();
        let why = why.unwrap_or_default();
        return format!(
            "Verdict: the device does nothing in any of {n} cases; in the last because {why}."
        );
    }
    let mut ratios: Vec<f64> = devices
        .iter()
        .map(|(_, of)| of.metres[0] / of.metres[1])
        .collect();
    ratios.sort_by(f64::total_cmp);
    let median = times(ratios[n / 2]);
    let (least, most) = (times(ratios[0]), times(ratios[n - 1]));
    let harms = match harmed.as_slice() {
        [] => "harms in none".to_owned(),
        all => format!("harms in {} ({})", all.len(), all.join("; ")),
    };
    format!(
        "Verdict: of {n} cases the device {harms}, helps in {helped}, and makes no difference in \
         {}. The error at the end is {median} times the uncorrected one in the median case \
         ({least} to {most}).",
        open + idle
    )
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
/// verdict on the device. Empty where nothing was compared with uncorrected samples.
fn sentences(rows: &[Ended<'_>], unit: &str, course: Option<&Course>) -> Vec<String> {
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
    let device = device(rows, unit, course).map(|device| device.sentence());
    let mut out = vec![device.unwrap_or_else(|| without_device(&worse, &better))];
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

/// The verdict where the device does not take part.
fn without_device(worse: &[String], better: &[String]) -> String {
    let others = match (worse.is_empty(), better.is_empty()) {
        (true, true) => "none makes a difference at the end",
        (true, false) => "at the end some help and none harms",
        (false, true) => "at the end some harm and none helps",
        (false, false) => "at the end some help and some harm",
    };
    format!("Verdict: the device does not take part. Of the other schemes, {others}.")
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
        _ => format!(
            "{} ({} %)",
            metres(error),
            signed(100.0 * (error / raw - 1.0), 0)
        ),
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
pub(crate) fn metres(value: f64) -> String {
    length(value, value).replace('\u{a0}', " ")
}

#[cfg(test)]
mod tests;
