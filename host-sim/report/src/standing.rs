//! What logs at rest show of a unit, for readers of `unit from-log`.

use super::allan::figures;
use super::terminal::fitted;
use comfy_table::{Cell, CellAlignment, Table, presets};
use host_core::inertial::units::{DEG_PER_H, UG};
use host_estimation::analysis::standing::{Law, LogResults, Number, Scatter, Sheet};

/// Ratio to the preset from which on a number differs from it.
const DIFFERS: f64 = 1.5;

/// The report as text: the logs, the numbers beside the preset's, laws, margins, notes.
#[must_use]
pub fn text(shown: &LogResults, sheet: &Sheet, width: usize) -> String {
    let mut text = format!("{}\n\n{}\n\n", fitted(logs(shown), width, [2, 4]), {
        fitted(numbers(sheet), width, [5, 3])
    });
    for line in differences(sheet)
        .into_iter()
        .chain(laws(shown))
        .chain(margins(shown))
    {
        text += &format!("{line}\n");
    }
    for note in &shown.notes {
        text += &format!("- {note}\n");
    }
    text
}

/// The first comment lines of the file.
#[must_use]
pub fn about(shown: &LogResults) -> Vec<String> {
    let rest: f64 = shown.logs.iter().map(|log| log.rest_s).sum();
    let mut lines = vec![format!(
        "Written by `host-sim unit from-log` from {}, {:.0} s at rest in all",
        match shown.logs.len() {
            1 => "one log".to_owned(),
            n => format!("{n} logs"),
        },
        rest
    )];
    lines.extend(shown.logs.iter().map(|log| format!("log: {}", log.name)));
    lines.extend(laws(shown));
    lines
}

fn right(text: String) -> Cell {
    Cell::new(text).set_alignment(CellAlignment::Right)
}

fn range([least, most]: [f64; 2]) -> String {
    format!("{least:.1} to {most:.1}")
}

fn logs(shown: &LogResults) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::UTF8_FULL_CONDENSED);
    table.set_header([
        "log",
        "at rest, s",
        "moves",
        "degrees C",
        "gyro bias, deg/h",
        "force off gravity, ug",
    ]);
    for log in &shown.logs {
        let bias: Vec<String> = log
            .gyro_bias
            .iter()
            .map(|b| figures(b / DEG_PER_H))
            .collect();
        let [off, sigma] = log.above_gravity.map(|f| f / UG);
        table.add_row([
            Cell::new(&log.name),
            right(format!("{:.0}", log.rest_s)),
            right(log.rests.moves.len().to_string()),
            right(log.range_degc.map_or("unknown".into(), range)),
            right(match bias.is_empty() {
                true => "unknown".into(),
                false => bias.join(", "),
            }),
            right(format!("{off:.0} \u{b1} {sigma:.0}")),
        ]);
    }
    table
}

fn numbers(sheet: &Sheet) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::UTF8_FULL_CONDENSED);
    let preset = format!("preset {}", sheet.preset);
    table.set_header([
        "field",
        "in the file",
        "the logs show",
        "unit",
        &preset,
        "because",
    ]);
    for number in &sheet.numbers {
        table.add_row([
            Cell::new(number.key),
            right(figures(number.value)),
            right(number.measured.map_or("-".into(), figures)),
            Cell::new(number.unit),
            right(figures(number.preset)),
            Cell::new(&number.source),
        ]);
    }
    table
}

/// What differs from the preset, by what the logs show. A bias that is smaller than the preset's
/// standard deviation does not.
fn differences(sheet: &Sheet) -> Vec<String> {
    let ratio = |n: &Number| Some(n.measured? / n.preset);
    let far = |n: &Number, ratio: f64| {
        let one_draw = n.key.contains("turn_on");
        ratio > DIFFERS && !(one_draw && ratio < 3.0) || ratio < 1.0 / DIFFERS && !one_draw
    };
    let measured = sheet.numbers.iter().filter_map(|n| Some((n, ratio(n)?)));
    let all: Vec<String> = measured
        .filter(|(n, ratio)| far(n, *ratio))
        .map(|(n, ratio)| format!("{} is {} times the preset's", n.key, figures(ratio)))
        .collect();
    let preset = &sheet.preset;
    vec![match all.is_empty() {
        true => format!("Against preset {preset}: nothing that the logs show differs from it."),
        false => format!("Against preset {preset}: {}.", all.join(", ")),
    }]
}

fn law(name: &str, law: &Law, axes: &[&str], si: f64, unit: &str) -> String {
    let each = axes.iter().enumerate().map(|(i, axis)| {
        let (slope, sigma) = (law.per_k[i] / si, law.sigma[i] / si);
        format!("{axis} {slope:+.3} \u{b1} {sigma:.3}")
    });
    let whence = match law.within {
        true => "within the logs",
        false => "between the logs, with what is new at each power-on",
    };
    format!(
        "Temperature law of the {name}, {unit}/K, from {} degrees C ({whence}): {}.",
        range(law.range_degc),
        each.collect::<Vec<_>>().join(", ")
    )
}

/// Laws of the temperature, or the range in which nothing is known of it.
fn laws(shown: &LogResults) -> Vec<String> {
    let mut lines = vec![];
    if let Some(of) = &shown.gyro_law {
        lines.push(law("gyros", of, &["x", "y", "z"], DEG_PER_H, "deg/h"));
    }
    if let Some(of) = &shown.accel_law {
        lines.push(law("force along gravity", of, &["up"], UG, "ug"));
    }
    if lines.is_empty() {
        let ends = shown.logs.iter().filter_map(|log| log.range_degc);
        let ends = ends.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        lines.push(match ends {
            None => "Temperatures: unknown, so the file holds at that of the logs only.".into(),
            Some(ends) => format!(
                "Temperatures: {} degrees C, too few or too narrow for a law; the file holds there \
                 only.",
                range(ends)
            ),
        });
    }
    lines
}

/// Which margins the numbers have, and why.
fn margins(shown: &LogResults) -> Vec<String> {
    let new = |name: &str, of: &Option<Scatter>, si: f64, unit: &str| match of {
        Some(s) => format!(
            "New at a power-on, {name}: {} {unit}, below {} at 95 % ({} degrees of freedom).",
            figures(s.sigma / si),
            figures(s.high / si),
            s.degrees
        ),
        None => format!("New at a power-on, {name}: needs two logs or more."),
    };
    vec![
        new("gyros", &shown.gyro_scatter, DEG_PER_H, "deg/h"),
        new("force along gravity", &shown.accel_scatter, UG, "ug"),
        "Margins: the upper end of 95 % where a number is measured, because a noise, a walk or a \
         bias that is too small makes the device trust what it should not; what is new at a \
         power-on also counts the preset as three degrees of freedom. No more than that: what \
         vibration adds in a vehicle, a log at rest does not show."
            .into(),
    ]
}
