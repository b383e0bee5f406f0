//! The rounding to whole pulses, which is white noise only if other noise is larger.
//!
//! A sensor that counts pulses carries the remainder of a pulse to the next sample. So its integral
//! has a rounding error that is uniform over one pulse p, with the variance p^2 / 12. The model
//! takes the errors at two times as independent (`Q = p / sqrt 12`). This is true only if the noise
//! in between moves the integral by a good part of a pulse. At shorter times the error is a regular
//! sawtooth, whose Allan variance depends on the bias. From the Fourier series of the sawtooth: if
//! the integral changes by a Gaussian amount of standard deviation s, the correlation of the errors
//! is at most about `exp(-2 pi^2 s^2 / p^2)`. Such a series is fitted from a longer time on:
//! samples are joined until their rounding errors are independent.

use super::deviation::{LEAST_SAMPLES, variance};
use rayon::prelude::*;

/// The mean square of the second differences at which rounding errors are independent, in squares
/// of a pulse. A sawtooth alone has at most 1 and independent errors have one half. The remaining
/// three quarters are noise with s^2 = 0.375 p^2, which leaves a correlation of 6e-4.
const INDEPENDENT: f64 = 1.25;

/// The smallest step between different values. It is the pulse if the series is made of pulses, and
/// nearly zero if not.
fn pulse(mut values: Vec<f64>) -> Option<f64> {
    values.par_sort_unstable_by(f64::total_cmp);
    let steps = values.windows(2).map(|pair| pair[1] - pair[0]);
    steps.filter(|step| *step > 0.0).min_by(f64::total_cmp)
}

/// Number of samples to join, so that the rounding errors of the joined ones are independent: a
/// power of two. It is 1 if no number is enough, or if too few joined samples would remain.
#[must_use]
pub fn joined(increments: Vec<f64>, x: &[f64]) -> usize {
    let samples = increments.len();
    let Some(pulse) = pulse(increments) else {
        return 1;
    };
    let longest = samples / LEAST_SAMPLES;
    let octaves = (0..).map(|k| 1_usize << k).take_while(|&m| m <= longest);
    let mut join = None;
    for m in octaves {
        // with intervals of one, the mean square is 2 m^2 times the variance
        let mean_square = 2.0 * (m as f64).powi(2) * variance(x, 1.0, m);
        if mean_square < INDEPENDENT * pulse * pulse {
            join = None;
        } else {
            join = join.or(Some(m));
        }
    }
    join.unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::super::deviation::phase;
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// White noise of `sigma` pulses a sample and a bias of 0.01 pulses, in whole pulses of 3.
    fn counted(sigma: f64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut rest = 0.0;
        let counts = (0..100_000).map(|_| {
            let z: f64 = StandardNormal.sample(&mut rng);
            let sum: f64 = rest + 0.01 + sigma * z;
            rest = sum - sum.round();
            3.0 * sum.round()
        });
        counts.collect()
    }

    #[test]
    fn samples_are_joined_until_noise_spans_the_pulse() {
        // s^2 = 0.375 is reached after 0.375 / sigma^2 samples: 1, 37.5, 104
        for (sigma, want) in [(2.0, 1), (0.1, 64), (0.06, 128)] {
            let d = counted(sigma);
            let x = phase(&d);
            assert_eq!(joined(d, &x), want, "{sigma}");
        }
        // no noise at all: no number of samples helps
        for d in [counted(0.0), vec![1.0; 500]] {
            let x = phase(&d);
            assert_eq!(joined(d, &x), 1);
        }
    }
}
