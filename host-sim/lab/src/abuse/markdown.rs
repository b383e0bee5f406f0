//! `docs/ABUSE.md`: prose of `assets/abuse.md` around generated tables, and all rows as CSV.

use super::case::Row;
use super::names::{Activation, Computer, Sensor};
use super::rests;
use super::summary::{GAIN_KEPT, LIMITS, Summary};
use super::table::{self, AT_POWER_ON, COMBINED, PARTS};
use super::times::{RECOVERY_S, Times};
use host_core::words::thousands;
use std::fmt::Write;

const TEMPLATE: &str = include_str!("../../../assets/abuse.md");

/// In the order of the page: the default of a device's configuration comes first.
const ACTIVATIONS: [Activation; 5] = [
    Activation::NextPowerOn,
    Activation::NextPowerOnAided,
    Activation::Live,
    Activation::FirstRest,
    Activation::FirstRestNew,
];

/// The activations that have columns in the tables of kinds and cases.
const SHOWN: [Activation; 2] = [Activation::NextPowerOn, Activation::Live];

/// The page, made by `command` of this version; all rows are in the file `csv` beside it.
#[must_use]
pub fn markdown(
    (command, version): (&str, &str),
    csv: &str,
    times: &Times,
    all: &[Summary],
) -> String {
    let harming = |activation| {
        let of = all.iter().filter(move |of| of.activation == activation);
        of.filter(|of| of.harms())
    };
    let rows_of = |activation| all.iter().filter(|of| of.activation == activation).count();
    let [usual, live] = SHOWN;
    let plain: Vec<_> = rows(all, usual, Sensor::Errors)
        .filter(|of| of.computer == Computer::Plain)
        .collect();
    let plain_that = |is: fn(&Summary) -> bool| plain.iter().filter(|of| is(of)).count();
    let ends = |of: &&Summary| of.gain_kept.is_some();
    let ending: Vec<Summary> = all.iter().filter(ends).cloned().collect();
    let estimating = harming(live).filter(|of| of.computer != Computer::Plain);
    let names: Vec<String> = Computer::ALL.iter().map(|of| format!("`{of}`")).collect();
    let values = [
        ("command", command.to_owned()),
        ("csv", csv.to_owned()),
        ("version", version.to_owned()),
        ("standstill", times.standstill_s.to_string()),
        ("aided", times.aided_s.to_string()),
        ("free", times.free_s.to_string()),
        (
            "runs",
            all.iter()
                .filter(|of| SHOWN.contains(&of.activation))
                .map(|of| of.runs)
                .max()
                .unwrap_or(0)
                .to_string(),
        ),
        ("median", format!("{:.2}", LIMITS[0])),
        ("worst", format!("{:.2}", LIMITS[1])),
        ("gain", format!("{:.2}", 1.0 / LIMITS[0])),
        ("usual harming", harming(usual).count().to_string()),
        ("usual rows", rows_of(usual).to_string()),
        ("usual worse", worse(all, usual)),
        ("live worse", worse(all, live)),
        ("live harming", harming(live).count().to_string()),
        ("live rows", rows_of(live).to_string()),
        ("estimating", estimating.count().to_string()),
        ("plain rows", plain.len().to_string()),
        (
            "plain halved",
            plain_that(|of| (100.0 * of.ratio_median).round() <= 50.0).to_string(),
        ),
        (
            "plain unchanged",
            plain_that(|of| of.promoted_share == 0.0).to_string(),
        ),
        ("recovery", RECOVERY_S.to_string()),
        ("share", format!("{:.0}", 100.0 * GAIN_KEPT)),
        (
            "losing",
            all.iter().filter(|of| of.loses()).count().to_string(),
        ),
        ("ending", ending.len().to_string()),
        ("counts of harm", counts(all, harm)),
        (
            "counts of losses",
            counts(&ending, |of| {
                (of.iter().filter(|of| of.loses()).count(), String::new())
            }),
        ),
        ("rows that harm", harming_table(harming(usual))),
        ("kinds", kinds(all)),
        ("computers", names.join(", ")),
        ("cases", cases(all)),
        ("first rests", rests::tables(all)),
    ];
    values
        .iter()
        .fold(TEMPLATE.to_owned(), |page, (key, value)| {
            page.replace(&format!("{{{key}}}"), value)
        })
}

