//! Recursive least squares with a prior: each reference is used once, so none has to be stored.
//!
//! ```text
//! reference = x + h . delta + v,   var v = variance       delta ~ N(0, P) at first
//! P = U D U^T,  U unit upper triangular, D diagonal >= 0
//! ```
//!
//! It uses Bierman's update of the factors (*Factorization Methods for Discrete Sequential
//! Estimation*, 1977, sec. V.3). P cannot lose its positivity to rounding, as a covariance in
//! single precision does. For a linear network the result is that of one Gauss-Newton pass over all
//! references.

use crate::real::{Real, all_finite};

/// The factors of the covariance P of `N` unknowns; `PACKED` is N (N - 1) / 2. 4 (N + PACKED) bytes
/// in `f32`: 8 064 for 63.
///
/// ```
/// use lrnn_nostd::learn::UdCovariance;
///
/// // A bias and a slope, known to 1 and 2 beforehand, from readings of 3 + 0.5 t with noise 0.01.
/// let mut covariance: UdCovariance<2, 1> = UdCovariance::zero();
/// covariance.set(&[4.0, 2.0]);
/// let mut found = [0.0_f32; 2];
/// for k in 0..50 {
///     let t = 0.1 * k as f32;
///     let h = [1.0, t];
///     let residual = 3.0 + 0.5 * t - (h[0] * found[0] + h[1] * found[1]);
///     assert!(covariance.update(&mut found, &h, residual, 1e-4, 5.0));
/// }
/// assert!((found[0] - 3.0).abs() < 0.01 && (found[1] - 0.5).abs() < 0.01);
/// // A reading that is far from what is expected is refused and changes nothing.
/// assert!(!covariance.update(&mut found, &[1.0, 0.0], 10.0, 1e-4, 5.0));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct UdCovariance<const N: usize, const PACKED: usize, T = f32> {
    /// U without its diagonal, column by column: column j holds rows 0..j.
    u: [T; PACKED],
    d: [T; N],
}

impl<const N: usize, const PACKED: usize, T: Real> UdCovariance<N, PACKED, T> {
    /// P = 0: nothing is unknown, and no update changes anything.
    #[must_use]
    pub const fn zero() -> Self {
        const {
            assert!(2 * PACKED == N * (N - 1), "PACKED is N (N - 1) / 2");
        }
        Self {
            u: [T::ZERO; PACKED],
            d: [T::ZERO; N],
        }
    }

    /// Sets independent unknowns with these standard deviations, in place because the matrix is
    /// large.
    pub fn set(&mut self, sigma: &[T; N]) {
        self.u = [T::ZERO; PACKED];
        self.d = sigma.map(|s| s * s);
    }

    /// Update with one scalar reference, where `residual` = reference - h . delta so far. Changes
    /// `delta` and returns true. A reference more than `gate` standard deviations from its expected
    /// value, or one that is not finite, changes nothing and returns false. So does one whose
    /// finite step overflows `delta`, except that P has become narrower.
    pub fn update(
        &mut self,
        delta: &mut [T; N],
        h: &[T; N],
        residual: T,
        variance: T,
        gate: T,
    ) -> bool {
        let f = self.transposed(h);
        let mut gain = [T::ZERO; N];
        let mut expected = variance;
        for ((&f, &d), g) in f.iter().zip(&self.d).zip(&mut gain) {
            *g = d * f;
            expected += f * *g;
        }
        let near = residual * residual <= gate * gate * expected;
        let step = residual / expected; // where both are finite, so is the residual
        if !(near && variance > T::ZERO && expected.is_finite() && step.is_finite()) {
            return false;
        }
        self.downdate(&f, &mut gain, variance);
        let mut next = *delta;
        for (x, &g) in next.iter_mut().zip(&gain) {
            *x += g * step;
        }
        let good = all_finite(&next);
        if good {
            *delta = next;
        }
        good
    }

    /// f = U^T h.
    fn transposed(&self, h: &[T; N]) -> [T; N] {
        let mut f = *h;
        let mut rest = self.u.as_slice();
        for (j, f) in f.iter_mut().enumerate() {
            let Some((column, below)) = rest.split_at_checked(j) else {
                break;
            };
            for (&u, &h) in column.iter().zip(h) {
                *f += u * h;
            }
            rest = below;
        }
        f
    }

