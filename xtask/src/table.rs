//! The printed tables.

use comfy_table::{CellAlignment, Row, Table, presets};

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

/// A table as Markdown without padding, for documents.
pub fn markdown(header: &[String], rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut out = format!(
        "| {} |\n|{}\n",
        header.join(" | "),
        "---|".repeat(header.len())
    );
    for row in rows {
        out += &format!("| {} |\n", row.join(" | "));
    }
    out
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
    fn a_row_is_a_line_of_markdown() {
        let row = |cells: [&str; 2]| cells.map(str::to_owned).to_vec();
        let text = markdown(&row(["n", "ns"]), [row(["1", "2.5"])].into_iter());
        assert_eq!(text, "| n | ns |\n|---|---|\n| 1 | 2.5 |\n");
    }

    #[test]
    fn long_numbers_are_grouped() {
        assert_eq!(thousands(999.6), "1000");
        assert_eq!(thousands(12_345.0), "12 345");
        assert_eq!(thousands(1_234_567.4), "1 234 567");
    }
}
