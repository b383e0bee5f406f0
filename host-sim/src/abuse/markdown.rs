//! `docs/ABUSE.md`.

use super::case::Row;
use super::names::{Activation, Computer, Sensor};
use super::summary::{GAIN_KEPT, LIMITS, Summary};
use super::table::{self, COMBINED, PARTS};
use super::times::{RECOVERY_S, Times};
use std::fmt::Write;

/// In the order of the page: how a device acts unless it is told otherwise comes first.
const ACTIVATIONS: [Activation; 3] = [
    Activation::NextPowerOn,
    Activation::NextPowerOnAided,
    Activation::Live,
];

/// The page, made by `command`.
#[must_use]
pub fn markdown(command: &str, times: &Times, all: &[Summary]) -> String {
    let mut out = String::new();
    beginning(&mut out, command, times);
    harm(&mut out, all);
    losses(&mut out, all);
    let _ = writeln!(out, "\n## All rows\n\n### Rows that harm\n");
    out.push_str(&harming(all, &ACTIVATIONS));
    let _ = writeln!(out, "\n### Rows in which the gain does not come back\n");
    out.push_str(&losing(all));
    tables(&mut out, all);
    cases(&mut out);
    out
}

/// What the page is about, and how it was made.
fn beginning(out: &mut String, command: &str, times: &Times) {
    let _ = writeln!(
        out,
        "# Abuse\n\n\
         What does the device do when the world is not as it was told? Fixes come late or lie, a sensor\n\
         breaks, a datasheet is wrong, frames get lost, the vehicle creeps or swings. This page is for\n\
         somebody who must know whether navigation is then worse with the device than without it, and\n\
         where. [What to expect](what-to-expect.md) draws the conclusions.\n\
         [RELIABILITY](RELIABILITY.md) is about parts of the device that break.\n\n\
         ## How it was tried\n\n\
         Each disturbance is a *case*. A *run* is one simulated unit in a case:\n\n\
         1. The unit stands for {} s.\n\
         2. It drives for {} s with fixes, while the case disturbs it and the device learns.\n\
         3. It drives for {} s without fixes. Here a navigation computer behind the device is judged.\n\n\
         The code is the device's own. It gets the bytes of sensor and receiver and sends bytes, as on a\n\
         board.\n\n\
         **When the correction acts.** Each case is judged with two settings of the device, its\n\
         *activations*:\n\n\
         | activation | what the device has learnt acts |\n|---|---|\n\
         | `next-power-on` | after the unit is switched on again, from the first sample of another \
         drive on. A device does this unless it is told otherwise |\n\
         | `live` | in the drive in which it is learnt, as soon as it has proved itself |\n",
        times.standstill_s, times.aided_s, times.free_s,
    );
    let _ = writeln!(
        out,
        "**Behind the device** is one of three navigation computers. They differ in what they estimate\n\
         themselves:\n\n\
         | computer | it estimates |\n|---|---|\n\
         | `plain` | no sensor errors: it takes the sensors for right |\n\
         | `biases` | six biases |\n\
         | `gauss-markov` | biases and scale factors, as KF-GINS does |\n\n\
         **The sensor** is one of two. `perfect` has white noise and rounding only, so whatever is learnt\n\
         there is wrong. `errors` has all errors of its preset.\n\n\
         **The numbers** are horizontal errors at the end: *raw* without the device, *corrected* with it.\n\n\
         Made by\n\n    {command}\n",
    );
}

