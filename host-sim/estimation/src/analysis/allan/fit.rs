//! Fits the coefficients to the curve by non-negative least squares, with intervals.
//!
//! The Allan variance is linear in the squares of Q, N, B, K, R ([`Model::basis`]). The weight of a
//! point is the inverse of its variance under the model of the previous round; a few rounds
//! converge. Neighbouring points share most of their data, so the covariance P of the squares
//! follows from the design A, the weights W and the full covariance C of the points:
//!
//! ```text
//! P = (A' W A)^-1 A' W C W A (A' W A)^-1
//! ```
//!
//! A curve that is not a sum of the five noises (because of sway, vibration, a settling
//! temperature, or a spectral line) would be fitted at short times only,
//! which are the most certain ones statistically. Therefore every point gets a further error, the
//! same fraction f of each variance, just large enough that the residuals are as large as expected.
//! f is zero for pure noise and is reported as the misfit.

use super::covariance::Model;
use super::deviation::{Point, averages, curve, phase};
use super::outliers::{Outliers, leave_out};
use super::rounding::joined;
use super::{Kind, NOISES, Series};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Probability of each tail of a 95 % interval.
const TAIL: f64 = 0.025;
/// Half width of a 95 % interval of a normal distribution, in standard deviations.
const SIGMAS: f64 = 1.959_964;
/// Rounds of fitting.
const ROUNDS: usize = 12;
/// Above this misfit the curve is not a sum of the five noises.
pub const POOR_FIT: f64 = 0.1;

/// One coefficient with its 95 % interval.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coefficient {
    /// Q, N, B, K or R.
    pub symbol: &'static str,
    /// Name.
    pub name: &'static str,
    /// Unit of the three values.
    pub unit: &'static str,
    /// Estimate, >= 0.
    pub value: f64,
    /// Lower end of the interval; 0 if the data do not show this noise.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

impl Coefficient {
    /// Whether the data show this noise. If not, only the upper end is meaningful.
    #[must_use]
    pub fn is_seen(&self) -> bool {
        self.low > 0.0
    }
}

/// A point of the curve with its 95 % interval, in the unit of the deviation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Deviation {
    /// Averaging time, s.
    pub tau_s: f64,
    /// Overlapping Allan deviation.
    pub deviation: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Equivalent degrees of freedom.
    pub edf: f64,
    /// Deviation of the fitted coefficients.
    pub fitted: f64,
}

/// The results for one column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Analysis {
    /// Column.
    pub column: String,
    /// Gyro or accelerometer.
    pub kind: Kind,
    /// Samples per second.
    pub rate_hz: f64,
    /// Length, s.
    pub duration_s: f64,
    /// Unit of the deviations.
    pub unit: &'static str,
    /// Q, N, B, K, R.
    pub coefficients: Vec<Coefficient>,
    /// Shortest averaging time of the fit, s. It is one sample interval, or more if the pulses are
    /// coarse; see module `rounding`.
    pub fitted_from_s: f64,
    /// Departure of the curve from the fit that chance does not explain, as a fraction of the
    /// deviation. It is 0 for pure noise; above `POOR_FIT` the curve is not a sum of the five
    /// noises.
    pub misfit: f64,
    /// Single samples far from their neighbours, if there are any.
    pub outliers: Option<Outliers>,
    /// The curve.
    pub curve: Vec<Deviation>,
}

/// Curve, coefficients and intervals of a series, without outliers if they are few. `None` if it
/// has fewer than 100 samples or never changes.
#[must_use]
pub fn analyse(mut series: Series) -> Option<Analysis> {
    let (samples, t0) = (series.increments.len(), 1.0 / series.rate_hz);
    if samples < super::deviation::LEAST_SAMPLES {
        return None;
    }
    let outliers = leave_out(&mut series.increments, series.rate_hz);
    let mut x = phase(&series.increments);
    let points = curve(&x, t0, averages(samples));
    if points.iter().any(|p| p.variance <= 0.0) {
        return None;
    }
    let join = joined(series.increments, &x);
    let fitted_from = join as f64 * t0;
    // averages of 1, 2, 4, ... samples; those between hold no further information
    let mut octaves = points.clone();
    let mut pieces = samples;
    if join > 1 {
        x = x.into_iter().step_by(join).collect();
        pieces = x.len() - 1;
        let mut ms = averages(pieces);
        ms.retain(|m| m.is_power_of_two());
        octaves = curve(&x, fitted_from, ms);
    }
    octaves.retain(|p| p.m.is_power_of_two());
    let fit = Fit::new(&octaves, pieces, fitted_from);
    let (unit, unit_si) = series.kind.unit();
    let shown = |p: &Point| {
        let edf = fit.model.edf(p.m, samples, t0);
        let deviation = p.variance.sqrt() / unit_si;
        let (low, high) = interval(edf);
        Deviation {
            tau_s: p.tau,
            deviation,
            low: deviation * low,
            high: deviation * high,
            edf,
            fitted: fit.model.variance(p.tau).sqrt() / unit_si,
        }
    };
    Some(Analysis {
        column: series.column,
        kind: series.kind,
        rate_hz: series.rate_hz,
        duration_s: samples as f64 * t0,
        unit,
        coefficients: fit.coefficients(series.kind),
        fitted_from_s: fitted_from,
        misfit: fit.misfit,
        outliers,
        curve: points.iter().map(shown).collect(),
    })
}

