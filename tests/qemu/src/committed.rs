//! Measured figures that are committed and shown in the pages: `docs/figures/NAME.csv`. The first
//! line, a comment, names the command that made it. A row is named by its first cells.

use std::fs;

use anyhow::{Context, Result, bail, ensure};

use crate::images::workspace;

/// Relative deviation of a measured figure from the committed one above which the file is outdated.
pub const NEAR: f64 = 0.03;

/// The remedy for an outdated file.
const REMEDY: &str = "remedy: cargo xtask figures";

/// A committed table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Committed {
    /// Name of the file, without folder and extension.
    pub name: String,
    /// The command that made it.
    pub made_by: String,
    /// Names of the columns.
    pub header: Vec<String>,
    /// Cells of the rows, as many as columns.
    pub rows: Vec<Vec<String>>,
}

/// The file of a table, from the top of the workspace.
#[must_use]
pub fn file(name: &str) -> String {
    format!("docs/figures/{name}.csv")
}

impl Committed {
    /// Reads the file of this name.
    ///
    /// # Errors
    /// It is missing or malformed; the error names the line.
    pub fn read(name: &str) -> Result<Self> {
        let text = fs::read_to_string(workspace().join(file(name)));
        let text = text.with_context(|| file(name))?;
        Self::parse(name, &text).with_context(|| file(name))
    }

    /// Reads a text.
    ///
    /// # Errors
    /// No comment in the first line, no header, or a row of another length.
    pub fn parse(name: &str, text: &str) -> Result<Self> {
        let first = text.lines().next().unwrap_or_default();
        let made_by = first.strip_prefix("# ");
        let made_by = made_by.context("line 1: not `# ` and the command that made it")?;
        let mut lines = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .from_reader(text.as_bytes());
        let cells = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect();
        let header: Vec<String> = cells(lines.headers()?);
        ensure!(!header.is_empty(), "no header");
        let rows = lines.records().map(|record| Ok(cells(&record?)));
        Ok(Self {
            name: name.to_owned(),
            made_by: made_by.to_owned(),
            rows: rows.collect::<Result<_>>()?,
            header,
        })
    }

    /// Writes the file.
    ///
    /// # Errors
    /// It cannot be written, or a row has another length than the header.
    pub fn write(&self) -> Result<()> {
        let mut lines = csv::Writer::from_writer(Vec::new());
        lines.write_record(&self.header)?;
        for row in &self.rows {
            lines.write_record(row)?;
        }
        let lines = String::from_utf8(lines.into_inner()?)?;
        let path = workspace().join(file(&self.name));
        fs::write(path, format!("# {}\n{lines}", self.made_by)).with_context(|| file(&self.name))
    }

    /// The text of a cell. `row` is what the row begins with: one cell or several, with commas
    /// between them.
    ///
    /// # Errors
    /// No such row, more than one, or no such column.
    pub fn cell(&self, row: &str, column: &str) -> Result<&str> {
        let at = self.header.iter().position(|name| name == column);
        let at = at.with_context(|| format!("no column `{column}`"))?;
        let key: Vec<_> = row.split(',').map(str::trim).collect();
        let mut found = self.rows.iter().filter(|cells| {
            let first = cells.iter().map(String::as_str);
            first.take(key.len()).eq(key.iter().copied())
        });
        match (found.next(), found.next()) {
            (Some(cells), None) => cells.get(at).map(String::as_str).context("no cell"),
            (None, _) => bail!("no row `{row}`"),
            _ => bail!("several rows `{row}`"),
        }
    }

    /// Checks that a measured figure agrees with the committed one within [`NEAR`].
    ///
    /// # Errors
    /// It does not: the committed file is outdated.
    pub fn near(&self, row: &str, column: &str, measured: f64) -> Result<()> {
        let committed: f64 = self.cell(row, column)?.parse().context("no number")?;
        ensure!(
            (measured - committed).abs() <= NEAR * committed.abs(),
            "`{row}`, `{column}`: measured {measured:.0}, {} says {committed}; {REMEDY} {}",
            file(&self.name),
            self.name
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# cargo xtask x\nseed,min,\"m, at worst\"\n1,5,7\n1,22,100\n2,5,8\n";

    #[test]
    fn a_cell_by_the_first_cells_of_its_row() {
        let table = Committed::parse("x", TEXT).expect("a table");
        assert_eq!(table.made_by, "cargo xtask x");
        assert_eq!(table.cell("1,22", "m, at worst").expect("there"), "100");
        assert_eq!(table.cell("2", "m, at worst").expect("there"), "8");
        for (row, column) in [("1", "min"), ("3", "min"), ("2", "max")] {
            assert!(table.cell(row, column).is_err(), "{row} {column}");
        }
        for bad in ["a,b\n1,2\n", "# x\na,b\n1\n", "# x\n"] {
            assert!(Committed::parse("x", bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn what_is_measured_is_near_what_is_committed() {
        let table = Committed::parse("x", TEXT).expect("a table");
        for (measured, near) in [(100.0, true), (102.9, true), (103.1, false), (96.9, false)] {
            let is = table.near("1,22", "m, at worst", measured);
            assert_eq!(is.is_ok(), near, "{measured}: {is:?}");
        }
        assert!(table.near("1,22", "m, at worst", f64::NAN).is_err());
    }
}
