//! The tables that a campaign prints.

use super::T_MIN;
use crate::terminal::{fitted, named};
use comfy_table::{Table, presets::UTF8_FULL_CONDENSED};
use host_chart::axis::grouped;
use host_lab::campaign::{Ratio, Summary, between};
use std::collections::BTreeSet;

/// The scheme with which all others are compared in the first table.
const BASELINE: &str = "ekf6";
/// Of more than so many schemes only the pairs with these are printed.
const READABLE: usize = 6;
const AGAINST: [&str; 4] = ["uncorrected", BASELINE, "limit", "device"];

/// Errors of each scheme in each group of errors, and the ratios of each scheme to each other.
#[must_use]
pub fn tables(summary: &[Summary], ratios: &[Ratio], width: usize) -> String {
    let drives: BTreeSet<u32> = ratios.iter().map(|r| r.drives).collect();
    let paired: String = drives
        .iter()
        .map(|&after| {
            let several = if drives.len() > 1 {
                format!(", after {after} earlier drives")
            } else {
                String::new()
            };
            format!(
                "\n\npaired ratios over all groups of errors (row to column, median of the runs; \
                 all pairs: --ratios)\
                 {several}\n\n{}",
                fitted(of_all_groups(ratios, after), width, [])
            )
        })
        .collect();
    format!(
        "horizontal error after {T_MIN} min free inertial, m\n\
         95 %: interval of the median; ratio: median of the errors divided by those of {BASELINE}\n\
         in the same runs; better: in how many runs the ratio is below 1\n\n\
         {}{paired}",
        fitted(errors(summary, ratios), width, [9, 5, 6, 8, 2, 4, 7]),
    )
}

fn empty<'a>(header: impl IntoIterator<Item = &'a str>) -> Table {
    let mut table = Table::new();
    table.load_preset(UTF8_FULL_CONDENSED);
    table.set_header(header);
    table
}

fn errors(summary: &[Summary], ratios: &[Ratio]) -> Table {
    let several = summary.iter().any(|s| s.drives != summary[0].drives);
    let drives = several.then_some("drives");
    let names = [
        "errors", "scheme", "n", "median", "95 %", "mean", "worst", "ratio", "95 %", "better",
    ];
    let mut table = empty(names.into_iter().chain(drives));
    for s in summary.iter().filter(|s| s.t_min == T_MIN) {
        let ratio = ratios.iter().find(|r| {
            (r.error_model, r.t_min, r.drives) == (Some(s.error_model), T_MIN, s.drives)
                && (r.scheme == s.scheme && r.baseline == BASELINE)
        });
        let m = |x: f64| grouped(x, 0);
        let of = |text: &dyn Fn(&Ratio) -> String| ratio.map_or_else(String::new, text);
        let cells = [
            s.error_model.to_string(),
            named(&s.scheme),
            s.n.to_string(),
            m(s.median_m),
            between(s.lo95_m.zip(s.hi95_m), m),
            m(s.mean_m),
            m(s.max_m),
            of(&|r| format!("{:.2}", r.ratio)),
            of(&|r| between(r.interval(), |x| format!("{x:.2}"))),
            of(&|r| r.better.to_string()),
        ];
        let drives = several.then(|| s.drives.to_string());
        table.add_row(cells.into_iter().chain(drives));
    }
    table
}

fn of_all_groups(ratios: &[Ratio], drives: u32) -> Table {
    let all = ratios.iter();
    let all = all.filter(|r| r.error_model.is_none() && r.drives == drives);
    let all: Vec<&Ratio> = all.filter(|r| r.t_min == T_MIN).collect();
    let mut schemes: Vec<&str> = Vec::new();
    for r in &all {
        if !schemes.contains(&r.scheme.as_str()) {
            schemes.push(&r.scheme);
        }
    }
    let mut columns = schemes.clone();
    if columns.len() > READABLE {
        columns.retain(|scheme| AGAINST.contains(scheme));
    }
    let mut table = empty([""].into_iter().chain(columns.iter().copied()));
    for scheme in &schemes {
        let cell = |baseline: &&str| {
            let pair = |r: &&&Ratio| r.scheme == *scheme && r.baseline == *baseline;
            let found = all.iter().find(pair);
            found.map_or("1".to_string(), |r| format!("{:.2}", r.ratio))
        };
        let row = columns.iter().map(cell);
        table.add_row([named(scheme)].into_iter().chain(row));
    }
    table
}
