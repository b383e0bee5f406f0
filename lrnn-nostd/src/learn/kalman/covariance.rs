//! The covariance of X outer errors and N parameters, symmetric by construction.

use super::packed::{
    Held, Row, Rows, axpy, axpy_rows, diagonal, dot, dot_four, finite, tail, times,
};
use crate::real::Real;

/// P in three parts: outer errors X x X, outer by parameters X x N, parameters packed (row i holds the columns 0..=i, so that
/// `PACKED` = N (N + 1) / 2 values).
///
/// What an observation of an outer error changes in the last of them, P_tt, is needed by no other observation of an outer error: it is
/// held back and taken in for several at once ([`Self::absorb`]), so that the largest part is read and written once.
#[derive(Clone, Debug, PartialEq)]
pub struct Covariance<const X: usize, const N: usize, const PACKED: usize, T = f32> {
    xx: [[T; X]; X],
    xt: [[T; N]; X],
    tt: [T; PACKED],
    held: Held<N, T>,
}

/// What a step of time keeps from one part to the next: P_xt J' as it was, and J P_tt J'.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage<const X: usize, const E: usize, T = f32> {
    c: [[T; E]; X],
    s: [[T; E]; E],
}

impl<const X: usize, const E: usize, T: Real> Passage<X, E, T> {
    /// Nothing yet.
    pub const BLANK: Self = Self {
        c: [[T::ZERO; E]; X],
        s: [[T::ZERO; E]; E],
    };
}

/// One scalar observation: what it was expected to be off by, and what it is off by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation<T = f32> {
    /// Observed minus predicted.
    pub value: T,
    /// Variance of that: of the prediction and of the observation together.
    pub variance: T,
}

impl<T: Real> Innovation<T> {
    /// value^2 / variance: chi-square of one degree of freedom where all assumptions hold.
    #[inline]
    pub fn squared_ratio(&self) -> T {
        self.value * self.value / self.variance
    }
}

impl<const X: usize, const N: usize, const PACKED: usize, T: Real> Covariance<X, N, PACKED, T> {
    /// To be begun.
    pub const BLANK: Self = {
        assert!(PACKED == N * (N + 1) / 2);
        Self {
            xx: [[T::ZERO; X]; X],
            xt: [[T::ZERO; N]; X],
            tt: [T::ZERO; PACKED],
            held: Held::BLANK,
        }
    };

    /// Independent errors with these standard deviations.
    pub fn begin(&mut self, outer: &[T; X], parameters: &[T; N]) {
        self.restart_outer(outer);
        self.held.clear();
        self.tt = [T::ZERO; PACKED];
        for (diagonal, &sigma) in diagonal(&mut self.tt).zip(parameters) {
            *diagonal = sigma * sigma;
        }
    }

    /// P_xx.
    pub fn outer(&self) -> &[[T; X]; X] {
        &self.xx
    }

