//! The covariance of X navigation errors and N parameters, symmetric to rounding.

use super::blocks::{
    align_errors, at_least, cross_products, finite, propagate_errors, update_errors,
};
use super::deferred::Deferred;
use super::packed::{diagonal, packed, place, times};
use super::row::{Rows, axpy, axpy_rows, axpy_three, dot, transform};
use crate::real::Real;

/// P in three blocks: P_xx of the navigation errors (X x X), P_xt of navigation errors by
/// parameters (X x N), and P_tt of the parameters. Of P_tt the lower triangle is stored,
/// so `PACKED` = N (N + 1) / 2 values.
///
/// An observation of a navigation error changes P_tt, but no later observation of a navigation
/// error needs that change. It is therefore deferred and applied for several observations at once,
/// so that the largest block is read and written only once.
#[derive(Clone, Debug, PartialEq)]
pub struct Covariance<const X: usize, const N: usize, const PACKED: usize, T = f32> {
    xx: [[T; X]; X],
    xt: [[T; N]; X],
    tt: [T; PACKED],
    deferred: Deferred<N, T>,
}

/// Outputs whose effects are computed together: those of a triad.
pub(super) const GROUP: usize = 3;

/// Memory of a time update: P_xt J' before the update, and J P_tt J'.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Workspace<const X: usize, const E: usize, T = f32> {
    pub(super) c: [[T; E]; X],
    pub(super) s: [[T; E]; E],
}

impl<const X: usize, const E: usize, T: Real> Workspace<X, E, T> {
    /// All zeros.
    pub const ZEROED: Self = Self {
        c: [[T::ZERO; E]; X],
        s: [[T::ZERO; E]; E],
    };
}

/// The innovation of one scalar observation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation<T = f32> {
    /// Observed minus predicted.
    pub value: T,
    /// Variance of the innovation: that of the prediction plus that of the observation.
    pub variance: T,
}

impl<T: Real> Innovation<T> {
    /// value^2 / variance: chi-square with one degree of freedom if all assumptions hold.
    #[inline]
    pub fn squared_ratio(&self) -> T {
        self.value * self.value / self.variance
    }
}

impl<const X: usize, const N: usize, const PACKED: usize, T: Real> Covariance<X, N, PACKED, T> {
    /// All zeros. Call [`Self::init`] before use.
    pub const ZEROED: Self = {
        assert!(PACKED == packed(N));
        Self {
            xx: [[T::ZERO; X]; X],
            xt: [[T::ZERO; N]; X],
            tt: [T::ZERO; PACKED],
            deferred: Deferred::ZEROED,
        }
    };

    /// Starts with independent errors of these standard deviations.
    pub fn init(&mut self, error: &[T; X], parameters: &[T; N]) {
        self.reset_errors(error);
        self.deferred.clear();
        self.tt = [T::ZERO; PACKED];
        for (i, &sigma) in parameters.iter().enumerate() {
            self.set_parameter(i, i, sigma * sigma);
        }
    }

