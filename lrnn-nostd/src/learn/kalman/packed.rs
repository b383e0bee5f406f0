//! A symmetric matrix, stored as its lower triangle row by row, and the operations on it. They are
//! most of the cost of a fix.

use crate::real::Real;

/// A row of N values that is 0 outside a range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row<'a, T = f32> {
    /// Index of the first value of the range.
    pub start: usize,
    /// The values of the range.
    pub values: &'a [T],
}

impl<T: Real> Row<'_, T> {
    /// Product with a vector of N values.
    #[inline]
    pub fn dot(&self, vector: &[T]) -> T {
        vector
            .get(self.start..)
            .map_or(T::ZERO, |part| dot(self.values, part))
    }
}

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

/// `out` = packed symmetric matrix times a row. The value in row i at column j < i also counts for
/// row j.
///
/// It works on four rows at a time, so that their sums do not wait for each other. Each value adds
/// up in the order of the columns, as it would row by row.
#[inline(never)]
pub(super) fn times<T: Real>(packed: &[T], v: Row<'_, T>, out: &mut [T]) {
    out.fill(T::ZERO);
    let mut rows = Rows::from(packed, v.start);
    // Rows inside the range of `v`; the ends of four rows, from the diagonal on, are done apart.
    let (fours, ones) = v.values.as_chunks::<4>();
    for (m, factors) in fours.iter().enumerate() {
        let i = rows.next;
        let Some(four) = rows.next_four() else { break };
        let Some((above, own)) = out.split_at_mut_checked(i) else {
            break;
        };
        let Some(own) = own.first_chunk_mut::<4>() else {
            break;
        };
        let sums = dot_four(
            four.map(|row| tail(row, v.start)),
            fours.get(..m).unwrap_or_default(),
            &[],
        );
        axpy_four(above, factors, &four);
        let ends = four.map(|row| tail(row, i));
        for r in 0..4 {
            own[r] += ends[r]
                .iter()
                .zip(factors)
                .fold(sums[r], |sum, (&p, &v)| sum + p * v);
        }
        for r in 0..4 {
            for (own, &p) in own.iter_mut().take(r).zip(ends[r]) {
                *own += p * factors[r];
            }
        }
    }
    for &factor in ones {
        let i = rows.next;
        let Some(row) = rows.next() else { break };
        let Some((above, [own, ..])) = out.split_at_mut_checked(i) else {
            break;
        };
        *own += v.dot(row);
        axpy(above, factor, row);
    }
    // Rows below the range of `v`.
    let Some(below) = out.get_mut(rows.next..) else {
        return;
    };
    let (below_fours, below_ones) = below.as_chunks_mut::<4>();
    for own in below_fours {
        let Some(four) = rows.next_four() else { break };
        *own = dot_four(four.map(|row| tail(row, v.start)), fours, ones);
    }
    for (own, row) in below_ones.iter_mut().zip(rows) {
        *own = v.dot(row);
    }
}

/// a . b over the shorter of the two.
#[inline(always)]
pub(super) fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    a.iter().zip(b).fold(T::ZERO, |sum, (&a, &b)| sum + a * b)
}

