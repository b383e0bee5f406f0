//! Tables of numbers from text files, plain or gzipped. Every error names file, line and column.

mod source;

pub(crate) use source::unquoted;
use source::{Bytes, Lines, named};
pub use source::{Separator, Source};

use host_core::error::{Error, excerpt};
use std::fmt::Display;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A number that a table can hold.
pub trait Cell: Copy + Display {
    /// Remedy in error messages: what to write instead.
    const REMEDY: &str;

    /// The number in `text`, or a description of the fault.
    fn parse(text: &str) -> Result<Self, &'static str>;
}

impl Cell for f64 {
    const REMEDY: &str = "give a decimal number, with a point and without unit";

    fn parse(text: &str) -> Result<Self, &'static str> {
        match text.parse::<Self>() {
            Err(_) if text.is_empty() => Err("missing"),
            Err(_) => Err("not a number"),
            Ok(x) if !x.is_finite() => Err("not finite"),
            Ok(x) => Ok(x),
        }
    }
}

/// Which columns of a file are read, and in which order.
#[derive(Debug)]
pub struct Layout<'a, T = f64> {
    /// Lines before the data.
    pub skip: usize,
    /// Names of all columns of a line.
    pub names: &'a [String],
    /// Positions in `names` of the columns wanted.
    pub wanted: &'a [usize],
    /// Value of a cell that is empty or says that there is no value, as `nan` does; without it such
    /// a cell is an error.
    pub gap: Option<T>,
    /// From this one of the columns wanted on, any cell that is no number counts as a gap.
    pub loose: usize,
    /// Whether a first or a last line that is not whole is left out, with a note.
    pub cut: bool,
}

/// Numbers by rows; columns in the order wanted.
#[derive(Debug)]
pub struct Table<T = f64> {
    /// Path as given.
    pub file: PathBuf,
    names: Vec<String>,
    values: Vec<T>,
    rows: usize,
    first_line: usize,
    /// Notes on lines that are left out, a sentence each.
    pub notes: Vec<String>,
}

/// Texts of a cell without a value, in small letters.
const GAPS: [&str; 8] = ["nan", "-nan", "na", "n/a", "null", "none", "-", "--"];

impl<T: Cell> Table<T> {
    /// Reads `source`.
    pub fn read(source: &Source, layout: &Layout<'_, T>) -> Result<Self, Error> {
        Self::read_first(source, layout, layout.wanted.len(), |_| Ok(()))
    }

    /// Reads `source` and keeps the first `count` columns wanted. The values of the others go to
    /// `rest`, row by row.
    pub fn read_first(
        source: &Source,
        layout: &Layout<'_, T>,
        count: usize,
        mut rest: impl FnMut(&[T]) -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let wanted = layout.wanted.iter();
        let names: Vec<String> = wanted.map(|&c| layout.names[c].clone()).collect();
        let mut table = Self {
            file: source.file.clone(),
            names: names[..count].to_vec(),
            values: Vec::new(),
            rows: 0,
            first_line: layout.skip + 1,
            notes: Vec::new(),
        };
        let mut row = Vec::with_capacity(names.len());
        let mut lines = source.lines()?;
        // a line with a fault, which only the first and the last may have
        let mut faulty: Option<(usize, Error)> = None;
        while let Some(line) = lines.next()? {
            if line <= layout.skip || lines.trails() {
                continue;
            }
            let read = table.cells(line, &lines, layout, &names, &mut row);
            match (faulty.take(), read) {
                (Some((_, fault)), _) if table.rows > 0 || !layout.cut => return Err(fault),
                (Some((_, fault)), Err(_)) => return Err(fault),
                (None, Err(fault)) => {
                    faulty = Some((line, fault));
                    continue;
                }
                (Some((at, _)), Ok(())) => {
                    table.note(at, "the first line of data is not whole and is left out");
                    table.first_line = line;
                }
                (None, Ok(())) => {}
            }
            let (keep, other) = row.split_at(count);
            table.values.extend_from_slice(keep);
            table.rows += 1;
            rest(other)?;
        }
        match faulty {
            Some((at, _)) if table.rows > 0 && layout.cut && lines.is_cut() => table.note(
                at,
                "the file ends within this line and is read up to it (was the power cut?)",
            ),
            Some((_, fault)) => return Err(fault),
            None => {}
        }
        if table.rows == 0 {
            let names = layout.names.join(",");
            return Err(match layout.skip {
                0 => source.empty("is empty", format!("lines of {names}, without a header")),
                _ => source.empty("has a header and no data", named(&names)),
            });
        }
        Ok(table)
    }

