//! A file's lines and the values on them.

use crate::recordings::input::Input;
use host_core::error::Error;
use std::borrow::Cow;
use std::cell::RefCell;
use std::io::{self, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Separator of the values of a line. Blanks around a value do not count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Separator {
    /// One ASCII character.
    Char(u8),
    /// Any run of blanks and tabs.
    Blank,
    /// Any run of blanks, tabs and commas.
    BlankOrComma,
}

impl Separator {
    /// The comma.
    pub const COMMA: Self = Self::Char(b',');

    /// Whether `byte` is replaced by a blank.
    fn reads_as_blank(self, byte: u8) -> bool {
        match self {
            Self::Char(_) => false,
            Self::Blank => byte == b'\t',
            Self::BlankOrComma => byte == b'\t' || byte == b',',
        }
    }
}

/// A text file that is read from front to back.
pub struct Source {
    /// Path as given.
    pub file: PathBuf,
    separator: Separator,
    /// The beginning of the file, at least its first line, and what follows. `None` once the lines
    /// have been read.
    begun: RefCell<Option<Begun>>,
    /// The values on the first line.
    first: Vec<String>,
}

/// The bytes of a file behind those that have been read to see its first line.
pub(super) type Begun = io::Chain<io::Cursor<Vec<u8>>, Text>;

impl Source {
    /// Opens a file. Bytes that are not UTF-8 become replacement characters, which are no numbers.
    pub fn open(file: &Path, separator: Separator) -> Result<Self, Error> {
        let begun = begin(file, separator)?;
        let start = begun.get_ref().0.get_ref();
        let end = start.iter().position(|byte| *byte == b'\n');
        let line = &start[..end.map_or(start.len(), |end| end + 1)];
        let mut lines = Lines::new(file, separator, line);
        let first = match lines.next()? {
            Some(_) => lines.cells().map(|cell| cell.into_owned()).collect(),
            None => Vec::new(),
        };
        if line.iter().any(|byte| is_no_text(*byte)) {
            let file = file.to_path_buf();
            return Err(Error::NotText { file });
        }
        Ok(Self {
            file: file.to_path_buf(),
            separator,
            begun: RefCell::new(Some(begun)),
            first,
        })
    }

    /// The lines from the first on. The file is opened again if they have been read before.
    pub(super) fn lines(&self) -> Result<Lines<'_, Begun>, Error> {
        let begun = match self.begun.take() {
            Some(begun) => begun,
            None => begin(&self.file, self.separator)?,
        };
        Ok(Lines::new(&self.file, self.separator, begun))
    }

    /// The values on the first line.
    pub fn first_line(&self) -> Vec<String> {
        self.first.clone()
    }

    /// The names on the first line; `expected` describes them in errors.
    pub fn header(&self, expected: &str) -> Result<Vec<String>, Error> {
        let names = self.first_line();
        if names.is_empty() {
            return Err(self.empty("is empty", named(expected)));
        }
        Ok(names)
    }

    /// The error of a file without data; `found` says what it has instead of `expected`.
    pub(super) fn empty(&self, found: &'static str, expected: String) -> Error {
        Error::Empty {
            file: self.file.clone(),
            found,
            expected,
        }
    }
}

/// Description of what a file with a header must have.
pub(super) fn named(header: &str) -> String {
    format!("the header line '{header}' and at least one data line")
}

/// Whether a byte cannot occur in a text of numbers and names, in any encoding.
fn is_no_text(byte: u8) -> bool {
    byte.is_ascii_control() && !byte.is_ascii_whitespace()
}

/// Opens a file and reads it up to the end of its first line at least.
fn begin(file: &Path, separator: Separator) -> Result<Begun, Error> {
    let mut text = Text {
        bytes: Input::open(file, &|_, _| {})?,
        separator,
        lines: 0,
        last: b'\n',
    };
    let mut start = Vec::new();
    let mut piece = [0; 4096];
    loop {
        let count = text.read(&mut piece);
        let read = &piece[..count.map_err(|fault| text.fault(file, fault))?];
        start.extend_from_slice(read);
        if read.is_empty() || read.contains(&b'\n') {
            return Ok(io::Cursor::new(start).chain(text));
        }
    }
}

/// The unpacked bytes of a file, with separators of the same meaning replaced by blanks. They end
/// with a line feed unless there are none.
pub(super) struct Text {
    bytes: Input<'static>,
    separator: Separator,
    /// Line feeds so far.
    lines: usize,
    last: u8,
}

