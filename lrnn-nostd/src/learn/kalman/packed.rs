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

/// Index of the first value of row `i` of a packed matrix.
pub(super) const fn packed(i: usize) -> usize {
    i * (i + 1) / 2
}

/// The first row of a packed matrix that begins at `offset` or later.
pub(super) fn first_row(offset: usize) -> usize {
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
