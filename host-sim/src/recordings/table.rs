//! Tables of numbers from text files, plain or gzipped; every complaint names file, line and column.

use crate::error::{Error, excerpt};
use std::path::{Path, PathBuf};

/// What stands between the values of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Separator {
    /// One character; blanks around values do not count.
    Char(char),
    /// Any run of blanks and tabs.
    Blank,
    /// Any run of blanks, tabs and commas.
    BlankOrComma,
}

impl Separator {
    /// The values of a line.
    pub(super) fn split(self, line: &str) -> Vec<&str> {
        match self {
            _ if line.trim().is_empty() => Vec::new(),
            Self::Char(c) => line.split(c).map(str::trim).collect(),
            Self::Blank => line.split_whitespace().collect(),
            Self::BlankOrComma => line
                .split(|c: char| c.is_whitespace() || c == ',')
                .filter(|value| !value.is_empty())
                .collect(),
        }
    }
}

/// A file's whole text.
#[derive(Debug)]
pub(super) struct Source {
    /// Path as given.
    pub(super) file: PathBuf,
    text: String,
}

impl Source {
    /// Reads a file; gzip is told by its first two bytes. Bytes that are no UTF-8 become replacement characters, which are no numbers.
    pub(super) fn open(file: &Path) -> Result<Self, Error> {
        let bytes = crate::recordings::read::read(file)?;
        Ok(Self {
            file: file.to_path_buf(),
            text: String::from_utf8_lossy(&bytes).into_owned(),
        })
    }

    /// Lines with their numbers from 1; a line end at the end of the file starts no further line.
    pub(super) fn lines(&self) -> impl Iterator<Item = (usize, &str)> {
        let text = self.text.strip_prefix('\u{feff}').unwrap_or(&self.text); // byte order mark of some spreadsheets
        text.lines().enumerate().map(|(k, line)| (k + 1, line))
    }

    /// The names in the first line.
    pub(super) fn header(
        &self,
        separator: Separator,
        expected: &str,
    ) -> Result<Vec<String>, Error> {
        match self.lines().next() {
            Some((_, line)) if !line.trim().is_empty() => Ok(separator
                .split(line)
                .iter()
                .map(ToString::to_string)
                .collect()),
            _ => Err(self.empty("is empty", expected)),
        }
    }

    fn empty(&self, found: &'static str, expected: &str) -> Error {
        Error::Empty {
            file: self.file.clone(),
            found,
            expected: expected.to_owned(),
        }
    }
}

/// Which columns of a file are read, in which order.
#[derive(Debug)]
pub(super) struct Layout<'a> {
    /// Separator of values.
    pub(super) separator: Separator,
    /// Lines before the data.
    pub(super) skip: usize,
    /// All columns of a line.
    pub(super) names: &'a [String],
    /// Positions in `names` of the columns wanted.
    pub(super) wanted: &'a [usize],
    /// Whether values may be missing; they read as NaN.
    pub(super) gaps: bool,
}

/// Numbers by rows; columns in the order wanted.
#[derive(Debug)]
pub(super) struct Table {
    /// Path as given.
    pub(super) file: PathBuf,
    names: Vec<String>,
    values: Vec<f64>,
    first_line: usize,
}

impl Table {
    /// Reads `source`.
    pub(super) fn read(source: &Source, layout: &Layout<'_>) -> Result<Self, Error> {
        let names: Vec<String> = layout
            .wanted
            .iter()
            .map(|&c| layout.names[c].clone())
            .collect();
        let mut table = Self {
            file: source.file.clone(),
            names,
            values: Vec::new(),
            first_line: layout.skip + 1,
        };
        for (line, text) in source.lines().skip(layout.skip) {
            let cells = layout.separator.split(text);
            if cells.len() != layout.names.len() {
                return Err(Error::ColumnCount {
                    file: source.file.clone(),
                    line,
                    found: cells.len(),
                    expected: layout.names.len(),
                    columns: layout.names.join(","),
                });
            }
            for (&column, name) in layout.wanted.iter().zip(&table.names) {
                let value = number(cells[column], layout.gaps)
                    .map_err(|fault| value_error(&source.file, line, name, cells[column], fault))?;
                table.values.push(value);
            }
        }
        if table.values.is_empty() {
            let found = if layout.skip > 0 {
                "has a header and no data"
            } else {
                "is empty"
            };
            return Err(source.empty(found, &layout.names.join(",")));
        }
        Ok(table)
    }

