//! Irregular motion in six degrees of freedom as a sum of sinusoids with random phases: the waves
//! of a sea, the turbulence of the air.

use super::dual::Dual;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Standard gravity, m/s2, for the dispersion of waves and the bank of turns.
pub(super) const GRAVITY: f64 = 9.806_65;
/// Sinusoids of a spectrum.
const LINES: usize = 32;

/// One sinusoid: `amplitude * sin(omega t + phase)` in each degree of freedom.
#[derive(Debug, Clone, Copy)]
struct Line {
    omega: f64,
    /// Amplitude times cosine and sine of the phase.
    shares: [[f64; 2]; 6],
}

impl Line {
    fn new(omega: f64, shares: [[f64; 2]; 6]) -> Self {
        let shares = shares.map(|[amplitude, phase]| {
            let (s, c) = phase.sin_cos();
            [amplitude * c, amplitude * s]
        });
        Self { omega, shares }
    }
}

/// Velocities along north-east-down or the ship's forward, right, down axes (m/s), then the angles
/// roll, pitch, yaw (rad).
#[derive(Debug, Clone)]
pub(super) struct Waves {
    lines: Vec<Line>,
}

/// A sea, and the response of a hull to it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sea {
    /// Significant height of the waves, m.
    pub(super) height: f64,
    /// Period at the peak of the spectrum, s.
    pub(super) period: f64,
    /// Natural period of the roll, s, and its damping ratio.
    pub(super) roll_period: f64,
    pub(super) roll_damping: f64,
    /// Length of the hull, m: shorter waves do not move it.
    pub(super) length: f64,
}

impl Waves {
    /// Values and derivatives at `t` s.
    pub(super) fn at(&self, t: f64) -> [Dual; 6] {
        let mut out = [Dual::default(); 6];
        for line in &self.lines {
            let (sin, cos) = (line.omega * t).sin_cos();
            for (sum, [s, c]) in out.iter_mut().zip(line.shares) {
                sum.value += s * sin + c * cos;
                sum.rate += line.omega * (s * cos - c * sin);
            }
        }
        out
    }

    /// The motion of a hull in a sea. The spectrum is that of Bretschneider, which the ITTC
    /// recommends for the open sea (1978):
    ///
    /// ```text
    /// S(w) = 5/16 H^2 wp^4 / w^5 exp(-5/4 (wp/w)^4)
    /// ```
    ///
    /// The waves come from one random side. A hull follows waves that are much longer than itself:
    /// heave is the height of the wave, roll and pitch are its slope, surge and sway are the motion
    /// of the water. The response falls for waves shorter than the hull, and roll resonates
    /// (assumed; a plain strip-theory picture). The frequencies are the encounter frequencies of
    /// the ship.
    pub(super) fn of_sea(sea: &Sea, rng: &mut ChaCha8Rng) -> Self {
        let peak = TAU / sea.period;
        let (beam, ahead) = rng.random_range(0.0..TAU).sin_cos();
        let [low, high] = [0.55 * peak, 3.0 * peak];
        let width = (high - low) / LINES as f64;
        let lines = (0..LINES).map(|k| {
            let omega = low + (k as f64 + rng.random_range(0.0..1.0)) * width;
            let ratio = peak / omega;
            let density = 5.0 / 16.0 * sea.height.powi(2) * ratio.powi(4) / omega
                * (-1.25 * ratio.powi(4)).exp();
            let elevation = (2.0 * density * width).sqrt();
            let number = omega * omega / GRAVITY;
            let follows = 1.0 / (1.0 + (number * sea.length / TAU).powi(2));
            let slope = number * elevation * follows;
            let r = omega * sea.roll_period / TAU;
            let resonance = 1.0 / (1.0 - r * r).hypot(2.0 * sea.roll_damping * r);
            let water = omega * elevation * follows;
            let mut share = |amplitude: f64| [amplitude, rng.random_range(0.0..TAU)];
            let shares = [
                share(water * ahead),
                share(water * beam),
                share(water),
                share(slope * beam * resonance),
                share(slope * ahead),
                share(0.3 * slope * beam * ahead * 2.0),
            ];
            Line::new(omega, shares)
        });
        Self {
            lines: lines.collect(),
        }
    }

    /// Turbulence: velocities of `speed` m/s and angles of `angle` rad, 1 sigma, with periods from
    /// 3 to 40 s. The power falls with the square of the frequency, as in Dryden's spectrum above
    /// its corner.
    pub(super) fn of_air(speed: f64, angle: f64, rng: &mut ChaCha8Rng) -> Self {
        const MODES: usize = 12;
        let lines: Vec<[f64; 2]> = (0..MODES)
            .map(|k| {
                let share = (k as f64 + rng.random_range(0.0..1.0)) / MODES as f64;
                let period = 40.0 * (3.0_f64 / 40.0).powf(share);
                [TAU / period, period]
            })
            .collect();
        let power: f64 = lines.iter().map(|[_, weight]| 0.5 * weight * weight).sum();
        let scale = power.sqrt().recip();
        let lines = lines.iter().map(|&[omega, weight]| {
            let mut share = |sigma: f64| [sigma * weight * scale, rng.random_range(0.0..TAU)];
            let [v, a] = [speed, angle];
            Line::new(
                omega,
                [
                    share(v),
                    share(v),
                    share(v),
                    share(a),
                    share(a),
                    share(0.5 * a),
                ],
            )
        });
        Self {
            lines: lines.collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// The heave of a hull much shorter than the waves is the sea's elevation: four times its
    /// standard deviation is the significant height, by its definition. The spectrum above three
    /// times the peak's frequency holds 1.5 %, and below 0.55 times nothing.
    #[test]
    fn the_heave_has_the_significant_height() {
        let sea = Sea {
            height: 2.0,
            period: 8.0,
            roll_period: 10.0,
            roll_damping: 0.1,
            length: 1e-3,
        };
        let mut ratio = 0.0;
        for seed in 0..8 {
            let waves = Waves::of_sea(&sea, &mut ChaCha8Rng::seed_from_u64(seed));
            let dt = 0.1;
            let n = 200_000;
            let (mut height, mut sum, mut square) = (0.0, 0.0, 0.0);
            for k in 0..n {
                height += waves.at(f64::from(k) * dt)[2].value * dt;
                sum += height;
                square += height * height;
            }
            let mean = sum / f64::from(n);
            ratio += 4.0 * (square / f64::from(n) - mean * mean).sqrt() / sea.height / 8.0;
        }
        assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
    }

    #[test]
    fn turbulence_has_the_power_that_was_asked_for() {
        let waves = Waves::of_air(1.5, 0.02, &mut ChaCha8Rng::seed_from_u64(1));
        let n = 100_000;
        let square = |i: usize| {
            let values = (0..n).map(|k| waves.at(f64::from(k) * 0.1)[i].value.powi(2));
            (values.sum::<f64>() / f64::from(n)).sqrt()
        };
        assert!((square(0) / 1.5 - 1.0).abs() < 0.02, "{}", square(0));
        assert!((square(4) / 0.02 - 1.0).abs() < 0.02, "{}", square(4));
    }
}
