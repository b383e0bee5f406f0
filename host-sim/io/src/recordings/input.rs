//! A large file read from front to back: unpacked on the way, its bytes counted for progress and
//! for error messages.

use flate2::read::MultiGzDecoder;
use host_core::error::Error;
use std::cell::Cell;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;
use std::rc::Rc;

/// Bytes between two reports of progress.
const REPORT: u64 = 1 << 20;

/// Beginning of the text that stands for a large file in a copy of a repository.
const POINTER: &[u8] = b"version https://git-lfs";

/// Refuses a file that is only the pointer to another one. `start` is its beginning.
///
/// # Errors
/// [`Error::Pointer`].
pub(super) fn check_pointer(file: &Path, start: &[u8]) -> Result<(), Error> {
    match start.starts_with(POINTER) {
        true => Err(Error::Pointer { file: file.into() }),
        false => Ok(()),
    }
}

/// Reports progress: bytes read, and bytes of the whole file.
pub type Progress<'a> = &'a dyn Fn(u64, u64);

/// A file that is being read.
pub(super) struct Input<'a> {
    bytes: Box<dyn Read + 'a>,
    /// Whether the file itself has been read to its end.
    file_ended: Rc<Cell<bool>>,
    /// Whether the file is packed with gzip.
    pub(super) gzipped: bool,
    /// Unpacked bytes read so far.
    pub(super) at: u64,
    /// Whether more bytes were requested than the file has.
    pub(super) ended: bool,
}

impl<'a> Input<'a> {
    /// Opens a file. Its first bytes identify gzip and zstd, so its name does not matter.
    ///
    /// # Errors
    /// [`Error::Missing`], [`Error::Unreadable`], [`Error::Pointer`].
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
        let first = Read::by_ref(&mut file).take(POINTER.len() as u64);
        { first }.read_to_end(&mut start).map_err(unreadable)?;
        check_pointer(path, &start)?;
        let gzipped = start.starts_with(&[0x1F, 0x8B]);
        let packed = io::Cursor::new(start.clone()).chain(file);
        let bytes: Box<dyn Read + 'a> = match start[..] {
            [0x1F, 0x8B, ..] => Box::new(BufReader::new(MultiGzDecoder::new(packed))),
            [0x28, 0xB5, 0x2F, 0xFD, ..] => {
                let decoder = ruzstd::decoding::StreamingDecoder::new(packed);
                let decoder = decoder.map_err(|e| unreadable(io::Error::other(e)))?;
                Box::new(BufReader::new(decoder))
            }
            _ => Box::new(packed),
        };
        Ok(Self {
            bytes,
            file_ended,
            gzipped,
            at: 0,
            ended: false,
        })
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
