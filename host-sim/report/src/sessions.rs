//! The printed tables of several sessions of one unit.

use comfy_table::{CellAlignment, Table, presets};
use host_lab::experiment::sessions::{Judged, PHASES, Row};
use std::collections::BTreeSet;
use std::fmt::Write;

/// The tables and sentences on the terminal.
#[must_use]
pub fn text(sessions: &[Judged]) -> String {
    let mut out = String::new();
    for of in sessions {
        let _ = writeln!(
            out,
            "session {}, {} ({:.0} s, residual {:.1}): the device {}",
            of.session, of.name, of.duration_s, of.residual, of.device.says
        );
        for note in &of.notes {
            let _ = writeln!(out, "  {note}");
        }
    }
    let rows: Vec<&Row> = sessions.iter().flat_map(|of| &of.rows).collect();
    out.push_str(
        "\nmedian over the sessions of the median horizontal error, m. Every coast starts from one \
         state, smoothed\nfrom all fixes, that no row's parameters shaped.\n",
    );
    for phase in PHASES {
        if let Some(table) = table(&rows, phase) {
            let _ = writeln!(out, "\n{phase}\n{table}");
        }
    }
    out
}

/// A phase: a row a scheme, a column a horizon.
fn table(rows: &[&Row], phase: &str) -> Option<Table> {
    let of = |row: &&&Row| row.phase == phase;
    let horizons: BTreeSet<u64> = rows
        .iter()
        .filter(of)
        .map(|r| r.horizon_s.to_bits())
        .collect();
    let mut schemes: Vec<&str> = Vec::new();
    for row in rows.iter().filter(of) {
        if !schemes.contains(&row.scheme.as_str()) {
            schemes.push(&row.scheme);
        }
    }
    if schemes.is_empty() {
        return None;
    }
    let mut table = Table::new();
    table.load_preset(presets::NOTHING);
    let seconds = horizons.iter().map(|h| format!("{} s", f64::from_bits(*h)));
    let head = std::iter::once("scheme".to_owned()).chain(seconds);
    table.set_header(head.chain(["sessions".to_owned()]));
    for scheme in schemes {
        let medians = |horizon: u64| {
            let own = rows
                .iter()
                .filter(of)
                .filter(|row| row.scheme == scheme && row.horizon_s.to_bits() == horizon);
            let mut all: Vec<f64> = own.map(|row| row.median_m).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let shown = horizons.iter().map(|horizon| figure(&medians(*horizon)));
        let count = horizons
            .iter()
            .map(|h| medians(*h).len())
            .max()
            .unwrap_or(0);
        let cells = std::iter::once(scheme.to_owned()).chain(shown);
        table.add_row(cells.chain([count.to_string()]));
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    Some(table)
}

fn figure(sorted: &[f64]) -> String {
    let median = match sorted.len() {
        0 => return "-".into(),
        n if n % 2 == 1 => sorted[n / 2],
        n => f64::midpoint(sorted[n / 2 - 1], sorted[n / 2]),
    };
    match median {
        m if m < 10.0 => format!("{m:.2}"),
        m if m < 100.0 => format!("{m:.1}"),
        m => format!("{m:.0}"),
    }
}
