//! Covariance of several filters side by side: [`super::super::covariance`] for parameters that do
//! not fade. Only the lower triangle is kept, column by column.

use super::super::NAV;
use crate::inertial::lane::{Lane, PLACES, all, of};
use fearless_simd::Simd;

/// Nine rows of a column.
pub(super) type Column<S> = [Lane<S>; NAV];

/// Covariances, and what their updates need beside them.
pub(super) struct Covariance<S: Simd> {
    size: usize,
    /// The lower triangle by columns.
    cells: Vec<Lane<S>>,
    /// Where each column begins.
    begins: Vec<usize>,
    /// The first nine rows of `[Phi Psi] P`.
    top: Vec<Column<S>>,
    /// The column of each measurement, one after the other.
    columns: Vec<Lane<S>>,
    weights: [Lane<S>; MOST],
    /// The estimated errors.
    pub(super) errors: Vec<Lane<S>>,
}

/// One measurement: error state, value, standard deviation.
pub(super) type Scalar<S> = (usize, Lane<S>, f64);
/// Values of a fix.
pub(super) const MOST: usize = 6;

impl<S: Simd> Covariance<S> {
    /// `cell(l, i, j)` is a cell of filter `l`.
    #[inline(always)]
    pub(super) fn of(simd: S, size: usize, cell: impl Fn(usize, usize, usize) -> f64) -> Self {
        let mut cells = Vec::with_capacity(size * (size + 1) / 2);
        let mut begins = Vec::with_capacity(size);
        for j in 0..size {
            begins.push(cells.len());
            for i in j..size {
                cells.push(of(simd, |l| cell(l, i, j)));
            }
        }
        let zero = all(simd, 0.0);
        Self {
            size,
            cells,
            begins,
            top: vec![[zero; NAV]; size],
            columns: vec![zero; MOST * size],
            weights: [zero; MOST],
            errors: vec![zero; size],
        }
    }

    /// The cell of filter `l`.
    pub(super) fn cell(&self, l: usize, i: usize, j: usize) -> f64 {
        let (i, j) = (i.max(j), i.min(j));
        self.cells[self.begins[j] + i - j][l]
    }

    /// `P <- [Phi Psi; 0 I] P [Phi Psi; 0 I]' + Q`. `by`: the columns of `[Phi Psi]`; `walks`:
    /// the variance that each parameter walks in a second, for `time` seconds.
    #[inline(always)]
    pub(super) fn propagate(
        &mut self,
        by: &[Column<S>],
        q: &[Column<S>; NAV],
        walks: &[Lane<S>],
        time: f64,
    ) {
        self.transform(by);
        let size = self.size;
        let mut nav = *q;
        for c in (0..NAV - 1).step_by(2) {
            let mut two = [nav[c], nav[c + 1]];
            for (top, by) in self.top.iter().zip(by) {
                accumulate(&mut two, top, [by[c], by[c + 1]]);
            }
            [nav[c], nav[c + 1]] = two;
        }
        let mut last = [nav[NAV - 1]];
        for (top, by) in self.top.iter().zip(by) {
            accumulate(&mut last, top, [by[NAV - 1]]);
        }
        [nav[NAV - 1]] = last;
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
        for (walk, begin) in walks.iter().zip(&self.begins[NAV..]) {
            self.cells[*begin] += *walk * time;
        }
    }

    /// The first nine rows of `[Phi Psi] P`, two columns at a time, so that a column of `[Phi Psi]`
    /// is read once for both.
    #[inline(always)]
    fn transform(&mut self, by: &[Column<S>]) {
        let size = self.size;
        let zero = [all(by[0][0].simd, 0.0); NAV];
        for j in (0..size - 1).step_by(2) {
            let mut two = [zero; 2];
            for (k, (by, begin)) in by.iter().zip(&self.begins).enumerate().take(j + 1) {
                let at = begin + j - k;
                accumulate(&mut two, by, [self.cells[at], self.cells[at + 1]]);
            }
            let (one, other) = (self.begins[j] + 1, self.begins[j + 1]);
            let one = &self.cells[one..one + size - j - 1];
            let other = &self.cells[other..other + size - j - 1];
            for (by, (x, y)) in by[j + 1..].iter().zip(one.iter().zip(other)) {
                accumulate(&mut two, by, [*x, *y]);
            }
            [self.top[j], self.top[j + 1]] = two;
        }
        if size % 2 == 1 {
            let mut last = [zero];
            for (k, (by, begin)) in by.iter().zip(&self.begins).enumerate() {
                accumulate(&mut last, by, [self.cells[begin + size - 1 - k]]);
            }
            [self.top[size - 1]] = last;
        }
    }

    /// Measurements one after the other. The logarithm of their density is added to `score`.
    #[inline(always)]
    pub(super) fn update(&mut self, scalars: &[Scalar<S>], score: &mut Lane<S>) {
        let size = self.size;
        let zero = all(score.simd, 0.0);
        self.errors.fill(zero);
        let mut density = zero;
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
            let mut log = std::f64::consts::TAU * s;
            for l in 0..PLACES {
                log[l] = log[l].ln();
            }
            density -= 0.5 * (square + log);
            self.weights[m] = 1.0 / s;
        }
        *score += density;
        self.subtract(scalars.len());
    }

    /// `P - sum w c c'` over the first `count` measurements. All six of a whole fix are taken off
    /// in one pass over the cells.
    #[inline(always)]
    fn subtract(&mut self, count: usize) {
        let (size, w) = (self.size, &self.weights);
        for (j, begin) in self.begins.iter().enumerate() {
            let cells = &mut self.cells[*begin..*begin + size - j];
            if count == MOST {
                let column = |m: usize| &self.columns[m * size + j..(m + 1) * size];
                let columns = [
                    column(0),
                    column(1),
                    column(2),
                    column(3),
                    column(4),
                    column(5),
                ];
                let mut by = *w;
                for (by, column) in by.iter_mut().zip(&columns) {
                    *by = column[0] * *by;
                }
                for (k, cell) in cells.iter_mut().enumerate() {
                    let mut x = *cell;
                    for (column, by) in columns.iter().zip(&by) {
                        x -= column[k] * *by;
                    }
                    *cell = x;
                }
                continue;
            }
            for (column, w) in self.columns.chunks_exact(size).zip(w).take(count) {
                let by = column[j] * *w;
                for (cell, x) in cells.iter_mut().zip(&column[j..]) {
                    *cell -= *x * by;
                }
            }
        }
    }
}

/// Each sum and the column times its number.
#[inline(always)]
fn accumulate<S: Simd, const N: usize>(
    sums: &mut [Column<S>; N],
    column: &Column<S>,
    x: [Lane<S>; N],
) {
    for (r, c) in column.iter().enumerate() {
        for (sum, x) in sums.iter_mut().zip(&x) {
            sum[r] += *c * *x;
        }
    }
}
