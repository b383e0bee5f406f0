//! Tables for terminals of any width.

use comfy_table::{ColumnConstraint, ContentArrangement, Table, presets};

/// The mark of the device's rows.
pub(super) const MARK: &str = "\u{25c2}";

/// The name of a scheme, the device's marked.
pub(super) fn named(scheme: &str) -> String {
    match super::verdict::is_device(scheme) {
        true => format!("{scheme} {MARK}"),
        false => scheme.to_owned(),
    }
}

/// The table in `width` columns: without frame if that is enough, else also without the columns of
/// `order`, the first of them first, else with broken words. A line says what is left out.
pub(super) fn fitted(
    mut table: Table,
    width: usize,
    order: impl IntoIterator<Item = usize>,
) -> String {
    let fits = |table: &Table| {
        let broadest = table.lines().map(|line| line.chars().count()).max();
        broadest.unwrap_or(0) <= width
    };
    if fits(&table) {
        return table.to_string();
    }
    table.load_preset(presets::NOTHING);
    let mut left_out = 0;
    for column in order {
        if fits(&table) {
            break;
        }
        if let Some(column) = table.column_mut(column) {
            column.set_constraint(ColumnConstraint::Hidden);
            left_out += 1;
        }
    }
    if !fits(&table) {
        table.set_content_arrangement(ContentArrangement::Dynamic);
        table.set_width(u16::try_from(width).unwrap_or(u16::MAX));
    }
    match left_out {
        0 => table.to_string(),
        1 => format!("{table}\n(1 column has no room here)"),
        n => format!("{table}\n({n} columns have no room here)"),
    }
}

/// Whether the lines of a table, up to its notes, have at most so many columns.
#[cfg(test)]
pub(super) fn is_within(text: &str, notes: &str, width: usize) -> bool {
    let rows = text.lines().take_while(|line| !line.starts_with(notes));
    let mut rows = rows.filter(|line| !line.starts_with('('));
    rows.all(|line| line.chars().count() <= width)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut table = Table::new();
        table.load_preset(presets::UTF8_FULL);
        table.set_header(["scheme", "first column", "second column", "third column"]);
        table.add_row(["device", "1.00", "22.00", "333.00"]);
        table
    }

    #[test]
    fn a_table_fits_every_width_and_says_what_it_leaves_out() {
        for width in [20, 40, 60, 80, 120] {
            let text = fitted(table(), width, [1, 2]);
            let broadest = text.lines().filter(|line| !line.starts_with('('));
            let broadest = broadest.map(|line| line.chars().count()).max();
            assert!(broadest.unwrap() <= width, "{width}:\n{text}");
            assert!(text.contains("333.00"), "{width}:\n{text}");
        }
        assert!(fitted(table(), 40, [1, 2]).contains("(1 column has no room here)"));
        assert!(
            fitted(table(), 120, [1]).starts_with('\u{250c}'),
            "its frame"
        );
    }
}
