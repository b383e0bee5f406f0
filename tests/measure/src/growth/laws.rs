//! How cost should grow: polynomials fitted to the measured values.

use nalgebra::{DMatrix, DVector};

/// `c[0] + c[1] n + c[2] n^2 ...`.
#[derive(Clone, Debug, PartialEq)]
pub struct Polynomial(pub Vec<f64>);

impl Polynomial {
    /// The polynomial of `degree` with the least squares of *relative* errors; all `y` > 0. `None`
    /// when there are fewer different `x` than coefficients.
    pub fn fit(degree: usize, x: &[f64], y: &[f64]) -> Option<Self> {
        // The columns are scaled to 1 at the largest x, or the unit would decide the rank.
        let most = x.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let rows = DMatrix::from_fn(x.len(), degree + 1, |i, k| {
            (x[i] / most).powi(k as i32) / y[i]
        });
        let ones = DVector::from_element(x.len(), 1.0);
        let svd = rows.svd(true, true);
        let least = 1e-9 * svd.singular_values.max();
        if svd.rank(least) <= degree {
            return None;
        }
        let found = svd.solve(&ones, least).ok()?;
        let unscaled = found.iter().zip(0..).map(|(c, k)| c / most.powi(k));
        Some(Self(unscaled.collect()))
    }

    /// Its value at `n`.
    pub fn at(&self, n: f64) -> f64 {
        self.0.iter().rev().fold(0.0, |sum, c| sum * n + c)
    }

    /// The fraction that the highest power contributes at `n`.
    pub fn top_share(&self, n: f64) -> f64 {
        let degree = self.0.len().saturating_sub(1) as i32;
        self.0.last().map_or(0.0, |c| c * n.powi(degree)) / self.at(n)
    }

    /// Largest relative error at the points it was fitted to.
    pub fn worst(&self, x: &[f64], y: &[f64]) -> f64 {
        let off = x.iter().zip(y).map(|(&x, y)| (self.at(x) / y - 1.0).abs());
        off.fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_found_again_and_its_square_weighed() {
        let x = [0.0, 6.0, 24.0, 96.0, 132.0];
        let y = x.map(|n: f64| 30e3 + 2e3 * n + 30.0 * n * n);
        let fit = Polynomial::fit(2, &x, &y).expect("enough points");
        for (found, c) in fit.0.iter().zip([30e3, 2e3, 30.0]) {
            assert!((found / c - 1.0).abs() < 1e-9, "{found} {c}");
        }
        assert!(fit.worst(&x, &y) < 1e-12);
        let share = 30.0 * 132.0 * 132.0 / y[4];
        assert!((fit.top_share(132.0) - share).abs() < 1e-9);
        assert!((fit.worst(&[6.0], &[2.0 * y[1]]) - 0.5).abs() < 1e-9);
    }

    #[test]
    fn too_few_points_give_no_law() {
        assert_eq!(Polynomial::fit(1, &[1.0, 1.0, 1.0], &[2.0, 2.0, 2.0]), None);
        assert_eq!(Polynomial::fit(2, &[1.0, 2.0], &[2.0, 2.0]), None);
    }
}