    /// Reads a comma-separated file whose first line is exactly `header`.
    pub(super) fn with_header(file: &Path, header: &str) -> Result<Self, Error> {
        let source = Source::open(file)?;
        let comma = Separator::Char(',');
        let names = source.header(comma, header)?;
        if names.join(",") != header {
            return Err(Error::Header {
                file: file.to_path_buf(),
                found: excerpt(&names.join(",")),
                expected: header.to_owned(),
            });
        }
        let wanted: Vec<usize> = (0..names.len()).collect();
        let layout = Layout {
            separator: comma,
            skip: 1,
            names: &names,
            wanted: &wanted,
            gaps: false,
        };
        Self::read(&source, &layout)
    }

    /// Number of rows.
    pub(super) fn len(&self) -> usize {
        self.values.len() / self.names.len()
    }

    /// Row `i`.
    pub(super) fn row(&self, i: usize) -> &[f64] {
        let n = self.names.len();
        &self.values[i * n..(i + 1) * n]
    }

    /// All rows.
    pub(super) fn rows(&self) -> impl DoubleEndedIterator<Item = &[f64]> + ExactSizeIterator {
        self.values.chunks_exact(self.names.len())
    }

    /// Line of row `i`.
    pub(super) fn line(&self, i: usize) -> usize {
        self.first_line + i
    }

    /// Complaint about a value.
    pub(super) fn complain(
        &self,
        i: usize,
        column: usize,
        fault: &'static str,
        remedy: &str,
    ) -> Error {
        Error::Value {
            file: self.file.clone(),
            line: self.line(i),
            field: self.names[column].clone(),
            text: self.row(i)[column].to_string(),
            fault,
            remedy: remedy.to_owned(),
        }
    }

    /// Checks that `column` rises on every line.
    pub(super) fn check_rising(&self, column: usize) -> Result<(), Error> {
        for i in 1..self.len() {
            let (before, now) = (self.row(i - 1)[column], self.row(i)[column]);
            if now <= before {
                return Err(Error::TimeBack {
                    file: self.file.clone(),
                    line: self.line(i),
                    field: self.names[column].clone(),
                    before,
                    now,
                });
            }
        }
        Ok(())
    }

    /// Checks that no value of the columns lies outside `-limit..=limit`.
    pub(super) fn check_within(
        &self,
        columns: std::ops::Range<usize>,
        limit: f64,
        remedy: &str,
    ) -> Result<(), Error> {
        for (i, row) in self.rows().enumerate() {
            for c in columns.clone() {
                if row[c].abs() > limit {
                    return Err(self.complain(i, c, "out of range", remedy));
                }
            }
        }
        Ok(())
    }
}

fn number(text: &str, gaps: bool) -> Result<f64, &'static str> {
    match text.parse::<f64>() {
        Err(_) if text.is_empty() && gaps => Ok(f64::NAN),
        Err(_) if text.is_empty() => Err("missing"),
        Err(_) => Err("not a number"),
        Ok(x) if !x.is_finite() => Err("not finite"),
        Ok(x) => Ok(x),
    }
}

