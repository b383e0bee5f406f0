//! The overlapping Allan variance (IEEE 952-1997, C.1; NIST SP 1065, eq. 11).
//!
//! ```text
//! sigma^2(m t0) = 1 / (2 (m t0)^2 (N - 2m)) sum_i (x_{i+2m} - 2 x_{i+m} + x_i)^2
//! ```
//!
//! where x are the N integrals of the output (angle or velocity) at the ends of the sample
//! intervals t0.

use rayon::prelude::*;

/// The longest averaging time is this fraction of the recording, one quarter. Beyond it there are
/// fewer than three independent differences.
const LONGEST_PART: usize = 4;
/// Smallest number of samples that is analysed.
pub const LEAST_SAMPLES: usize = 100;

/// The estimate at one averaging time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Number of samples averaged.
    pub m: usize,
    /// Averaging time, s.
    pub tau: f64,
    /// Allan variance, (rad/s)^2 or (m/s2)^2.
    pub variance: f64,
}

/// Integral of `increments` without their mean, from 0 on. Second differences do not depend on the
/// mean, but rounding errors do.
#[must_use]
pub fn phase(increments: &[f64]) -> Vec<f64> {
    let mean = increments.iter().sum::<f64>() / increments.len().max(1) as f64;
    let mut sum = 0.0;
    let ends = increments.iter().map(|d| {
        sum += d - mean;
        sum
    });
    let mut x = Vec::with_capacity(increments.len() + 1);
    x.push(0.0);
    x.extend(ends);
    x
}

/// Overlapping Allan variance of the integral `x` at intervals of `t0` s for averages of `m`
/// samples, 1 <= m <= (N - 1) / 2.
#[must_use]
pub fn variance(x: &[f64], t0: f64, m: usize) -> f64 {
    let (early, middle, late) = (x, &x[m..], &x[2 * m..]);
    let n = late.len();
    // four partial sums: their order is fixed, so every machine gets the same result, and the loop
    // can be vectorised
    let mut sums = [0.0; 4];
    let (a, b, c) = (
        early[..n].chunks_exact(4),
        middle[..n].chunks_exact(4),
        late.chunks_exact(4),
    );
    let rest = n - n % 4..n;
    for ((a, b), c) in a.zip(b).zip(c) {
        for k in 0..4 {
            let d = c[k] - 2.0 * b[k] + a[k];
            sums[k] += d * d;
        }
    }
    let tail: f64 = rest
        .map(|i| (late[i] - 2.0 * middle[i] + early[i]).powi(2))
        .sum();
    let tau = m as f64 * t0;
    (sums.iter().sum::<f64>() + tail) / (2.0 * tau * tau * n as f64)
}

/// Numbers of samples to average: 1, 2, 4, ... and two between each pair, up to a quarter of
/// `samples`.
#[must_use]
pub fn averages(samples: usize) -> Vec<usize> {
    let all = (0..).map(|k| 2.0_f64.powf(f64::from(k) / 3.0).round() as usize);
    let mut ms: Vec<usize> = all.take_while(|&m| m <= samples / LONGEST_PART).collect();
    ms.dedup();
    ms
}

/// The Allan variance of `x`, at intervals of `t0` s, for averages of `ms` samples.
#[must_use]
pub fn curve(x: &[f64], t0: f64, ms: Vec<usize>) -> Vec<Point> {
    let point = |m: usize| Point {
        m,
        tau: m as f64 * t0,
        variance: variance(x, t0, m),
    };
    ms.into_par_iter().map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variance_is_that_of_its_definition() {
        let d: Vec<f64> = (0..203).map(|i| f64::from(i * 7919 % 101) - 50.0).collect();
        let x = phase(&d);
        for m in [1, 2, 3, 17, 50] {
            // half the mean square of the differences of neighbouring averages
            let average = |i: usize| d[i..i + m].iter().sum::<f64>() / (m as f64 * 0.5);
            let n = d.len() - 2 * m + 1;
            let want = (0..n)
                .map(|i| (average(i + m) - average(i)).powi(2))
                .sum::<f64>()
                / (2 * n) as f64;
            assert!((variance(&x, 0.5, m) / want - 1.0).abs() < 1e-12, "{m}");
        }
    }

    #[test]
    fn a_ramp_and_a_constant_are_known_exactly() {
        let ramp: Vec<f64> = (0..1000).map(|i| 3.0 + 0.01 * f64::from(i)).collect();
        let x = phase(&ramp);
        // sigma = R tau / sqrt 2 with R = 0.01 a sample interval of 1 s
        assert!((variance(&x, 1.0, 20) / (0.01_f64 * 20.0).powi(2) * 2.0 - 1.0).abs() < 1e-9);
        assert!(
            curve(&phase(&[5.0; 400]), 1.0, averages(400))
                .iter()
                .all(|p| p.variance < 1e-25)
        );
    }

    #[test]
    fn averages_rise_and_end_at_a_quarter() {
        let ms = averages(1_440_000);
        assert!(ms.is_sorted() && ms.windows(2).all(|w| w[0] < w[1]));
        assert_eq!(&ms[..5], &[1, 2, 3, 4, 5]);
        let last = *ms.last().unwrap();
        assert!(last <= 360_000 && last > 270_000 && ms.contains(&262_144));
        assert_eq!(averages(3), Vec::<usize>::new());
    }
}
