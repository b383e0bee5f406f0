//! The filter against the textbook's: all errors in one vector with one dense covariance, P+ = F P
//! F' + Q and P - P H' H P / s.

use super::*;
use crate::{Normalisation, Weights};
use std::vec::Vec;

/// Errors of the navigator: not a multiple of the three that are computed together.
const X: usize = 8;
const STEP: f64 = 0.7;
const ERROR_FLOOR: [f64; X] = [0.0, 0.4, 0.0, 0.0, 0.3, 0.0, 0.0, 0.35];
const PARAMETER_FLOOR: f64 = 0.8;

type Filter<L, const N: usize, const PACKED: usize> = Kalman<L, X, N, PACKED, Rational, f64>;

/// Repeatable numbers between -1 and 1.
struct Numbers(u32);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0 >> 8) / 8_388_608.0 - 1.0
    }
    fn row<const M: usize>(&mut self) -> [f64; M] {
        core::array::from_fn(|_| self.next())
    }
    fn rows<const M: usize, const K: usize>(&mut self) -> [[f64; M]; K] {
        core::array::from_fn(|_| self.row())
    }
    /// A matrix near the unit matrix.
    fn phi(&mut self) -> [[f64; X]; X] {
        core::array::from_fn(|i| {
            core::array::from_fn(|j| 0.3 * self.next() + f64::from(u8::from(i == j)))
        })
    }
    /// A positive matrix: A A'.
    fn positive(&mut self) -> [[f64; X]; X] {
        let a: [[f64; X]; X] = self.rows();
        core::array::from_fn(|i| core::array::from_fn(|j| row::dot(&a[i], &a[j])))
    }
    fn block(&mut self) -> Transition<X, f64> {
        Transition {
            phi: self.phi(),
            gamma: self.rows(),
            proportional: self.rows(),
            q: self.positive(),
            time: STEP,
        }
    }
    fn correction(&mut self) -> Correction<f64> {
        Correction {
            estimate: self.row(),
            maps: [self.rows(), self.rows()],
        }
    }
}

type Matrix = Vec<Vec<f64>>;

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let column = |j: usize| b.iter().map(move |row| row[j]);
    let of = |row: &Vec<f64>, j| row.iter().zip(column(j)).map(|(a, b)| a * b).sum();
    let columns = b.first().map_or(0, Vec::len);
    a.iter()
        .map(|row| (0..columns).map(|j| of(row, j)).collect())
        .collect()
}

fn transposed(a: &Matrix) -> Matrix {
    (0..a[0].len())
        .map(|j| a.iter().map(|row| row[j]).collect())
        .collect()
}

/// The same filter in the textbook's form.
struct Textbook {
    x: Vec<f64>,
    p: Matrix,
    log_likelihood: f64,
}

impl Textbook {
    fn new<const N: usize>(prior: &Prior<X, N, f64>) -> Self {
        let sigma: Vec<_> = (prior.error_sigma.into_iter())
            .chain(prior.parameter_sigma)
            .collect();
        let of = |i: usize| (0..X + N).map(move |j| f64::from(u8::from(i == j)));
        Self {
            x: std::vec![0.0; X],
            p: (0..X + N)
                .map(|i| of(i).map(|one| one * sigma[i] * sigma[i]).collect())
                .collect(),
            log_likelihood: 0.0,
        }
    }

    /// The errors that an alignment leaves are `by` times what is left of the sensors', and `rest`.
    fn align(&mut self, j: &Matrix, by: &[[f64; OUTPUTS]; X], rest: &[[f64; X]; X]) {
        let tt: Matrix = self.p[X..].iter().map(|row| row[X..].to_vec()).collect();
        let by: Matrix = by.iter().map(|row| row.to_vec()).collect();
        let of_theta = product(&by, &product(j, &tt));
        let by = product(&by, j);
        for i in 0..X {
            for k in 0..X {
                self.p[i][k] = row::dot(&of_theta[i], &by[k]) + rest[i][k];
            }
            for n in X..self.p.len() {
                (self.p[i][n], self.p[n][i]) = (-of_theta[i][n - X], -of_theta[i][n - X]);
            }
        }
    }

    /// F = [Phi, Gamma J; 0, 1], with the noise of the sensors and the walk of the biases.
    fn propagate(&mut self, block: &Transition<X, f64>, effect: &Matrix, walk: &[f64]) {
        let all = self.p.len();
        let f: Matrix = (0..all)
            .map(|i| match i {
                0..X => block.phi[i].iter().chain(&effect[i]).copied().collect(),
                _ => (0..all).map(|k| f64::from(u8::from(i == k))).collect(),
            })
            .collect();
        self.p = product(&product(&f, &self.p), &transposed(&f));
        for i in 0..X {
            for k in 0..X {
                self.p[i][k] += block.q[i][k];
            }
        }
        for (n, walk) in walk.iter().enumerate() {
            self.p[X + n][X + n] += walk;
        }
    }