    /// Variance of each parameter.
    pub fn variances(&self) -> impl Iterator<Item = T> + '_ {
        let last = Rows::from(&self.tt, 0).filter_map(|row| row.last());
        let now = last.enumerate();
        now.map(|(i, &variance)| self.held.of_diagonal(i, variance))
    }

    /// New outer errors with these standard deviations that have nothing to do with what the parameters are.
    pub fn restart_outer(&mut self, outer: &[T; X]) {
        self.xx = [[T::ZERO; X]; X];
        self.xt = [[T::ZERO; N]; X];
        for i in 0..X {
            self.xx[i][i] = outer[i] * outer[i];
        }
    }

    /// New outer errors x = `by` (e - J theta') + rest, where theta' are the parameters' errors: an initial state that was found with the
    /// sensors' help is in error by what the sensors are.
    ///
    /// ```text
    /// P_xt = -by J P_tt,   P_xx = by (J P_tt J') by' + rest
    /// ```
    ///
    /// This is the first of its parts; then come the E parts [`Self::pass`] with -`by`, then [`Self::derived`].
    pub fn derive_outer(&mut self) {
        self.absorb_all();
        self.xt = [[T::ZERO; N]; X];
    }

    /// The last part of [`Self::derive_outer`].
    pub fn derived<const E: usize>(
        &mut self,
        by: &[[T; E]; X],
        rest: &[[T; X]; X],
        passage: &Passage<X, E, T>,
    ) {
        for i in 0..X {
            let mut left = [T::ZERO; E];
            for k in 0..E {
                axpy(&mut left, by[i][k], &passage.s[k]);
            }
            // the upper half twice, so that rounding cannot make it unsymmetric
            for j in i..X {
                let value = dot(&left, &by[j]) + rest[i][j];
                self.xx[i][j] = value;
                self.xx[j][i] = value;
            }
        }
    }

    /// Adds to the variances of the outer errors: what was believed of them is worth less than it was.
    pub fn inflate(&mut self, variance: &[T; X]) {
        for i in 0..X {
            self.xx[i][i] += variance[i];
        }
    }

    /// One step of time (section 5 of the mathematics), written for an effect of the parameters that passes through E outputs of a
    /// model, e = J theta, whose rows `jacobian[k]` are 0 outside a range:
    ///
    /// ```text
    /// x+ = Phi x + Gamma e + noise(Q),   theta+ = theta + noise(walk)
    /// P_xt+ = Phi P_xt + Gamma (J P_tt)
    /// P_xx+ = Phi P_xx Phi' + Phi (P_xt J') Gamma' + (.)' + Gamma (J P_tt J') Gamma' + Q
    /// P_tt+ = P_tt + walk
    /// ```
    ///
    /// About E N^2 / 2 + X (X + E) N multiply-adds. `walk` are variances. This is the first of its parts, C = P_xt J' and
    /// P_xt <- Phi P_xt; then come the E parts [`Self::pass`], then [`Self::arrive`].
    pub fn leave<const E: usize>(
        &mut self,
        phi: &[[T; X]; X],
        jacobian: &[Row<'_, T>; E],
    ) -> Passage<X, E, T> {
        self.absorb_all();
        let mut passage = Passage::BLANK;
        for (k, row) in jacobian.iter().enumerate() {
            let (fours, ones) = passage.c.as_chunks_mut::<4>();
            let (xt_fours, xt_ones) = self.xt.as_chunks::<4>();
            for (c, xt) in fours.iter_mut().zip(xt_fours) {
                let rows = xt.each_ref().map(|xt| tail(xt, row.start));
                let (row_fours, row_ones) = row.values.as_chunks::<4>();
                let products = dot_four(rows, row_fours, row_ones);
                for (c, product) in c.iter_mut().zip(products) {
                    c[k] = product;
                }
            }
            for (c, xt) in ones.iter_mut().zip(xt_ones) {
                c[k] = row.dot(xt);
            }
        }
        self.carry_outer(phi);
        passage
    }

    /// One of the E parts in between: what output `k` does; nothing beyond E.
    #[inline(never)]
    pub fn pass<const E: usize>(
        &mut self,
        k: usize,
        gamma: &[[T; E]; X],
        jacobian: &[Row<'_, T>; E],
        passage: &mut Passage<X, E, T>,
    ) {
        let (Some(&row), Some(products)) = (jacobian.get(k), passage.s.get_mut(k)) else {
            return;
        };
        let mut b = [T::ZERO; N];
        times(&self.tt, row, &mut b);
        for (product, row) in products.iter_mut().zip(jacobian) {
            *product = row.dot(&b);
        }
        let factors = gamma.map(|row| row.get(k).copied().unwrap_or(T::ZERO));
        axpy_rows(&mut self.xt, factors, &b);
    }

    /// The last part of what [`Self::leave`] began: P_xx and P_tt.
    pub fn arrive<const E: usize>(
        &mut self,
        phi: &[[T; X]; X],
        gamma: &[[T; E]; X],
        q: &[[T; X]; X],
        walk: &[T; N],
        passage: &Passage<X, E, T>,
    ) {
        self.spread(phi, gamma, &passage.c, &passage.s, q);
        for (diagonal, &walk) in diagonal(&mut self.tt).zip(walk) {
            *diagonal += walk;
        }
    }

    /// P_xt <- Phi P_xt.
    #[inline]
    fn carry_outer(&mut self, phi: &[[T; X]; X]) {
        for j in (0..N).step_by(2) {
            let mut columns = [[T::ZERO; 2]; X];
            for (columns, row) in columns.iter_mut().zip(&self.xt) {
                for (value, &entry) in columns.iter_mut().zip(tail(row, j)) {
                    *value = entry;
                }
            }
            for (row, phi) in self.xt.iter_mut().zip(phi) {
                let mut sums = [T::ZERO; 2];
                for (&phi, columns) in phi.iter().zip(&columns) {
                    axpy(&mut sums, phi, columns);
                }
                for (entry, sum) in row.iter_mut().skip(j).zip(sums) {
                    *entry = sum;
                }
            }
        }
    }

    /// P_xx <- Phi P_xx Phi' + Phi C Gamma' + (.)' + Gamma S Gamma' + Q, from the halves U of a sum U + U'.
    fn spread<const E: usize>(
        &mut self,
        phi: &[[T; X]; X],
        gamma: &[[T; E]; X],
        c: &[[T; E]; X],
        s: &[[T; E]; E],
        q: &[[T; X]; X],
    ) {
        let half = T::from_f64(0.5);
        let mut u = [[T::ZERO; X]; X];
        for i in 0..X {
            // left = Phi_i P_xx / 2,  right = Phi_i C + Gamma_i S / 2
            let (mut left, mut right) = ([T::ZERO; X], [T::ZERO; E]);
            for l in 0..X {
                axpy(&mut left, half * phi[i][l], &self.xx[l]);
                axpy(&mut right, phi[i][l], &c[l]);
            }
            for l in 0..E {
                axpy(&mut right, half * gamma[i][l], &s[l]);
            }
            for k in 0..X {
                u[i][k] = dot(&left, &phi[k]) + dot(&right, &gamma[k]);
            }
        }
        for i in 0..X {
            for k in 0..X {
                self.xx[i][k] = u[i][k] + u[k][i] + q[i][k];
            }
        }
    }

    /// Variance of outer error `i`; 0 beyond X.
    #[inline]
    pub fn variance(&self, i: usize) -> T {
        self.xx
            .get(i)
            .and_then(|row| row.get(i))
            .copied()
            .unwrap_or(T::ZERO)
    }

    /// Takes in an observation of outer error `i` itself and adds K * innovation to the means; nothing happens beyond X. P_tt follows
    /// in [`Self::absorb`].
    ///
    /// ```text
    /// means += c v / s,  P -= c c' / s
    /// ```
    #[inline]
    pub fn observe_outer(
        &mut self,
        i: usize,
        innovation: Innovation<T>,
        x: &mut [T; X],
        theta: &mut [T; N],
    ) {
        if self.held.is_closed() {
            self.absorb_all();
        }
        let weight = T::ONE / innovation.variance;
        let (Some(&cx), Some(ct)) = (self.xx.get(i), self.xt.get(i)) else {
            return;
        };
        let (Some(&own), Some(ct)) = (cx.get(i), self.held.hold(ct, weight)) else {
            return;
        };
        axpy(x, weight * innovation.value, &cx);
        axpy(theta, weight * innovation.value, ct);
        let factors = cx.map(|c| -(weight * c));
        axpy_rows(&mut self.xx, factors, &cx);
        axpy_rows(&mut self.xt, factors, ct);
        // What was observed: (1 - P_ii / s) P_ij, without the cancellation.
        let left = (innovation.variance - own) / innovation.variance;
        for j in 0..X {
            let value = left * cx[j];
            if let Some(entry) = self.xx.get_mut(i).and_then(|row| row.get_mut(j)) {
                *entry = value;
            }
            if let Some(entry) = self.xx[j].get_mut(i) {
                *entry = value;
            }
        }
        if let Some(row) = self.xt.get_mut(i) {
            for (entry, &c) in row.iter_mut().zip(ct) {
                *entry = left * c;
            }
        }
    }

    /// The next part, of [`ABSORB_PARTS`](super::ABSORB_PARTS), of what the observations that are held back change in P_tt; whether there is more. Whatever
    /// else needs P_tt does all of them first.
    pub fn absorb(&mut self) -> bool {
        self.held.absorb(&mut self.tt)
    }

    fn absorb_all(&mut self) {
        while self.absorb() {}
    }

    /// No variance below these: P stays positive, and what is learnt stays open to change, for days.
    pub fn floor(&mut self, outer: &[T; X], parameters: &[T; N]) {
        self.absorb_all();
        for i in 0..X {
            self.xx[i][i] = at_least(self.xx[i][i], outer[i]);
        }
        for (variance, &least) in diagonal(&mut self.tt).zip(parameters) {
            *variance = at_least(*variance, least);
        }
    }

    /// Whether every value is finite, without what is held back.
    pub fn is_finite(&self) -> bool {
        let [xx, xt] = [self.xx.as_flattened(), self.xt.as_flattened()];
        [xx, xt, &self.tt].into_iter().all(finite)
    }
}

/// `least` for what is less or no number.
#[inline]
fn at_least<T: Real>(value: T, least: T) -> T {
    if value >= least { value } else { least }
}
