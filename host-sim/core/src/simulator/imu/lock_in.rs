//! Lock-in of a dithered ring laser, the cause of its angle random walk.
//!
//! The phase psi of the beat obeys (Aronowitz 1971; Chow et al. 1985)
//!
//! ```text
//! dpsi/dt = k (Omega - Omega_L sin psi + dtheta_D/dt),     k = 2 pi / fringe,
//! ```
//!
//! with input rate Omega, lock-in threshold Omega_L and dither angle theta_D = A sin(2 pi f t),
//! whose amplitude A is drawn for every half period. Near each reversal of the dither rate the
//! phase is psi_0 + k alpha t^2 / 2 with the peak angular acceleration alpha = A (2 pi f)^2. The
//! method of stationary phase gives the angle that the lock-in term adds there,
//!
//! ```text
//! delta = -Omega_L sqrt(2 pi / (k alpha)) sin(psi_0 + pi/4).
//! ```
//!
//! The random amplitude makes psi_0 uniform and independent at each of the 2 f reversals per
//! second. So the angle makes a random walk with
//!
//! ```text
//! N^2 = 2 f <delta^2> = 2 f Omega_L^2 pi / (k alpha)
//! N = Omega_L sqrt(fringe / (2 pi Omega_D)),
//! ```
//!
//! where Omega_D = 2 pi f A is the peak dither rate. N is proportional to the lock-in rate and, at
//! a given amplitude, to one over the root of the dither frequency, as Tehrani and Soltanieh (arXiv
//! 2005.09749) find from the Fokker-Planck equation. The simulator adds this random walk to its
//! samples. The tests here integrate the equation itself and find the same walk.

use std::f64::consts::TAU;

