//! Changes of a packed covariance that are collected and applied together.

use super::packed::Squares;
use crate::real::Real;

/// Number of deferred updates that are applied together: those of a position, or of a velocity.
pub const MAX_DEFERRED: usize = 3;

/// Deferred changes P -= c c' / s of a packed matrix, for columns c of N values, in the order in
/// which they will be applied. The columns are side by side; those that are not there are 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Deferred<const N: usize, T> {
    columns: [[T; MAX_DEFERRED]; N],
    /// -1 / s.
    weights: [T; MAX_DEFERRED],
    count: usize,
}

/// Equal when the same changes remain to be applied. Unused columns are not compared.
impl<const N: usize, T: PartialEq> PartialEq for Deferred<N, T> {
    fn eq(&self, other: &Self) -> bool {
        let count = self.count;
        let mut columns = self.columns.iter().zip(&other.columns);
        count == other.count
            && self.weights.get(..count) == other.weights.get(..count)
            && columns.all(|(own, others)| own.get(..count) == others.get(..count))
    }
}

impl<const N: usize, T: Real> Deferred<N, T> {
    /// No changes.
    pub const ZEROED: Self = Self {
        columns: [[T::ZERO; MAX_DEFERRED]; N],
        weights: [T::ZERO; MAX_DEFERRED],
        count: 0,
    };

    /// Whether these changes must be applied before another one can be added.
    #[inline]
    pub fn is_closed(&self) -> bool {
        self.count >= MAX_DEFERRED
    }

    /// Drops all changes.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds a change; `weight` is 1 / s. False when no other can be added.
    #[inline]
    pub fn hold(&mut self, column: &[T; N], weight: T) -> bool {
        if self.is_closed() {
            return false;
        }
        if self.count == 0 {
            self.weights = [T::ZERO; MAX_DEFERRED];
            for (columns, &value) in self.columns.iter_mut().zip(column) {
                *columns = [value, T::ZERO, T::ZERO];
            }
        } else {
            for (columns, &value) in self.columns.iter_mut().zip(column) {
                if let Some(of_row) = columns.get_mut(self.count) {
                    *of_row = value;
                }
            }
        }
        if let Some(of_column) = self.weights.get_mut(self.count) {
            *of_column = -weight;
        }
        self.count += 1;
        true
    }

    /// Place for columns of other work while no change is deferred.
    pub fn scratch(&mut self) -> &mut [[T; MAX_DEFERRED]; N] {
        self.clear();
        &mut self.columns
    }

    /// The value `i` of the diagonal after the deferred changes.
    pub fn of_diagonal(&self, i: usize, value: T) -> T {
        let Some(column) = self.columns.get(i) else {
            return value;
        };
        let changes = column.iter().zip(&self.weights).take(self.count);
        changes.fold(value, |sum, (&c, &weight)| sum + weight * c * c)
    }

    /// Applies the changes to a packed matrix and drops them.
    pub fn apply(&mut self, matrix: &mut [T]) {
        if self.count > 0 {
            let squares = Squares {
                columns: &self.columns,
                weights: self.weights,
            };
            squares.add_to(matrix);
        }
        self.clear();
    }
}
