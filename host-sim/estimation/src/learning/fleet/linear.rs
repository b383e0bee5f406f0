//! The parameters of a unit: the output layer on given features, in closed form.
//!
//! The error of an axis in units of the output scale is, at the time k of the drive d of a unit,
//!
//! ```text
//! e = w' y + b + t_d + noise of the variance 1 / q          w_j ~ N(m_j, s_j^2), t_d ~ N(0, T)
//! ```
//!
//! For given features y this is linear (variable projection: Golub and Pereyra, SIAM J. Numer.
//! Anal. 10, 1973). `t_d` is eliminated drive by drive. The moments m, s and T are those of the
//! fleet. They are found by expectation maximisation (Dempster, Laird and Rubin 1977): the mean
//! square of the units' estimates plus their covariances.

use super::hidden_layers::Three;
use nalgebra::{Matrix4, Vector4};

/// A standard deviation never falls below this, in units of the output scale.
const LEAST: f64 = 1e-4;

/// One axis at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Second since power-on.
    pub second: usize,
    /// Error, in units of the output scale.
    pub error: f64,
    /// Weight: one over its variance.
    pub weight: f64,
}

/// Sums over one drive of one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sums {
    square: Matrix4<f64>,
    cross: Vector4<f64>,
    /// Sum of the errors' squares.
    errors: f64,
}

impl Sums {
    /// The sums over the points of a drive, with the features of each second.
    pub fn of(points: &[Point], features: &[Three]) -> Self {
        let mut out = Self {
            square: Matrix4::zeros(),
            cross: Vector4::zeros(),
            errors: 0.0,
        };
        for p in points {
            let phi = regressors(features, p.second);
            out.square += phi * phi.transpose() * p.weight;
            out.cross += phi * (p.weight * p.error);
            out.errors += p.weight * p.error * p.error;
        }
        out
    }

    /// Sum of the squares of the residuals with these constants.
    pub fn left(&self, constants: &Vector4<f64>) -> f64 {
        let explained =
            2.0 * constants.dot(&self.cross) - constants.dot(&(self.square * constants));
        (self.errors - explained).max(0.0)
    }

    /// Sum of the squares of the errors.
    pub fn errors(&self) -> f64 {
        self.errors
    }
}

/// The features of a second, and 1 for the bias.
pub fn regressors(features: &[Three], second: usize) -> Vector4<f64> {
    let [a, b, c] = features.get(second).copied().unwrap_or_default();
    Vector4::new(a, b, c, 1.0)
}

/// Mean and variances over the units of a type, in units of the output scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moments {
    /// Means of each axis: three weights and a bias.
    pub mean: [Vector4<f64>; 3],
    /// Standard deviations of the columns and of the bias.
    pub sigma: Vector4<f64>,
    /// Standard deviation of the change at a turn-on.
    pub turn_on: f64,
}

impl Moments {
    /// Wide moments: each feature may contribute as much as a bias.
    pub fn wide(features: &[Vec<Three>]) -> Self {
        let mut squares = [0.0; 3];
        let mut count = 0.0;
        for feature in features.iter().flatten() {
            count += 1.0;
            squares
                .iter_mut()
                .zip(feature)
                .for_each(|(s, x)| *s += x * x);
        }
        let [a, b, c] = squares.map(|s: f64| 1.0 / (s / f64::max(count, 1.0)).sqrt().max(1e-3));
        Self {
            mean: [Vector4::zeros(); 3],
            sigma: Vector4::new(a, b, c, 1.0),
            turn_on: 0.3,
        }
    }
}

/// The estimated constants of one axis of one unit.
#[derive(Debug, Clone)]
pub struct Constants {
    /// Estimate.
    pub mean: Vector4<f64>,
    /// Covariance of the estimate.
    pub covariance: Matrix4<f64>,
    /// The turn-on bias of each drive, and its mean square.
    pub turn_ons: Vec<(f64, f64)>,
}