/// The share of the runs with this activation that are worse than the limit of a run, with their
/// numbers.
fn worse(all: &[Summary], activation: Activation) -> String {
    let of = || all.iter().filter(|of| of.activation == activation);
    let worse: usize = of().map(|of| of.runs_worse).sum();
    let runs: usize = of().map(|of| of.runs).sum();
    let share = 100.0 * worse as f64 / runs.max(1) as f64;
    format!("{worse} of {} ({share:.1} %)", thousands(runs))
}

/// All rows, one a line.
#[must_use]
pub fn csv(all: &[Summary]) -> String {
    let mut out =
        "case,activation,sensor,computer,runs,raw_m,corrected_m,ratio_median,ratio_worst,\
                   worst_run,corrected_share,given_up_share,gain_kept,harms,runs_worse\n"
            .to_owned();
    for of in all {
        let gain = of.gain_kept.map(|gain| format!("{gain:.2}"));
        let _ = writeln!(
            out,
            "{},{},{},{},{},{},{},{:.2},{:.2},{},{:.2},{:.2},{},{},{}",
            of.case,
            of.activation,
            of.sensor,
            of.computer,
            of.runs,
            metres(of.raw_median_m),
            metres(of.corrected_median_m),
            of.ratio_median,
            of.ratio_worst,
            of.ratio_worst_run,
            of.promoted_share,
            of.rolled_back_share,
            gain.unwrap_or_default(),
            u8::from(of.harms()),
            of.runs_worse,
        );
    }
    out
}

/// Number of rows that harm, and the worst run of them.
fn harm(of: &[&Summary]) -> (usize, String) {
    let of: Vec<_> = of.iter().filter(|of| of.harms()).collect();
    // as it is in the file: of two that are equal there, the later
    let shown = |of: &Summary| (100.0 * of.ratio_worst).round();
    let worst = of.iter().max_by(|a, b| shown(a).total_cmp(&shown(b)));
    let worst = worst.map(|of| format!(", at worst {:.2} (`{}`)", of.ratio_worst, of.case));
    (of.len(), worst.unwrap_or_default())
}

/// A table of the number of rows that `count` counts, with its text, by activation, sensor and
/// computer; below it, with the number of their rows, those in which it counts none.
fn counts(all: &[Summary], count: impl Fn(&[&Summary]) -> (usize, String)) -> String {
    let computers: Vec<Computer> = Computer::ALL
        .iter()
        .copied()
        .filter(|computer| all.iter().any(|of| of.computer == *computer))
        .collect();
    let mut out = "| activation, sensor |".to_owned();
    for computer in &computers {
        let _ = write!(out, " {computer} |");
    }
    let _ = writeln!(out, " all |\n|---|{}---|", "---|".repeat(computers.len()));
    let mut none = Vec::new();
    for activation in ACTIVATIONS {
        for &sensor in Sensor::ALL {
            let of: Vec<&Summary> = rows(all, activation, sensor).collect();
            if of.is_empty() {
                continue;
            }
            if count(&of).0 == 0 {
                none.push(format!("{activation}, {sensor} ({})", of.len()));
                continue;
            }
            let _ = write!(out, "| {activation}, {sensor} |");
            for computer in &computers {
                let of = of.iter().copied().filter(|of| of.computer == *computer);
                let of: Vec<&Summary> = of.collect();
                let (number, words) = count(&of);
                let _ = write!(out, " {number} of {}{words} |", of.len());
            }
            let _ = writeln!(out, " {} of {} |", count(&of).0, of.len());
        }
    }
    if !none.is_empty() {
        let _ = writeln!(out, "\nNone of the rows of: {}.", none.join("; "));
    }
    out
}

/// The rows of an activation and a sensor.
fn rows(all: &[Summary], activation: Activation, sensor: Sensor) -> impl Iterator<Item = &Summary> {
    all.iter()
        .filter(move |of| of.sensor == sensor && of.activation == activation)
}

/// A table of these rows.
fn harming_table<'a>(rows: impl Iterator<Item = &'a Summary>) -> String {
    let mut out = "| case | sensor | computer | raw, m | corrected, m | worst run, times raw \
                   | its number |\n|---|---|---|---|---|---|---|\n"
        .to_owned();
    for of in rows {
        let _ = writeln!(
            out,
            "| `{}` | {} | {} | {} | {} | {:.2} | {} |",
            of.case,
            of.sensor,
            of.computer,
            metres(of.raw_median_m),
            metres(of.corrected_median_m),
            of.ratio_worst,
            of.ratio_worst_run,
        );
    }
    out
}

fn metres(x: f64) -> String {
    if x < 100.0 {
        format!("{x:.1}")
    } else {
        format!("{x:.0}")
    }
}