/// Ends of the 95 % interval of a deviation, as factors of its estimate: `sqrt(edf / chi2)`.
fn interval(edf: f64) -> (f64, f64) {
    let quantile = |p: f64| {
        let exact = (edf < 1e4).then(|| ChiSquared::new(edf).ok()).flatten();
        exact.map_or_else(|| wilson_hilferty(edf, p), |chi2| chi2.inverse_cdf(p))
    };
    (
        (edf / quantile(1.0 - TAIL)).sqrt(),
        (edf / quantile(TAIL)).sqrt(),
    )
}

/// Quantile `TAIL` or `1 - TAIL` of chi-square, accurate to 1e-6 from 10 000 degrees of freedom on.
fn wilson_hilferty(edf: f64, p: f64) -> f64 {
    let z = if p < 0.5 { -SIGMAS } else { SIGMAS };
    let c = 2.0 / (9.0 * edf);
    edf * (1.0 - c + z * c.sqrt()).powi(3)
}

/// The five squares with their uncertainties.
struct Fit {
    model: Model,
    /// Squares fitted without the condition that none is negative. They are unbiased, and the
    /// intervals are around them.
    free: [f64; 5],
    /// Standard deviations of `free`.
    sigma: [f64; 5],
    misfit: f64,
}

impl Fit {
    fn new(points: &[Point], samples: usize, t0: f64) -> Self {
        let design = DMatrix::from_fn(points.len(), 5, |i, j| Model::basis(points[i].tau)[j]);
        let observed = DVector::from_iterator(points.len(), points.iter().map(|p| p.variance));
        // the first weights, without a model: only independent averages count
        let mut sigmas = DVector::from_iterator(
            points.len(),
            points
                .iter()
                .map(|p| p.variance * (2.0 * p.m as f64 / samples as f64).sqrt()),
        );
        let mut model = Model::default();
        let mut further = 0.0;
        for _ in 0..ROUNDS {
            model = Model(non_negative(&design, &observed, &sigmas));
            let chance = |p: &Point| model.covariance(p.m, p.m, samples, t0);
            let chances: Vec<f64> = points.iter().map(chance).collect();
            further = further_error(points, &model, &chances);
            for ((sigma, p), chance) in sigmas.iter_mut().zip(points).zip(&chances) {
                *sigma = (chance + (further * p.variance).powi(2)).sqrt();
            }
        }
        let covariance = DMatrix::from_fn(points.len(), points.len(), |i, j| {
            let further = if i == j {
                (further * points[i].variance).powi(2)
            } else {
                0.0
            };
            further + model.covariance(points[i].m, points[j].m, samples, t0)
        });
        let (free, sigma) = intervals(&design, &observed, &sigmas, &covariance);
        // the relative error of a deviation is half that of its variance
        Self {
            model,
            free,
            sigma,
            misfit: further / 2.0,
        }
    }

    fn coefficients(&self, kind: Kind) -> Vec<Coefficient> {
        let units = kind.coefficient_units();
        (0..5)
            .map(|i| {
                let (unit, si) = units[i];
                let (symbol, name) = NOISES[i];
                let root = |square: f64| square.max(0.0).sqrt() / si;
                let square = self.model.0[i];
                // both estimates are right within sigma; they differ where another square is held
                // at 0
                let (less, more) = (self.free[i].min(square), self.free[i].max(square));
                let reach = SIGMAS * self.sigma[i];
                Coefficient {
                    symbol,
                    name,
                    unit,
                    value: root(square),
                    low: root(less - reach),
                    high: root(more + reach),
                }
            })
            .collect()
    }
}