/// Angle random walk from lock-in, rad/sqrt(s). Lock-in threshold in rad/s, angle of a fringe and
/// dither amplitude in rad, frequency in Hz.
#[must_use]
pub fn angle_random_walk(lock_in: f64, fringe: f64, amplitude: f64, frequency: f64) -> f64 {
    let peak_rate = TAU * frequency * amplitude;
    lock_in * (fringe / (TAU * peak_rate)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertial::units::{ARCSEC, DEG_PER_H};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};
    use std::f64::consts::PI;

    /// The equation itself, in SI.
    #[derive(Debug, Clone, Copy)]
    struct LockIn {
        /// Lock-in threshold, rad/s.
        lock_in: f64,
        /// Angle of a fringe, rad.
        fringe: f64,
        /// Dither frequency, Hz.
        frequency: f64,
    }

    impl LockIn {
        /// Advances `psi` over one half period of the dither of this amplitude (rad, its sign is
        /// the direction) at the input `rate` (rad/s), by fourth-order Runge-Kutta in steps of at
        /// most 0.2 rad of phase. The dither angle is zero at both ends of the half period, so
        /// `fringe / 2 pi` times the change of `psi` is the measured angle.
        fn half_period(&self, psi: f64, rate: f64, amplitude: f64) -> f64 {
            const PHASE_STEP: f64 = 0.2;
            let k = TAU / self.fringe;
            let omega = TAU * self.frequency;
            let span = 0.5 / self.frequency;
            let fastest = k * (rate.abs() + self.lock_in + omega * amplitude.abs());
            let steps = (fastest * span / PHASE_STEP).ceil().max(16.0);
            let h = span / steps;
            // dpsi/dt; the values at start, middle and end of a step share their cosines
            let slope = |psi: f64, dither: f64| k * (rate + dither - self.lock_in * psi.sin());
            let dither = |t: f64| amplitude * omega * (PI * t / span).cos();
            let mut psi = psi;
            let mut start = dither(0.0);
            for i in 0..steps as usize {
                let t = i as f64 * h;
                let (middle, end) = (dither(t + 0.5 * h), dither(t + h));
                let k1 = slope(psi, start);
                let k2 = slope(psi + 0.5 * h * k1, middle);
                let k3 = slope(psi + 0.5 * h * k2, middle);
                let k4 = slope(psi + h * k3, end);
                psi += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
                start = end;
            }
            psi
        }
    }

    const RING: LockIn = LockIn {
        lock_in: 300.0 * DEG_PER_H,
        fringe: 2.42 * ARCSEC,
        frequency: 400.0,
    };

    /// Errors of the measured angle over each whole dither period, rad.
    fn errors(ring: &LockIn, rate: f64, amplitude: f64, noise: f64, periods: usize) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut psi = 0.3;
        let mut half = |psi: f64, sign: f64| {
            let z: f64 = StandardNormal.sample(&mut rng);
            ring.half_period(psi, rate, sign * (amplitude + noise * z))
        };
        (0..periods)
            .map(|_| {
                let before = psi;
                psi = half(psi, 1.0);
                psi = half(psi, -1.0);
                (psi - before) * ring.fringe / TAU - rate / ring.frequency
            })
            .collect()
    }

    /// Random walk from the variance of sums over `block` periods, so that correlation within a
    /// block counts.
    fn walk(errors: &[f64], block: usize, frequency: f64) -> f64 {
        let sums: Vec<f64> = errors.chunks_exact(block).map(|c| c.iter().sum()).collect();
        let mean = sums.iter().sum::<f64>() / sums.len() as f64;
        let variance = sums.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / sums.len() as f64;
        (variance * frequency / block as f64).sqrt()
    }

    #[test]
    fn without_dither_it_locks_below_the_threshold_and_beats_above_as_adler_says() {
        let beat = |rate: f64| {
            let (mut psi, n) = (0.3, 4000);
            for _ in 0..n {
                psi = RING.half_period(psi, rate, 0.0);
            }
            psi * RING.fringe / TAU / (0.5 * f64::from(n) / RING.frequency)
        };
        assert!(beat(0.9 * RING.lock_in).abs() < 1e-3 * RING.lock_in);
        for ratio in [1.2, 3.0] {
            let adler = RING.lock_in * (ratio * ratio - 1.0_f64).sqrt();
            assert!(
                (beat(ratio * RING.lock_in) / adler - 1.0).abs() < 5e-3,
                "{ratio}"
            );
        }
    }

    #[test]
    fn regular_dither_leaves_the_dead_band_of_the_bessel_function() {
        // Below Omega_L |J0(k A)| the averaged phase does not move. k A = 3.8317 is the greatest
        // |J0| beyond its first zero, 0.4028. The lock-in is weak, because the average is exact
        // only for k Omega_L much below the dither frequency.
        let ring = LockIn {
            lock_in: 2.0 * DEG_PER_H,
            ..RING
        };
        let amplitude = 3.8317 * ring.fringe / TAU;
        let mean = |rate: f64| {
            let e = errors(&ring, rate, amplitude, 0.0, 40_000);
            let settled = &e[20_000..];
            rate + settled.iter().sum::<f64>() / settled.len() as f64 * ring.frequency
        };
        let band = 0.4028 * ring.lock_in;
        assert!(
            mean(0.9 * band).abs() < 0.02 * band,
            "{}",
            mean(0.9 * band) / band
        );
        let above = mean(1.5 * band) / band;
        assert!(
            (above - (1.5_f64 * 1.5 - 1.0).sqrt()).abs() < 0.03,
            "{above}"
        );
    }

    #[test]
    fn random_dither_frees_the_gyro_and_makes_the_random_walk_of_the_formula() {
        let base = (RING, 20.0 * ARCSEC);
        let cases = [
            base,
            (
                LockIn {
                    lock_in: 2.0 * RING.lock_in,
                    ..RING
                },
                20.0 * ARCSEC,
            ), // twice the walk
            (
                LockIn {
                    frequency: 1600.0,
                    ..RING
                },
                20.0 * ARCSEC,
            ), // half the walk
            (RING, 40.0 * ARCSEC), // 0.71 of the walk
        ];
        for (ring, amplitude) in cases {
            let rate = 15.0 * DEG_PER_H; // a twentieth of the lock-in threshold
            let e = errors(&ring, rate, amplitude, 2.42 * ARCSEC, 4000);
            let want = angle_random_walk(ring.lock_in, ring.fringe, amplitude, ring.frequency);
            let got = walk(&e, 4, ring.frequency);
            // 1000 sums: 2.2 % at one sigma
            assert!(
                (got / want - 1.0).abs() < 0.08,
                "{ring:?} {amplitude}: {}",
                got / want
            );
            let seconds = e.len() as f64 / ring.frequency;
            let mean = e.iter().sum::<f64>() / seconds;
            assert!(
                mean.abs() < 3.5 * want / seconds.sqrt(),
                "mean error {} deg/h",
                mean / DEG_PER_H
            );
        }
    }
}
