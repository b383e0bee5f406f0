//! The table that `host-sim abuse` prints.

use super::terminal::fitted;
use comfy_table::{Cell, CellAlignment, Table, presets::UTF8_FULL_CONDENSED};
use host_lab::abuse::Summary;

/// What a row is of, then its numbers.
const HEADER: [&str; 13] = [
    "case",
    "sensor",
    "activation",
    "computer",
    "runs",
    "raw, m",
    "corr., m",
    "median",
    "worst",
    "prom.",
    "gone",
    "",
    "kept",
];
/// The number of columns that are words.
const WORDS: usize = 4;
/// Columns in the order in which they make room: what is compared stays.
const ORDER: [usize; 9] = [10, 9, 4, 12, 5, 6, 8, 1, 3];

/// One line for each row, in at most `width` columns, and how many rows harm.
#[must_use]
pub fn table(all: &[Summary], width: usize) -> String {
    let mut table = Table::new();
    table.load_preset(UTF8_FULL_CONDENSED);
    let aligned = |(column, text): (usize, String)| match column {
        0..WORDS => Cell::new(text),
        _ => Cell::new(text).set_alignment(CellAlignment::Right),
    };
    let header = HEADER.iter().map(|name| (*name).to_owned());
    table.set_header(header.enumerate().map(aligned));
    for of in all {
        let cells = [
            of.case.clone(),
            of.sensor.to_string(),
            of.activation.to_string(),
            of.computer.to_string(),
            of.runs.to_string(),
            format!("{:.1}", of.raw_median_m),
            format!("{:.1}", of.corrected_median_m),
            format!("{:.3}", of.ratio_median),
            format!("{:.3}", of.ratio_worst),
            format!("{:.2}", of.promoted_share),
            format!("{:.2}", of.rolled_back_share),
            if of.harms() { "harms" } else { "" }.to_owned(),
            of.gain_kept
                .map_or(String::new(), |kept| format!("{kept:.2}")),
        ];
        table.add_row(cells.into_iter().enumerate().map(aligned));
    }
    let harming = all.iter().filter(|of| of.harms()).count();
    format!(
        "{}\nmedian: corrected median over raw median; worst: largest ratio of a run\n\
         prom., gone: share of runs with a promoted hypothesis, with one given up\n\
         kept: gain kept after a disturbance that ends\n{harming} of {} rows harm",
        fitted(table, width, ORDER),
        all.len()
    )
}

#[cfg(test)]
mod tests {
    use super::super::terminal::is_within;
    use super::*;
    use host_lab::abuse::{Activation, Computer, Sensor};

    #[test]
    fn every_width_has_the_case_its_ratio_and_whether_it_harms() {
        let row = Summary {
            case: "late-fixes+multipath:ended".into(),
            sensor: Sensor::Perfect,
            computer: Computer::Plain,
            activation: Activation::NextPowerOn,
            runs: 50,
            raw_median_m: 1234.5,
            corrected_median_m: 99_876.5,
            ratio_median: 80.904,
            ratio_of_runs_median: 80.0,
            ratio_worst: 123.456,
            ratio_worst_run: 7,
            runs_worse: 1,
            promoted_share: 0.5,
            rolled_back_share: 0.25,
            gain_kept: Some(0.75),
            faults: 0,
        };
        for width in [40, 80, 120, usize::MAX] {
            let text = table(std::slice::from_ref(&row), width);
            assert!(is_within(&text, "median: ", width), "{width}:\n{text}");
            for part in ["80.904", "harms", "1 of 1 rows harm"] {
                assert!(text.contains(part), "{width}, {part}:\n{text}");
            }
        }
        assert!(table(&[row], usize::MAX).contains("late-fixes+multipath:ended"));
    }
}
