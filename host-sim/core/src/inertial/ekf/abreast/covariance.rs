//! Covariance of several filters side by side: [`super::super::covariance`] for parameters that do
//! not fade. Only the lower triangle is stored, column by column.

use super::super::transition::Column;
use super::super::{NAV, Triad};
use super::parts::Source;
use crate::inertial::lane::Lane;

/// Covariances, and the buffers of their updates.
pub(super) struct Covariance<L: Lane> {
    size: usize,
    /// The lower triangle by columns.
    cells: Vec<L>,
    /// Start index of each column.
    begins: Vec<usize>,
    /// The columns of `P` by which columns of `[Phi Psi]` are multiplied, in order.
    factors: Vec<L>,
    /// The first nine rows of `[Phi Psi] P`.
    top: Vec<Column<L>>,
    /// For each source the sum of the columns of `top` that belong to its parameters.
    sums: Vec<Column<L>>,
    /// The values of all measurements' columns, row by row.
    rows: Vec<[L; MOST]>,
    weights: [L; MOST],
    /// The estimated errors.
    pub(super) errors: Vec<L>,
}

/// `[Phi Psi]` by columns. Parameters that are slow act along the six axes of the two triads: their
/// columns of `Psi` are those of the axes times a number, so products with them need one column
/// for each axis.
pub(super) struct Transitions<L: Lane> {
    /// The columns of the nine navigation errors, then of each source.
    pub(super) columns: Vec<Column<L>>,
    /// The sources, each with a column of `Psi`.
    pub(super) sources: Vec<Source>,
    /// For each parameter, the factor of its source's column.
    pub(super) numbers: Vec<L>,
}

/// One measurement: error state, value, standard deviation.
pub(super) type Scalar<L> = (usize, L, f64);
/// Number of values of a fix.
pub(super) const MOST: usize = 6;

impl<L: Lane> Covariance<L> {
    /// `cell(l, i, j)` is a cell of filter `l`.
    #[inline(always)]
    pub(super) fn of(
        kind: L::Kind,
        (size, sources): (usize, usize),
        cell: impl Fn(usize, usize, usize) -> f64,
    ) -> Self {
        let mut cells = Vec::with_capacity(size * (size + 1) / 2);
        let mut begins = Vec::with_capacity(size);
        for j in 0..size {
            begins.push(cells.len());
            for i in j..size {
                cells.push(L::of(kind, |l| cell(l, i, j)));
            }
        }
        let zero = L::all(kind, 0.0);
        Self {
            size,
            cells,
            begins,
            factors: vec![zero; (NAV + sources) * size],
            top: vec![[zero; NAV]; size],
            sums: vec![[zero; NAV]; sources],
            rows: vec![[zero; MOST]; size],
            weights: [zero; MOST],
            errors: vec![zero; size],
        }
    }

    /// The cell of filter `l`.
    pub(super) fn cell(&self, l: usize, i: usize, j: usize) -> f64 {
        let (i, j) = (i.max(j), i.min(j));
        self.cells[self.begins[j] + i - j].at(l)
    }

    /// `P <- [Phi Psi; 0 I] P [Phi Psi; 0 I]' + Q`. `by`: `[Phi Psi]`; `walks`: the variance that
    /// each parameter walks in a second, for `time` seconds.
    #[inline(always)]
    pub(super) fn propagate(
        &mut self,
        by: &Transitions<L>,
        q: &[Column<L>; NAV],
        walks: &[L],
        time: f64,
    ) {
        self.find_factors(by);
        self.transform(by);
        self.find_sums(by);
        // the lower triangle of the navigation block, two columns at a time
        let mut nav = *q;
        self.block::<2, 0>(&mut nav, by);
        self.block::<2, 2>(&mut nav, by);
        self.block::<2, 4>(&mut nav, by);
        self.block::<2, 6>(&mut nav, by);
        self.block::<1, 8>(&mut nav, by);
        let size = self.size;
        for (c, column) in nav.iter().enumerate() {
            let begin = self.begins[c];
            self.cells[begin..begin + NAV - c].copy_from_slice(&column[c..]);
            let below = &mut self.cells[begin + NAV - c..begin + size - c];
            for (cell, top) in below.iter_mut().zip(&self.top[NAV..]) {
                *cell = top[c];
            }
        }
        for (walk, begin) in walks.iter().zip(&self.begins[NAV..]) {
            self.cells[*begin] += *walk * time;
        }
    }

    #[inline(always)]
    fn find_factors(&mut self, by: &Transitions<L>) {
        for k in 0..NAV {
            self.factor::<false>(k, k, L::all(by.columns[0][0].kind(), 1.0));
        }
        for (index, source) in by.sources.iter().enumerate() {
            for (n, &k) in source.parameters.iter().enumerate() {
                match n {
                    0 => self.factor::<false>(NAV + index, NAV + k, by.numbers[k]),
                    _ => self.factor::<true>(NAV + index, NAV + k, by.numbers[k]),
                }
            }
        }
    }

    /// Writes a column of `P` times a number to the factor at `index`, or adds it to that factor.
    #[inline(always)]
    fn factor<const ADD: bool>(&mut self, index: usize, column: usize, number: L) {
        let to = &mut self.factors[index * self.size..][..self.size];
        let (left, below) = to.split_at_mut(column);
        for ((j, to), begin) in left.iter_mut().enumerate().zip(&self.begins) {
            let x = number * self.cells[*begin + column - j];
            *to = if ADD { *to + x } else { x };
        }
        for (to, cell) in below.iter_mut().zip(&self.cells[self.begins[column]..]) {
            let x = number * *cell;
            *to = if ADD { *to + x } else { x };
        }
    }

