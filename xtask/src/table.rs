//! The printed tables.

use comfy_table::{CellAlignment, Row, Table, presets};

/// An empty one that reads as Markdown; every column but the first holds numbers.
pub fn numbers(header: impl Into<Row>) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::ASCII_MARKDOWN);
    table.set_header(header);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
