//! The tables and the page of several sessions of one unit.

mod page;

pub use page::{document, verdict};

use crate::terminal::{MARK, fitted, named};
use comfy_table::{CellAlignment, Table, presets};
use host_chart::axis::grouped;
use host_lab::experiment::sessions::{self, Judged, PHASES, PaperRow, Row, shared};
use std::collections::BTreeSet;
use std::fmt::Write;

/// The tables and sentences on the terminal. `start`: where coasts start.
#[must_use]
pub fn text(sessions: &[Judged], start: &str, width: usize) -> String {
    let mut out = verdict(sessions).join("\n") + "\n\n";
    for of in sessions {
        let _ = writeln!(
            out,
            "session {}, {} ({:.0} s, residual {:.2}): the device {}",
            of.session, of.name, of.duration_s, of.residual, of.device.says
        );
        for note in &of.notes {
            let _ = writeln!(out, "  {note}");
        }
    }
    let rows: Vec<&Row> = sessions.iter().flat_map(|of| &of.rows).collect();
    let _ = writeln!(
        out,
        "\nMedian over the sessions of the median horizontal error, m; only sessions that all rows \
         have (last line). {MARK}: the device; sorted by the last time.\n{start}"
    );
    for phase in PHASES {
        if let Some(mut table) = table(&rows, phase) {
            let horizons = 1..table.column_count().saturating_sub(1);
            let table = fitted(table, width, horizons);
            let _ = writeln!(out, "\n{phase}\n{table}");
        }
    }
    out
}

/// A phase: a row a scheme, a column a horizon.
fn table(rows: &[&Row], phase: &str) -> Option<Table> {
    let of = shared(&of_phase(rows, phase));
    let (horizons, schemes) = (horizons(&of), schemes(&of));
    if schemes.is_empty() {
        return None;
    }
    let mut table = Table::new();
    table.load_preset(presets::NOTHING);
    let seconds = horizons.iter().map(|horizon| format!("{horizon} s"));
    table.set_header(std::iter::once("scheme".to_owned()).chain(seconds));
    let mut schemes = schemes;
    let end = |scheme: &str| median(&of, phase, scheme, *horizons.last()?);
    schemes.sort_by(|a, b| {
        let [a, b] = [a, b].map(|scheme| end(scheme).unwrap_or(f64::INFINITY));
        a.total_cmp(&b)
    });
    for scheme in schemes {
        let shown = horizons.iter().map(|horizon| {
            let median = median(&of, phase, scheme, *horizon);
            median.map_or("-".into(), figure)
        });
        table.add_row(std::iter::once(named(scheme)).chain(shown));
    }
    table.add_row(counted_sessions(&of, &horizons));
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    Some(table)
}

/// The last line of a phase's table: over how many sessions its medians are.
fn counted_sessions(rows: &[&Row], horizons: &[f64]) -> Vec<String> {
    let count = |horizon: &f64| {
        let own = rows.iter().filter(|row| row.horizon_s == *horizon);
        let sessions: BTreeSet<usize> = own.map(|row| row.session).collect();
        sessions.len().to_string()
    };
    let counts = horizons.iter().map(count);
    std::iter::once("sessions".to_owned())
        .chain(counts)
        .collect()
}

/// The paper's test: a row a scheme, a column a protocol, the median and the range over the drives.
#[must_use]
pub fn paper(rows: &[PaperRow], width: usize) -> String {
    let horizon = rows.first().map_or(0.0, |row| row.horizon_s);
    let mut out = format!(
        "\nthe paper's test: horizontal error after {horizon} s without fixes, m, median over the \
         drives (least to most)\n"
    );
    let mut cases: Vec<&str> = Vec::new();
    let mut schemes: Vec<&str> = Vec::new();
    for row in rows {
        for (list, name) in [(&mut cases, &row.judged_on), (&mut schemes, &row.scheme)] {
            if !list.contains(&name.as_str()) {
                list.push(name);
            }
        }
    }
    let mut table = Table::new();
    table.load_preset(presets::NOTHING);
    table.set_header(std::iter::once("scheme").chain(cases.iter().copied()));
    for scheme in schemes {
        let cells = cases.iter().map(|case| {
            let own = rows
                .iter()
                .filter(|row| row.scheme == scheme && row.judged_on == *case);
            let mut all: Vec<f64> = own.map(|row| row.error_m).collect();
            all.sort_by(f64::total_cmp);
            match (all.first(), all.last()) {
                (Some(least), Some(most)) => {
                    let median = all[all.len() / 2];
                    format!(
                        "{} ({} to {})",
                        figure(median),
                        figure(*least),
                        figure(*most)
                    )
                }
                _ => "-".into(),
            }
        });
        table.add_row(std::iter::once(named(scheme)).chain(cells));
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let _ = writeln!(out, "{}", fitted(table, width, []));
    out
}

fn of_phase<'a>(rows: &[&'a Row], phase: &str) -> Vec<&'a Row> {
    rows.iter()
        .copied()
        .filter(|row| row.phase == phase)
        .collect()
}

/// The horizons, rising, s.
fn horizons(rows: &[&Row]) -> Vec<f64> {
    let mut all: Vec<f64> = rows.iter().map(|row| row.horizon_s).collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

/// The schemes in the order of their rows.
fn schemes<'a>(rows: &[&'a Row]) -> Vec<&'a str> {
    let mut all: Vec<&str> = Vec::new();
    for row in rows {
        if !all.contains(&row.scheme.as_str()) {
            all.push(&row.scheme);
        }
    }
    all
}

/// Median over the sessions.
fn median(rows: &[&Row], phase: &str, scheme: &str, horizon: f64) -> Option<f64> {
    let own = rows
        .iter()
        .filter(|row| row.phase == phase && row.scheme == scheme && row.horizon_s == horizon);
    Some(sessions::median(own.map(|row| row.median_m))).filter(|median| median.is_finite())
}

fn figure(metres: f64) -> String {
    match metres {
        m if m < 10.0 => format!("{m:.2}"),
        m if m < 100.0 => format!("{m:.1}"),
        m => grouped(m, 0).replace('\u{a0}', " "),
    }
}
