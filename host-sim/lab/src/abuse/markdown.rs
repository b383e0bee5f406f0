//! `docs/ABUSE.md`: prose of `assets/abuse.md` around generated tables.

use super::case::Row;
use super::names::{Activation, Computer, Sensor};
use super::summary::{GAIN_KEPT, LIMITS, Summary};
use super::table::{self, COMBINED, PARTS};
use super::times::{RECOVERY_S, Times};
use std::fmt::Write;

const TEMPLATE: &str = include_str!("../../../assets/abuse.md");

/// In the order of the page: the default of a device's configuration comes first.
const ACTIVATIONS: [Activation; 3] = [
    Activation::NextPowerOn,
    Activation::NextPowerOnAided,
    Activation::Live,
];

/// The page, made by `command`.
#[must_use]
pub fn markdown(command: &str, times: &Times, all: &[Summary]) -> String {
    let harming_rows: Vec<&Summary> = all.iter().filter(|of| of.harms()).collect();
    let estimating =
        |of: &&&Summary| of.activation == Activation::Live && of.computer != Computer::Plain;
    let losing_rows = all.iter().filter(|of| of.loses()).count();
    let number = |number: usize| number.to_string();
    let values = [
        ("command", command.to_owned()),
        ("standstill", times.standstill_s.to_string()),
        ("aided", times.aided_s.to_string()),
        ("free", times.free_s.to_string()),
        (
            "runs",
            all.iter().map(|of| of.runs).max().unwrap_or(0).to_string(),
        ),
        ("median", format!("{:.2}", LIMITS[0])),
        ("worst", format!("{:.2}", LIMITS[1])),
        ("harming", number(harming_rows.len())),
        ("rows", number(all.len())),
        (
            "estimating",
            number(harming_rows.iter().filter(estimating).count()),
        ),
        ("recovery", RECOVERY_S.to_string()),
        ("share", format!("{:.0}", 100.0 * GAIN_KEPT)),
        ("losing", number(losing_rows)),
        ("counts of harm", counts(all, harm)),
        (
            "rows that harm usually",
            harming(all, &[Activation::NextPowerOn]),
        ),
        (
            "counts of losses",
            counts(all, |of| {
                (of.iter().filter(|of| of.loses()).count(), String::new())
            }),
        ),
        ("rows that harm", harming(all, &ACTIVATIONS)),
        ("rows that lose", losing(all)),
        ("tables", tables(all)),
        ("cases", cases()),
    ];
    values
        .iter()
        .fold(TEMPLATE.to_owned(), |page, (key, value)| {
            page.replace(&format!("{{{key}}}"), value)
        })
}

/// Number of rows that harm, and the worst run of them.
fn harm(of: &[&Summary]) -> (usize, String) {
    let of: Vec<_> = of.iter().filter(|of| of.harms()).collect();
    let worst = of
        .iter()
        .max_by(|a, b| a.ratio_worst.total_cmp(&b.ratio_worst));
    let worst = worst.map(|of| format!(", at worst {:.2} (`{}`)", of.ratio_worst, of.case));
    (of.len(), worst.unwrap_or_default())
}

/// A table of the number of rows that `count` counts, with its text, by activation, sensor and
/// computer.
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
    for activation in ACTIVATIONS {
        for &sensor in Sensor::ALL {
            let of: Vec<&Summary> = rows(all, activation, sensor).collect();
            if of.is_empty() {
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
    out
}

/// The rows of an activation and a sensor.
fn rows(all: &[Summary], activation: Activation, sensor: Sensor) -> impl Iterator<Item = &Summary> {
    all.iter()
        .filter(move |of| of.sensor == sensor && of.activation == activation)
}

/// The rows for which this holds, in the order of these activations.
fn of_activations<'a>(
    all: &'a [Summary],
    activations: &'a [Activation],
    holds: fn(&Summary) -> bool,
) -> impl Iterator<Item = &'a Summary> {
    let rows_of = move |activation| all.iter().filter(move |of| of.activation == activation);
    let rows = activations.iter().copied().flat_map(rows_of);
    rows.filter(move |of| holds(of))
}

/// The first cells of a row in a list, which identify it.
fn head(of: &Summary) -> String {
    format!(
        "| `{}` | {} | {} | {} |",
        of.case, of.activation, of.sensor, of.computer
    )
}

