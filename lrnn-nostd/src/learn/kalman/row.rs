//! Products and sums of rows of numbers.

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

    /// All N values, and which fours of them are not all 0.
    #[inline]
    pub(super) fn wide<const N: usize>(&self) -> ([T; N], core::ops::Range<usize>) {
        let mut wide = [T::ZERO; N];
        for (wide, &value) in wide.iter_mut().skip(self.start).zip(self.values) {
            *wide = value;
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

/// Adds to each row of `y` each of three x times its factor, in turn.
#[inline(always)]
pub(super) fn axpy_three<T: Real, const N: usize, const X: usize>(
    y: &mut [[T; N]; X],
    factors: &[[T; 3]; X],
    [a, b, c]: &[[T; N]; 3],
) {
    let changed = |y: T, f: &[T; 3], x: [T; 3]| y + f[0] * x[0] + f[1] * x[1] + f[2] * x[2];
    let fours = [a, b, c].map(|x| x.as_chunks::<4>());
    let [(a, a_rest), (b, b_rest), (c, c_rest)] = fours;
    for (j, ((&a, &b), &c)) in a.iter().zip(b).zip(c).enumerate() {
        for (y, f) in y.iter_mut().zip(factors) {
            if let Some(y) = y.as_chunks_mut::<4>().0.get_mut(j) {
                *y = core::array::from_fn(|k| changed(y[k], f, [a[k], b[k], c[k]]));
            }
        }
    }
    for (y, f) in y.iter_mut().zip(factors) {
        let rest = a_rest.iter().zip(b_rest).zip(c_rest);
        for (y, ((&a, &b), &c)) in y.as_chunks_mut::<4>().1.iter_mut().zip(rest) {
            *y = changed(*y, f, [a, b, c]);
        }
    }
}

/// The values from `start` on.
#[inline(always)]
pub(super) fn tail<T>(values: &[T], start: usize) -> &[T] {
    values.get(start..).unwrap_or(&[])
}