impl Text {
    /// Why a file cannot be read further.
    fn fault(&self, file: &Path, fault: io::Error) -> Error {
        if !self.bytes.gzipped {
            return Error::reading(file, fault);
        }
        Error::DamagedGzip {
            file: file.to_path_buf(),
            line: self.lines,
            fault: match fault.kind() {
                io::ErrorKind::UnexpectedEof => "cut short",
                _ => "damaged",
            },
        }
    }
}

impl Read for Text {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = loop {
            match self.bytes.read(buffer) {
                Err(fault) if fault.kind() == io::ErrorKind::Interrupted => {}
                other => break other?,
            }
        };
        let Some(read) = buffer.get_mut(..count).filter(|read| !read.is_empty()) else {
            let missing = self.last != b'\n' && !buffer.is_empty();
            if missing {
                self.last = b'\n';
                buffer[0] = b'\n';
            }
            return Ok(usize::from(missing));
        };
        for byte in &mut *read {
            self.lines += usize::from(*byte == b'\n');
            if self.separator.reads_as_blank(*byte) {
                *byte = b' ';
            }
        }
        self.last = read[read.len() - 1];
        Ok(count)
    }
}

/// A source of lines.
pub(super) trait Bytes: Read {
    /// The error when the bytes end too early.
    fn fault(&self, file: &Path, fault: io::Error) -> Error;
}

impl Bytes for Begun {
    fn fault(&self, file: &Path, fault: io::Error) -> Error {
        self.get_ref().1.fault(file, fault)
    }
}

impl Bytes for &[u8] {
    fn fault(&self, file: &Path, fault: io::Error) -> Error {
        Error::reading(file, fault)
    }
}

/// Reads the lines of a file one by one.
pub(super) struct Lines<'a, R> {
    file: &'a Path,
    reader: csv::Reader<R>,
    record: csv::ByteRecord,
    /// Byte ranges of the values of the present line.
    spans: Vec<Range<usize>>,
    /// Number of the next line, from 1.
    next: u64,
    /// Whether a run of separators counts as one.
    runs: bool,
}

impl<'a, R: Bytes> Lines<'a, R> {
    fn new(file: &'a Path, separator: Separator, bytes: R) -> Self {
        let delimiter = match separator {
            Separator::Char(c) => c,
            Separator::Blank | Separator::BlankOrComma => b' ',
        };
        let reader = csv::ReaderBuilder::new()
            .delimiter(delimiter)
            .terminator(csv::Terminator::Any(b'\n')) // a carriage return before it is trimmed
            .has_headers(false)
            .flexible(true)
            .quoting(false) // numbers need no quotes, and a stray one must not join lines
            .buffer_capacity(1 << 16)
            .from_reader(bytes);
        Self {
            file,
            reader,
            record: csv::ByteRecord::new(),
            spans: Vec::new(),
            next: 1,
            runs: !matches!(separator, Separator::Char(_)),
        }
    }

    /// Reads the next line and gives its number. An empty line has no values.
    pub(super) fn next(&mut self) -> Result<Option<usize>, Error> {
        let more = self.reader.read_byte_record(&mut self.record);
        let more = more.map_err(|error| {
            let fault = match error.into_kind() {
                csv::ErrorKind::Io(fault) => fault,
                other => io::Error::other(format!("{other:?}")),
            };
            self.reader.get_ref().fault(self.file, fault)
        })?;
        let line = self.next;
        self.next = self.reader.position().line();
        // the reader skips empty lines; they must be reported
        let skipped = self.next > line + u64::from(more);
        if !more && !skipped {
            return Ok(None);
        }
        self.spans.clear();
        let bytes = self.record.as_slice();
        let cells = (0..self.record.len()).filter_map(|i| self.record.range(i));
        let trimmed = cells.map(|cell| {
            let text = &bytes[cell.clone()];
            let blanks = text.len() - text.trim_ascii_start().len();
            let start = cell.start + blanks;
            start..start + text.trim_ascii().len()
        });
        let runs = self.runs;
        self.spans
            .extend(trimmed.filter(|cell| !(runs && cell.is_empty())));
        let only_blank = matches!(&self.spans[..], [alone] if alone.is_empty());
        if skipped || only_blank {
            self.spans.clear();
        }
        Ok(Some(line as usize))
    }

    /// The values of the present line.
    pub(super) fn cells(&self) -> impl ExactSizeIterator<Item = Cow<'_, str>> {
        let bytes = self.record.as_slice();
        let text = |span: &Range<usize>| String::from_utf8_lossy(&bytes[span.clone()]);
        self.spans.iter().map(text)
    }

    /// Value `i` of the present line.
    pub(super) fn cell(&self, i: usize) -> Cow<'_, str> {
        let span = self.spans.get(i).cloned().unwrap_or_default();
        String::from_utf8_lossy(&self.record.as_slice()[span])
    }
}