    /// Variance of each parameter.
    pub fn variances(&self) -> impl Iterator<Item = T> + '_ {
        (0..N).map(|i| self.deferred.of_diagonal(i, self.parameter(i, i)))
    }

    /// Replaces the navigation errors by new ones with these standard deviations, uncorrelated with
    /// the parameters.
    pub fn reset_errors(&mut self, sigma: &[T; X]) {
        self.xx = [[T::ZERO; X]; X];
        self.xt = [[T::ZERO; N]; X];
        for i in 0..X {
            self.xx[i][i] = sigma[i] * sigma[i];
        }
    }

    /// Replaces the navigation errors by x = `by` (e - J theta') + rest, where theta' are the
    /// parameters' errors. An initial state that was found with the help of the sensors carries
    /// their errors.
    ///
    /// ```text
    /// P_xt = -by J P_tt,   P_xx = by (J P_tt J') by' + rest
    /// ```
    pub fn align<const E: usize, const G: usize>(
        &mut self,
        jacobian: &[Rows<'_, T>; G],
        by: &[[T; E]; X],
        rest: &[[T; X]; X],
        workspace: &mut Workspace<X, E, T>,
    ) {
        self.apply_deferred();
        self.xt = [[T::ZERO; N]; X];
        let against = by.map(|row| row.map(|value| -value));
        self.propagate_outputs(&against, jacobian, workspace);
        align_errors(&mut self.xx, by, rest, &workspace.s);
    }

    /// Adds to the variances of the navigation errors.
    pub fn inflate(&mut self, variance: &[T; X]) {
        for i in 0..X {
            self.xx[i][i] += variance[i];
        }
    }

    /// Time update, for parameters that act through the E outputs of a model, e = J theta. The rows
    /// `jacobian[k]` are 0 outside a range. `walk`: variances.
    ///
    /// ```text
    /// x+ = Phi x + Gamma e + noise(Q),   theta+ = theta + noise(walk)
    /// P_xt+ = Phi P_xt + Gamma (J P_tt)
    /// P_xx+ = Phi P_xx Phi' + Phi (P_xt J') Gamma' + (.)' + Gamma (J P_tt J') Gamma' + Q
    /// P_tt+ = P_tt + walk
    /// ```
    ///
    /// It takes about E N^2 / 2 + X (X + E) N multiply-adds.
    pub fn propagate<const E: usize, const G: usize>(
        &mut self,
        jacobian: &[Rows<'_, T>; G],
        phi: &[[T; X]; X],
        gamma: &[[T; E]; X],
        q: &[[T; X]; X],
        walk: &[T; N],
        workspace: &mut Workspace<X, E, T>,
    ) {
        self.apply_deferred();
        *workspace = Workspace::ZEROED;
        for (g, rows) in jacobian.iter().enumerate() {
            cross_products(self.xt.as_flattened(), N, rows, g, &mut workspace.c);
        }
        transform(self.xt.as_flattened_mut(), N, phi);
        self.propagate_outputs(gamma, jacobian, workspace);
        propagate_errors(&mut self.xx, phi, gamma, workspace, q);
        diagonal(&mut self.tt, N, |i, variance| {
            *variance += walk.get(i).copied().unwrap_or(T::ZERO);
        });
    }

    /// The effect of the outputs, one triad after the other: P_xt += Gamma J P_tt, and J P_tt J'.
    /// The products of P_tt with the three rows of J add up where deferred changes are, none of
    /// which is left now.
    #[inline(never)]
    fn propagate_outputs<const E: usize, const G: usize>(
        &mut self,
        gamma: &[[T; E]; X],
        jacobian: &[Rows<'_, T>; G],
        workspace: &mut Workspace<X, E, T>,
    ) {
        const { assert!(E == GROUP * G) };
        for (group, rows) in jacobian.iter().enumerate() {
            let products = self.deferred.scratch();
            *products = [[T::ZERO; GROUP]; N];
            let mut wide = [[T::ZERO; GROUP]; N];
            let used = rows.widen(&mut wide);
            times(&self.tt, &wide, used, products);
            let first = group * GROUP;
            for (l, rows) in jacobian.iter().enumerate() {
                let of_group = rows.times_three(products);
                for (s, values) in workspace.s.iter_mut().skip(first).zip(of_group) {
                    if let Some(s) = s.as_chunks_mut().0.get_mut(l) {
                        *s = values;
                    }
                }
            }
            let of_group = |row: &[T; E]| row.as_chunks::<GROUP>().0.get(group).copied();
            let factors = gamma
                .each_ref()
                .map(|row| of_group(row).unwrap_or([T::ZERO; GROUP]));
            axpy_three(self.xt.as_flattened_mut(), &factors, products);
        }
    }

    /// Variance of navigation error `i`; 0 beyond X.
    #[inline]
    pub fn variance(&self, i: usize) -> T {
        self.xx
            .get(i)
            .and_then(|row| row.get(i))
            .copied()
            .unwrap_or(T::ZERO)
    }

    /// P_xx.
    pub fn errors(&self) -> &[[T; X]; X] {
        &self.xx
    }

    /// P_xt.
    pub fn cross(&self) -> &[[T; N]; X] {
        &self.xt
    }

    /// Covariance of parameters `i` and `j` without the changes that are still deferred; 0 beyond
    /// N. After [`Self::floor`] none is.
    pub fn parameter(&self, i: usize, j: usize) -> T {
        let at = place(N, i, j);
        at.and_then(|at| self.tt.get(at))
            .copied()
            .unwrap_or(T::ZERO)
    }

    /// Sets the covariance of parameters `i` and `j`; indices beyond N have no effect.
    pub(super) fn set_parameter(&mut self, i: usize, j: usize, value: T) {
        if let Some(entry) = place(N, i, j).and_then(|at| self.tt.get_mut(at)) {
            *entry = value;
        }
    }

    /// Measurement update with an observation of navigation error `i`. Adds gain times innovation
    /// to the means. An index beyond X has no effect. P_tt follows when it is needed.
    ///
    /// ```text
    /// means += c v / s,  P -= c c' / s
    /// ```
    #[inline]
    pub fn update_error(
        &mut self,
        i: usize,
        innovation: Innovation<T>,
        x: &mut [T; X],
        theta: &mut [T; N],
    ) {
        if self.deferred.is_closed() {
            self.apply_deferred();
        }
        let weight = T::ONE / innovation.variance;
        let (Some(&cx), Some(&ct)) = (self.xx.get(i), self.xt.get(i)) else {
            return;
        };
        let Some(&own) = cx.get(i).filter(|_| self.deferred.hold(&ct, weight)) else {
            return;
        };
        axpy(x, weight * innovation.value, &cx);
        axpy(theta, weight * innovation.value, &ct);
        let factors = cx.map(|c| -(weight * c));
        axpy_rows(self.xt.as_flattened_mut(), &factors, &ct);
        // The observed row: (1 - P_ii / s) P_ij, without the cancellation.
        let left = (innovation.variance - own) / innovation.variance;
        update_errors(&mut self.xx, i, &cx, factors, left);
        if let Some(row) = self.xt.get_mut(i) {
            for (entry, c) in row.iter_mut().zip(ct) {
                *entry = left * c;
            }
        }
    }

    /// Covariances of the observation e_k + `by` x with the navigation errors and with the
    /// parameters' errors theta', and its variance. The truth of an output is e_k = J_k (theta -
    /// theta'); `rows`: J, of which it is row `k`, 0 to 2.
    ///
    /// ```text
    /// c_x = P_xx by' - P_xt J_k',   c_t = P_tx by' - P_tt J_k',   by c_x - J_k c_t
    /// ```
    pub fn of_output(&mut self, rows: &Rows<'_, T>, k: usize, by: &[T; X]) -> ([T; X], [T; N], T) {
        self.apply_deferred();
        let mut row = [T::ZERO; N];
        for (entry, values) in row.iter_mut().skip(rows.start).zip(rows.values) {
            *entry = values.get(k).copied().unwrap_or(T::ZERO);
        }
        let mut of_x = [T::ZERO; X];
        let mut of_theta = [T::ZERO; N];
        for (entry, (xx, xt)) in of_x.iter_mut().zip(self.xx.iter().zip(&self.xt)) {
            *entry = dot(xx, by) - dot(xt, &row);
        }
        for (&by, xt) in by.iter().zip(&self.xt) {
            axpy(&mut of_theta, by, xt);
        }
        for (i, entry) in of_theta.iter_mut().enumerate() {
            for (j, value) in row.iter().enumerate() {
                *entry -= self.parameter(i, j) * *value;
            }
        }
        let variance = dot(by, &of_x) - dot(&row, &of_theta);
        (of_x, of_theta, variance)
    }

    /// Measurement update with an observation whose products with the errors are these
    /// ([`Self::of_output`]), and whose innovation has the variance 1 / `weight`: P -= c c' weight.
    pub fn update_output(&mut self, of_x: &[T; X], of_theta: &[T; N], weight: T) {
        self.apply_deferred();
        let factors = of_x.map(|c| -(weight * c));
        for (row, &factor) in self.xx.iter_mut().zip(&factors) {
            axpy(row, factor, of_x);
        }
        axpy_rows(self.xt.as_flattened_mut(), &factors, of_theta);
        for (i, &c) in of_theta.iter().enumerate() {
            for (j, &d) in of_theta.iter().enumerate().take(i + 1) {
                let left = self.parameter(i, j) - weight * c * d;
                self.set_parameter(i, j, left);
            }
        }
    }

    /// Applies the deferred changes to P_tt. Every method that needs P_tt does so first.
    pub(super) fn apply_deferred(&mut self) {
        self.deferred.apply(&mut self.tt);
    }

    /// Raises each variance to at least these values, so that what was learnt stays open to change
    /// over days.
    pub fn floor(&mut self, error: &[T; X], parameters: &[T; N]) {
        self.apply_deferred();
        for i in 0..X {
            self.xx[i][i] = at_least(self.xx[i][i], error[i]);
        }
        diagonal(&mut self.tt, N, |i, variance| {
            let least = parameters.get(i).copied().unwrap_or(T::ZERO);
            *variance = at_least(*variance, least);
        });
    }

    /// Whether every value is finite; deferred changes are not included.
    ///
    /// Of P_tt the diagonal is looked at. Each change adds w c c' to it, and the value in row i and
    /// column j cannot leave the range of numbers if those of c_i^2 and c_j^2 do not. A value that
    /// another cause has damaged comes into P_xt with the next time update, if it is no number.
    pub fn is_finite(&self) -> bool {
        let [xx, xt] = [self.xx.as_flattened(), self.xt.as_flattened()];
        let mut variances = [T::ZERO; N];
        for (i, variance) in variances.iter_mut().enumerate() {
            *variance = self.parameter(i, i);
        }
        [xx, xt, &variances].into_iter().all(finite)
    }
}
