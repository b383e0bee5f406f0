//! The printed tables.

use comfy_table::{CellAlignment, Row, Table, presets};
pub use xtask::table::markdown;

/// An empty table that prints as Markdown; every column but the first holds numbers.
pub fn numbers(header: impl Into<Row>) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::ASCII_MARKDOWN);
    table.set_header(header);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// A whole number with its digits in groups of three.
pub fn thousands(value: f64) -> String {
    let text = format!("{value:.0}");
    let mut out = String::new();
    for (i, digit) in text.chars().enumerate() {
        if i > 0 && (text.len() - i).is_multiple_of(3) && text.len() > 4 {
            out.push(' ');
        }
        out.push(digit);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_numbers_are_grouped() {
        assert_eq!(thousands(999.6), "1000");
        assert_eq!(thousands(12_345.0), "12 345");
        assert_eq!(thousands(1_234_567.4), "1 234 567");
    }
}
