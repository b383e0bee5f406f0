//! A large file read from front to back: unpacked on the way, its bytes counted for progress and
//! for error messages.

use crate::recordings::zstd::{Frames, is_zstd};
use encoding_rs_io::DecodeReaderBytesBuilder;
use flate2::read::MultiGzDecoder;
use host_core::error::Error;
use std::cell::Cell;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;
use std::rc::Rc;

/// Bytes between two reports of progress.
const REPORT: u64 = 1 << 20;

/// Bytes that show the kind of a file.
pub(super) const START: usize = 64;

/// Kinds of files that are given in place of a recording: how they begin, in small letters, what
/// they are, and the remedy.
const OTHERS: [(&[u8], &str, &str); 11] = [
    (
        b"version https://git-lfs",
        "only a pointer of git-lfs, not the file itself",
        "run 'git lfs pull' in its repository, or download the file from there",
    ),
    (
        b"/annex/objects/",
        "only a pointer of git-annex, not the file itself",
        "run 'git annex get' in its repository, or download the file from there",
    ),
    (b"<!doctype html", PAGE, DOWNLOAD),
    (b"<html", PAGE, DOWNLOAD),
    (
        b"<?xml",
        "a file of XML (GPX, KML)",
        "give the log itself, or a table as CSV",
    ),
    (
        b"pk\x03\x04",
        "a zip archive or a spreadsheet (.xlsx)",
        "unpack it, or save the table as CSV",
    ),
    (
        b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1",
        "a document of Office (.xls)",
        "save the table as CSV",
    ),
    (b"bzh", "packed with bzip2", UNPACK),
    (b"\xfd7zxz\0", "packed with xz", UNPACK),
    (b"7z\xbc\xaf\x27\x1c", "packed with 7-Zip", UNPACK),
    (b"rar!", "packed with RAR", UNPACK),
];
const PAGE: &str = "a web page (HTML), not a recording";
const DOWNLOAD: &str = "download the file itself; sites send a page where one must log in";
const UNPACK: &str = "unpack it; files that are packed with gzip or zstd are read as they are";

/// Refuses a file of another kind. `start` is its beginning.
///
/// # Errors
/// [`Error::OtherKind`].
pub(super) fn check_kind(file: &Path, start: &[u8]) -> Result<(), Error> {
    let start = start.trim_ascii_start().to_ascii_lowercase();
    let other = OTHERS.iter().find(|(begin, ..)| start.starts_with(begin));
    other.map_or(Ok(()), |(_, kind, remedy)| {
        Err(Error::OtherKind {
            file: file.into(),
            kind,
            remedy,
        })
    })
}

/// Reports progress: bytes read, and bytes of the whole file.
pub type Progress<'a> = &'a dyn Fn(u64, u64);

/// A text as UTF-8: one of UTF-16 begins with the mark of it, as spreadsheets write it.
pub(super) fn in_utf8<R: Read>(bytes: R) -> impl Read {
    DecodeReaderBytesBuilder::new()
        .utf8_passthru(true)
        .build(bytes)
}

/// Whether a file begins as a text of UTF-16: the mark, and a letter of ASCII.
fn is_wide(start: &[u8]) -> bool {
    matches!(
        start,
        [0xFF, 0xFE, 1..=127, 0, ..] | [0xFE, 0xFF, 0, 1..=127, ..]
    )
}

/// A file that is being read.
pub(super) struct Input<'a> {
    bytes: Box<dyn Read + 'a>,
    /// Whether the file itself has been read to its end.
    file_ended: Rc<Cell<bool>>,
    /// Whether the file is packed with gzip or zstd.
    pub(super) packed: bool,
    /// Whether it may be a text of UTF-16.
    may_be_wide: bool,
    /// Unpacked bytes read so far.
    pub(super) at: u64,
    /// Whether more bytes were requested than the file has.
    pub(super) ended: bool,
}

impl<'a> Input<'a> {
    /// Opens a file. Its first bytes identify gzip and zstd, so its name does not matter.
    ///
    /// # Errors
    /// [`Error::Missing`], [`Error::Unreadable`], [`Error::OtherKind`].
    pub(super) fn open(path: &Path, progress: Progress<'a>) -> Result<Self, Error> {
        let unreadable = |source| Error::reading(path, source);
        let file = File::open(path).map_err(unreadable)?;
        let length = file.metadata().map_err(unreadable)?.len();
        let file_ended = Rc::new(Cell::new(false));
        let mut file = BufReader::with_capacity(
            1 << 16,
            Counted {
                file,
                length,
                read: 0,
                reported: 0,
                ended: Rc::clone(&file_ended),
                progress,
            },
        );
        let mut start = Vec::new();
        let first = Read::by_ref(&mut file).take(START as u64);
        { first }.read_to_end(&mut start).map_err(unreadable)?;
        check_kind(path, &start)?;
        let is_packed = start.starts_with(&[0x1F, 0x8B]) || is_zstd(&start);
        let may_be_wide = is_packed || is_wide(&start);
        let packed = io::Cursor::new(start.clone()).chain(file);
        let bytes: Box<dyn Read + 'a> = match start[..] {
            [0x1F, 0x8B, ..] => Box::new(BufReader::new(MultiGzDecoder::new(packed))),
            _ if is_zstd(&start) => Box::new(BufReader::new(Frames::new(packed))),
            _ => Box::new(packed),
        };
        Ok(Self {
            bytes,
            file_ended,
            packed: is_packed,
            may_be_wide,
            at: 0,
            ended: false,
        })
    }

    /// [`Input::open`] of a text, which may be in UTF-16.
    ///
    /// # Errors
    /// As [`Input::open`].
    pub(super) fn text(path: &Path, progress: Progress<'a>) -> Result<Self, Error> {
        let mut input = Self::open(path, progress)?;
        if input.may_be_wide {
            input.bytes = Box::new(in_utf8(input.bytes));
        }
        Ok(input)
    }

    /// The error of reading `file`.
    pub(super) fn fault(&self, file: &Path, source: io::Error) -> Error {
        match self.packed {
            true => Error::unpacking(file, self.at, 0, &source),
            false => Error::reading(file, source),
        }
    }
}

impl Read for Input<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.bytes.read(buffer);
        match &read {
            Ok(0) => self.ended |= !buffer.is_empty(),
            Ok(count) => self.at += *count as u64,
            // An unpacker that lacks bytes complains instead of ending.
            Err(_) => self.ended |= self.file_ended.get(),
        }
        read
    }
}

/// The file on the disk, with its bytes counted.
struct Counted<'a> {
    file: File,
    length: u64,
    read: u64,
    reported: u64,
    ended: Rc<Cell<bool>>,
    progress: Progress<'a>,
}

impl Read for Counted<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(buffer)?;
        self.ended.set(count == 0 && !buffer.is_empty());
        self.read += count as u64;
        if self.read - self.reported >= REPORT {
            self.reported = self.read;
            (self.progress)(self.read, self.length);
        }
        Ok(count)
    }
}
