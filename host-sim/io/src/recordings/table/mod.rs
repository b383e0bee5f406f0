//! Tables of numbers from text files, plain or gzipped. Every error names file, line and column.

mod source;

pub(crate) use source::unquoted;
use source::{Bytes, Lines, named};
pub use source::{HEAD_LINES, Separator, Source};

use super::week::Unwrapped;
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

    /// The value of a word where a number may be missing.
    fn of_word(_: &str) -> Option<Self> {
        None
    }
}

/// Value of a word by which a receiver says that there is no fix.
pub(crate) const DENIED: f64 = f64::NEG_INFINITY;
/// These words, in small letters.
const DENIALS: [&str; 8] = [
    "v", "false", "no", "none", "nofix", "no fix", "no_fix", "invalid",
];

impl Cell for f64 {
    const REMEDY: &str = "give a decimal number without unit";

    fn parse(text: &str) -> Result<Self, &'static str> {
        let parsed = text
            .parse::<Self>()
            .or_else(|error| match text.contains(',') {
                true => text.replacen(',', ".", 1).parse(), // a decimal comma
                false => Err(error),
            });
        match parsed {
            Err(_) if text.is_empty() => Err("missing"),
            Err(_) => Err("not a number"),
            Ok(x) if !x.is_finite() => Err("not finite"),
            Ok(x) => Ok(x),
        }
    }

    fn of_word(text: &str) -> Option<Self> {
        let word = text.to_ascii_lowercase();
        DENIALS.contains(&&*word).then_some(DENIED)
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
    /// From this one of the columns wanted on, any cell that is no number counts as a gap, or as
    /// what its word says.
    pub loose: usize,
    /// Whether a first or a last line that is not whole is left out, with a note, and empty lines
    /// are. Without it they may stand for samples that are missing, and are errors.
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
    /// A row and its line, where the row before it is not on the line before that.
    lines: Vec<(usize, usize)>,
    /// Notes on lines that are left out, a sentence each.
    pub notes: Vec<String>,
}

/// Note on a last line that is not whole.
pub(super) const CUT: &str =
    "the file ends within this line and is read up to it (was the power cut?)";

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
        let names = layout.wanted.iter().map(|&c| layout.names[c].clone());
        let names: Vec<String> = names.collect();
        let mut table = Self {
            file: source.file.clone(),
            names: names[..count].to_vec(),
            values: Vec::new(),
            rows: 0,
            lines: Vec::new(),
            notes: Vec::new(),
        };
        let mut lines = source.lines()?;
        let read = table.lines(&mut lines, layout, &names, count, &mut rest);
        read.map_err(|fault| lines.damage().unwrap_or(fault))?;
        if table.rows == 0 {
            let names = layout.names.join(",");
            return Err(match layout.skip {
                0 => source.empty("is empty", format!("lines of {names}, without a header")),
                _ => source.empty("has a header and no data", named(&names)),
            });
        }
        Ok(table)
    }

    /// Reads all lines, with the columns `names`, as [`Self::read_first`] does.
    fn lines<R: Bytes>(
        &mut self,
        lines: &mut Lines<'_, R>,
        layout: &Layout<'_, T>,
        names: &[String],
        count: usize,
        rest: &mut impl FnMut(&[T]) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut row = Vec::with_capacity(names.len());
        let mut before = layout.skip;
        // a line with a fault, which only the first and the last may have
        let mut faulty: Option<(usize, Error)> = None;
        let mut end = 0;
        // a line that is cut if no other follows
        let mut last: Option<(usize, Vec<T>)> = None;
        while let Some(line) = lines.next()? {
            if line <= layout.skip {
                continue;
            }
            // an empty line may be a sample that is missing, where the lines have no times
            let next = std::mem::replace(&mut before, line) + 1;
            if line != next && !layout.cut {
                return self.check_count(next, 0, layout);
            }
            if let Some((line, row)) = last.take() {
                self.keep(line, &row, count, rest)?;
            }
            let read = self.cells(line, lines, layout, names, &mut row);
            if layout.cut && read.is_err() && lines.cell(0).starts_with(['#', '%']) {
                continue; // a comment
            }
            // a last line that has all its values may lack digits of the last one
            let lacks = lines.is_cut() && (lines.end() < end || lines.cut_short().is_some());
            end = lines.end();
            if layout.cut && self.rows > 0 && read.is_ok() && lacks && faulty.is_none() {
                last = Some((line, row.clone()));
                continue;
            }
            match (faulty.take(), read) {
                (Some((_, fault)), _) if self.rows > 0 || !layout.cut => return Err(fault),
                (Some((_, fault)), Err(_)) => return Err(fault),
                (None, Err(fault)) => {
                    faulty = Some((line, fault));
                    continue;
                }
                (Some((at, _)), Ok(())) => {
                    self.note(at, "the first line of data is not whole and is left out");
                }
                (None, Ok(())) => {}
            }
            self.keep(line, &row, count, rest)?;
        }
        if let Some((line, _)) = last {
            self.note(line, CUT);
        }
        self.end(lines, faulty, layout.cut)
    }

    /// Keeps the first `count` values of the row on a line. The others go to `rest`.
    fn keep(
        &mut self,
        line: usize,
        row: &[T],
        count: usize,
        rest: &mut impl FnMut(&[T]) -> Result<(), Error>,
    ) -> Result<(), Error> {
        if line != self.line(self.rows) {
            self.lines.push((self.rows, line));
        }
        let (keep, other) = row.split_at(count);
        self.values.extend_from_slice(keep);
        self.rows += 1;
        rest(other)
    }

    /// The line of a row.
    fn line(&self, row: usize) -> usize {
        let after = self.lines.partition_point(|(first, _)| *first <= row);
        let (first, line) = self.lines[..after].last().copied().unwrap_or_default();
        line + row - first
    }

    /// What is not whole at the end of a file: a note if it may be so, else an error.
    fn end<R: Bytes>(
        &mut self,
        lines: &Lines<'_, R>,
        faulty: Option<(usize, Error)>,
        cut: bool,
    ) -> Result<(), Error> {
        let cut = cut && self.rows > 0;
        match lines.cut_short() {
            Some(Error::Packed { line, .. }) if cut => {
                let note = "the gzip stream is cut after this line; the file is read up to it";
                self.note(line, note);
            }
            Some(fault) => return Err(fault),
            None => {}
        }
        match faulty {
            Some((at, _)) if cut && lines.is_cut() => self.note(at, CUT),
            Some((_, fault)) => return Err(fault),
            None => {}
        }
        Ok(())
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
            let text = lines.cell(column);
            let word = (k >= layout.loose).then(|| T::of_word(&text)).flatten();
            let value = word.map_or_else(|| self.value(line, name, &text, layout.gap), Ok);
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
            line: self.line(i),
            field: name.to_owned(),
            text: value.to_string(),
            fault,
            remedy: remedy.to_owned(),
        }
    }
}

impl Table {
    /// Continues the seconds of week in `column` over the end of a week. Returns the note on `what`
    /// if one has ended.
    pub fn continue_weeks(&mut self, column: usize, what: &str) -> Option<String> {
        let mut week = Unwrapped::default();
        for row in self.values.chunks_exact_mut(self.names.len()) {
            row[column] = week.on(row[column]);
        }
        week.note(what)
    }

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
            line: self.line(i),
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
mod tests;