    /// Reads the present line into `row`.
    fn cells<R: Bytes>(
        &self,
        line: usize,
        lines: &Lines<'_, R>,
        layout: &Layout<'_, T>,
        names: &[String],
        row: &mut Vec<T>,
    ) -> Result<(), Error> {
        let count = lines.cells().len();
        // a comma at the end of a line separates nothing
        let trailing = count == layout.names.len() + 1 && lines.cell(count - 1).is_empty();
        let unnamed = layout.names.last().is_some_and(String::is_empty);
        let lacks_unnamed = unnamed && count + 1 == layout.names.len();
        if !(trailing || lacks_unnamed) {
            self.check_count(line, count, layout)?;
        }
        row.clear();
        for (k, (&column, name)) in layout.wanted.iter().zip(names).enumerate() {
            let value = self.value(line, name, &lines.cell(column), layout.gap);
            row.push(match (value, layout.gap) {
                (Err(_), Some(gap)) if k >= layout.loose => gap,
                (value, _) => value?,
            });
        }
        Ok(())
    }

    fn note(&mut self, line: usize, text: &str) {
        let file = self.file.display();
        self.notes.push(format!("{file}:{line}: {text}"));
    }

    /// Checks that a line has as many values as the file has columns.
    fn check_count(&self, line: usize, found: usize, layout: &Layout<'_, T>) -> Result<(), Error> {
        if found == layout.names.len() {
            return Ok(());
        }
        Err(Error::ColumnCount {
            file: self.file.clone(),
            line,
            found,
            expected: layout.names.len(),
            columns: layout.names.join(","),
        })
    }

    /// The number in `text`, a cell of the column `name`.
    fn value(&self, line: usize, name: &str, text: &str, gap: Option<T>) -> Result<T, Error> {
        let value = match gap {
            Some(gap) if text.is_empty() || GAPS.contains(&&*text.to_ascii_lowercase()) => Ok(gap),
            _ => T::parse(text),
        };
        value.map_err(|fault| Error::Value {
            file: self.file.clone(),
            line,
            field: name.to_owned(),
            text: excerpt(text),
            fault,
            remedy: T::REMEDY.to_owned(),
        })
    }

    /// Reads a comma-separated file whose first line is exactly `header`.
    pub fn with_header(file: &Path, header: &str) -> Result<Self, Error> {
        let source = Source::open(file, Separator::COMMA)?;
        let names = source.header(header)?;
        if names.join(",") != header {
            return Err(Error::Header {
                file: file.to_path_buf(),
                found: excerpt(&names.join(",")),
                expected: header.to_owned(),
            });
        }
        Self::first_columns(&source, 1, &names, names.len())
    }

    /// Reads the first `count` columns of a file with the columns `names`, which begins after
    /// `skip` lines.
    pub fn first_columns(
        source: &Source,
        skip: usize,
        names: &[String],
        count: usize,
    ) -> Result<Self, Error> {
        let wanted: Vec<usize> = (0..count).collect();
        let layout = Layout {
            skip,
            names,
            wanted: &wanted,
            gap: None,
            loose: usize::MAX,
            cut: false,
        };
        Self::read(source, &layout)
    }

    /// Number of rows.
    pub fn count(&self) -> usize {
        self.rows
    }

    /// Row `i`.
    pub fn row(&self, i: usize) -> &[T] {
        let n = self.names.len();
        &self.values[i * n..(i + 1) * n]
    }

