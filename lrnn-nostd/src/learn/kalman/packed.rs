//! A symmetric matrix of which the lower triangle is kept, row after row, and what is done with it: most of what a fix costs.

use crate::real::Real;

/// A row of N values of which only those from `start` on, as many as `values`, are not 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row<'a, T = f32> {
    /// Index of the first value.
    pub start: usize,
    /// The values.
    pub values: &'a [T],
}

impl<T: Real> Row<'_, T> {
    /// The product with a whole vector.
    #[inline]
    pub fn dot(&self, vector: &[T]) -> T {
        vector
            .get(self.start..)
            .map_or(T::ZERO, |part| dot(self.values, part))
    }
}

/// Changes that are held back together: those of a position, or of a velocity.
pub const HELD: usize = 3;
/// Parts in which they are made.
pub const ABSORB_PARTS: usize = 2;

/// Changes P -= c c' / s of a packed matrix, for columns c of N values, that are still to be made, in this order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held<const N: usize, T> {
    columns: [[T; N]; HELD],
    /// -1 / s.
    weights: [T; HELD],
    count: usize,
    /// Parts of them that are made: 0 .. [`ABSORB_PARTS`].
    made: usize,
}

/// The same changes are to be made; what lies behind them does not matter.
impl<const N: usize, T: PartialEq> PartialEq for Held<N, T> {
    fn eq(&self, other: &Self) -> bool {
        let [own, others] = [self, other].map(|held| {
            let columns = held.columns.iter().zip(&held.weights);
            columns.take(held.count)
        });
        self.made == other.made && own.eq(others)
    }
}

impl<const N: usize, T: Real> Held<N, T> {
    /// Nothing.
    pub const BLANK: Self = Self {
        columns: [[T::ZERO; N]; HELD],
        weights: [T::ZERO; HELD],
        count: 0,
        made: 0,
    };

    /// No other can be held before these are made.
    #[inline]
    pub fn is_closed(&self) -> bool {
        self.count >= HELD || self.made > 0
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        (self.count, self.made) = (0, 0);
    }

    /// Holds one more and shows it; `weight` is 1 / s. `None` when no other can be held.
    #[inline]
    pub fn hold(&mut self, column: &[T; N], weight: T) -> Option<&[T; N]> {
        if self.is_closed() {
            return None;
        }
        let held = self.columns.get_mut(self.count)?;
        *held = *column;
        *self.weights.get_mut(self.count)? = -weight;
        self.count += 1;
        Some(held)
    }

    /// What the value `i` of the diagonal becomes.
    pub fn of_diagonal(&self, i: usize, value: T) -> T {
        if i < first_row(packed(N) * self.made / ABSORB_PARTS) {
            return value;
        }
        let changes = self.columns.iter().zip(&self.weights).take(self.count);
        changes.fold(value, |sum, (column, &weight)| {
            column.get(i).map_or(sum, |&c| sum + weight * c * c)
        })
    }

    /// Makes the next of [`ABSORB_PARTS`] parts of the changes in a packed matrix; the last forgets them. Whether there is more.
    pub fn absorb(&mut self, matrix: &mut [T]) -> bool {
        if self.count > 0 {
            let [begin, end] =
                [self.made, self.made + 1].map(|part| first_row(packed(N) * part / ABSORB_PARTS));
            let rows = matrix.get_mut(packed(begin)..packed(end));
            let columns = self.columns.each_ref().map(|column| &column[..]);
            let changes = Changes {
                columns,
                weights: &self.weights,
                count: self.count,
            };
            changes.make(rows.unwrap_or_default(), begin);
            self.made += 1;
        }
        if self.made >= ABSORB_PARTS {
            self.clear();
        }
        self.count > 0
    }
}

/// [`Held`] of any length, so that there is the code for one.
struct Changes<'a, T> {
    columns: [&'a [T]; HELD],
    weights: &'a [T; HELD],
    count: usize,
}

impl<T: Real> Changes<'_, T> {
    /// Two rows and all columns at a time, each value's changes in their order; the first of the rows is row `i`.
    #[inline(never)]
    fn make(&self, mut rows: &mut [T], mut i: usize) {
        if self.count == HELD {
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

    /// -c_i / s of each column.
    #[inline(always)]
    fn factors(&self, i: usize) -> [T; HELD] {
        core::array::from_fn(|k| {
            let c = self.columns[k].get(i);
            c.map_or(T::ZERO, |&c| self.weights[k] * c)
        })
    }
}

/// `out` = packed symmetric matrix times a row: what stands in row i at j < i counts for j, too.
///
/// Four rows at a time, whose sums do not wait for each other. Each value adds up in the order of the columns, as row by row.
#[inline(never)]
pub(super) fn times<T: Real>(packed: &[T], v: Row<'_, T>, out: &mut [T]) {
    out.fill(T::ZERO);
    let mut rows = Rows::from(packed, v.start);
    // rows that `v` has values for, but for the ends of four from the diagonal on
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
    // rows below
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

/// The product of each row with a vector in fours and at most three values more.
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

/// y += factor x for each of four rows in turn, none shorter than y.
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

/// Each row of `y` += its factor times x.
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
    let done = N / 4 * 4;
    for (y, factor) in y.iter_mut().zip(factors) {
        for (y, &x) in y.iter_mut().zip(x).skip(done) {
            *y += factor * x;
        }
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

    /// As many as four rows; none where there are fewer.
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

/// y += factor x for each of three x in turn, of two rows y, one a value longer than the other.
#[inline(always)]
fn axpy_two<T: Real>(
    short: &mut [T],
    long: &mut [T],
    columns: [&[T]; HELD],
    factors: [[T; HELD]; 2],
) {
    let changed = |y: T, c: [T; HELD], f: &[T; HELD]| y + f[0] * c[0] + f[1] * c[1] + f[2] * c[2];
    let [f, g] = &factors;
    let (short, short_rest) = short.as_chunks_mut::<4>();
    let Some((long, long_rest)) = long.split_at_mut_checked(4 * short.len()) else {
        return;
    };
    let (done, long) = (long.len(), long.as_chunks_mut::<4>().0);
    let [a, b, c] = columns.map(|column| column.as_chunks::<4>().0);
    for ((((y, z), a), b), c) in short.iter_mut().zip(long).zip(a).zip(b).zip(c) {
        // a whole row first, for LLVM does not know that y and z are two
        let row = |y: [T; 4], f| core::array::from_fn(|k| changed(y[k], [a[k], b[k], c[k]], f));
        (*y, *z) = (row(*y, f), row(*z, g));
    }
    // four values at most
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

/// Whether every value is finite: sums of several, each 0 where all are.
#[inline]
pub(super) fn finite<T: Real>(values: &[T]) -> bool {
    let (eights, ones) = values.as_chunks::<8>();
    let mut sums = [T::ZERO; 8];
    for values in eights {
        for (sum, &value) in sums.iter_mut().zip(values) {
            *sum += value * T::ZERO;
        }
    }
    let sum = sums
        .iter()
        .chain(ones)
        .fold(T::ZERO, |sum, &value| sum + value * T::ZERO);
    sum == T::ZERO
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
