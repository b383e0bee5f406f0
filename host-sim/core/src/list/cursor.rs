//! Reads a list, in memory or in a file.

use super::{Item, List};
use std::borrow::Cow;
use std::ops::Range;

/// Reads items near each other; the block of the last item is in memory.
#[derive(Debug)]
pub struct Cursor<'a, T: Clone> {
    list: &'a List<T>,
    block: Cow<'a, [T]>,
    /// Number of the first item of the block.
    first: usize,
}

impl<'a, T: Item> Cursor<'a, T> {
    pub(super) fn new(list: &'a List<T>) -> Self {
        Self {
            list,
            block: Cow::Borrowed(&[]),
            first: 0,
        }
    }

    /// Item `k`; `None` where the list ends or its file cannot be read.
    pub fn get(&mut self, k: usize) -> Option<&T> {
        if k.wrapping_sub(self.first) >= self.block.len() {
            self.turn_to(k);
        }
        self.block.get(k - self.first)
    }

    /// Loads the block with item `k`, in the direction of reading.
    #[cold]
    fn turn_to(&mut self, k: usize) {
        let most = self.list.per_block();
        let range = match k < self.first {
            true => (k + 1).saturating_sub(most)..k + 1,
            false if most >= self.list.len() => 0..most,
            false => k..k.saturating_add(most),
        };
        self.first = range.start.min(k);
        self.block = match k < self.list.len() {
            true => self.list.block(range),
            false => Cow::Borrowed(&[]),
        };
    }
}

/// The items from either end.
#[derive(Debug)]
pub struct Each<'a, T: Clone> {
    cursor: Cursor<'a, T>,
    left: Range<usize>,
}

impl<'a, T: Item> Each<'a, T> {
    pub(super) fn new(list: &'a List<T>) -> Self {
        Self {
            cursor: list.cursor(),
            left: 0..list.len(),
        }
    }
}

impl<T: Item> Iterator for Each<'_, T> {
    type Item = T;

    fn next(&mut self) -> Option<T> {
        self.left.next().and_then(|k| self.cursor.get(k).cloned())
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        self.left.size_hint()
    }
}

impl<T: Item> DoubleEndedIterator for Each<'_, T> {
    fn next_back(&mut self) -> Option<T> {
        let k = self.left.next_back()?;
        self.cursor.get(k).cloned()
    }
}