    /// Gives the gain of an observation of error `i` and takes it into account.
    fn update(&mut self, i: usize, value: f64, variance: f64, cap: f64) -> Vec<f64> {
        let (column, s) = (self.p[i].clone(), self.p[i][i] + variance);
        let gain: Vec<f64> = column.iter().map(|p| p / s).collect();
        for (row, gain) in self.p.iter_mut().zip(&gain) {
            (row.iter_mut().zip(&column)).for_each(|(p, c)| *p -= gain * c);
        }
        (self.x.iter_mut().zip(&gain)).for_each(|(x, gain)| *x += gain * value);
        let density = (value * value / s).min(cap) + (core::f64::consts::TAU * s).ln();
        self.log_likelihood -= 0.5 * density;
        gain
    }
}

fn near(a: f64, b: f64, what: &str) {
    assert!(
        (a - b).abs() < 1e-9 * (1.0 + b.abs()),
        "{what}: {a}, not {b}"
    );
}

fn same<L: ParameterSet, const N: usize, const PACKED: usize>(
    filter: &Filter<L, N, PACKED>,
    book: &Textbook,
    what: &str,
) {
    let covariance = filter.covariance();
    for i in 0..X {
        near(filter.error_state()[i], book.x[i], what);
        for k in 0..X {
            near(covariance.errors()[i][k], book.p[i][k], what);
        }
        for n in 0..N {
            near(covariance.cross()[i][n], book.p[i][X + n], what);
        }
    }
    for (n, variance) in covariance.variances().enumerate() {
        near(variance, book.p[X + n][X + n], what);
    }
    near(filter.log_likelihood(), book.log_likelihood, what);
}

/// J, dense.
fn jacobian<L: ParameterSet, const N: usize, const PACKED: usize>(
    filter: &Filter<L, N, PACKED>,
) -> Matrix {
    let mut rows = std::vec![std::vec![0.0; N]; OUTPUTS];
    for (triad, of) in filter.model().jacobian().iter().enumerate() {
        for (n, values) in of.values.iter().enumerate() {
            for (k, value) in values.iter().enumerate() {
                rows[NEURONS * triad + k][of.start + n] = *value;
            }
        }
    }
    rows
}

fn nets(numbers: &mut Numbers) -> [Net<Rational, Identity, Full, f64>; TRIADS] {
    core::array::from_fn(|_| {
        let mut scales = Normalisation::identity();
        scales.output_scale = numbers.row::<3>().map(|value| 2.0 + value);
        Net::new(Weights::from_fn(|_| 0.4 * numbers.next()), scales)
    })
}

fn prior<const N: usize>(numbers: &mut Numbers) -> Prior<X, N, f64> {
    Prior {
        error_sigma: numbers.row().map(|value| 0.5 + 0.2 * value),
        parameter_sigma: numbers.row().map(|value| 0.7 + 0.3 * value),
        walk: numbers.row().map(|value| 0.2 + 0.1 * value),
        error_floor: ERROR_FLOOR,
        parameter_floor: PARAMETER_FLOOR,
    }
}

/// Effects of all parameters on the navigator's errors: by the estimate, and of a map's elements by
/// what is felt beyond the input at rest.
fn effect<L: ParameterSet, const N: usize>(j: &Matrix, block: &Transition<X, f64>) -> Matrix {
    let gamma: Matrix = block.gamma.iter().map(|row| row.to_vec()).collect();
    let mut effect = product(&gamma, j);
    for (row, by) in effect.iter_mut().zip(&block.proportional) {
        for k in 0..TRIADS {
            for element in 0..L::MAP {
                row[k * N / TRIADS + NEURONS + element] += by[9 * k + element];
            }
        }
    }
    effect
}

/// One block, some observations and the floors, in both.
fn one_block<L: ParameterSet, const N: usize, const PACKED: usize>(
    filter: &mut Filter<L, N, PACKED>,
    book: &mut Textbook,
    numbers: &mut Numbers,
) {
    let (block, applied) = (numbers.block(), numbers.correction());
    let (j, e) = (jacobian(filter), *filter.model().estimate());
    let mut x = book.x.clone();
    for (i, x) in x.iter_mut().enumerate() {
        let own = *filter.model().maps();
        let maps =
            (applied.maps.as_flattened().iter().flatten()).zip(own.as_flattened().iter().flatten());
        let by_maps = (maps.zip(block.proportional[i])).map(|((a, own), by)| by * (a - own));
        let by_rest = (0..OUTPUTS).map(|k| block.gamma[i][k] * (applied.estimate[k] - e[k]));
        *x = row::dot(&block.phi[i], &book.x) + by_maps.sum::<f64>() + by_rest.sum::<f64>();
    }
    book.x = x;
    let mut walk = [0.0; N];
    for (output, sigma) in filter.prior.walk.iter().enumerate() {
        if L::BIASES {
            walk[output / 3 * (N / TRIADS) + output % 3] = sigma * sigma * STEP;
        }
    }
    book.propagate(&block, &effect::<L, N>(&j, &block), &walk);
    filter.propagate(&block, &applied);
    same(filter, book, "a block");

    for (i, z) in [0, 3, 7, 4, 1].into_iter().zip(numbers.row::<5>()) {
        let (variance, cap) = (0.3 + 0.2 * z, 0.4);
        let before = *filter.model().estimate();
        let innovation = filter.innovation(i, z, variance);
        let (of_x, of_e) = filter.gains(i, variance);
        near(innovation.value, z - book.x[i], "innovation");
        let gain = book.update(i, innovation.value, variance, cap);
        filter.score(innovation, cap);
        filter.update(i, innovation);
        (of_x.iter().zip(&gain)).for_each(|(own, gain)| near(*own, *gain, "gain"));
        for (k, row) in j.iter().enumerate() {
            let gain = row::dot(row, &gain[X..]);
            near(of_e[k], gain, "gain of an output");
            let moved = filter.model().estimate()[k] - before[k];
            near(moved, -gain * innovation.value, "estimate");
        }
        same(filter, book, "an observation");
    }
    filter.finish_update();
    let floors = filter.prior.parameter_sigma.map(|s| PARAMETER_FLOOR * s);
    for (i, floor) in ERROR_FLOOR.into_iter().chain(floors).enumerate() {
        book.p[i][i] = book.p[i][i].max(floor * floor);
    }
    same(filter, book, "the floors");
}