/// The sensor of the tables of kinds and cases: the one with errors, or else the last.
fn shown_sensor(all: &[Summary]) -> Sensor {
    let has_errors = all.iter().any(|of| of.sensor == Sensor::Errors);
    let last = all.iter().map(|of| of.sensor).max();
    last.filter(|_| !has_errors).unwrap_or(Sensor::Errors)
}

/// What is found of a case whose medians do not change and that has no gain to come back.
const UNCHANGED: &str = " 1.00 | 1.00 |  |";

/// Whether a kind has columns of the activations shown. Cases of the first rest may have none.
fn is_shown(all: &[Summary], heading: &str) -> bool {
    let at_power_on = |of: &Summary| table::part_of(&of.case) == AT_POWER_ON;
    let mut shown = all.iter().filter(|of| SHOWN.contains(&of.activation));
    heading != AT_POWER_ON || shown.any(at_power_on)
}

/// How many rows of each kind gain and harm.
fn kinds(all: &[Summary]) -> String {
    let mut out = "| kind |".to_owned();
    for activation in SHOWN {
        let _ = write!(out, " {activation}: gain | harm | neither |");
    }
    let _ = writeln!(out, "\n|---|{}", "---|".repeat(3 * SHOWN.len()));
    let sensor = shown_sensor(all);
    let headings = PARTS.iter().map(|(heading, _)| *heading).chain([COMBINED]);
    for heading in headings.filter(|heading| is_shown(all, heading)) {
        let _ = write!(out, "| {heading} |");
        for activation in SHOWN {
            let of = rows(all, activation, sensor);
            let of: Vec<_> = of
                .filter(|of| table::part_of(&of.case) == heading)
                .collect();
            let harm = of.iter().filter(|of| of.harms()).count();
            let gain = of.iter().filter(|of| of.gains()).count();
            let _ = write!(out, " {gain} | {harm} | {} |", of.len() - gain - harm);
        }
        out.push('\n');
    }
    out
}

/// The last cells of a case: the ratios of its rows by activation, and the gain that is back.
fn found(all: &[Summary], case: &str) -> String {
    let mut out = String::new();
    let sensor = shown_sensor(all);
    let of_case = |activation| rows(all, activation, sensor).filter(|of| of.case == case);
    for activation in SHOWN {
        let _ = write!(out, " {} |", rests::ratios(of_case(activation)));
    }
    let gain = of_case(SHOWN[0]).filter_map(|of| of.gain_kept);
    let gain = gain
        .reduce(f64::min)
        .map(|of| format!("{:.0} %", 100.0 * of));
    let _ = write!(out, " {} |", gain.unwrap_or_default());
    out
}

/// What happens in a case, and its parameters.
fn about(row: &Row) -> String {
    let given: Vec<String> = row
        .given
        .iter()
        .map(|given| format!("`{}` {}", given.key, given.value))
        .collect();
    let [open, close] = if given.is_empty() {
        ["", ""]
    } else {
        [" (", ")"]
    };
    format!("{}{open}{}{close}", row.about, given.join(", "))
}

/// Cases in a table with what was found; those without a change have a table without it.
fn cases(all: &[Summary]) -> String {
    let [usual, live] = SHOWN;
    let tail = format!(" {usual} | {live} | gain back |");
    let mut out = String::new();
    for (heading, rows) in PARTS {
        let _ = writeln!(out, "### {heading}");
        let changed = |row: &&Row| is_shown(all, heading) && found(all, row.name) != UNCHANGED;
        let (some, same): (Vec<&Row>, Vec<&Row>) = rows.iter().partition(changed);
        if !some.is_empty() {
            let _ = writeln!(
                out,
                "\n| case | what happens |{tail}\n|---|---|---|---|---|"
            );
        }
        for row in some {
            let found = found(all, row.name);
            let _ = writeln!(out, "| `{}` | {} |{found}", row.name, about(row));
        }
        if !same.is_empty() {
            let unchanged = if is_shown(all, heading) { ": 1.00" } else { "" };
            let _ = writeln!(out, "\n| case{unchanged} | what happens |\n|---|---|");
        }
        for row in same {
            let _ = writeln!(out, "| `{}` | {} |", row.name, about(row));
        }
        out.push('\n');
    }
    let _ = writeln!(out, "### {COMBINED}\n\n| cases |{tail}\n|---|---|---|---|");
    for name in table::usual().filter(|name| table::part_of(name) == COMBINED) {
        let _ = writeln!(out, "| `{name}` |{}", found(all, name));
    }
    out
}