/// A table of the rows that harm with one of these activations.
fn harming(all: &[Summary], activations: &[Activation]) -> String {
    let mut out = "| case | activation | sensor | computer | raw, m | corrected, m \
                   | worst run, times | its number |\n|---|---|---|---|---|---|---|---|\n"
        .to_owned();
    for of in of_activations(all, activations, Summary::harms) {
        let _ = writeln!(
            out,
            "{} {} | {} | {:.2} | {} |",
            head(of),
            metres(of.raw_median_m),
            metres(of.corrected_median_m),
            of.ratio_worst,
            of.ratio_worst_run,
        );
    }
    out
}

/// A table of the rows in which too little of the gain is recovered.
fn losing(all: &[Summary]) -> String {
    let mut out =
        "| case | activation | sensor | computer | of the gain, % |\n|---|---|---|---|---|\n"
            .to_owned();
    for of in of_activations(all, &ACTIVATIONS, Summary::loses) {
        let gain = 100.0 * of.gain_kept.unwrap_or(f64::NAN);
        let _ = writeln!(out, "{} {gain:.0} |", head(of));
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

/// A table for each sensor and activation: all cases, with columns for the computers.
fn tables(all: &[Summary]) -> String {
    let mut out = String::new();
    for activation in ACTIVATIONS {
        for &sensor in Sensor::ALL {
            let of: Vec<&Summary> = rows(all, activation, sensor).collect();
            if !of.is_empty() {
                let _ = writeln!(out, "\n### {activation}, {sensor}\n");
                out.push_str(&table_of(&of));
            }
        }
    }
    out
}

fn table_of(of: &[&Summary]) -> String {
    let computers: Vec<Computer> = Computer::ALL
        .iter()
        .copied()
        .filter(|computer| of.iter().any(|one| one.computer == *computer))
        .collect();
    let mut out = String::new();
    let _ = write!(out, "| case | corrected in | given up in |");
    for computer in &computers {
        let _ = write!(out, " {computer}: raw | corrected | median | worst |");
    }
    let _ = write!(out, " kept |\n|---|---|---|");
    let _ = writeln!(out, "{}---|", "---|---|---|---|".repeat(computers.len()));
    let mut names: Vec<&str> = of.iter().map(|one| one.case.as_str()).collect();
    names.dedup();
    let mut seen = std::collections::BTreeSet::new();
    for name in names.into_iter().filter(|name| seen.insert(*name)) {
        let rows: Vec<&&Summary> = of.iter().filter(|one| one.case == name).collect();
        let _ = write!(
            out,
            "| `{name}` | {:.0} % | {:.0} % |",
            100.0 * rows[0].promoted_share,
            100.0 * rows[0].rolled_back_share,
        );
        for row in &rows {
            let mark = if row.harms() { "**" } else { "" };
            let _ = write!(
                out,
                " {} | {} | {mark}{:.2}{mark} | {mark}{:.2}{mark} |",
                metres(row.raw_median_m),
                metres(row.corrected_median_m),
                row.ratio_median,
                row.ratio_worst,
            );
        }
        let gain = rows.iter().filter_map(|row| row.gain_kept).reduce(f64::min);
        let _ = writeln!(
            out,
            " {} |",
            gain.map_or(String::new(), |gain| format!("{:.0} %", 100.0 * gain))
        );
    }
    out
}

/// The description of the cases, with their parameters.
fn cases() -> String {
    let mut out = String::new();
    for (heading, rows) in PARTS {
        let _ = writeln!(
            out,
            "### {heading}\n\n| case | what happens | parameters |\n|---|---|---|"
        );
        for Row {
            name, about, given, ..
        } in rows
        {
            let given: Vec<String> = given
                .iter()
                .map(|given| format!("`{}` {}", given.key, given.value))
                .collect();
            let _ = writeln!(out, "| `{name}` | {about} | {} |", given.join(", "));
        }
        out.push('\n');
    }
    let more: Vec<String> = table::usual()
        .filter(|name| table::part_of(name) == COMBINED)
        .map(|name| format!("`{name}`"))
        .collect();
    let _ = writeln!(out, "### {COMBINED}\n\n{}", more.join(", "));
    out
}
