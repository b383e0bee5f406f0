//! A list in a temporary file.

use super::Item;
use crate::error::Error;
use std::borrow::Cow;
use std::fs;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::{Mutex, OnceLock, PoisonError};

/// Number of bytes that are read or written at once.
const BLOCK: usize = 1 << 16;

/// Writes items to the file.
#[derive(Debug)]
pub(super) struct Writer {
    file: BufWriter<fs::File>,
    bytes: Vec<u8>,
}

impl Writer {
    pub(super) fn create() -> Result<Self, Error> {
        let file = tempfile::tempfile().map_err(refused)?;
        Ok(Self {
            file: BufWriter::with_capacity(BLOCK, file),
            bytes: Vec::new(),
        })
    }

    pub(super) fn push<T: Item>(&mut self, item: &T) -> Result<(), Error> {
        self.bytes.clear();
        item.put(&mut self.bytes);
        self.file.write_all(&self.bytes).map_err(refused)
    }

    pub(super) fn finish(self) -> Result<fs::File, Error> {
        let file = self.file.into_inner();
        file.map_err(|unwritten| refused(unwritten.into_error()))
    }
}

/// Items in a file.
#[derive(Debug)]
pub(super) struct File<T> {
    /// `None`: it could not be written.
    file: Option<Mutex<fs::File>>,
    size: usize,
    pub(super) count: usize,
    /// The first fault.
    fault: OnceLock<io::Error>,
    /// All items, for those who need them as a slice.
    all: OnceLock<Vec<T>>,
    of: PhantomData<T>,
}

impl<T> File<T> {
    pub(super) fn new(file: fs::File, size: usize, count: usize) -> Self {
        Self {
            file: Some(Mutex::new(file)),
            size,
            count,
            fault: OnceLock::new(),
            all: OnceLock::new(),
            of: PhantomData,
        }
    }

    /// A file that could not be written.
    pub(super) fn broken(error: Error) -> Self {
        let source = match error {
            Error::Unwritable { source, .. } => source,
            other => io::Error::other(other),
        };
        Self {
            file: None,
            size: 1,
            count: 0,
            fault: OnceLock::from(source),
            all: OnceLock::new(),
            of: PhantomData,
        }
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        match self.fault.get() {
            None => Ok(()),
            Some(fault) => Err(refused(io::Error::new(fault.kind(), fault.to_string()))),
        }
    }

    /// Number of items that are read at once.
    pub(super) fn per_block(&self) -> usize {
        (BLOCK / self.size.max(1)).max(1)
    }

    fn bytes(&self, range: &Range<usize>) -> io::Result<Vec<u8>> {
        let mut bytes = vec![0; self.size * range.len()];
        if let Some(file) = &self.file {
            let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
            file.seek(SeekFrom::Start((self.size * range.start) as u64))?;
            file.read_exact(&mut bytes)?;
        }
        Ok(bytes)
    }
}

impl<T: Item> File<T> {
    /// Items `range`, which the list has; none when the file cannot be read.
    pub(super) fn block(&self, range: Range<usize>) -> Cow<'_, [T]> {
        if let Some(all) = self.all.get() {
            return Cow::Borrowed(all.get(range).unwrap_or_default());
        }
        match self.bytes(&range) {
            Ok(bytes) => bytes.chunks_exact(self.size).map(T::take).collect(),
            Err(fault) => {
                let _ = self.fault.set(fault); // the first fault is reported
                Cow::Owned(Vec::new())
            }
        }
    }

    /// All items, in memory.
    pub(super) fn all(&self) -> &Vec<T> {
        self.all.get_or_init(|| {
            let starts = (0..self.count).step_by(self.per_block());
            let mut all = Vec::with_capacity(self.count);
            for start in starts {
                let end = self.count.min(start + self.per_block());
                match self.bytes(&(start..end)) {
                    Ok(bytes) => all.extend(bytes.chunks_exact(self.size).map(T::take)),
                    Err(fault) => {
                        let _ = self.fault.set(fault);
                        break;
                    }
                }
            }
            all
        })
    }
}

/// The error of a temporary file.
fn refused(source: io::Error) -> Error {
    Error::writing(&std::env::temp_dir().join("a temporary file"), source)
}