/// A drive in both: an alignment, blocks, feedback, doubt, a new alignment.
fn drive<L: ParameterSet, const N: usize, const PACKED: usize>(seed: u32) {
    let numbers = &mut Numbers(seed);
    let prior = prior(numbers);
    let mut filter = Filter::<L, N, PACKED>::ZEROED;
    filter.init(&nets(numbers), &prior);
    let mut book = Textbook::new(&prior);
    same(&filter, &book, "the prior");
    filter.set_rest([numbers.row(), numbers.row()]);
    for round in 0..2 {
        filter.step([numbers.row(), numbers.row()]);
        let (by, applied) = (numbers.rows(), numbers.row::<OUTPUTS>());
        let rest = numbers.positive();
        for (i, by) in by.iter().enumerate() {
            let left = (0..OUTPUTS).map(|k| by[k] * (filter.model().estimate()[k] - applied[k]));
            book.x[i] = left.sum();
        }
        book.align(&jacobian(&filter), &by, &rest);
        filter.align(&by, &rest, &applied);
        same(&filter, &book, "an alignment");
        for _ in 0..2 {
            filter.step([numbers.row(), numbers.row()]);
            one_block(&mut filter, &mut book, numbers);
            let fed = numbers.row();
            filter.feedback(&fed);
            (book.x.iter_mut().zip(fed)).for_each(|(x, fed)| *x -= fed);
            let doubt = numbers.row().map(f64::abs);
            filter.inflate(&doubt);
            (0..X).for_each(|i| book.p[i][i] += doubt[i]);
            same(&filter, &book, "feedback and doubt");
        }
        filter.believe(f64::from(round) - 3.0);
        book.log_likelihood += f64::from(round) - 3.0;
        outlook(&filter, &book);
    }
    filter.reset_errors(&[0.5; X]);
    assert_eq!(filter.error_state(), &[0.0; X]);
    for i in 0..X {
        for k in 0..X {
            let variance = if i == k { 0.25 } else { 0.0 };
            assert_eq!(filter.covariance().errors()[i][k], variance);
        }
        assert_eq!(filter.covariance().cross()[i], [0.0; N]);
    }
    assert!(filter.is_healthy());
}

/// What is said of the biases: their second moments, and the variance of their sum.
fn outlook<L: ParameterSet, const N: usize, const PACKED: usize>(
    filter: &Filter<L, N, PACKED>,
    book: &Textbook,
) {
    for output in 0..OUTPUTS {
        let bias = output / 3 * (N / TRIADS) + output % 3;
        let mut sum = std::vec![0.0; N];
        let mut moment = 0.0;
        if L::BIASES {
            sum[bias] = 1.0;
            let mean = filter.model().biases()[output / 3][output % 3];
            moment = mean * mean + book.p[X + bias][X + bias];
            if let Some(at) = L::OUTPUT_BIAS {
                let net = filter.model().unit_nets()[output / 3];
                let scale = net.normalisation.output_scale[output % 3];
                sum[bias + NEURONS + at] = scale;
            }
        }
        let of = |i: usize| row::dot(&book.p[X + i][X..], &sum);
        let variance: f64 = (0..N).map(|i| sum[i] * of(i)).sum();
        near(
            filter.bias_sigma()[output],
            variance.sqrt(),
            "sum of biases",
        );
        near(filter.turn_on_moments()[output], moment, "second moment");
    }
}

#[test]
fn every_set_is_the_textbook_filter() {
    drive::<NoParameters, 0, 0>(1);
    drive::<FixedWeights, 0, 0>(2);
    drive::<Biases, 6, 21>(3);
    drive::<UnitBiases, 12, 78>(4);
    drive::<OutputWeights, 24, 300>(5);
    drive::<UnitMap, 30, 465>(6);
    drive::<UnitOutput, 30, 465>(7);
    drive::<DiagonalWeights, 96, 4656>(8);
}

mod model;