/// How many rows harm, and which of them do so with the usual activation.
fn harm(out: &mut String, all: &[Summary]) {
    let [median, worst] = LIMITS;
    let runs = all.iter().map(|of| of.runs).max().unwrap_or(0);
    let harming: Vec<&Summary> = all.iter().filter(|of| of.harms()).collect();
    let estimating =
        |of: &&&Summary| of.activation == Activation::Live && of.computer != Computer::Plain;
    let _ = writeln!(
        out,
        "## Where correcting harms\n\n\
         A *row* is a case with a sensor, a navigation computer and an activation, over {runs} runs. A row\n\
         *harms* if its median corrected error is more than {median:.2} times the raw one, or if that of one\n\
         of its runs is more than {worst:.2} times. Errors below 1 m count as 1 m.\n\n\
         **{} of {} rows harm. {} of them are live corrections behind a computer that estimates biases\n\
         itself.** A correction that moves in a drive changes the very errors that such a computer\n\
         estimates.\n\n\
         The table counts the rows that harm. Behind each count stands the worst run: its corrected error\n\
         divided by its raw one, and its case.\n",
        harming.len(),
        all.len(),
        harming.iter().filter(estimating).count(),
    );
    out.push_str(&counts(all, |of| {
        let of: Vec<_> = of.iter().filter(|of| of.harms()).collect();
        let worst = of
            .iter()
            .max_by(|a, b| a.ratio_worst.total_cmp(&b.ratio_worst));
        let worst = worst.map(|of| format!(", at worst {:.2} (`{}`)", of.ratio_worst, of.case));
        (of.len(), worst.unwrap_or_default())
    }));
    let usual = [Activation::NextPowerOn];
    let _ = writeln!(
        out,
        "\nThese are the rows that harm with `next-power-on`, so with a device that was told nothing else.\n\
         [Rows that harm](#rows-that-harm) has the others. The last two columns tell the worst run: its\n\
         corrected error divided by its raw one, and the number of the run.\n"
    );
    out.push_str(&self::harming(all, &usual));
}

/// In how many rows too little of the gain comes back.
fn losses(out: &mut String, all: &[Summary]) {
    let _ = writeln!(
        out,
        "\n## Where the gain does not come back\n\n\
         Some disturbances end {RECOVERY_S} s before the fixes do. The device then has time to recover. The goal\n\
         is that at least {:.0} % of what it gains without a disturbance is back at the end. In {} rows it is\n\
         not. The table counts them;\n\
         [the list](#rows-in-which-the-gain-does-not-come-back) has each one.\n",
        100.0 * GAIN_KEPT,
        all.iter().filter(|of| of.loses()).count(),
    );
    out.push_str(&counts(all, |of| {
        (of.iter().filter(|of| of.loses()).count(), String::new())
    }));
}

/// A table of how many rows of each activation, sensor and computer are counted, with words behind
/// the number.
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

/// The rows for which this holds, of one of these activations after the other.
fn of_activations<'a>(
    all: &'a [Summary],
    activations: &'a [Activation],
    holds: fn(&Summary) -> bool,
) -> impl Iterator<Item = &'a Summary> {
    let rows_of = move |activation| all.iter().filter(move |of| of.activation == activation);
    let rows = activations.iter().copied().flat_map(rows_of);
    rows.filter(move |of| holds(of))
}

/// The first cells of a row in a list: which one it is.
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

/// A table of the rows in which too little of the gain comes back.
fn losing(all: &[Summary]) -> String {
    let mut out =
        "| case | activation | sensor | computer | of the gain, % |\n|---|---|---|---|---|\n"
            .to_owned();
    for of in of_activations(all, &ACTIVATIONS, Summary::loses) {
        let kept = 100.0 * of.gain_kept.unwrap_or(f64::NAN);
        let _ = writeln!(out, "{} {kept:.0} |", head(of));
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
fn tables(out: &mut String, all: &[Summary]) {
    let _ = writeln!(out, "\n{HEADS}");
    for activation in ACTIVATIONS {
        for &sensor in Sensor::ALL {
            let of: Vec<&Summary> = rows(all, activation, sensor).collect();
            if !of.is_empty() {
                let _ = writeln!(out, "\n### {activation}, {sensor}\n");
                out.push_str(&table_of(&of));
            }
        }
    }
}

/// What the columns of the following tables are.
const HEADS: &str = "\
The following tables have all rows, one table for each activation and sensor. Their columns are:

| column | what it tells |
|---|---|
| corrected in | the share of the runs in which the device corrected something |
| given up in | the share of the runs in which it gave a correction up again |
| raw, corrected | for each navigation computer: the medians of the two errors, m |
| median | the second of these divided by the first |
| worst | the largest such ratio of a run |
| kept | after a disturbance that has ended: the share of the gain that is back, the least of the computers |

Ratios in **bold** are those of a row that harms.";

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
         To run a case with other numbers, give `--set CASE.KEY=VALUE`. Names joined by `+` act at once.\n\
         `:ended` after a name ends the disturbance {RECOVERY_S} s before the fixes.\n\n\
         To add a case, write one row in `host-sim/src/abuse/table/`: its name, what happens, when, its\n\
         numbers, and the acts that it is made of. A new act is a variant of `Fault` in `receiver.rs`,\n\
         `sensor.rs`, `line.rs` or `told.rs`, of `Motion`, or of `Asked`, beside the code that does it.\n",
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
