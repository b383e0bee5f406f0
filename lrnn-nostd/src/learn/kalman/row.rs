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
    #[inline(always)]
    pub(super) fn times_three(&self, vectors: &[[T; 3]]) -> [[T; 3]; 3] {
        let mut sums = [[T::ZERO; 3]; 3];
        for (&of, &value) in self.values.iter().zip(tail(vectors, self.start)) {
            for (sums, value) in sums.iter_mut().zip(value) {
                axpy(sums, value, &of);
            }
        }
        sums
    }

    /// All N columns, and which fours of them are not all 0.
    #[inline]
    pub(super) fn wide<const N: usize>(&self) -> ([[T; 3]; N], Range<usize>) {
        let mut wide = [[T::ZERO; 3]; N];
        for (wide, value) in wide.iter_mut().skip(self.start).zip(self.values) {
            *wide = *value;
        }
        let end = self.start.saturating_add(self.values.len());
        (wide, self.start / 4..end.div_ceil(4).min(N / 4))
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

/// Adds to each row of `y` each of three x, which are side by side, times its factor, in turn.
#[inline(always)]
pub(super) fn axpy_three<T: Real, const N: usize, const X: usize>(
    y: &mut [[T; N]; X],
    factors: &[[T; 3]; X],
    x: &[[T; 3]; N],
) {
    let changed = |y: T, f: &[T; 3], x: [T; 3]| y + f[0] * x[0] + f[1] * x[1] + f[2] * x[2];
    let (fours, rest) = x.as_chunks::<4>();
    for (j, &x) in fours.iter().enumerate() {
        for (y, f) in y.iter_mut().zip(factors) {
            if let Some(y) = y.as_chunks_mut::<4>().0.get_mut(j) {
                *y = core::array::from_fn(|k| changed(y[k], f, x[k]));
            }
        }
    }
    for (y, f) in y.iter_mut().zip(factors) {
        for (y, &x) in y.as_chunks_mut::<4>().1.iter_mut().zip(rest) {
            *y = changed(*y, f, x);
        }
    }
}

/// The values from `start` on.
#[inline(always)]
pub(super) fn tail<T>(values: &[T], start: usize) -> &[T] {
    values.get(start..).unwrap_or(&[])
}
