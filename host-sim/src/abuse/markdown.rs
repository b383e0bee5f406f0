//! `docs/ABUSE.md`.

use super::case::Row;
use super::names::{Activation, Computer, Sensor};
use super::summary::{GAIN_KEPT, LIMITS, Summary};
use super::table::{self, COMBINED, PARTS};
use super::times::{RECOVERY_S, Times};
use std::fmt::Write;

/// The page, made by `command`.
#[must_use]
pub fn markdown(command: &str, times: &Times, all: &[Summary]) -> String {
    let mut out = String::new();
    let [median, worst] = LIMITS;
    let _ = writeln!(
        out,
        "# Abuse\n\n\
         The device's own code in a hostile world, bytes in and bytes out. A unit stands for {} s and\n\
         drives for {} s with fixes while a case disturbs it. Then a navigation computer goes on free\n\
         inertial for {} s behind the device (*live*). After that the unit is switched on again, and\n\
         what the device has stored acts from the first sample of another drive without fixes (*next\n\
         power-on*). *Raw* is the horizontal error at the end without the device, *corrected* with it.\n\n\
         Made by\n\n    {command}\n",
        times.standstill_s, times.aided_s, times.free_s,
    );
    let runs = all.iter().map(|of| of.runs).max().unwrap_or(0);
    let harming: Vec<&Summary> = all.iter().filter(|of| of.harms()).collect();
    let _ = writeln!(out, "## Where correcting harms\n");
    let _ = writeln!(
        out,
        "Harm is a median of more than {median:.2} times the raw one, or a run of more than {worst:.2} \
         times\n(errors below 1 m count as 1 m). {} of {} rows harm, over {runs} runs each.\n",
        harming.len(),
        all.len(),
    );
    let mut names: Vec<&str> = harming.iter().map(|of| of.case.as_str()).collect();
    names.sort_by_key(|case| all.iter().position(|of| of.case == **case));
    names.dedup();
    for case in names {
        let of = harming.iter().filter(|of| of.case == case);
        let words: Vec<String> = of.map(|of| words(of)).collect();
        let _ = writeln!(out, "- `{case}`: {}", words.join("; "));
    }
    let losing: Vec<&Summary> = all.iter().filter(|of| of.loses()).collect();
    let _ = writeln!(
        out,
        "\n## Where the gain does not come back\n\n\
         After a disturbance that ends {RECOVERY_S} s before the fixes do, at least {:.0} % of the \
         undisturbed\ngain should be back. In {} rows it is not.\n",
        100.0 * GAIN_KEPT,
        losing.len(),
    );
    for of in &losing {
        let kept = of.gain_kept.unwrap_or(f64::NAN);
        let _ = writeln!(out, "- {}: {:.0} % of the gain", head(of), 100.0 * kept);
    }
    tables(&mut out, all);
    cases(&mut out);
    out
}

fn head(of: &Summary) -> String {
    format!(
        "`{}`, {}, {}, {}",
        of.case, of.sensor, of.computer, of.activation
    )
}

/// A row that harms, in words.
fn words(of: &Summary) -> String {
    format!(
        "{}, {}, {}: {} to {} m, {:.2} times in run {}",
        of.sensor,
        of.computer,
        of.activation,
        metres(of.raw_median_m),
        metres(of.corrected_median_m),
        of.ratio_worst,
        of.ratio_worst_run,
    )
}

fn metres(x: f64) -> String {
    if x < 100.0 {
        format!("{x:.1}")
    } else {
        format!("{x:.0}")
    }
}

/// A table for each sensor and activation: all cases, with columns for the computers.
fn tables(out: &mut String, all: &[Summary]) {
    for &activation in Activation::ALL {
        for &sensor in Sensor::ALL {
            let of: Vec<&Summary> = all
                .iter()
                .filter(|of| of.sensor == sensor && of.activation == activation)
                .collect();
            if !of.is_empty() {
                let _ = writeln!(out, "\n## {activation}, {sensor}\n");
                out.push_str(&table_of(&of));
            }
        }
    }
}

/// What a table's columns are.
const HEADS: &str = "Of each navigation computer: raw and corrected median, m; their ratio; the worst run's ratio. \
                     **Bold** harms.\n\n";

fn table_of(of: &[&Summary]) -> String {
    let computers: Vec<Computer> = Computer::ALL
        .iter()
        .copied()
        .filter(|computer| of.iter().any(|one| one.computer == *computer))
        .collect();
    let mut out = HEADS.to_owned();
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
        let kept = rows.iter().filter_map(|row| row.gain_kept).reduce(f64::min);
        let _ = writeln!(
            out,
            " {} |",
            kept.map_or(String::new(), |kept| format!("{:.0} %", 100.0 * kept))
        );
    }
    out
}

/// What the cases are, with their parameters.
fn cases(out: &mut String) {
    let _ = writeln!(
        out,
        "\n## The cases\n\n\
         `--set CASE.KEY=VALUE` gives a parameter another value. Names joined by `+` act at once, and \
         `:ended`\nafter a name ends it {RECOVERY_S} s before the fixes. A new case is one row in \
         `host-sim/src/abuse/table/`:\nits name, what happens, when, its numbers, and the acts that it \
         is made of. A new act is a variant of\n`Fault` in `receiver.rs`, `sensor.rs`, `line.rs` or \
         `told.rs`, of `Motion`, or of `Asked`, beside the code that\ndoes it.\n",
    );
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
}