/// The constants of an axis from its drives.
pub fn solve(drives: &[Sums], moments: &Moments, axis: usize) -> Constants {
    let prior = moments.sigma.map(|s| 1.0 / (s * s));
    let mean = moments.mean[axis];
    let turn_on = 1.0 / (moments.turn_on * moments.turn_on);
    let mut square = Matrix4::from_diagonal(&prior);
    let mut cross = prior.component_mul(&mean);
    for d in drives {
        // t takes the same column as the bias
        let column = d.square.column(3).into_owned();
        let known = column[3] + turn_on;
        square += d.square - column * column.transpose() / known;
        cross += d.cross - column * (d.cross[3] / known);
    }
    // the prior makes the matrix positive definite
    let covariance = square.try_inverse().unwrap_or_default();
    let x = covariance * cross;
    let turn_ons = drives.iter().map(|d| {
        let column = d.square.column(3).into_owned();
        let known = column[3] + turn_on;
        let t = (d.cross[3] - column.dot(&x)) / known;
        let by_constants = column.dot(&(covariance * column)) / (known * known);
        (t, t * t + 1.0 / known + by_constants)
    });
    Constants {
        mean: x,
        covariance,
        turn_ons: turn_ons.collect(),
    }
}

/// The next moments, from the estimates of all units. `units` has three axes of each.
pub fn renewed(units: &[[Constants; 3]]) -> Moments {
    let count = units.len().max(1) as f64;
    let mean = [0, 1, 2].map(|axis| {
        let all = units.iter().map(|unit| unit[axis].mean);
        let mean = all.clone().sum::<Vector4<f64>>() / count;
        let squares = all.map(|x| (x - mean).map(|d| d * d));
        let spread: Vector4<f64> = squares.sum::<Vector4<f64>>() / count;
        // the mean of few units is shrunk by its own variance
        mean.zip_map(&spread, |m, s| shrunk(m, s / count))
    });
    let mut squares = Vector4::zeros();
    let (mut turn_ons, mut drives) = (0.0, 0.0);
    for unit in units {
        for (constants, mean) in unit.iter().zip(&mean) {
            let off = constants.mean - mean;
            squares += off.map(|d| d * d) + constants.covariance.diagonal();
            for (_, square) in &constants.turn_ons {
                turn_ons += square;
                drives += 1.0;
            }
        }
    }
    Moments {
        mean,
        sigma: squares.map(|s| (s / (3.0 * count)).sqrt().max(LEAST)),
        turn_on: f64::sqrt(turn_ons / f64::max(drives, 1.0)).max(LEAST),
    }
}

