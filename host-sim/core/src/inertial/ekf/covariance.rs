//! Covariance of navigation errors and parameters over an interval and at a fix. The transition is
//! `[Phi Psi; 0 D]` with a diagonal `D`, and the covariance is symmetric. So a fraction of the
//! dense products is enough. The widest vectors of the processor compute the same bits.

use super::dynamics::Interval;
use super::{ErrorModel, NAV};
use crate::inertial::vectors::widest;
use nalgebra::{DMatrix, DVector};

/// `P <- [Phi Psi; 0 D] P [Phi Psi; 0 D]' + Q`.
pub(super) fn propagate(p: &mut DMatrix<f64>, interval: &Interval, model: &ErrorModel) {
    widest!(_ => propagated(p, interval, model));
}

#[inline(always)]
fn propagated(p: &mut DMatrix<f64>, interval: &Interval, model: &ErrorModel) {
    let size = p.nrows();
    let phi = interval.phi.as_slice();
    let psi = interval.psi.as_slice();
    let time = interval.time;
    let keeps: Vec<f64> = model.parameters.iter().map(|q| q.keeps(time)).collect();
    let fading: Vec<usize> = (0..keeps.len()).filter(|i| keeps[*i] != 1.0).collect();
    let cells = p.as_mut_slice();
    // the first nine rows of Phi P
    let mut top: Vec<[f64; NAV]> = Vec::with_capacity(size);
    for column in cells.chunks_exact(size) {
        let sum = combine(phi, &column[..NAV], [0.0; NAV]);
        top.push(combine(psi, &column[NAV..], sum));
    }
    // navigation block: rows of (Phi P) times the transposed transition; its lower triangle counts
    let mut nav = interval.q;
    for (j, t) in top.iter().enumerate() {
        let by = if j < NAV {
            &phi[j * NAV..(j + 1) * NAV]
        } else {
            &psi[(j - NAV) * NAV..(j - NAV + 1) * NAV]
        };
        for (c, b) in by.iter().enumerate() {
            for (r, t) in t.iter().enumerate() {
                nav[(r, c)] += t * b;
            }
        }
    }
    for c in 0..NAV {
        for r in 0..NAV {
            cells[c * size + r] = nav[(r, c)];
        }
    }
    for c in 0..NAV {
        for r in 0..c {
            cells[c * size + r] = cells[r * size + c];
        }
    }
    for (j, keep) in keeps.iter().enumerate() {
        let column = &mut cells[(NAV + j) * size..(NAV + j + 1) * size];
        for (cell, t) in column.iter_mut().zip(top[NAV + j]) {
            *cell = t * keep;
        }
        if *keep == 1.0 {
            for i in &fading {
                column[NAV + i] *= keeps[*i];
            }
        } else {
            for (cell, other) in column[NAV..].iter_mut().zip(&keeps) {
                *cell *= keep * other;
            }
        }
        let q = &model.parameters[j];
        column[NAV + j] += q.walk * q.walk * time;
    }
    for j in NAV..size {
        for i in 0..NAV {
            cells[i * size + j] = cells[j * size + i];
        }
    }
}

/// `sum + M x` for a matrix of nine rows, stored by columns.
#[inline(always)]
fn combine(m: &[f64], x: &[f64], mut sum: [f64; NAV]) -> [f64; NAV] {
    for (column, x) in m.chunks_exact(NAV).zip(x) {
        for (s, m) in sum.iter_mut().zip(column) {
            *s += m * x;
        }
    }
    sum
}

/// Agreement of measurements with their prediction.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Evidence {
    /// Logarithm of their joint probability density.
    pub log_likelihood: f64,
    /// Normalised innovation squared: chi-square with as many degrees of freedom as there are
    /// scalars.
    pub nis: f64,
}

/// Applies scalar measurements in order, each given as index of the error state, measured value and
/// sigma. Gives the estimated error and how likely the measurements were.
pub(super) fn update(
    p: &mut DMatrix<f64>,
    scalars: &[(usize, f64, f64)],
) -> (DVector<f64>, Evidence) {
    widest!(_ => updated(p, scalars))
}

#[inline(always)]
fn updated(p: &mut DMatrix<f64>, scalars: &[(usize, f64, f64)]) -> (DVector<f64>, Evidence) {
    let size = p.nrows();
    let mut e = DVector::zeros(size);
    let mut found = Evidence::default();
    // the product of the variances of the innovations times 2 pi
    let mut variances = 1.0;
    // The column of the covariance at the time of each measurement, and 1 / variance of the
    // innovation. P itself is updated once, at the end.
    let mut columns: Vec<(Vec<f64>, f64)> = Vec::with_capacity(scalars.len());
    for &(i, z, sigma) in scalars {
        let mut column = p.as_slice()[i * size..(i + 1) * size].to_vec();
        for (earlier, weight) in &columns {
            let by = earlier[i] * weight;
            for (c, x) in column.iter_mut().zip(earlier) {
                *c -= x * by;
            }
        }
        let s = column[i] + sigma * sigma;
        let weight = 1.0 / s;
        let innovation = z - e[i];
        let gain = innovation * weight;
        for (e, c) in e.iter_mut().zip(&column) {
            *e += c * gain;
        }
        found.nis += innovation * gain;
        variances *= std::f64::consts::TAU * s;
        columns.push((column, weight));
    }
    found.log_likelihood = -0.5 * (found.nis + variances.ln());
    subtract(p, &columns);
    (e, found)
}