fn value_error(file: &Path, line: usize, name: &str, text: &str, fault: &'static str) -> Error {
    Error::Value {
        file: file.to_path_buf(),
        line,
        field: name.to_owned(),
        text: excerpt(text),
        fault,
        remedy: "give a decimal number, with a point and without unit".to_owned(),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::io::Write;

    /// A file called `name` with `bytes`, and the folder that keeps it alive.
    pub(crate) fn file(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        (dir, path)
    }

    /// A recorded file, if it is there; says that the test is skipped if not.
    pub(crate) fn recorded(name: &str) -> Option<PathBuf> {
        let path = crate::recordings::data_dir()
            .map(|dir| dir.join(name))
            .filter(|p| p.is_file());
        if path.is_none() {
            println!("skipped: no {name} in ../shared/data or LRNN_DATA");
        }
        path
    }

    /// The message from the file's name on; it must have a remedy.
    pub(crate) fn message(error: &Error) -> String {
        let text = error.to_string();
        assert!(text.contains("; remedy: "), "{text}");
        let start = text.find("/in.").map_or(0, |at| at + 1);
        text[start..].to_owned()
    }

    fn complaint(bytes: &[u8]) -> String {
        let (_dir, path) = file("in.csv", bytes);
        message(&Table::with_header(&path, "t,x").unwrap_err())
    }

    #[test]
    fn plain_gzip_and_windows_files_read_alike() {
        let plain = b"t,x\n0.5,-1e-3\n1, 2\n".to_vec();
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        gzip.write_all(&plain).unwrap();
        let windows = String::from_utf8(plain.clone())
            .unwrap()
            .replace('\n', "\r\n");
        for bytes in [
            plain.clone(),
            gzip.finish().unwrap(),
            windows.into_bytes(),
            [b"\xef\xbb\xbf".as_slice(), &plain].concat(),
        ] {
            let (_dir, path) = file("in.csv", &bytes);
            let table = Table::with_header(&path, "t,x").unwrap();
            let rows: Vec<&[f64]> = table.rows().collect();
            assert_eq!(rows, [[0.5, -1e-3], [1.0, 2.0]]);
            table.check_rising(0).unwrap();
        }
    }

    #[test]
    fn every_fault_names_its_place() {
        for (bytes, start) in [
            (b"".as_slice(), "in.csv: is empty"),
            (b"t,x\n", "in.csv: has a header and no data"),
            (b"t,y\n1,2\n", "in.csv:1: header is 't,y'"),
            (
                b"t,x\n1,2\n3\n",
                "in.csv:3: 1 columns where the header names 2",
            ),
            (b"t,x\n1,2\n\n3,4\n", "in.csv:3: 0 columns"),
            (b"t,x\n1,2,3\n", "in.csv:2: 3 columns"),
            (b"t,x\n1,a\n", "in.csv:2: column 'x': 'a' is not a number"),
            (b"t,x\n1,\n", "in.csv:2: column 'x': '' is missing"),
            (b"t,x\nNaN,1\n", "in.csv:2: column 't': 'NaN' is not finite"),
            (
                b"t,x\n1,\xff\n",
                "in.csv:2: column 'x': '\u{fffd}' is not a number",
            ),
            (b"\x1f\x8b\x08", "in.csv:0: the gzip stream is cut short"),
        ] {
            let got = complaint(bytes);
            assert!(got.starts_with(start), "{got}");
        }
        let missing = Table::with_header(Path::new("no/such.csv"), "t,x").unwrap_err();
        assert!(matches!(missing, Error::Missing { .. }));
    }

    #[test]
    fn time_must_rise_and_values_stay_in_range() {
        let (_dir, path) = file("in.csv", b"t,x\n1,2\n2,-9\n2,3\n");
        let table = Table::with_header(&path, "t,x").unwrap();
        let back = message(&table.check_rising(0).unwrap_err());
        assert!(
            back.starts_with("in.csv:4: column 't': time 2 follows 2"),
            "{back}"
        );
        let wide = message(&table.check_within(1..2, 5.0, "give m").unwrap_err());
        assert_eq!(
            wide,
            "in.csv:3: column 'x': '-9' is out of range; remedy: give m"
        );
    }
}
