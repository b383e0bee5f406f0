//! Products and sums of rows of numbers.

use crate::real::Real;
use core::ops::Range;

/// Three rows of N values side by side: the values of a column are adjacent. They are 0 outside a
/// range of columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rows<'a, T = f32> {
    /// Index of the first column of the range.
    pub start: usize,
    /// The columns of the range.
    pub values: &'a [[T; 3]],
}

impl<T: Real> Rows<'_, T> {
    /// Products with a vector of N values.
    #[inline]
    pub fn times(&self, vector: &[T]) -> [T; 3] {
        let [sums] = self.times_each([vector]);
        sums
    }

    /// Products with several vectors, each value of the rows read once.
    #[inline(always)]
    pub(super) fn times_each<const M: usize>(&self, vectors: [&[T]; M]) -> [[T; 3]; M] {
        let mut sums = [[T::ZERO; 3]; M];
        let parts = vectors.map(|vector| {
            let part = tail(vector, self.start);
            part.get(..self.values.len()).unwrap_or(part)
        });
        for (i, &of) in self.values.iter().enumerate() {
            for (sums, part) in sums.iter_mut().zip(parts) {
                if let Some(&value) = part.get(i) {
                    axpy(sums, value, &of);
                }
            }
        }
        sums
    }

    /// Products with three vectors that are side by side, too.
    #[inline(never)]
    pub(super) fn times_three(&self, vectors: &[[T; 3]]) -> [[T; 3]; 3] {
        let mut sums = [[T::ZERO; 3]; 3];
        for (&of, &value) in self.values.iter().zip(tail(vectors, self.start)) {
            for (sums, value) in sums.iter_mut().zip(value) {
                axpy(sums, value, &of);
            }
        }
        sums
    }

    /// Writes all columns to `wide`, and gives which fours of them are not all 0.
    #[inline(never)]
    pub(super) fn widen(&self, wide: &mut [[T; 3]]) -> Range<usize> {
        wide.fill([T::ZERO; 3]);
        let own = wide.get_mut(self.start..).unwrap_or_default();
        let (fours, rest) = own.as_chunks_mut::<4>();
        let (of_fours, of_rest) = self.values.as_chunks::<4>();
        if let Some(next) = fours.get_mut(of_fours.len()) {
            (next.iter_mut().zip(of_rest)).for_each(|(wide, value)| *wide = *value);
        } else {
            (rest.iter_mut().zip(of_rest)).for_each(|(wide, value)| *wide = *value);
        }
        (fours.iter_mut().zip(of_fours)).for_each(|(wide, values)| *wide = *values);
        let end = self.start.saturating_add(self.values.len());
        self.start / 4..end.div_ceil(4).min(wide.len() / 4)
    }
}

/// The products of a vector with the rows of two triads, times a factor: once for all filters.
#[inline(never)]
pub(super) fn of_outputs<T: Real>(rows: &[Rows<'_, T>; 2], vector: &[T], factor: T) -> [T; 6] {
    let [[a, b, c], [d, e, f]] = rows.each_ref().map(|rows| rows.times(vector));
    [a, b, c, d, e, f].map(|value| factor * value)
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

// A matrix below is given as its rows one after the other, so that filters of any number of
// parameters share the code.

/// Adds to each row of `y` its factor times x.
#[inline(never)]
pub(super) fn axpy_rows<T: Real>(y: &mut [T], factors: &[T], x: &[T]) {
    change_rows(y, factors, x, |y, &f, &x| *y += f * x);
}

/// Adds to each row of `y` each of three x, which are side by side, times its factor, in turn.
#[inline(never)]
pub(super) fn axpy_three<T: Real>(y: &mut [T], factors: &[[T; 3]], x: &[[T; 3]]) {
    change_rows(y, factors, x, |y, f, x| {
        *y = *y + f[0] * x[0] + f[1] * x[1] + f[2] * x[2];
    });
}

/// Changes the rows of `y` by their factors and x, three rows at a time, so that x is read once for
/// them.
#[inline(always)]
fn change_rows<T, F: Copy, V: Copy>(
    y: &mut [T],
    factors: &[F],
    x: &[V],
    change: impl Fn(&mut T, &F, &V),
) {
    let n = x.len().max(1);
    let (x_fours, x_rest) = x.as_chunks::<4>();
    for (y, factors) in y.chunks_mut(3 * n).zip(factors.chunks(3)) {
        if let &[f, g, h] = factors
            && let Some((a, rest)) = y.split_at_mut_checked(n)
            && let Some((b, c)) = rest.split_at_mut_checked(n)
        {
            let [(a, a_rest), (b, b_rest), (c, c_rest)] =
                [a, b, c].map(|row| row.as_chunks_mut::<4>());
            // read before anything is written: the compiler cannot know that they do not overlap
            for (((a, b), c), &x) in a.iter_mut().zip(b).zip(c).zip(x_fours) {
                for (row, f) in [(a, &f), (b, &g), (c, &h)] {
                    row.iter_mut().zip(&x).for_each(|(y, x)| change(y, f, x));
                }
            }
            for (row, f) in [(a_rest, &f), (b_rest, &g), (c_rest, &h)] {
                row.iter_mut()
                    .zip(x_rest)
                    .for_each(|(y, x)| change(y, f, x));
            }
        } else {
            for (row, f) in y.chunks_mut(n).zip(factors) {
                row.iter_mut().zip(x).for_each(|(y, x)| change(y, f, x));
            }
        }
    }
}

/// `y` <- `by` `y`, for rows of `n` values.
#[inline(never)]
pub(super) fn transform<T: Real, const X: usize>(y: &mut [T], n: usize, by: &[[T; X]; X]) {
    let length = n.max(1);
    for j in (0..n).step_by(3) {
        let mut rows = y.chunks_exact(length);
        let columns: [[T; 3]; X] = core::array::from_fn(|_| {
            let row = tail(rows.next().unwrap_or_default(), j);
            let at = |k: usize| row.get(k).copied().unwrap_or(T::ZERO);
            let three = row.first_chunk::<3>().copied();
            three.unwrap_or_else(|| [at(0), at(1), at(2)])
        });
        for (row, by) in y.chunks_exact_mut(length).zip(by) {
            let mut sums = [T::ZERO; 3];
            for (&by, columns) in by.iter().zip(&columns) {
                axpy(&mut sums, by, columns);
            }
            let row = row.get_mut(j..).unwrap_or_default();
            match row.first_chunk_mut::<3>() {
                Some(three) => *three = sums,
                None => row.iter_mut().zip(sums).for_each(|(y, sum)| *y = sum),
            }
        }
    }
}

/// The values from `start` on.
#[inline(always)]
pub(super) fn tail<T>(values: &[T], start: usize) -> &[T] {
    values.get(start..).unwrap_or(&[])
}
