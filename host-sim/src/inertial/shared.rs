//! A list that several owners share: a part of a session holds no copy of its counts.

use std::ops::{Deref, Range};
use std::sync::Arc;

/// A part of a list. It reads as a slice.
#[derive(Debug, Clone)]
pub struct Shared<T> {
    all: Arc<Vec<T>>,
    part: Range<usize>,
}

impl<T> Shared<T> {
    /// A part of this part, which ends at its end at the latest.
    #[must_use]
    pub fn part(&self, of: Range<usize>) -> Self {
        let at = |k: usize| (self.part.start + k).min(self.part.end);
        Self {
            all: Arc::clone(&self.all),
            part: at(of.start)..at(of.end),
        }
    }
}

impl<T: Clone> Shared<T> {
    /// The elements to change. They are copied first if somebody else has them, too.
    pub fn to_mut(&mut self) -> &mut [T] {
        &mut Arc::make_mut(&mut self.all)[self.part.clone()]
    }
}

impl<T> Deref for Shared<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.all[self.part.clone()]
    }
}

impl<T> From<Vec<T>> for Shared<T> {
    fn from(all: Vec<T>) -> Self {
        Self {
            part: 0..all.len(),
            all: Arc::new(all),
        }
    }
}

impl<T: PartialEq> PartialEq for Shared<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_shared_until_it_is_changed() {
        let all = Shared::from(vec![0, 1, 2, 3, 4]);
        let mut part = all.part(1..4).part(1..9);
        assert_eq!(*part, [2, 3]);
        assert!(Arc::ptr_eq(&all.all, &part.all));
        part.to_mut()[0] = 7;
        assert_eq!((&*part, &*all), (&[7, 3][..], &[0, 1, 2, 3, 4][..]));
    }
}
