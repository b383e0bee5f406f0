//! Tables of documents.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_a_line_of_markdown() {
        let row = |cells: [&str; 2]| cells.map(str::to_owned).to_vec();
        let text = markdown(&row(["n", "ns"]), [row(["1", "2.5"])].into_iter());
        assert_eq!(text, "| n | ns |\n|---|---|\n| 1 | 2.5 |\n");
    }
}