    /// P - P h h^T P / alpha in the factors, from f and D f, with alpha = h^T P h + variance.
    /// Leaves P h in `gain`.
    fn downdate(&mut self, f: &[T; N], gain: &mut [T; N], variance: T) {
        let mut alpha = variance;
        let mut rest = self.u.as_mut_slice();
        for (j, (&f, d)) in f.iter().zip(&mut self.d).enumerate() {
            let Some((column, below)) = rest.split_at_mut_checked(j) else {
                break;
            };
            let Some((above, [own, ..])) = gain.split_at_mut_checked(j) else {
                break;
            };
            let before = alpha;
            alpha += f * *own;
            let lambda = f / before;
            *d = *d * before / alpha;
            for (u, b) in column.iter_mut().zip(above) {
                let old = *u;
                *u -= lambda * *b;
                *b += old * *own;
            }
            rest = below;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl<const N: usize, const PACKED: usize, T: Real> UdCovariance<N, PACKED, T> {
        /// Trace of P: how much is still unknown.
        fn trace(&self) -> T {
            let mut trace = self.d.iter().fold(T::ZERO, |sum, &d| sum + d);
            let mut rest = self.u.as_slice();
            for (j, &d) in self.d.iter().enumerate() {
                let Some((column, below)) = rest.split_at_checked(j) else {
                    break;
                };
                trace = column.iter().fold(trace, |sum, &u| sum + u * u * d);
                rest = below;
            }
            trace
        }
    }

    /// Compared with the normal equations solved by elimination, in f64: three unknowns, many
    /// references.
    #[test]
    fn equals_least_squares_with_a_prior() {
        let sigma = [2.0, 0.5, 1.0];
        let mut covariance = UdCovariance::<3, 3, f64>::zero();
        covariance.set(&sigma);
        let before = covariance.trace();
        let mut delta = [0.0; 3];
        let mut normal = [[0.0; 4]; 3];
        for (i, s) in sigma.iter().enumerate() {
            normal[i][i] = 1.0 / (s * s);
        }
        for k in 0..50 {
            let t = f64::from(k);
            let h = [1.0, (t * 0.7).sin(), (t * 0.3).cos()];
            let reference = 0.8 - 0.3 * h[1] + 0.4 * h[2] + 0.05 * (t * 12.9898).sin();
            let variance = 0.01 + 0.001 * t;
            let known: f64 = h.iter().zip(&delta).map(|(h, x)| h * x).sum();
            assert!(covariance.update(&mut delta, &h, reference - known, variance, 100.0));
            for i in 0..3 {
                for j in 0..3 {
                    normal[i][j] += h[i] * h[j] / variance;
                }
                normal[i][3] += h[i] * reference / variance;
            }
        }
        for i in 0..3 {
            for k in i + 1..3 {
                let factor = normal[k][i] / normal[i][i];
                for j in i..4 {
                    normal[k][j] -= factor * normal[i][j];
                }
            }
        }
        let mut solved = [0.0; 3];
        for i in (0..3).rev() {
            let known: f64 = (i + 1..3).map(|j| normal[i][j] * solved[j]).sum();
            solved[i] = (normal[i][3] - known) / normal[i][i];
        }
        for (x, s) in delta.iter().zip(solved) {
            assert!((x - s).abs() < 1e-10, "{delta:?} {solved:?}");
        }
        assert!(covariance.trace() < 0.05 * before);
    }

    #[test]
    fn what_is_far_off_or_not_finite_changes_nothing() {
        let mut covariance = UdCovariance::<2, 1>::zero();
        covariance.set(&[1.0, 1.0]);
        let (before, mut delta) = (covariance.clone(), [0.0; 2]);
        let h = [1.0, 1.0];
        for (residual, variance) in [
            (20.0, 1.0),
            (f32::NAN, 1.0),
            (1.0, f32::NAN),
            (1.0, 0.0),
            (1.0, -1.0),
            (f32::INFINITY, 1.0),
        ] {
            assert!(!covariance.update(&mut delta, &h, residual, variance, 5.0));
        }
        assert!(!covariance.update(&mut delta, &[f32::INFINITY, 0.0], 0.0, 1.0, 5.0));
        // nor where the gate lets everything pass, or the step overflows
        for (h, residual, variance) in [
            (1.0, f32::INFINITY, 1.0),
            (1.0, f32::NEG_INFINITY, 1.0),
            (1e-19, 1e34, 1e-38),
        ] {
            let gate = f32::INFINITY;
            assert!(!covariance.update(&mut delta, &[h; 2], residual, variance, gate));
        }
        assert_eq!((&covariance, delta), (&before, [0.0; 2]));
        assert!(covariance.update(&mut delta, &h, 1.0, 1.0, 5.0));
        assert!((delta[0] - 1.0 / 3.0).abs() < 1e-6);
        // expected: 0.5 + 1 + 1, so three standard deviations are 4.74
        for (residual, taken) in [(4.70, true), (4.78, false), (-4.70, true), (-4.78, false)] {
            let mut fresh = before.clone();
            assert_eq!(fresh.update(&mut [0.0; 2], &h, residual, 0.5, 3.0), taken);
        }
        let mut known = UdCovariance::<2, 1>::zero();
        assert!(known.update(&mut delta, &h, 1.0, 1.0, 5.0));
        assert!((delta[0] - 1.0 / 3.0).abs() < 1e-6);
    }

    /// Ten thousand references in f32 of one direction: variances stay positive and small.
    #[test]
    fn stays_positive() {
        let mut covariance = UdCovariance::<4, 6>::zero();
        covariance.set(&[1.0, 1e3, 1e-3, 1.0]);
        let mut delta = [0.0; 4];
        for k in 0..10_000u16 {
            let h = [1.0, 1e-3, 1e3 + f32::from(k % 7), 1.0];
            assert!(covariance.update(&mut delta, &h, 0.0, 1e-8, 5.0));
            assert!(covariance.d.iter().all(|&d| d >= 0.0 && d.is_finite()));
        }
    }
}