/// `P - sum w c c'`, three columns at a time. This reads the memory once instead of three times and
/// gives the same bits.
#[inline(always)]
fn subtract(p: &mut DMatrix<f64>, columns: &[(Vec<f64>, f64)]) {
    let size = p.nrows();
    let cells = p.as_mut_slice();
    for j in 0..size {
        let target = &mut cells[j * size + j..(j + 1) * size];
        for group in columns.chunks(3) {
            if let [(a, by_a), (b, by_b), (c, by_c)] = group {
                let (by_a, by_b, by_c) = (a[j] * by_a, b[j] * by_b, c[j] * by_c);
                let rows = a[j..].iter().zip(&b[j..]).zip(&c[j..]);
                for (cell, ((a, b), c)) in target.iter_mut().zip(rows) {
                    *cell = *cell - a * by_a - b * by_b - c * by_c;
                }
            } else {
                for (column, weight) in group {
                    let by = column[j] * weight;
                    for (cell, x) in target.iter_mut().zip(&column[j..]) {
                        *cell -= x * by;
                    }
                }
            }
        }
    }
    mirror(cells, size);
}

/// Copies the lower triangle to the upper one. It works in tiles, because neighbouring columns lie
/// in different cache lines.
#[inline(always)]
fn mirror(cells: &mut [f64], size: usize) {
    const TILE: usize = 8;
    for first in (0..size).step_by(TILE) {
        for second in (first..size).step_by(TILE) {
            for j in second..(second + TILE).min(size) {
                for i in first..(first + TILE).min(j) {
                    cells[j * size + i] = cells[i * size + j];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertial::ekf::{Parameter, Regressor, Triad};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn random(rows: usize, columns: usize, rng: &mut ChaCha8Rng) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |_, _| rng.random_range(-1.0..1.0))
    }

    fn near(a: &DMatrix<f64>, b: &DMatrix<f64>) {
        assert!((a - b).amax() < 1e-12 * b.amax(), "{}", (a - b).amax());
        assert_eq!(*a, a.transpose());
    }

    /// Compares the blocks with the dense products, with parameters that decay and that walk.
    #[test]
    fn blocks_are_the_dense_products() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let n = 7;
        let size = NAV + n;
        let root = random(size, size, &mut rng);
        let mut p = &root * root.transpose();
        let mut model = ErrorModel::default();
        for k in 0..n {
            model.parameters.push(Parameter {
                walk: 0.1 * k as f64,
                time_s: if k % 2 == 0 { f64::INFINITY } else { k as f64 },
                ..Parameter::constant(Triad::Gyro, 0, Regressor::One, 1.0)
            });
        }
        let mut interval = Interval::new(n);
        interval.time = 1.5;
        interval.phi.copy_from(&random(NAV, NAV, &mut rng));
        interval.psi.copy_from(&random(NAV, n, &mut rng));
        let noise = random(NAV, NAV, &mut rng);
        interval.q.copy_from(&(&noise * noise.transpose()));

        let mut dense = DMatrix::identity(size, size);
        dense.view_mut((0, 0), (NAV, NAV)).copy_from(&interval.phi);
        dense.view_mut((0, NAV), (NAV, n)).copy_from(&interval.psi);
        let mut q = DMatrix::zeros(size, size);
        q.view_mut((0, 0), (NAV, NAV)).copy_from(&interval.q);
        for (k, parameter) in model.parameters.iter().enumerate() {
            dense[(NAV + k, NAV + k)] = (-1.5 / parameter.time_s).exp();
            q[(NAV + k, NAV + k)] = parameter.walk * parameter.walk * 1.5;
        }
        let want = &dense * &p * dense.transpose() + q;
        propagate(&mut p, &interval, &model);
        near(&p, &want);
    }

    /// Compares measurements one after the other with all at once: the textbook gain, and the joint
    /// density.
    #[test]
    fn scalar_updates_are_the_joint_update() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let size = 14;
        let root = random(size, size, &mut rng);
        let mut p = &root * root.transpose();
        let scalars: [(usize, f64, f64); 4] =
            [(6, 0.4, 0.3), (3, -0.2, 0.1), (7, 1.0, 0.5), (13, 0.1, 0.2)];
        let m = scalars.len();
        let h = DMatrix::from_fn(m, size, |r, c| f64::from(u8::from(scalars[r].0 == c)));
        let z = DVector::from_fn(m, |r, _| scalars[r].1);
        let noise = DMatrix::from_fn(m, m, |r, c| if r == c { scalars[r].2.powi(2) } else { 0.0 });
        let s = &h * &p * h.transpose() + noise;
        let inverse = s.clone().try_inverse().unwrap();
        let gain = &p * h.transpose() * &inverse;
        let want = &p - &gain * &h * &p;
        let density = -0.5
            * ((z.transpose() * &inverse * &z)[0]
                + (s.determinant() * std::f64::consts::TAU.powi(m as i32)).ln());
        let (e, found) = update(&mut p, &scalars);
        near(&p, &want);
        assert!((e - gain * &z).amax() < 1e-12);
        assert!((found.log_likelihood - density).abs() < 1e-10);
        assert!((found.nis - (z.transpose() * &inverse * &z)[0]).abs() < 1e-10);
    }
}