/// The smallest f >= 0 for which the mean of the squared residuals, each divided by
/// `chance + (f V)^2`, is at most 1.
fn further_error(points: &[Point], model: &Model, chances: &[f64]) -> f64 {
    let mean_square = |f: f64| {
        let terms = points.iter().zip(chances).map(|(p, chance)| {
            let residual = p.variance - model.variance(p.tau);
            residual * residual / (chance + (f * p.variance).powi(2))
        });
        terms.sum::<f64>() / points.len() as f64
    };
    if mean_square(0.0) <= 1.0 {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    while mean_square(high) > 1.0 && high < 1e6 {
        high *= 2.0;
    }
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if mean_square(middle) > 1.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// The columns `used` of the design, divided by the errors of the points and scaled to length one,
/// with their lengths.
fn scaled(
    design: &DMatrix<f64>,
    sigmas: &DVector<f64>,
    used: &[usize],
) -> (DMatrix<f64>, Vec<f64>) {
    let mut a = DMatrix::from_fn(design.nrows(), used.len(), |i, j| {
        design[(i, used[j])] / sigmas[i]
    });
    let lengths: Vec<f64> = (0..used.len()).map(|j| a.column(j).norm()).collect();
    for (j, length) in lengths.iter().enumerate() {
        a.column_mut(j).scale_mut(1.0 / length);
    }
    (a, lengths)
}

/// Least squares under the condition that no square is negative. Of all 31 subsets of the columns
/// whose solution is not negative it takes the one with the smallest residual.
fn non_negative(design: &DMatrix<f64>, observed: &DVector<f64>, sigmas: &DVector<f64>) -> [f64; 5] {
    let target = observed.component_div(sigmas);
    let mut best = ([0.0; 5], f64::INFINITY);
    for choice in 1_u32..32 {
        let used: Vec<usize> = (0..5).filter(|j| choice >> j & 1 == 1).collect();
        let (a, lengths) = scaled(design, sigmas, &used);
        let Ok(x) = a.clone().svd(true, true).solve(&target, 1e-12) else {
            continue;
        };
        let cost = (&a * &x - &target).norm_squared();
        if x.iter().all(|&value| value >= 0.0) && cost < best.1 {
            let mut squares = [0.0; 5];
            for (k, &j) in used.iter().enumerate() {
                squares[j] = x[k] / lengths[k];
            }
            best = (squares, cost);
        }
    }
    best.0
}

/// Unconstrained estimate and standard deviation of each square.
fn intervals(
    design: &DMatrix<f64>,
    observed: &DVector<f64>,
    sigmas: &DVector<f64>,
    covariance: &DMatrix<f64>,
) -> ([f64; 5], [f64; 5]) {
    let (a, lengths) = scaled(design, sigmas, &[0, 1, 2, 3, 4]);
    let whitened = DMatrix::from_fn(sigmas.len(), sigmas.len(), |i, j| {
        covariance[(i, j)] / (sigmas[i] * sigmas[j])
    });
    let Ok(inverse) = a.pseudo_inverse(1e-12) else {
        return ([0.0; 5], [f64::INFINITY; 5]);
    };
    let free = &inverse * observed.component_div(sigmas);
    let spread = &inverse * whitened * inverse.transpose();
    (
        std::array::from_fn(|j| free[j] / lengths[j]),
        std::array::from_fn(|j| spread[(j, j)].max(0.0).sqrt() / lengths[j]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chi_square_ends_are_those_of_the_tables() {
        // 2.5 % and 97.5 % points of chi-square tables
        for (edf, low, high) in [
            (1.0, 0.000_982, 5.024),
            (10.0, 3.247, 20.483),
            (100.0, 74.222, 129.561),
        ] {
            let (a, b) = interval(edf);
            let want = ((edf / high).sqrt(), (edf / low).sqrt());
            assert!(
                (a / want.0 - 1.0).abs() < 1e-3 && (b / want.1 - 1.0).abs() < 1e-3,
                "{edf}: {a} {b}"
            );
        }
        let (below, above) = (interval(9_999.0), interval(10_001.0));
        assert!((below.0 - above.0).abs() < 1e-5 && (below.1 - above.1).abs() < 1e-5);
    }

    #[test]
    fn exact_variances_give_back_their_coefficients() {
        let truth = [4e-12, 1e-10, 9e-14, 1e-16, 1e-20];
        let t0 = 0.01;
        let points: Vec<Point> = (0..17)
            .map(|k| 1usize << k)
            .map(|m| Point {
                m,
                tau: m as f64 * t0,
                variance: Model(truth).variance(m as f64 * t0),
            })
            .collect();
        let fit = Fit::new(&points, 720_000, t0);
        for (found, truth) in fit.model.0.iter().zip(truth) {
            assert!((found / truth - 1.0).abs() < 1e-6, "{:?}", fit.model);
        }
        assert_eq!(fit.misfit, 0.0);
    }
}
