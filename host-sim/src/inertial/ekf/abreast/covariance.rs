//! Covariance of several filters side by side: [`super::super::covariance`] for parameters that do
//! not fade. Only the lower triangle is kept, column by column.

use super::super::NAV;
use super::lane::Lane;

/// Nine rows of a column.
pub(super) type Column<const L: usize> = [Lane<L>; NAV];

/// Covariances, and what their updates need beside them.
#[derive(Debug, Clone)]
pub(super) struct Covariance<const L: usize> {
    size: usize,
    /// The lower triangle by columns.
    cells: Vec<Lane<L>>,
    /// Where each column begins.
    begins: Vec<usize>,
    /// The first nine rows of `[Phi Psi] P`.
    top: Vec<Column<L>>,
    /// The column of each measurement, one after the other.
    columns: Vec<Lane<L>>,
    weights: Vec<Lane<L>>,
    /// The estimated errors.
    pub(super) errors: Vec<Lane<L>>,
}

/// One measurement: error state, value, standard deviation.
pub(super) type Scalar<const L: usize> = (usize, Lane<L>, f64);
/// Values of a fix.
pub(super) const MOST: usize = 6;

impl<const L: usize> Covariance<L> {
    /// `of(l, i, j)` is a cell of filter `l`.
    pub(super) fn of(size: usize, of: impl Fn(usize, usize, usize) -> f64) -> Self {
        let cells = (0..size).flat_map(|j| (j..size).map(move |i| (i, j)));
        Self {
            size,
            cells: cells.map(|(i, j)| Lane::of(|l| of(l, i, j))).collect(),
            begins: (0..size)
                .map(|j| j * size - j * j.saturating_sub(1) / 2)
                .collect(),
            top: vec![[Lane::ZERO; NAV]; size],
            columns: vec![Lane::ZERO; MOST * size],
            weights: vec![Lane::ZERO; MOST],
            errors: vec![Lane::ZERO; size],
        }
    }

    /// The cell of filter `l`.
    pub(super) fn cell(&self, l: usize, i: usize, j: usize) -> f64 {
        let (i, j) = (i.max(j), i.min(j));
        self.cells[self.begins[j] + i - j].0[l]
    }

    /// `P <- [Phi Psi; 0 I] P [Phi Psi; 0 I]' + Q`. `by`: the columns of `[Phi Psi]`; `walked`:
    /// the variance that each parameter has walked.
    #[inline(always)]
    pub(super) fn propagate(
        &mut self,
        by: &[Column<L>],
        q: &[Column<L>; NAV],
        walked: impl Fn(usize) -> Lane<L>,
    ) {
        let size = self.size;
        for (j, top) in self.top.iter_mut().enumerate() {
            let mut sum = [Lane::ZERO; NAV];
            for (k, by) in by.iter().enumerate().take(j) {
                let x = self.cells[self.begins[k] + j - k];
                accumulate(&mut sum, by, x);
            }
            let below = &self.cells[self.begins[j]..self.begins[j] + size - j];
            for (by, x) in by[j..].iter().zip(below) {
                accumulate(&mut sum, by, *x);
            }
            *top = sum;
        }
        let mut nav = *q;
        for (c, sum) in nav.iter_mut().enumerate() {
            for (top, by) in self.top.iter().zip(by) {
                accumulate(sum, top, by[c]);
            }
        }
        for c in 0..NAV {
            let begin = self.begins[c];
            for (r, row) in nav.iter().enumerate().skip(c) {
                self.cells[begin + r - c] = 0.5 * (nav[c][r] + row[c]);
            }
            let below = &mut self.cells[begin + NAV - c..begin + size - c];
            for (cell, top) in below.iter_mut().zip(&self.top[NAV..]) {
                *cell = top[c];
            }
        }
        for (k, begin) in self.begins[NAV..].iter().enumerate() {
            self.cells[*begin] += walked(k);
        }
    }

    /// Measurements one after the other. The logarithm of their density is added to `score`.
    #[inline(always)]
    pub(super) fn update(&mut self, scalars: &[Scalar<L>], score: &mut Lane<L>) {
        let size = self.size;
        self.errors.fill(Lane::ZERO);
        let mut density = Lane::ZERO;
        for (m, &(i, z, sigma)) in scalars.iter().enumerate() {
            let (earlier, rest) = self.columns.split_at_mut(m * size);
            let column = &mut rest[..size];
            for (k, cell) in column[..i].iter_mut().enumerate() {
                *cell = self.cells[self.begins[k] + i - k];
            }
            let begin = self.begins[i];
            column[i..].copy_from_slice(&self.cells[begin..begin + size - i]);
            for (earlier, weight) in earlier.chunks_exact(size).zip(&self.weights) {
                let by = earlier[i] * *weight;
                for (c, x) in column.iter_mut().zip(earlier) {
                    *c -= *x * by;
                }
            }
            let s = column[i] + sigma * sigma;
            let innovation = z - self.errors[i];
            let gain = innovation / s;
            for (e, c) in self.errors.iter_mut().zip(&*column) {
                *e += *c * gain;
            }
            let square = innovation * innovation / s;
            let log = (std::f64::consts::TAU * s).map(f64::ln);
            density -= 0.5 * (square + log);
            self.weights[m] = 1.0 / s;
        }
        *score += density;
        self.subtract(scalars.len());
    }

    /// `P - sum w c c'` over the first `count` measurements, three at a time.
    #[inline(always)]
    fn subtract(&mut self, count: usize) {
        let (size, w) = (self.size, &self.weights);
        for first in (0..count).step_by(3) {
            let number = (count - first).min(3);
            let columns = &self.columns[first * size..(first + number) * size];
            for (j, begin) in self.begins.iter().enumerate() {
                let cells = &mut self.cells[*begin..*begin + size - j];
                if number == 3 {
                    let (a, rest) = columns.split_at(size);
                    let (b, c) = rest.split_at(size);
                    let by_a = a[j] * w[first];
                    let by_b = b[j] * w[first + 1];
                    let by_c = c[j] * w[first + 2];
                    let rows = a[j..].iter().zip(&b[j..]).zip(&c[j..]);
                    for (cell, ((a, b), c)) in cells.iter_mut().zip(rows) {
                        *cell = *cell - *a * by_a - *b * by_b - *c * by_c;
                    }
                    continue;
                }
                for (m, column) in columns.chunks_exact(size).enumerate() {
                    let by = column[j] * w[first + m];
                    for (cell, x) in cells.iter_mut().zip(&column[j..]) {
                        *cell -= *x * by;
                    }
                }
            }
        }
    }
}

/// `sum + column * x`.
#[inline(always)]
fn accumulate<const L: usize>(sum: &mut Column<L>, column: &Column<L>, x: Lane<L>) {
    for (s, c) in sum.iter_mut().zip(column) {
        *s += *c * x;
    }
}
