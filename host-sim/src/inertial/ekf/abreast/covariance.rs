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

/// `[Phi Psi]` by columns. Parameters that are slow act along the six axes of the two triads: their
/// columns of `Psi` are those of the axes times a number, so products with them need one column
/// for each axis.
pub(super) struct Transitions<S: Simd> {
    pub(super) phi: [Column<S>; NAV],
    /// Of a bias along each axis: gyros, then accelerometers.
    pub(super) axes: [Column<S>; AXES],
    /// Of each parameter that is not slow; unused for the others.
    pub(super) own: Vec<Column<S>>,
    /// Of each slow parameter: its number in place of a column.
    pub(super) numbers: Vec<Lane<S>>,
    /// The slow parameters of each axis.
    pub(super) slow: [Vec<usize>; AXES],
    /// The others.
    pub(super) others: Vec<usize>,
}

/// Axes of the two triads.
pub(super) const AXES: usize = 6;

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

    /// `P <- [Phi Psi; 0 I] P [Phi Psi; 0 I]' + Q`. `by`: `[Phi Psi]`; `walks`: the variance that
    /// each parameter walks in a second, for `time` seconds.
    #[inline(always)]
    pub(super) fn propagate(
        &mut self,
        by: &Transitions<S>,
        q: &[Column<S>; NAV],
        walks: &[Lane<S>],
        time: f64,
    ) {
        self.transform(by);
        let size = self.size;
        let zero = [all(q[0][0].simd, 0.0); NAV];
        // what the slow parameters of each axis add to the first nine rows of [Phi Psi] P
        let mut along = [zero; AXES];
        for (along, slow) in along.iter_mut().zip(&by.slow) {
            let mut sum = [*along];
            for &k in slow {
                accumulate(&mut sum, &self.top[NAV + k], [by.numbers[k]]);
            }
            [*along] = sum;
        }
        let mut nav = *q;
        for c in (0..NAV).step_by(2) {
            // nine columns two at a time: the last one is alone, and beside itself
            let other = (c + 1).min(NAV - 1);
            let mut two = [nav[c], nav[other]];
            for (top, by) in self.top.iter().zip(&by.phi) {
                accumulate(&mut two, top, [by[c], by[other]]);
            }
            for (along, by) in along.iter().zip(&by.axes) {
                accumulate(&mut two, along, [by[c], by[other]]);
            }
            for &k in &by.others {
                let own = &by.own[k];
                accumulate(&mut two, &self.top[NAV + k], [own[c], own[other]]);
            }
            nav[c] = two[0];
            nav[other] = two[1];
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
        for (walk, begin) in walks.iter().zip(&self.begins[NAV..]) {
            self.cells[*begin] += *walk * time;
        }
    }

    /// The first nine rows of `[Phi Psi] P`, two columns at a time, so that a column of `[Phi Psi]`
    /// is read once for both.
    #[inline(always)]
    fn transform(&mut self, by: &Transitions<S>) {
        let size = self.size;
        let zero = all(by.phi[0][0].simd, 0.0);
        for j in (0..size).step_by(2) {
            let other = (j + 1).min(size - 1);
            let mut two = [[zero; NAV]; 2];
            for (k, by) in by.phi.iter().enumerate() {
                accumulate(&mut two, by, [self.get(j, k), self.get(other, k)]);
            }
            for (slow, by_axis) in by.slow.iter().zip(&by.axes) {
                let mut along = [zero; 2];
                for &k in slow {
                    along[0] += by.numbers[k] * self.get(j, NAV + k);
                    along[1] += by.numbers[k] * self.get(other, NAV + k);
                }
                accumulate(&mut two, by_axis, along);
            }
            for &k in &by.others {
                let x = [self.get(j, NAV + k), self.get(other, NAV + k)];
                accumulate(&mut two, &by.own[k], x);
            }
            self.top[j] = two[0];
            self.top[other] = two[1];
        }
    }

    /// A cell of all.
    #[inline(always)]
    fn get(&self, i: usize, j: usize) -> Lane<S> {
        let (i, j) = if i < j { (j, i) } else { (i, j) };
        self.cells[self.begins[j] + i - j]
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