/// y += factor x over the shorter of the two.
#[inline(always)]
pub(super) fn axpy<T: Real>(y: &mut [T], factor: T, x: &[T]) {
    for (y, &x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

/// The product of each row with a vector, given in fours and at most three more values.
#[inline(always)]
pub(super) fn dot_four<T: Real>(rows: [&[T]; 4], v_fours: &[[T; 4]], v_ones: &[T]) -> [T; 4] {
    let mut sums = [T::ZERO; 4];
    let [a, b, c, d] = rows.map(|row| row.as_chunks::<4>().0);
    for ((((a, b), c), d), v) in a.iter().zip(b).zip(c).zip(d).zip(v_fours) {
        for k in 0..4 {
            sums[0] += a[k] * v[k];
            sums[1] += b[k] * v[k];
            sums[2] += c[k] * v[k];
            sums[3] += d[k] * v[k];
        }
    }
    let rests = rows.map(|row| tail(row, 4 * v_fours.len()));
    for (k, &v) in v_ones.iter().enumerate().take(3) {
        for (sum, rest) in sums.iter_mut().zip(rests) {
            if let Some(&p) = rest.get(k) {
                *sum += p * v;
            }
        }
    }
    sums
}

/// y += factor x for each of four rows in turn; none is shorter than y.
#[inline(always)]
fn axpy_four<T: Real>(y: &mut [T], factors: &[T; 4], rows: &[&[T]; 4]) {
    let [a, b, c, d] = rows.map(|row| row.as_chunks::<4>().0);
    let (y_fours, y_ones) = y.as_chunks_mut::<4>();
    let rests = rows.map(|row| tail(row, 4 * y_fours.len()));
    for ((((y, a), b), c), d) in y_fours.iter_mut().zip(a).zip(b).zip(c).zip(d) {
        for k in 0..4 {
            y[k] = y[k]
                + factors[0] * a[k]
                + factors[1] * b[k]
                + factors[2] * c[k]
                + factors[3] * d[k];
        }
    }
    for (k, y) in y_ones.iter_mut().enumerate().take(3) {
        for (&factor, rest) in factors.iter().zip(rests) {
            if let Some(&x) = rest.get(k) {
                *y += factor * x;
            }
        }
    }
}

/// Adds to each row of `y` its factor times x.
#[inline(always)]
pub(super) fn axpy_rows<T: Real, const N: usize, const X: usize>(
    y: &mut [[T; N]; X],
    factors: [T; X],
    x: &[T; N],
) {
    for (j, &x) in x.as_chunks::<4>().0.iter().enumerate() {
        for (y, factor) in y.iter_mut().zip(factors) {
            if let Some(y) = y.as_chunks_mut::<4>().0.get_mut(j) {
                axpy(y, factor, &x);
            }
        }
    }
    for (y, factor) in y.iter_mut().zip(factors) {
        axpy(y.as_chunks_mut::<4>().1, factor, x.as_chunks::<4>().1);
    }
}

/// The values from `start` on.
#[inline(always)]
pub(super) fn tail<T>(values: &[T], start: usize) -> &[T] {
    values.get(start..).unwrap_or(&[])
}

/// The rows of a packed matrix, of 1, 2, 3 ... values.
pub(super) struct Rows<'a, T> {
    rest: &'a [T],
    /// Index of the next row.
    next: usize,
}

impl<'a, T> Rows<'a, T> {
    /// From row `next` on.
    pub fn from(values: &'a [T], next: usize) -> Self {
        let rest = tail(values, packed(next));
        Self { rest, next }
    }

    /// The next four rows; `None` when fewer remain.
    #[inline(always)]
    fn next_four(&mut self) -> Option<[&'a [T]; 4]> {
        let i = self.next;
        let (a, rest) = self.rest.split_at_checked(i + 1)?;
        let (b, rest) = rest.split_at_checked(i + 2)?;
        let (c, rest) = rest.split_at_checked(i + 3)?;
        let (d, rest) = rest.split_at_checked(i + 4)?;
        (self.rest, self.next) = (rest, i + 4);
        Some([a, b, c, d])
    }
}

impl<'a, T> Iterator for Rows<'a, T> {
    type Item = &'a [T];

    #[inline(always)]
    fn next(&mut self) -> Option<&'a [T]> {
        let (row, rest) = self.rest.split_at_checked(self.next + 1)?;
        (self.rest, self.next) = (rest, self.next + 1);
        Some(row)
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

/// Index of the first value of row `i` of a packed matrix.
fn packed(i: usize) -> usize {
    i * (i + 1) / 2
}

/// The first row of a packed matrix that begins at `offset` or later.
fn first_row(offset: usize) -> usize {
    (0..).find(|&i| packed(i) >= offset).unwrap_or(0)
}

/// The diagonal of a packed matrix.
pub(super) fn diagonal<T>(packed: &mut [T]) -> impl Iterator<Item = &mut T> {
    let mut rest = packed;
    (0..).map_while(move |i: usize| {
        let (row, below) = core::mem::take(&mut rest).split_at_mut_checked(i + 1)?;
        rest = below;
        row.last_mut()
    })
}

#[cfg(test)]
mod tests;