    /// All rows.
    pub fn rows(&self) -> std::slice::ChunksExact<'_, T> {
        self.values.chunks_exact(self.names.len())
    }

    /// All values, row by row.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// An error in the value at row `i` of `column`.
    pub fn complain(&self, i: usize, column: usize, fault: &'static str, remedy: &str) -> Error {
        self.complain_of(i, &self.names[column], &self.row(i)[column], fault, remedy)
    }

    /// An error in a `value` of the column `name` on the line of row `i`.
    pub fn complain_of(
        &self,
        i: usize,
        name: &str,
        value: &T,
        fault: &'static str,
        remedy: &str,
    ) -> Error {
        Error::Value {
            file: self.file.clone(),
            line: self.first_line + i,
            field: name.to_owned(),
            text: value.to_string(),
            fault,
            remedy: remedy.to_owned(),
        }
    }
}

impl Table {
    /// Checks that `column` rises on every line.
    pub fn check_rising(&self, column: usize) -> Result<(), Error> {
        for i in 1..self.count() {
            let (before, now) = (self.row(i - 1)[column], self.row(i)[column]);
            if now <= before {
                return Err(self.time_back(i, &self.names[column], [before, now]));
            }
        }
        Ok(())
    }

    /// The error of a time that does not rise from the row before row `i`.
    pub fn time_back(&self, i: usize, name: &str, [before, now]: [f64; 2]) -> Error {
        Error::TimeBack {
            file: self.file.clone(),
            line: self.first_line + i,
            field: name.to_owned(),
            before,
            now,
        }
    }

    /// Checks that no value of the columns lies outside `-limit..=limit`.
    pub fn check_within(
        &self,
        columns: Range<usize>,
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use test_bench::recordings::{file, message};

    fn complaint(bytes: &[u8]) -> String {
        let (_dir, path) = file("in.csv", bytes);
        message(&Table::<f64>::with_header(&path, "t,x").unwrap_err())
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
            let table = Table::<f64>::with_header(&path, "t,x").unwrap();
            let rows: Vec<&[f64]> = table.rows().collect();
            assert_eq!(rows, [[0.5, -1e-3], [1.0, 2.0]]);
            table.check_rising(0).unwrap();
        }
    }

