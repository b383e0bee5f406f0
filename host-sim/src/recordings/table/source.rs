//! A file's lines and the values on them.

use crate::error::Error;
use crate::recordings::read::read;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// What separates the values of a line. Blanks around a value do not count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Separator {
    /// One ASCII character.
    Char(u8),
    /// Any run of blanks and tabs.
    Blank,
    /// Any run of blanks, tabs and commas.
    BlankOrComma,
}

impl Separator {
    /// The comma.
    pub(crate) const COMMA: Self = Self::Char(b',');

    /// Whether `byte` is replaced by a blank.
    fn reads_as_blank(self, byte: u8) -> bool {
        match self {
            Self::Char(_) => false,
            Self::Blank => byte == b'\t',
            Self::BlankOrComma => byte == b'\t' || byte == b',',
        }
    }
}

/// A whole file.
#[derive(Debug)]
pub(crate) struct Source {
    /// Path as given.
    pub(crate) file: PathBuf,
    separator: Separator,
    /// Ends with a line feed unless it is empty.
    bytes: Vec<u8>,
}

impl Source {
    /// Reads a file. Bytes that are not UTF-8 become replacement characters, which are no numbers.
    pub(crate) fn open(file: &Path, separator: Separator) -> Result<Self, Error> {
        let mut bytes = read(file)?;
        if bytes.last().is_some_and(|last| *last != b'\n') {
            bytes.push(b'\n');
        }
        for byte in &mut bytes {
            if separator.reads_as_blank(*byte) {
                *byte = b' ';
            }
        }
        Ok(Self {
            file: file.to_path_buf(),
            separator,
            bytes,
        })
    }

    /// The lines from the first on.
    pub(super) fn lines(&self) -> Lines<'_> {
        let delimiter = match self.separator {
            Separator::Char(c) => c,
            Separator::Blank | Separator::BlankOrComma => b' ',
        };
        let reader = csv::ReaderBuilder::new()
            .delimiter(delimiter)
            .terminator(csv::Terminator::Any(b'\n')) // a carriage return before it is trimmed
            .has_headers(false)
            .flexible(true)
            .quoting(false) // numbers need no quotes, and a stray one must not join lines
            .from_reader(&self.bytes[..]);
        Lines {
            reader,
            record: csv::ByteRecord::new(),
            next: 1,
            runs: !matches!(self.separator, Separator::Char(_)),
        }
    }

    /// The values on the first line.
    pub(crate) fn first_line(&self) -> Vec<String> {
        let mut lines = self.lines();
        let (_, values) = lines.next().unwrap_or_default();
        values.into_iter().map(Cow::into_owned).collect()
    }

    /// The names on the first line; `expected` tells the user what belongs there.
    pub(crate) fn header(&self, expected: &str) -> Result<Vec<String>, Error> {
        let names = self.first_line();
        if names.is_empty() {
            return Err(self.empty("is empty", expected));
        }
        Ok(names)
    }

    /// The error of a file without data; `found` says what it has instead.
    pub(super) fn empty(&self, found: &'static str, expected: &str) -> Error {
        Error::Empty {
            file: self.file.clone(),
            found,
            expected: expected.to_owned(),
        }
    }
}

/// Reads the lines of a file one by one.
pub(super) struct Lines<'a> {
    reader: csv::Reader<&'a [u8]>,
    record: csv::ByteRecord,
    /// Number of the next line, from 1.
    next: u64,
    /// Whether a run of separators counts as one.
    runs: bool,
}

impl Lines<'_> {
    /// The next line's number and values. An empty line has no values.
    pub(super) fn next(&mut self) -> Option<(usize, Vec<Cow<'_, str>>)> {
        // reading from memory does not fail
        let more = self.reader.read_byte_record(&mut self.record).ok()?;
        let line = self.next;
        self.next = self.reader.position().line();
        // the reader skips empty lines; they must be reported
        let skipped = self.next > line + u64::from(more);
        if !more && !skipped {
            return None;
        }
        let runs = self.runs;
        let mut values: Vec<_> = (self.record.iter())
            .map(|value| String::from_utf8_lossy(value.trim_ascii()))
            .filter(|value| !(runs && value.is_empty()))
            .collect();
        if skipped || (values.len() == 1 && values[0].is_empty()) {
            values.clear();
        }
        Some((line as usize, values))
    }
}