/// A mean with this `variance`, shrunk towards zero (James and Stein).
fn shrunk(mean: f64, variance: f64) -> f64 {
    match mean * mean > variance {
        true => mean * (1.0 - variance / (mean * mean)),
        false => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    fn points(n: usize, of: impl Fn(usize) -> f64) -> Vec<Point> {
        let point = |second| Point {
            second,
            error: of(second),
            weight: 4.0 + (second % 3) as f64,
        };
        (0..n).map(point).collect()
    }

    fn features(n: usize, phase: f64) -> Vec<Three> {
        let of = |k: usize| {
            let x = k as f64 * 0.1 + phase;
            [x.sin(), (0.3 * x).cos(), 0.02 * x]
        };
        (0..n).map(of).collect()
    }

    /// The result equals that of one dense least-squares problem with a row for each prior.
    #[test]
    fn the_closed_form_is_that_of_the_dense_problem() {
        let moments = Moments {
            mean: [Vector4::new(0.3, -0.1, 0.2, 0.5); 3],
            sigma: Vector4::new(0.7, 0.4, 1.1, 0.9),
            turn_on: 0.25,
        };
        let drives: Vec<(Vec<Point>, Vec<Three>)> = [0.0, 1.3, 4.0]
            .map(|phase| {
                let error = move |k: usize| 0.4 * (k as f64 * 0.05 + phase).sin() + 0.1 * phase;
                (points(60, error), features(60, phase))
            })
            .to_vec();
        let sums: Vec<Sums> = drives.iter().map(|(p, f)| Sums::of(p, f)).collect();
        let got = solve(&sums, &moments, 1);
        let size = 4 + drives.len();
        let (mut square, mut cross) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for (number, (points, features)) in drives.iter().enumerate() {
            for p in points {
                let mut row = DVector::zeros(size);
                row.rows_mut(0, 4)
                    .copy_from(&regressors(features, p.second));
                row[4 + number] = 1.0;
                square += &row * row.transpose() * p.weight;
                cross += &row * (p.weight * p.error);
            }
            square[(4 + number, 4 + number)] += 1.0 / moments.turn_on.powi(2);
        }
        for i in 0..4 {
            square[(i, i)] += 1.0 / moments.sigma[i].powi(2);
            cross[i] += moments.mean[1][i] / moments.sigma[i].powi(2);
        }
        let inverse = square.try_inverse().unwrap();
        let want = &inverse * cross;
        assert!((got.mean - want.rows(0, 4)).amax() < 1e-9);
        assert!((got.covariance - inverse.view((0, 0), (4, 4))).amax() < 1e-9);
        for (i, (t, square)) in got.turn_ons.iter().enumerate() {
            let at = 4 + i;
            assert!((t - want[at]).abs() < 1e-9);
            let known = want[at].powi(2) + inverse[(at, at)];
            assert!((square - known).abs() < 1e-9);
        }
    }

    #[test]
    fn what_is_left_is_the_sum_of_squares() {
        let (points, features) = (points(50, |k| (k as f64).sqrt()), features(50, 0.5));
        let sums = Sums::of(&points, &features);
        let x = Vector4::new(0.2, -0.4, 1.0, 3.0);
        let direct: f64 = points
            .iter()
            .map(|p| p.weight * (p.error - x.dot(&regressors(&features, p.second))).powi(2))
            .sum();
        assert!((sums.left(&x) / direct - 1.0).abs() < 1e-9);
        assert!((sums.left(&Vector4::zeros()) - sums.errors()).abs() < 1e-9);
    }

    /// 60 units whose constants and turn-ons are drawn: the moments are found.
    #[test]
    fn the_moments_of_a_fleet_are_found() {
        use rand::SeedableRng;
        use rand_distr::{Distribution, StandardNormal};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let mut z = || -> f64 { StandardNormal.sample(&mut rng) };
        let truth = ([0.8, 0.2, 0.0, 0.5], [0.4, 0.2, 1.5, 0.6], 0.15);
        let mut units = Vec::new();
        for _ in 0..60 {
            units.push([(); 3].map(|()| {
                let x = Vector4::from_fn(|i, _| truth.0[i] + truth.1[i] * z());
                [0.0, 2.0, 5.0].map(|phase| {
                    let t = truth.2 * z();
                    let features = features(200, phase);
                    let noise: Vec<f64> = (0..200).map(|_| 0.45 * z()).collect();
                    let of = |k: usize| x.dot(&regressors(&features, k)) + t + noise[k];
                    Sums::of(&points(200, of), &features)
                })
            }));
        }
        let all: Vec<Vec<Three>> = vec![features(200, 0.0)];
        let mut moments = Moments::wide(&all);
        for _ in 0..60 {
            let known: Vec<[Constants; 3]> = units
                .iter()
                .map(|unit| [0, 1, 2].map(|axis| solve(&unit[axis], &moments, axis)))
                .collect();
            moments = renewed(&known);
        }
        for i in 0..4 {
            let ratio = moments.sigma[i] / truth.1[i];
            assert!((0.8..1.25).contains(&ratio), "{i}: {ratio}");
            for mean in &moments.mean {
                let off = (mean[i] - truth.0[i]).abs() / truth.1[i];
                assert!(off < 0.4, "{i}: {off} sigma");
            }
        }
        assert!((0.85..1.15).contains(&(moments.turn_on / truth.2)));
    }
}
