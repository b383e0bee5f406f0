//! Resamples recorded rates or increments with time stamps to increments of equal length.

use host_core::inertial::sins::Increment;
use host_core::list::{Cursor, List};

/// Integrals of angular rate and specific force up to each sample. The sums are computed on
/// request.
#[derive(Debug, Clone)]
pub struct MotionIntegral {
    time: List<f64>,
    samples: List<Increment>,
    /// Length of the first increment, s; `None`: the samples are rates.
    lead: Option<f64>,
}

impl MotionIntegral {
    /// Integrates `rates` (rad/s and m/s2) at the rising times `time` by the trapezoidal rule.
    #[must_use]
    pub fn of_rates(time: impl Into<List<f64>>, rates: impl Into<List<Increment>>) -> Self {
        Self {
            time: time.into(),
            samples: rates.into(),
            lead: None,
        }
    }

    /// Sums `increments`, each of which ends at its time. Times rise; the first increment is `lead`
    /// s long.
    #[must_use]
    pub fn of_increments(
        time: impl Into<List<f64>>,
        increments: impl Into<List<Increment>>,
        lead: f64,
    ) -> Self {
        Self {
            time: time.into(),
            samples: increments.into(),
            lead: Some(lead),
        }
    }

    /// Number of times at which there is an integral.
    fn len(&self) -> usize {
        self.time.len() + usize::from(self.lead.is_some())
    }

    /// First and last time. There must be at least two samples.
    #[must_use]
    pub fn span(&self) -> (f64, f64) {
        let first = self.time.start().unwrap_or_default() - self.lead.unwrap_or_default();
        (first, self.time.end().unwrap_or_default())
    }

    /// `count` increments of length `dt` from time `from` on. The rate between two samples is taken
    /// as constant, so no motion is lost or counted twice however uneven the times are. Before the
    /// first and after the last sample there is no motion.
    pub fn increments(
        &self,
        from: f64,
        dt: f64,
        count: usize,
    ) -> impl ExactSizeIterator<Item = Increment> {
        let mut stretch = Stretch::first(self);
        let mut before = stretch.at(from);
        (0..count).map(move |n| {
            let now = stretch.at(from + (n + 1) as f64 * dt);
            let increment = Increment {
                dtheta: now.dtheta - before.dtheta,
                dv: now.dv - before.dv,
            };
            before = now;
            increment
        })
    }
}

/// Two neighbouring integrals.
struct Stretch<'a> {
    of: &'a MotionIntegral,
    time: Cursor<'a, f64>,
    samples: Cursor<'a, Increment>,
    k: usize,
    /// Their times.
    times: [f64; 2],
    ends: [Increment; 2],
}

impl<'a> Stretch<'a> {
    fn first(of: &'a MotionIntegral) -> Self {
        let mut stretch = Self {
            of,
            time: of.time.cursor(),
            samples: of.samples.cursor(),
            k: 0,
            times: [0.0; 2],
            ends: [Increment::default(); 2],
        };
        stretch.times = [0, 1].map(|k| stretch.time(k));
        stretch.advance(1);
        stretch
    }

    /// Time of integral `k`. The first of increments is the start of the first one.
    fn time(&mut self, k: usize) -> f64 {
        let mut at = |k: usize| self.time.get(k).copied().unwrap_or_default();
        match (self.of.lead, k) {
            (None, k) => at(k),
            (Some(lead), 0) => at(0) - lead,
            (Some(_), k) => at(k - 1),
        }
    }

    /// Extends the second integral to integral `k`.
    fn advance(&mut self, k: usize) {
        let mut sample = |k: usize| self.samples.get(k).copied().unwrap_or_default();
        let sum = &mut self.ends[1];
        if self.of.lead.is_some() {
            let increment = sample(k - 1);
            sum.dtheta += increment.dtheta;
            sum.dv += increment.dv;
        } else {
            let half = 0.5 * (self.times[1] - self.times[0]);
            let (a, b) = (sample(k - 1), sample(k));
            sum.dtheta += (b.dtheta + a.dtheta) * half;
            sum.dv += (b.dv + a.dv) * half;
        }
    }

    /// Integrals at `t`, which must not decrease.
    fn at(&mut self, t: f64) -> Increment {
        while self.k + 2 < self.of.len() && self.times[1] <= t {
            self.k += 1;
            self.times = [self.times[1], self.time(self.k + 1)];
            self.ends[0] = self.ends[1];
            self.advance(self.k + 1);
        }
        let [t0, t1] = self.times;
        let share = ((t - t0) / (t1 - t0)).clamp(0.0, 1.0);
        let [a, b] = &self.ends;
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
        let running = MotionIntegral::of_increments(time, increments.clone(), 0.005);
        assert_eq!(running.span(), (1000.0, 1001.5));
        let got = running.increments(1000.5, 0.005, 200);
        for (g, w) in got.zip(&increments[100..]) {
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
        let integral = MotionIntegral::of_rates(time, rates);
        let increments = integral.increments(0.5, 0.01, 100);
        let (mut angle, mut v) = (0.0, 0.0);
        for (k, w) in increments.enumerate() {
            angle += w.dtheta.x;
            v += w.dv.x;
            let t = 0.5 + 0.01 * (k + 1) as f64;
            // at most 12 ms apart: a constant rate errs by less than rate' * 0.012^2 / 8
            assert!((angle - (t * t - 0.25)).abs() < 1e-4, "{k}");
        }
        assert!((v - 1.0).abs() < 1e-12);
    }
}
