//! The covariance of Allan variances: the uncertainty of one, and the correlation of two at
//! different averaging times.
//!
//! The second differences d of the integral of a Gaussian noise have the covariance
//!
//! ```text
//! R(l) = sum_ab c_a c_b s(l + a m1 - b m2),      c = 1, -2, 1,
//! ```
//!
//! where s is the generalised autocovariance of the integral (Greenhall 1991; Greenhall and Riley
//! 2003). For the noises Q, N, B, K it is Q^2 delta, -N^2 |t|/2, B^2 t^2 ln|t| / 2 pi, K^2 |t|^3 /
//! 12. The mean squares of these differences then have the covariance
//!
//! ```text
//! cov(V1, V2) = (2 sum w R^2 + 4 mu1 mu2 sum w R) / (M1 M2)  /  (4 tau1^2 tau2^2)
//! ```
//!
//! with w(l) the number of pairs at lag l, and mu = R tau^2 the mean of d that a rate ramp R
//! causes. This holds for any mixture of noises. It gives the equivalent degrees of freedom 2 V^2 /
//! cov(V, V) that NIST SP 1065 tabulates for pure noises. The sums over lags have up to a million
//! terms. Between the lags at which an argument of s is zero the function R is smooth, so a
//! Gauss-Legendre rule for each such interval is enough.

use std::f64::consts::{LN_2, PI};

/// Squares of Q, N, B, K, R in SI.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Model(pub [f64; 5]);

impl Model {
    /// Factors of the squared coefficients in the Allan variance at averaging time `tau` s:
    /// 3/tau^2, 1/tau, 2 ln 2 / pi, tau/3, tau^2/2.
    #[must_use]
    pub fn basis(tau: f64) -> [f64; 5] {
        [
            3.0 / (tau * tau),
            1.0 / tau,
            2.0 * LN_2 / PI,
            tau / 3.0,
            tau * tau / 2.0,
        ]
    }

    /// Allan variance at `tau` s.
    #[must_use]
    pub fn variance(&self, tau: f64) -> f64 {
        Self::basis(tau)
            .iter()
            .zip(self.0)
            .map(|(basis, square)| basis * square)
            .sum()
    }

    /// Generalised autocovariance of the integral at the time `t`, s.
    fn s(&self, t: f64) -> f64 {
        let [q2, n2, b2, k2, _] = self.0;
        let t = t.abs();
        if t == 0.0 {
            return q2;
        }
        t * (-n2 / 2.0 + t * (b2 * t.ln() / (2.0 * PI) + t * k2 / 12.0))
    }

    /// Covariance of the second differences over m1 and m2 samples of `t0` s at a lag of `l`
    /// samples.
    fn r(&self, l: f64, m1: f64, m2: f64, t0: f64) -> f64 {
        const C: [(f64, f64); 3] = [(0.0, 1.0), (1.0, -2.0), (2.0, 1.0)];
        let mut sum = 0.0;
        for (a, ca) in C {
            for (b, cb) in C {
                sum += ca * cb * self.s((l + a * m1 - b * m2) * t0);
            }
        }
        sum
    }

    /// Covariance of the overlapping Allan variances at averages of m1 and m2 samples of `t0` s,
    /// from `samples` samples.
    #[must_use]
    pub fn covariance(&self, m1: usize, m2: usize, samples: usize, t0: f64) -> f64 {
        let count = |m: usize| (samples + 1 - 2 * m) as f64;
        let (n1, n2) = (count(m1), count(m2));
        let (m1, m2) = (m1 as f64, m2 as f64);
        let weight = |l: f64| n1.min(n2 + l) - l.max(0.0);
        let (mut squares, mut plain) = (0.0, 0.0);
        let mut add = |l: f64, step: f64| {
            let r = self.r(l, m1, m2, t0);
            squares += step * weight(l) * r * r;
            plain += step * weight(l) * r;
        };
        let stops = stops(m1, m2, n1, n2);
        for stretch in stops.windows(2) {
            sum_between(stretch[0], stretch[1], &mut add);
        }
        stops.iter().for_each(|&l| add(l, 1.0));
        let (tau1, tau2) = (m1 * t0, m2 * t0);
        let means = self.0[4] * (tau1 * tau2).powi(2); // mu1 mu2
        (2.0 * squares + 4.0 * means * plain) / (n1 * n2) / (4.0 * (tau1 * tau2).powi(2))
    }

    /// Equivalent degrees of freedom of the overlapping Allan variance at averages of m samples:
    /// 2 (mean)^2 / variance.
    #[must_use]
    pub fn edf(&self, m: usize, samples: usize, t0: f64) -> f64 {
        let mean = self.variance(m as f64 * t0);
        2.0 * mean * mean / self.covariance(m, m, samples, t0)
    }
}

