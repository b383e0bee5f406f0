//! Long lists of small things: samples, times, counts, records of a filter. A day of them is larger
//! than the memory that working on it takes, so a list that grows beyond a limit is stored in a
//! temporary file and read in blocks. A short one stays in memory.
//!
//! The temporary file lies in the system's folder for such files (`TMPDIR`). It has no name, so it
//! is removed when the program ends, however it ends.
//!
//! [`Writer`] takes the items one by one and gives the [`List`], which several owners share.
//! [`List::each`] and [`List::cursor`] read it from memory or file. Most lists are used as a slice:
//! then a list from a file is loaded into memory as a whole and stays there.

mod cursor;
mod file;
mod item;
mod median;

pub use cursor::{Cursor, Each};
pub use item::Item;
pub(crate) use item::{numbers, put_all};
pub use median::median;

use crate::error::Error;
use file::File;
use std::borrow::Cow;
use std::ops::{Deref, Range};
use std::sync::Arc;

/// Bytes of a list that stay in memory. These are samples of two hours at 200 a second.
pub const IN_MEMORY: usize = 1 << 26;

/// Writes a list item by item.
#[derive(Debug)]
pub struct Writer<T> {
    memory: Vec<T>,
    file: Option<file::Writer>,
    /// Bytes of an item in a file, taken from the first one.
    size: usize,
    count: usize,
    most: usize,
}

impl<T: Item> Default for Writer<T> {
    fn default() -> Self {
        Self::new(IN_MEMORY)
    }
}

impl<T: Item> Writer<T> {
    /// A writer of a list of which at most so many bytes stay in memory.
    #[must_use]
    pub fn new(most: usize) -> Self {
        Self {
            memory: Vec::new(),
            file: None,
            size: 0,
            count: 0,
            most,
        }
    }

    /// Number of items.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Adds an item.
    ///
    /// # Errors
    /// The temporary file cannot be written.
    pub fn push(&mut self, item: T) -> Result<(), Error> {
        self.count += 1;
        if let Some(file) = &mut self.file {
            return file.push(&item);
        }
        if self.memory.is_empty() {
            let mut bytes = Vec::new();
            item.put(&mut bytes);
            self.size = bytes.len();
        }
        self.memory.push(item);
        if self.memory.len() * self.size > self.most {
            let mut file = file::Writer::create()?;
            let items = std::mem::take(&mut self.memory);
            items.iter().try_for_each(|item| file.push(item))?;
            self.file = Some(file);
        }
        Ok(())
    }

    /// The list.
    ///
    /// # Errors
    /// The temporary file cannot be written.
    pub fn finish(self) -> Result<List<T>, Error> {
        Ok(match self.file {
            None => self.memory.into(),
            Some(file) => List::of(File::new(file.finish()?, self.size, self.count)),
        })
    }
}

/// A list, or a part of one, that several owners share.
#[derive(Debug)]
pub struct List<T> {
    storage: Storage<T>,
    part: Range<usize>,
}

/// Storage of the items.
#[derive(Debug)]
enum Storage<T> {
    Memory(Arc<Vec<T>>),
    File(Arc<File<T>>),
}

impl<T> Clone for List<T> {
    fn clone(&self) -> Self {
        Self {
            storage: match &self.storage {
                Storage::Memory(all) => Storage::Memory(Arc::clone(all)),
                Storage::File(file) => Storage::File(Arc::clone(file)),
            },
            part: self.part.clone(),
        }
    }
}

impl<T> List<T> {
    fn of(file: File<T>) -> Self {
        Self {
            part: 0..file.count,
            storage: Storage::File(Arc::new(file)),
        }
    }

    /// Number of items.
    #[must_use]
    pub fn len(&self) -> usize {
        self.part.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.part.is_empty()
    }

    /// A part of this part, which ends at its end at the latest.
    #[must_use]
    pub fn part(&self, of: Range<usize>) -> Self {
        let at = |k: usize| (self.part.start + k).min(self.part.end);
        Self {
            part: at(of.start)..at(of.end),
            ..self.clone()
        }
    }

    /// Whether all that was read of the temporary file, or written to it by [`List::collected`],
    /// succeeded. Where it did not, the list ends early.
    ///
    /// # Errors
    /// The system's error.
    pub fn check(&self) -> Result<(), Error> {
        match &self.storage {
            Storage::Memory(_) => Ok(()),
            Storage::File(file) => file.check(),
        }
    }
}

impl<T: Item> List<T> {
    /// A list of these items, of which at most so many bytes stay in memory. [`List::check`]
    /// reports whether the temporary file could be written; if not, the list is empty.
    pub fn collected(items: impl IntoIterator<Item = T>, most: usize) -> Self {
        let mut writer = Writer::new(most);
        let written = items.into_iter().try_for_each(|item| writer.push(item));
        let list = written.and_then(|()| writer.finish());
        list.unwrap_or_else(|error| Self::of(File::broken(error)))
    }

    /// Items `range`, fewer where the list ends or its file cannot be read.
    #[must_use]
    pub fn block(&self, range: Range<usize>) -> Cow<'_, [T]> {
        let Range { start, end } = self.part(range).part;
        match &self.storage {
            Storage::Memory(all) => Cow::Borrowed(&all[start..end]),
            Storage::File(file) => file.block(start..end),
        }
    }

    /// Reads items near each other.
    #[must_use]
    pub fn cursor(&self) -> Cursor<'_, T> {
        Cursor::new(self)
    }

    /// The items from either end.
    #[must_use]
    pub fn each(&self) -> Each<'_, T> {
        Each::new(self)
    }

    /// The first item.
    #[must_use]
    pub fn start(&self) -> Option<T> {
        self.block(0..1).first().cloned()
    }

    /// The last item.
    #[must_use]
    pub fn end(&self) -> Option<T> {
        self.block(self.len().saturating_sub(1)..self.len())
            .last()
            .cloned()
    }

    /// Changes the items. They are loaded into memory; other owners keep the unchanged ones.
    pub fn edit(&mut self, change: impl FnOnce(&mut Vec<T>)) {
        let mut all = self.to_vec();
        change(&mut all);
        *self = all.into();
    }

    /// Items of a block of the file, at most; at least one.
    fn per_block(&self) -> usize {
        match &self.storage {
            Storage::Memory(_) => self.len(),
            Storage::File(file) => file.per_block(),
        }
    }
}

impl<T: Item> Deref for List<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        let all = match &self.storage {
            Storage::Memory(all) => all,
            Storage::File(file) => file.all(),
        };
        &all[self.part.start.min(all.len())..self.part.end.min(all.len())]
    }
}

/// As a slice.
impl<'a, T: Item> IntoIterator for &'a List<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<T> From<Vec<T>> for List<T> {
    fn from(all: Vec<T>) -> Self {
        Self {
            part: 0..all.len(),
            storage: Storage::Memory(Arc::new(all)),
        }
    }
}

impl<T: Item> From<&List<T>> for List<T> {
    fn from(list: &List<T>) -> Self {
        list.clone()
    }
}

impl<T> Default for List<T> {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl<T> FromIterator<T> for List<T> {
    /// A list in memory.
    fn from_iter<I: IntoIterator<Item = T>>(items: I) -> Self {
        Vec::from_iter(items).into()
    }
}

impl<T: Item + PartialEq> PartialEq for List<T> {
    fn eq(&self, other: &Self) -> bool {
        self.len() == other.len() && self.each().eq(other.each())
    }
}

#[cfg(test)]
mod tests;
