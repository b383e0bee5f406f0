//! Changes of a packed covariance that are collected and applied together.

use super::packed::{axpy, first_row, packed, tail};
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

    /// The value `i` of the diagonal after the deferred changes.
    pub fn of_diagonal(&self, i: usize, value: T) -> T {
        if i < first_row(packed(N) * self.applied_parts / DEFERRED_PARTS) {
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
            let [begin, end] = [self.applied_parts, self.applied_parts + 1]
                .map(|part| first_row(packed(N) * part / DEFERRED_PARTS));
            let rows = matrix.get_mut(packed(begin)..packed(end));
            let columns = self.columns.each_ref().map(|column| &column[..]);
            let changes = Changes {
                columns,
                weights: &self.weights,
                count: self.count,
            };
            changes.apply(rows.unwrap_or_default(), begin);
            self.applied_parts += 1;
        }
        if self.applied_parts >= DEFERRED_PARTS {
            self.clear();
        }
        self.count > 0
    }
}

/// [`Deferred`] for any length, so that the code exists only once.
struct Changes<'a, T> {
    columns: [&'a [T]; MAX_DEFERRED],
    weights: &'a [T; MAX_DEFERRED],
    count: usize,
}

impl<T: Real> Changes<'_, T> {
    /// Two rows and all columns at a time; the changes of each value keep their order. The first of
    /// `rows` is row `i`.
    #[inline(never)]
    fn apply(&self, mut rows: &mut [T], mut i: usize) {
        if self.count == MAX_DEFERRED {
            while rows.len() > 2 * (i + 1)
                && let Some(short) = rows.split_off_mut(..i + 1)
                && let Some(long) = rows.split_off_mut(..i + 2)
            {
                axpy_two(
                    short,
                    long,
                    self.columns,
                    [i, i + 1].map(|i| self.factors(i)),
                );
                i += 2;
            }
        }
        while let Some(row) = rows.split_off_mut(..i + 1) {
            let changes = self.columns.iter().zip(self.factors(i));
            for (column, factor) in changes.take(self.count) {
                axpy(row, factor, column);
            }
            i += 1;
        }
    }

    /// -c_i / s for each column.
    #[inline(always)]
    fn factors(&self, i: usize) -> [T; MAX_DEFERRED] {
        core::array::from_fn(|k| {
            let c = self.columns[k].get(i);
            c.map_or(T::ZERO, |&c| self.weights[k] * c)
        })
    }
}

/// y += factor x for each of three x in turn, for two rows y, one a value longer than the other.
#[inline(always)]
fn axpy_two<T: Real>(
    short: &mut [T],
    long: &mut [T],
    columns: [&[T]; MAX_DEFERRED],
    factors: [[T; MAX_DEFERRED]; 2],
) {
    let changed = |y: T, c: [T; MAX_DEFERRED], f: &[T; MAX_DEFERRED]| {
        y + f[0] * c[0] + f[1] * c[1] + f[2] * c[2]
    };
    let [f, g] = &factors;
    let (short, short_rest) = short.as_chunks_mut::<4>();
    let Some((long, long_rest)) = long.split_at_mut_checked(4 * short.len()) else {
        return;
    };
    let (done, long) = (long.len(), long.as_chunks_mut::<4>().0);
    let [a, b, c] = columns.map(|column| column.as_chunks::<4>().0);
    for ((((y, z), a), b), c) in short.iter_mut().zip(long).zip(a).zip(b).zip(c) {
        // One whole row first, because LLVM does not know that y and z do not overlap.
        let row = |y: [T; 4], f| core::array::from_fn(|k| changed(y[k], [a[k], b[k], c[k]], f));
        (*y, *z) = (row(*y, f), row(*z, g));
    }
    // At most four values remain.
    let rests = columns.map(|column| tail(column, done));
    for (k, z) in long_rest.iter_mut().enumerate().take(4) {
        let column = rests.map(|rest| rest.get(k).copied().unwrap_or(T::ZERO));
        *z = changed(*z, column, g);
        if let Some(y) = short_rest.get_mut(k) {
            *y = changed(*y, column, f);
        }
    }
}