/// Lags at which R or the weight has a kink, and the ends of the sum, in rising order.
fn stops(m1: f64, m2: f64, n1: f64, n2: f64) -> Vec<f64> {
    // flicker has the longest tail: its R falls as 1/l^2, and at 6 (m1 + m2) its square is below
    // 1e-5 of that in the middle
    let reach = m1 + m2;
    let mut stops: Vec<f64> = [
        -2.0 * m1 - 6.0 * reach,
        -2.0 * m1 - reach,
        2.0 * m2 + reach,
        2.0 * m2 + 6.0 * reach,
        0.0,
        n1 - n2,
    ]
    .into();
    for a in 0..3 {
        for b in 0..3 {
            stops.push(f64::from(b) * m2 - f64::from(a) * m1);
        }
    }
    let (first, last) = (1.0 - n2, n1 - 1.0);
    stops.iter_mut().for_each(|l| *l = l.clamp(first, last));
    stops.sort_by(f64::total_cmp);
    stops.dedup();
    stops
}

/// Sums a smooth term over the whole numbers strictly between `low` and `high`. `add` takes a lag
/// and its weight.
fn sum_between(low: f64, high: f64, add: &mut impl FnMut(f64, f64)) {
    /// Positive half of the Gauss-Legendre rule of 8 points on [-1, 1].
    const RULE: [(f64, f64); 4] = [
        (0.183_434_642_495_649_8, 0.362_683_783_378_362),
        (0.525_532_409_916_329, 0.313_706_645_877_887_3),
        (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
        (0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
    ];
    const FEW: f64 = 24.0;
    if high - low <= FEW {
        let mut l = low + 1.0;
        while l < high {
            add(l, 1.0);
            l += 1.0;
        }
        return;
    }
    // near a stop flicker bends sharply (t^2 ln t), so the first lags are summed one by one
    let edge = FEW / 4.0;
    sum_between(low, low + edge + 1.0, add);
    sum_between(high - edge - 1.0, high, add);
    let (from, to) = (low + edge + 0.5, high - edge - 0.5);
    let (middle, half) = ((from + to) / 2.0, (to - from) / 2.0);
    for (x, w) in RULE {
        add(middle - half * x, half * w);
        add(middle + half * x, half * w);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pure(noise: usize) -> Model {
        let mut squares = [0.0; 5];
        squares[noise] = 4.0;
        Model(squares)
    }

    #[test]
    fn r_at_lag_zero_is_the_allan_variance() {
        for noise in 0..4 {
            for m in [1.0, 7.0, 1000.0] {
                let tau = m * 0.02;
                let from_r = pure(noise).r(0.0, m, m, 0.02) / (2.0 * tau * tau);
                assert!(
                    (from_r / pure(noise).variance(tau) - 1.0).abs() < 1e-9,
                    "{noise} {m}"
                );
            }
        }
    }

    #[test]
    fn sums_by_the_rule_equal_full_sums() {
        let mixture = Model([1e-4, 1e-2, 1e-3, 1e-5, 1e-9]);
        for (m1, m2) in [(1, 1), (1, 300), (40, 300), (128, 256), (300, 300)] {
            for model in [pure(0), pure(1), pure(2), pure(3), mixture] {
                let n = 2000;
                let (n1, n2) = ((n + 1 - 2 * m1) as f64, (n + 1 - 2 * m2) as f64);
                let (mut squares, mut plain) = (0.0, 0.0);
                for i in (1 - n2 as i64)..(n1 as i64) {
                    let l = i as f64;
                    let w = n1.min(n2 + l) - l.max(0.0);
                    let r = model.r(l, m1 as f64, m2 as f64, 0.5);
                    squares += w * r * r;
                    plain += w * r;
                }
                let tau = (m1 * m2) as f64 * 0.25;
                let full = (2.0 * squares + 4.0 * model.0[4] * tau * tau * plain)
                    / (n1 * n2 * 4.0 * tau * tau);
                let by_rule = model.covariance(m1, m2, n, 0.5);
                assert!(
                    (by_rule / full - 1.0).abs() < 0.01,
                    "{m1} {m2} {:?}: {}",
                    model.0,
                    by_rule / full
                );
            }
        }
    }

    #[test]
    fn degrees_of_freedom_are_those_of_sp_1065() {
        // Stein's approximations in table 5 for white and random-walk rate noise (N phase points)
        let (samples, t0) = (10_000, 1.0);
        let n = (samples + 1) as f64;
        for m in [1, 8, 100, 1000] {
            let k = m as f64;
            let white = (3.0 * (n - 1.0) / (2.0 * k) - 2.0 * (n - 2.0) / n) * 4.0 * k * k
                / (4.0 * k * k + 5.0);
            assert!(
                (pure(1).edf(m, samples, t0) / white - 1.0).abs() < 0.06,
                "white {m}: {} {white}",
                pure(1).edf(m, samples, t0)
            );
            let walk = (n - 2.0) / k * ((n - 1.0).powi(2) - 3.0 * k * (n - 1.0) + 4.0 * k * k)
                / (n - 3.0).powi(2);
            assert!(
                (pure(3).edf(m, samples, t0) / walk - 1.0).abs() < 0.12,
                "walk {m}: {} {walk}",
                pure(3).edf(m, samples, t0)
            );
        }
    }
}