    /// The first nine rows of `[Phi Psi] P`, two columns at a time, so that a column of `[Phi Psi]`
    /// is read once for both. Accelerometers do not turn the attitude: three rows of their columns
    /// are zero.
    #[inline(always)]
    fn transform(&mut self, by: &Transitions<L>) {
        let size = self.size;
        let zero = L::all(by.columns[0][0].kind(), 0.0);
        let (navigation, sources) = by.columns.split_at(NAV);
        for j in (0..size).step_by(2) {
            let other = (j + 1).min(size - 1);
            let mut two = [[zero; NAV]; 2];
            let mut factors = self.factors.chunks_exact(size);
            for (column, x) in navigation.iter().zip(&mut factors) {
                accumulate::<L, 2, 0>(&mut two, column, [x[j], x[other]]);
            }
            for ((column, source), x) in sources.iter().zip(&by.sources).zip(factors) {
                match source.triad {
                    Triad::Gyro => accumulate::<L, 2, 0>(&mut two, column, [x[j], x[other]]),
                    Triad::Accel => accumulate::<L, 2, 3>(&mut two, column, [x[j], x[other]]),
                }
            }
            self.top[j] = two[0];
            self.top[other] = two[1];
        }
    }

    #[inline(always)]
    fn find_sums(&mut self, by: &Transitions<L>) {
        let zero = L::all(by.columns[0][0].kind(), 0.0);
        for (sum, source) in self.sums.iter_mut().zip(&by.sources) {
            let mut one = [[zero; NAV]];
            for &k in &source.parameters {
                accumulate::<L, 1, 0>(&mut one, &self.top[NAV + k], [by.numbers[k]]);
            }
            *sum = one[0];
        }
    }

    /// Columns `C` to `C + N` of the navigation block, from row `C` on.
    #[inline(always)]
    fn block<const N: usize, const C: usize>(
        &self,
        nav: &mut [Column<L>; NAV],
        by: &Transitions<L>,
    ) {
        let mut sums = [nav[C]; N];
        let mut factors = [nav[C][C]; N];
        for (i, sum) in sums.iter_mut().enumerate() {
            *sum = nav[C + i];
        }
        let (navigation, sources) = by.columns.split_at(NAV);
        for (top, by) in self.top.iter().zip(navigation) {
            factors.copy_from_slice(&by[C..C + N]);
            accumulate::<L, N, C>(&mut sums, top, factors);
        }
        for ((sum, by), source) in self.sums.iter().zip(sources).zip(&by.sources) {
            if C + N <= 3 && source.triad == Triad::Accel {
                continue;
            }
            factors.copy_from_slice(&by[C..C + N]);
            accumulate::<L, N, C>(&mut sums, sum, factors);
        }
        nav[C..C + N].copy_from_slice(&sums);
    }

    /// Applies measurements in order, at most [`MOST`]. The logarithm of their density is added to
    /// `score`.
    #[inline(always)]
    pub(super) fn update(&mut self, scalars: &[Scalar<L>], score: &mut L) {
        let zero = L::all(score.kind(), 0.0);
        self.errors.fill(zero);
        self.weights = [zero; MOST];
        let one = L::all(zero.kind(), 1.0);
        let (mut squares, mut variances) = (zero, one);
        for (m, &(i, z, sigma)) in scalars.iter().enumerate() {
            self.measured(m, i);
            let s = self.rows[i][m] + sigma * sigma;
            let weight = one / s;
            let innovation = z - self.errors[i];
            let gain = innovation * weight;
            for (e, row) in self.errors.iter_mut().zip(&self.rows) {
                *e += row[m] * gain;
            }
            squares += innovation * gain;
            variances *= s * std::f64::consts::TAU;
            self.weights[m] = weight;
        }
        let mut log = variances;
        for l in 0..L::PLACES {
            log.put(l, log.at(l).ln());
        }
        *score += (squares + log) * -0.5;
        self.subtract();
    }

    /// The column of measurement `m`, of state `i`, after the measurements before it.
    #[inline(always)]
    fn measured(&mut self, m: usize, i: usize) {
        let mut by = self.rows[i];
        for (by, weight) in by.iter_mut().zip(&self.weights) {
            *by *= *weight;
        }
        for (k, row) in self.rows.iter_mut().enumerate() {
            let (low, high) = (k.min(i), k.max(i));
            let mut x = self.cells[self.begins[low] + high - low];
            for (earlier, by) in row[..m].iter().zip(&by) {
                x -= *earlier * *by;
            }
            row[m] = x;
        }
    }

    /// `P - sum w c c'` over all measurements, in one pass over the cells. A missing measurement
    /// has no weight.
    #[inline(always)]
    fn subtract(&mut self) {
        for (j, begin) in self.begins.iter().enumerate() {
            let rows = &self.rows[j..];
            let mut by = rows[0];
            for (by, weight) in by.iter_mut().zip(&self.weights) {
                *by *= *weight;
            }
            for (cell, row) in self.cells[*begin..].iter_mut().zip(rows) {
                let mut x = *cell;
                for (value, by) in row.iter().zip(&by) {
                    x -= *value * *by;
                }
                *cell = x;
            }
        }
    }
}

/// Each sum and the column times its number, from row `FROM` on.
#[inline(always)]
fn accumulate<L: Lane, const N: usize, const FROM: usize>(
    sums: &mut [Column<L>; N],
    column: &Column<L>,
    x: [L; N],
) {
    for (r, c) in column.iter().enumerate().skip(FROM) {
        for (sum, x) in sums.iter_mut().zip(&x) {
            sum[r] += *c * *x;
        }
    }
}
