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
    /// The values on the first lines, at most [`HEAD_LINES`].
    head: Vec<Vec<String>>,
}

/// So many lines are searched for the names of the columns.
pub const HEAD_LINES: usize = 256;
/// A file with longer lines shows fewer of them, bytes.
const HEAD_BYTES: usize = 1 << 18;

/// The bytes of a file behind those that have been read to see its first line.
pub(super) type Begun = io::Chain<io::Cursor<Vec<u8>>, Text>;

impl Source {
    /// Opens a file. Bytes that are not UTF-8 become replacement characters, which are no numbers.
    pub fn open(file: &Path, separator: Separator) -> Result<Self, Error> {
        let begun = begin(file, separator)?;
        let start = begun.get_ref().0.get_ref();
        let end = start.iter().position(|byte| *byte == b'\n');
        let line = &start[..end.map_or(start.len(), |end| end + 1)];
        if line.iter().any(|byte| is_no_text(*byte)) {
            let file = file.to_path_buf();
            return Err(Error::NotText { file });
        }
        let whole = start.iter().rposition(|byte| *byte == b'\n');
        let mut lines = Lines::new(file, separator, &start[..whole.map_or(0, |end| end + 1)]);
        let mut head: Vec<Vec<String>> = Vec::new();
        while head.len() < HEAD_LINES {
            let Some(line) = lines.next()? else { break };
            head.resize(line, Vec::new()); // empty lines in between
            head[line - 1] = lines.cells().map(Cow::into_owned).collect();
        }
        Ok(Self {
            file: file.to_path_buf(),
            separator,
            begun: RefCell::new(Some(begun)),
            head,
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
        self.head.first().cloned().unwrap_or_default()
    }

    /// The values on the first lines of the file, at most [`HEAD_LINES`].
    pub fn head(&self) -> &[Vec<String>] {
        &self.head
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
        bytes: Input::text(file, &|_, _| {})?,
        separator,
        lines: 0,
        last: b'\n',
        peeked: None,
        is_cut: false,
        lacks_bytes: false,
    };
    let mut start = Vec::new();
    let mut piece = [0; 4096];
    let mut lines = 0;
    loop {
        let count = text.read(&mut piece);
        let read = match count.map_err(|fault| text.fault(file, fault)) {
            Ok(count) => &piece[..count],
            // what has been read may be enough; a damaged file is reported with its line later
            Err(_) if lines > 0 => &[],
            Err(fault) => return Err(fault),
        };
        start.extend_from_slice(read);
        lines += read.iter().filter(|byte| **byte == b'\n').count();
        let enough = lines >= HEAD_LINES || lines > 0 && start.len() >= HEAD_BYTES;
        if read.is_empty() || enough {
            return Ok(io::Cursor::new(start).chain(text));
        }
    }
}

/// The unpacked bytes of a file, with separators of the same meaning replaced by blanks, and the
/// carriage returns that end a line alone by line feeds. They end with a line feed unless there are
/// none.
pub(super) struct Text {
    bytes: Input<'static>,
    separator: Separator,
    /// Line feeds so far.
    lines: usize,
    last: u8,
    /// A byte that was read to know what a carriage return before it means.
    peeked: Option<u8>,
    /// Whether the file ends without the end of a line.
    is_cut: bool,
    /// Whether the file is gzipped and ends before its content does.
    lacks_bytes: bool,
}

impl Text {
    /// Why a file cannot be read further.
    fn fault(&self, file: &Path, fault: io::Error) -> Error {
        if !self.bytes.packed {
            return Error::reading(file, fault);
        }
        Error::unpacking(file, self.bytes.at, self.lines, &fault)
    }
}

impl Text {
    /// The next bytes of the file.
    fn raw(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if let (Some(byte), [first, ..]) = (self.peeked, &mut *buffer) {
            *first = byte;
            self.peeked = None;
            return Ok(1);
        }
        while !self.lacks_bytes {
            match self.bytes.read(buffer) {
                Err(fault) if fault.kind() == io::ErrorKind::Interrupted => {}
                Err(fault) if fault.kind() == io::ErrorKind::UnexpectedEof && self.lines > 0 => {
                    self.lacks_bytes = true;
                }
                other => return other,
            }
        }
        Ok(0)
    }
}

impl Read for Text {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.raw(buffer)?;
        let Some(read) = buffer.get_mut(..count).filter(|read| !read.is_empty()) else {
            let missing = self.last != b'\n' && !buffer.is_empty();
            if missing {
                self.last = b'\n';
                self.is_cut = true;
                buffer[0] = b'\n';
            }
            return Ok(usize::from(missing));
        };
        if read.ends_with(b"\r") {
            let mut next = [0];
            self.peeked = (self.raw(&mut next)? == 1).then_some(next[0]);
        }
        let after = self.peeked;
        for k in 0..read.len() {
            let next = read.get(k + 1).copied().or(after);
            if read[k] == b'\r' && !matches!(next, Some(b'\n' | b'\r')) {
                read[k] = b'\n';
            }
        }
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

    /// Whether they have ended without the end of a line.
    fn is_cut(&self) -> bool;

    /// The error of a gzipped file that ends before its content does.
    fn cut_short(&self, file: &Path) -> Option<Error>;

    /// Reads a packed file to its end. The error if it is damaged.
    fn damage(&mut self, file: &Path) -> Option<Error>;
}

impl Bytes for Begun {
    fn fault(&self, file: &Path, fault: io::Error) -> Error {
        self.get_ref().1.fault(file, fault)
    }

    fn is_cut(&self) -> bool {
        self.get_ref().1.is_cut
    }

    fn cut_short(&self, file: &Path) -> Option<Error> {
        let text = self.get_ref().1;
        let fault = io::ErrorKind::UnexpectedEof.into();
        text.lacks_bytes.then(|| text.fault(file, fault))
    }

    fn damage(&mut self, file: &Path) -> Option<Error> {
        let packed = self.get_ref().1.bytes.packed;
        let rest = packed.then(|| io::copy(self, &mut io::sink()))?;
        rest.err().map(|fault| self.fault(file, fault))
    }
}

impl Bytes for &[u8] {
    fn fault(&self, file: &Path, fault: io::Error) -> Error {
        Error::reading(file, fault)
    }

    fn is_cut(&self) -> bool {
        false
    }

    fn cut_short(&self, _: &Path) -> Option<Error> {
        None
    }

    fn damage(&mut self, _: &Path) -> Option<Error> {
        None
    }
}

/// Reads the lines of a file one by one.
pub(super) struct Lines<'a, R> {
    file: &'a Path,
    reader: csv::Reader<R>,
    record: csv::ByteRecord,
    /// Byte ranges of the values of the present line.
    spans: Vec<Range<usize>>,
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
            runs: !matches!(separator, Separator::Char(_)),
        }
    }

    /// Whether the file ends without the end of a line. Known once all lines have been read.
    pub(super) fn is_cut(&self) -> bool {
        self.reader.get_ref().is_cut()
    }

    /// The error of a gzipped file that ends before its content does. Known as above.
    pub(super) fn cut_short(&self) -> Option<Error> {
        self.reader.get_ref().cut_short(self.file)
    }

    /// Length of the last value of the present line.
    pub(super) fn end(&self) -> usize {
        self.spans.last().map_or(0, Range::len)
    }

    /// The error of a packed file that is damaged behind what has been read. What was unpacked
    /// before the damage shows may be wrong too.
    pub(super) fn damage(&mut self) -> Option<Error> {
        self.reader.get_mut().damage(self.file)
    }

    /// Reads the next line that is not empty and gives its number, from 1.
    pub(super) fn next(&mut self) -> Result<Option<usize>, Error> {
        loop {
            let more = self.reader.read_byte_record(&mut self.record);
            let more = more.map_err(|error| {
                let fault = match error.into_kind() {
                    csv::ErrorKind::Io(fault) => fault,
                    other => io::Error::other(format!("{other:?}")),
                };
                self.reader.get_ref().fault(self.file, fault)
            })?;
            if !more {
                return Ok(None);
            }
            self.split();
            if !self.spans.is_empty() {
                return Ok(Some(self.reader.position().line() as usize - 1));
            }
        }
    }

    /// Finds the values of the record that was read.
    fn split(&mut self) {
        self.spans.clear();
        let bytes = self.record.as_slice();
        let cells = (0..self.record.len()).filter_map(|i| self.record.range(i));
        let trimmed = cells.map(|cell| {
            let text = &bytes[cell.clone()];
            let blanks = text.len() - text.trim_ascii_start().len();
            let start = cell.start + blanks;
            unquoted(bytes, start..start + text.trim_ascii().len())
        });
        let runs = self.runs;
        self.spans
            .extend(trimmed.filter(|cell| !(runs && cell.is_empty())));
        if matches!(&self.spans[..], [alone] if alone.is_empty()) {
            self.spans.clear();
        }
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

/// A value without the quotes around it.
pub(crate) fn unquoted(line: &[u8], value: Range<usize>) -> Range<usize> {
    match &line[value.clone()] {
        [b'"', inner @ .., b'"'] => {
            let start = value.start + 1 + inner.len() - inner.trim_ascii_start().len();
            start..start + inner.trim_ascii().len()
        }
        _ => value,
    }
}
