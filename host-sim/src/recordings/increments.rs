//! Resamples recorded rates or increments with time stamps to increments of equal length.

use crate::inertial::sins::Increment;

/// Integrals of angular rate and specific force up to each sample.
#[derive(Debug, Clone, Default)]
pub struct MotionIntegral {
    time: Vec<f64>,
    sum: Vec<Increment>,
}

impl MotionIntegral {
    /// Integrates `rates` (rad/s and m/s2) at the rising times `time` by the trapezoidal rule.
    #[must_use]
    pub fn of_rates(time: &[f64], rates: &[Increment]) -> Self {
        let mut sum = Increment::default();
        let mut sums = Vec::with_capacity(time.len());
        for k in 0..time.len() {
            if k > 0 {
                let half = 0.5 * (time[k] - time[k - 1]);
                sum.dtheta += (rates[k].dtheta + rates[k - 1].dtheta) * half;
                sum.dv += (rates[k].dv + rates[k - 1].dv) * half;
            }
            sums.push(sum);
        }
        Self {
            time: time.to_vec(),
            sum: sums,
        }
    }

    /// Sums `increments`, each of which ends at its time. Times rise; the first increment is `lead`
    /// s long.
    #[must_use]
    pub fn of_increments(time: &[f64], increments: &[Increment], lead: f64) -> Self {
        let mut sum = Increment::default();
        let first = time.first().map_or(0.0, |t| t - lead);
        let mut out = Self {
            time: vec![first],
            sum: vec![sum],
        };
        for (t, increment) in time.iter().zip(increments) {
            sum.dtheta += increment.dtheta;
            sum.dv += increment.dv;
            out.time.push(*t);
            out.sum.push(sum);
        }
        out
    }

    /// First and last time. There must be at least two samples.
    #[must_use]
    pub fn span(&self) -> (f64, f64) {
        (self.time[0], self.time[self.time.len() - 1])
    }

    /// `count` increments of length `dt` from time `from` on. The rate between two samples is taken
    /// as constant, so no motion is lost or counted twice however uneven the times are. Before the
    /// first and after the last sample there is no motion.
    #[must_use]
    pub fn increments(&self, from: f64, dt: f64, count: usize) -> Vec<Increment> {
        let mut k = 0;
        let mut before = self.at(from, &mut k);
        (1..=count)
            .map(|n| {
                let now = self.at(from + n as f64 * dt, &mut k);
                let increment = Increment {
                    dtheta: now.dtheta - before.dtheta,
                    dv: now.dv - before.dv,
                };
                before = now;
                increment
            })
            .collect()
    }

    /// Integrals at `t`. The search begins at interval `k` and leaves there the interval found.
    fn at(&self, t: f64, k: &mut usize) -> Increment {
        while *k + 2 < self.time.len() && self.time[*k + 1] <= t {
            *k += 1;
        }
        let (t0, t1) = (self.time[*k], self.time[*k + 1]);
        let share = ((t - t0) / (t1 - t0)).clamp(0.0, 1.0);
        let (a, b) = (&self.sum[*k], &self.sum[*k + 1]);
        Increment {
            dtheta: a.dtheta.lerp(&b.dtheta, share),
            dv: a.dv.lerp(&b.dv, share),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn increments_at_even_times_come_out_as_they_went_in() {
        let time: Vec<f64> = (1..=300).map(|k| 1000.0 + 0.005 * f64::from(k)).collect();
        let increments: Vec<Increment> = (0..300)
            .map(|k| Increment {
                dtheta: Vector3::repeat(1e-6 * f64::from(k)),
                dv: Vector3::repeat(-0.05),
            })
            .collect();
        let running = MotionIntegral::of_increments(&time, &increments, 0.005);
        assert_eq!(running.span(), (1000.0, 1001.5));
        let got = running.increments(1000.5, 0.005, 200);
        for (g, w) in got.iter().zip(&increments[100..]) {
            // a time stamp of 1000 s is rounded to 1e-13 s, 2e-11 of an increment
            assert!((g.dtheta - w.dtheta).norm() < 1e-13 && (g.dv - w.dv).norm() < 1e-10);
        }
    }

    #[test]
    fn jitter_moves_motion_between_increments_and_loses_none() {
        // angle t^2, so rate 2t, sampled at uneven times; the trapezoidal rule is exact for it
        let time: Vec<f64> = (0..200)
            .map(|k| 0.01 * f64::from(k) + 0.002 * f64::from(k % 3))
            .collect();
        let rates: Vec<Increment> = time
            .iter()
            .map(|t| Increment {
                dtheta: Vector3::repeat(2.0 * t),
                dv: Vector3::repeat(1.0),
            })
            .collect();
        let increments = MotionIntegral::of_rates(&time, &rates).increments(0.5, 0.01, 100);
        let (mut angle, mut v) = (0.0, 0.0);
        for (k, w) in increments.iter().enumerate() {
            angle += w.dtheta.x;
            v += w.dv.x;
            let t = 0.5 + 0.01 * (k + 1) as f64;
            // at most 12 ms apart: a constant rate errs by less than rate' * 0.012^2 / 8
            assert!((angle - (t * t - 0.25)).abs() < 1e-4, "{k}");
        }
        assert!((v - 1.0).abs() < 1e-12);
    }
}
