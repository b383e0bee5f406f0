//! Changes of a packed covariance that are collected and applied together.

use super::packed::{Squares, first_row, packed};
use crate::real::Real;

/// Number of deferred updates that are applied together: those of a position, or of a velocity.
pub const MAX_DEFERRED: usize = 3;
/// Number of parts in which the deferred updates are applied.
pub const DEFERRED_PARTS: usize = 2;

/// Deferred changes P -= c c' / s of a packed matrix, for columns c of N values, in the order in
/// which they will be applied.
#[derive(Clone, Copy, Debug)]
pub(super) struct Deferred<const N: usize, T> {
    columns: [[T; N]; MAX_DEFERRED],
    /// -1 / s.
    weights: [T; MAX_DEFERRED],
    count: usize,
    /// Parts already applied: 0 .. [`DEFERRED_PARTS`].
    applied_parts: usize,
}

/// Equal when the same changes remain to be applied. Unused columns are not compared.
impl<const N: usize, T: PartialEq> PartialEq for Deferred<N, T> {
    fn eq(&self, other: &Self) -> bool {
        let [own, others] = [self, other].map(|side| {
            let columns = side.columns.iter().zip(&side.weights);
            columns.take(side.count)
        });
        self.applied_parts == other.applied_parts && own.eq(others)
    }
}

impl<const N: usize, T: Real> Deferred<N, T> {
    /// No changes.
    pub const ZEROED: Self = Self {
        columns: [[T::ZERO; N]; MAX_DEFERRED],
        weights: [T::ZERO; MAX_DEFERRED],
        count: 0,
        applied_parts: 0,
    };

    /// Whether these changes must be applied before another one can be added.
    #[inline]
    pub fn is_closed(&self) -> bool {
        self.count >= MAX_DEFERRED || self.applied_parts > 0
    }

    /// Drops all changes.
    pub fn clear(&mut self) {
        (self.count, self.applied_parts) = (0, 0);
    }

    /// Adds a change and returns its column; `weight` is 1 / s. `None` when no other can be added.
    #[inline]
    pub fn hold(&mut self, column: &[T; N], weight: T) -> Option<&[T; N]> {
        if self.is_closed() {
            return None;
        }
        let slot = self.columns.get_mut(self.count)?;
        *slot = *column;
        *self.weights.get_mut(self.count)? = -weight;
        self.count += 1;
        Some(slot)
    }

    /// Place for columns of other work while no change is deferred.
    pub fn scratch(&mut self) -> &mut [[T; N]; MAX_DEFERRED] {
        self.clear();
        &mut self.columns
    }

    /// The row with which so many parts end, the first of a strip.
    fn end(parts: usize) -> usize {
        first_row(N, packed(N) * parts / DEFERRED_PARTS)
    }

    /// The value `i` of the diagonal after the deferred changes.
    pub fn of_diagonal(&self, i: usize, value: T) -> T {
        if i < Self::end(self.applied_parts) {
            return value;
        }
        let changes = self.columns.iter().zip(&self.weights).take(self.count);
        changes.fold(value, |sum, (column, &weight)| {
            column.get(i).map_or(sum, |&c| sum + weight * c * c)
        })
    }

    /// Applies the next of [`DEFERRED_PARTS`] parts of the changes to a packed matrix; the last
    /// part drops them. Returns whether more parts remain.
    pub fn apply(&mut self, matrix: &mut [T]) -> bool {
        if self.count > 0 {
            let [begin, end] = [self.applied_parts, self.applied_parts + 1].map(Self::end);
            let rows = matrix.get_mut(packed(begin)..packed(end));
            // a change that is not there counts nothing
            let count = self.count;
            let column = |k: usize| self.columns.get(if k < count { k } else { 0 });
            let squares = Squares {
                columns: [0, 1, 2].map(|k| column(k).map_or(&[][..], |column| column)),
                weights: core::array::from_fn(
                    |k| if k < count { self.weights[k] } else { T::ZERO },
                ),
            };
            squares.add_to(rows.unwrap_or_default(), begin);
            self.applied_parts += 1;
        }
        if self.applied_parts >= DEFERRED_PARTS {
            self.clear();
        }
        self.count > 0
    }
}