    #[test]
    fn every_fault_names_its_location() {
        for (bytes, start) in [
            (b"".as_slice(), "in.csv: is empty"),
            (b"t,x\n", "in.csv: has a header and no data"),
            (b"\x7fELF\x02,x\n1,2\n", "in.csv: is no text"),
            (b"t,y\n1,2\n", "in.csv:1: header is 't,y'"),
            (b"t,x\n1,2\n3\n", "in.csv:3: 1 columns instead of 2"),
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
        let missing = Table::<f64>::with_header(Path::new("no/such.csv"), "t,x").unwrap_err();
        assert!(matches!(missing, Error::Missing { .. }));
    }

    /// A table with the columns t and x whose first and last line may be cut.
    fn cut_table(path: &Path) -> Table {
        let source = Source::open(path, Separator::COMMA).unwrap();
        let layout = Layout {
            skip: 1,
            names: &["t", "x"].map(String::from),
            wanted: &[0, 1],
            gap: None,
            loose: usize::MAX,
            cut: true,
        };
        Table::read(&source, &layout).unwrap()
    }

    /// The rows of a file with the columns t and x, and the notes on it.
    fn rows(bytes: &[u8]) -> (Vec<[f64; 2]>, Vec<String>) {
        let (_dir, path) = file("in.csv", bytes);
        let table = cut_table(&path);
        let rows = table.rows().map(|row| [row[0], row[1]]).collect();
        let name = path.display().to_string();
        let notes = table.notes.iter();
        (
            rows,
            notes.map(|note| note.replace(&name, "in.csv")).collect(),
        )
    }

    #[test]
    fn loggers_habits_do_not_matter() {
        for bytes in [
            &b"t,x\r1,2\r3,4\r"[..],                  // carriage returns alone
            b"t,x\r1,2\r3,4",                         // the last one is missing
            b"t,x\r\r\n1,2\r\r\n3,4\r\r\n",           // two of them before each line feed
            b"t,x\n1,2,\n3,4,\n",                     // a separator at the end
            b"\"t\",\"x\"\n\"1\",\"2\"\n\" 3 \",4\n", // quotes
            b"t,x\n1,2\n3,4\n\n\n",                   // empty lines at the end
        ] {
            assert_eq!(
                rows(bytes),
                (vec![[1.0, 2.0], [3.0, 4.0]], vec![]),
                "{bytes:?}"
            );
        }
        // a carriage return at the end of a piece of the file
        for length in 4090..4100 {
            let first = format!("t,x\r{:>length$},2\r", 1);
            let bytes = [first.as_bytes(), b"3,4\r"].concat();
            assert_eq!(rows(&bytes).0, [[1.0, 2.0], [3.0, 4.0]], "{length}");
        }
    }

    #[test]
    fn a_first_or_last_line_that_is_cut_is_left_out_with_a_note() {
        let two = vec![[1.0, 2.0], [3.0, 4.0]];
        let last = "in.csv:4: the file ends within this line and is read up to it (was the power \
                    cut?)";
        for end in [&b"5"[..], b"5,", b"5,-", b"5,6e-", b"\0\0\0\0"] {
            let bytes = [b"t,x\n1,2\n3,4\n", end].concat();
            assert_eq!(
                rows(&bytes),
                (two.clone(), vec![last.to_owned()]),
                "{end:?}"
            );
        }
        let first = "in.csv:2: the first line of data is not whole and is left out";
        for line in ["9", "s,m", "7e,9"] {
            let bytes = format!("t,x\n{line}\n1,2\n3,4\n");
            assert_eq!(
                rows(bytes.as_bytes()),
                (two.clone(), vec![first.to_owned()])
            );
        }
        // the line after it is the third, also in errors
        let (_dir, path) = file("in.csv", b"t,x\n9\n1,2\n1,4\n");
        let table = cut_table(&path);
        let back = message(&table.check_rising(0).unwrap_err());
        assert!(back.starts_with("in.csv:4:"), "{back}");
        // whole lines with a fault are no cut ones
        let why = complaint(b"t,x\n1,2\n3,4\n5\n");
        assert!(why.starts_with("in.csv:4: 1 columns"), "{why}");
        let why = complaint(b"t,x\n9\n8\n1,2\n");
        assert!(why.starts_with("in.csv:2: 1 columns"), "{why}");
        // files of a known length are read whole or not at all
        let why = complaint(b"t,x\n1,2\n3");
        assert!(why.starts_with("in.csv:3: 1 columns"), "{why}");
    }

    #[test]
    fn a_long_file_is_read_in_pieces_and_keeps_only_what_is_wanted() {
        let mut text = String::from("t,x,y\n");
        for i in 0..20_000 {
            text += &format!("{i},{},7\n", 2 * i);
        }
        let (_dir, path) = file("in.csv", text.trim_end().as_bytes());
        let source = Source::open(&path, Separator::COMMA).unwrap();
        let layout = Layout {
            skip: 1,
            names: &["t", "x", "y"].map(String::from),
            wanted: &[0, 1],
            gap: None,
            loose: usize::MAX,
            cut: false,
        };
        for _ in 0..2 {
            let mut rest = Vec::new();
            let table = Table::<f64>::read_first(&source, &layout, 1, |row| {
                rest.extend_from_slice(row);
                Ok(())
            });
            let times: Vec<f64> = (0..20_000).map(f64::from).collect();
            assert_eq!(table.unwrap().values(), times);
            assert!(rest.iter().zip(&times).all(|(x, t)| *x == 2.0 * t));
            assert_eq!(rest.len(), 20_000);
        }
    }

    #[test]
    fn time_must_rise_and_values_stay_in_range() {
        let (_dir, path) = file("in.csv", b"t,x\n1,2\n2,-9\n2,3\n");
        let table = Table::<f64>::with_header(&path, "t,x").unwrap();
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
