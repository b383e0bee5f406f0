//! Tables of `docs/ABUSE.md` about the first rest: one for each class of sensors.

use super::names::{Activation, Sensor};
use super::summary::Summary;
use super::table::at_power_on;
use std::fmt::Write;

/// Classes of sensors with errors, and the same without errors.
const CLASSES: [(Sensor, Sensor); 3] = [
    (Sensor::Consumer, Sensor::ConsumerPerfect),
    (Sensor::Mems, Sensor::MemsPerfect),
    (Sensor::Errors, Sensor::Perfect),
];

/// The tables.
pub(super) fn tables(all: &[Summary]) -> String {
    let mut out = String::new();
    let names: Vec<&str> = at_power_on().collect();
    for (errs, perfect) in CLASSES {
        let of = |sensor: Sensor| {
            let of = all.iter().filter(move |of| of.sensor == sensor);
            of.filter(|of| of.activation.rests())
        };
        let runs = of(errs).map(|of| of.runs).max().unwrap_or(0);
        if runs == 0 {
            continue;
        }
        let (remembers, new) = (Activation::FirstRest, Activation::FirstRestNew);
        let _ = writeln!(
            out,
            "| `{errs}`, {runs} runs | {remembers} | {new} | `{perfect}`: runs corrected, worst \
             |\n|---|---|---|---|"
        );
        // cases with the same cells share a row
        let mut cells: Vec<(String, Vec<String>)> = Vec::new();
        for name in &names {
            let mut cell = String::new();
            for activation in [remembers, new] {
                let of = of(errs).filter(|of| of.case == *name && of.activation == activation);
                let _ = write!(cell, " {} |", ratios(of));
            }
            let of: Vec<&Summary> = of(perfect).filter(|of| of.case == *name).collect();
            let _ = write!(cell, " {} |", corrected(&of));
            let name = format!("`{name}`");
            match cells.iter_mut().find(|(known, _)| *known == cell) {
                Some((_, names)) => names.push(name),
                None => cells.push((cell, vec![name])),
            }
        }
        for (cell, names) in cells {
            let _ = writeln!(out, "| {} |{cell}", names.join(", "));
        }
        out.push('\n');
    }
    out
}

/// The ratios of the medians, those of rows that harm in bold.
pub(super) fn ratios<'a>(of: impl Iterator<Item = &'a Summary>) -> String {
    let ratio = |of: &Summary| {
        let mark = if of.harms() { "**" } else { "" };
        format!("{mark}{:.2}{mark}", of.ratio_median)
    };
    let mut ratios: Vec<String> = of.map(ratio).collect();
    if ratios.iter().all(|ratio| ratio == "1.00") {
        ratios.truncate(1);
    }
    ratios.join(" / ")
}

/// How many runs were corrected at all, and the largest ratio of a run.
fn corrected(of: &[&Summary]) -> String {
    let runs = of.iter().map(|of| of.runs).max().unwrap_or(0);
    let most = |value: fn(&Summary) -> f64| of.iter().map(|of| value(of)).fold(0.0, f64::max);
    let share = most(|of| of.promoted_share);
    match (runs, share > 0.0) {
        (0, _) => String::new(),
        (_, false) => format!("0 of {runs}"),
        (_, true) => {
            let worst = most(|of| of.ratio_worst);
            let mark = if of.iter().any(|of| of.harms()) {
                "**"
            } else {
                ""
            };
            format!(
                "{:.0} of {runs}, {mark}{worst:.2}{mark}",
                share * runs as f64
            )
        }
    }
}
