//! Bias instability: noise whose power density falls with one over the frequency (flicker).
//!
//! The coefficient B stands for this two-sided density and this Allan deviation (IEEE Std 952-1997,
//! annex C):
//!
//! ```text
//! S(f) = B^2 / (2 pi f)        sigma(tau) = sqrt(2 ln 2 / pi) B = 0.664 B,    whatever tau is
//! ```
//!
//! The noise is the sum of first-order Gauss-Markov processes whose time constants T grow by a
//! factor r (Keshner 1982, "1/f noise"). Between the fastest and the slowest, the sum of their
//! densities 2 s^2 T / (1 + (2 pi f T)^2) is s^2 / (2 f ln r). With s^2 = B^2 ln(r) / pi this is
//! S(f). With r = 4 each process has the standard deviation of the floor, 0.664 B. The Allan
//! deviation of the sum lies within 6 % of the floor from 1 s to 9 h, and within 1 % from 1 min to
//! 1 h.

use super::super::draws::normal3;
use super::SLOW_S;
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;

/// Number of processes.
const PROCESSES: usize = 9;
/// Time constant of the fastest one, s.
const SHORTEST_S: f64 = 1.0;
/// Ratio of neighbouring time constants.
const RATIO: f64 = 4.0;
/// Allan deviation, and standard deviation of each process, over B: the root of 2 ln 2 / pi.
pub(in super::super) const FLOOR: f64 = 0.664_282_470_267_960_1;
/// Standard deviation of the sum over B.
pub(in super::super) const SPREAD: f64 = 3.0 * FLOOR;

/// Time constants of the processes, s.
pub(in super::super) fn times_s() -> [f64; PROCESSES] {
    std::array::from_fn(|k| SHORTEST_S * RATIO.powi(k as i32))
}

/// The bias instability of one triad.
#[derive(Debug, Clone)]
pub(super) struct Flicker {
    states: [Vector3<f64>; PROCESSES],
    /// Factor by which each process decays over a period, and the standard deviation of the noise
    /// that is added.
    steps: [(f64, f64); PROCESSES],
    rng: ChaCha8Rng,
}

impl Flicker {
    /// With the coefficient `b`, in its stationary state. `None` if the coefficient is zero.
    pub(super) fn new(b: f64, mut rng: ChaCha8Rng) -> Option<Self> {
        let sigma = FLOOR * b;
        (b > 0.0).then(|| Self {
            states: [(); PROCESSES].map(|()| normal3(&mut rng) * sigma),
            steps: times_s().map(|time| {
                let keep = (-SLOW_S / time).exp();
                (keep, sigma * (1.0 - keep * keep).sqrt())
            }),
            rng,
        })
    }

    /// The bias, `SLOW_S` after the last one.
    pub(super) fn step(&mut self) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for (state, (keep, added)) in self.states.iter_mut().zip(self.steps) {
            *state = *state * keep + normal3(&mut self.rng) * added;
            sum += *state;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{ErrorModelName, Imu, ImuSpec};
    use super::*;
    use crate::inertial::ekf::Triad;
    use crate::inertial::sins::Increment;
    use crate::inertial::units::{DEG_PER_H, UG};

    fn spec() -> ImuSpec {
        let mut spec = ImuSpec::preset("medium")
            .unwrap()
            .error_model(ErrorModelName::Noise);
        spec.rate_hz = 10;
        spec.gyro.bias_instability_dph = 0.01;
        spec.accel.bias_instability_ug = 50.0;
        spec
    }

    /// Allan variance of a series at clusters of `m`, not overlapping.
    fn allan_variance(series: &[f64], m: usize) -> f64 {
        let means: Vec<f64> = series
            .chunks_exact(m)
            .map(|c| c.iter().sum::<f64>() / m as f64)
            .collect();
        let squares = means.windows(2).map(|w| (w[1] - w[0]).powi(2));
        squares.sum::<f64>() / (2 * (means.len() - 1)) as f64
    }

    /// Systematic errors of the six sensors second by second, in the units of the datasheet.
    fn biases(spec: &ImuSpec, turn_on: u64, seconds: usize) -> [Vec<f64>; 6] {
        let mut imu = Imu::new(spec, 1, turn_on);
        let mut out: [Vec<f64>; 6] = Default::default();
        for _ in 0..seconds {
            let mut last = Increment::default();
            for _ in 0..spec.rate_hz {
                last = imu.measure(&Increment::default()).1;
            }
            let (gyro, accel) = (last.dtheta / (0.1 * DEG_PER_H), last.dv / (0.1 * UG));
            for (series, x) in out.iter_mut().zip(gyro.iter().chain(&accel)) {
                series.push(*x);
            }
        }
        out
    }

    /// Four turn-ons of 36 h: at 1024 s each triad has 1500 clusters, 1.8 % of the deviation at one
    /// sigma.
    #[test]
    fn allan_deviation_is_flat_at_its_floor() {
        let clusters = [1, 4, 16, 64, 256, 1024];
        let mut variance = [[0.0; 2]; 6];
        for turn_on in 0..4 {
            let all = biases(&spec(), turn_on, 1 << 17);
            for (sum, m) in variance.iter_mut().zip(clusters) {
                for (sensor, series) in all.iter().enumerate() {
                    sum[sensor / 3] += allan_variance(series, m) / 12.0;
                }
            }
        }
        for (variance, m) in variance.into_iter().zip(clusters) {
            for (variance, b) in variance.into_iter().zip([0.01, 50.0]) {
                let off = variance.sqrt() / (0.664 * b) - 1.0;
                println!("{m} s, B = {b}: {:+.1} % off the floor", 100.0 * off);
                assert!(off.abs() < 0.05, "{m} s, B = {b}: {off}");
            }
        }
    }

    #[test]
    fn it_is_new_at_every_turn_on_and_shifts_no_other_draw() {
        let start = |turn_on| biases(&spec(), turn_on, 1).map(|s| s[0]);
        assert_eq!(start(1), start(1));
        assert!(start(1).iter().zip(start(2)).all(|(a, b)| *a != b));
        let preset = ImuSpec::preset("medium").unwrap();
        let mut with = preset.clone();
        with.gyro.bias_instability_dph = 1e-9; // draws, and adds next to nothing
        with.accel.bias_instability_ug = 1e-9;
        let [mut with, mut without] = [with, preset].map(|spec| Imu::new(&spec, 7, 11));
        for _ in 0..1000 {
            let [a, b] = [&mut with, &mut without].map(|imu| imu.measure(&Increment::default()));
            assert_eq!(a.0, b.0);
            assert!((a.1.dtheta - b.1.dtheta).norm() < 1e-9 * DEG_PER_H);
        }
    }

    #[test]
    fn a_filter_has_a_state_for_every_process() {
        for (triad, b) in [(Triad::Gyro, 0.01 * DEG_PER_H), (Triad::Accel, 50.0 * UG)] {
            let parameters = spec().parameters(triad, 2);
            assert_eq!(parameters.len(), PROCESSES);
            for (p, time) in parameters.iter().zip(times_s()) {
                assert_eq!((p.axis, p.time_s), (2, time));
                assert!((p.sigma / (FLOOR * b) - 1.0).abs() < 1e-12);
                // in a steady state the noise makes up for the decay: walk^2 = 2 sigma^2 / T
                assert!((p.walk.powi(2) * time / (2.0 * p.sigma.powi(2)) - 1.0).abs() < 1e-12);
            }
        }
        let [gyro, accel] = spec().expected_bias();
        assert!((gyro / 0.0199 - 1.0).abs() < 0.01 && (accel / 99.6 - 1.0).abs() < 0.01);
    }
}
