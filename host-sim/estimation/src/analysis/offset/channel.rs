//! Differences between fixes, and how well the samples explain them.

use nalgebra::{Matrix4, Vector4};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Number of constants of a channel.
const CONSTANTS: usize = 4;
/// Assumed standard deviations of the antenna's distance ahead of the point that does not slip, m,
/// about its distance ahead of the sensor, and of the tyres' slip, rad per m/s2 across.
const SLIP: [f64; 2] = [1.5, 0.01];
/// Scale factors of sensors whose units are right.
const SCALES: RangeInclusive<f64> = 0.3..=3.0;
/// Share of the squares that a motion with another scale factor may leave.
const UNEXPLAINED: f64 = 0.5;
/// Samples around the place that even steps give.
const NEAR: usize = 16;
/// Half the time over which a rate is averaged, s.
const RATE_S: f64 = 0.1;

/// An integral over time, by its values at rising times; at least two of them.
#[derive(Debug, Clone, Default)]
pub(super) struct Integral {
    /// Several integrals share them.
    pub(super) time: Arc<Vec<f64>>,
    pub(super) sum: Arc<Vec<f64>>,
}

impl Integral {
    /// Mean rate around `t`.
    fn rate(&self, t: f64) -> f64 {
        (self.at(t + RATE_S) - self.at(t - RATE_S)) / (2.0 * RATE_S)
    }

    /// The first sample that is not before `t`. It is looked for where it is with even steps first:
    /// that is many times faster than in all of them.
    fn next(&self, t: f64) -> usize {
        let time = &self.time[..];
        let [first, .., last] = time else { return 0 };
        let guess = ((t - first) / (last - first) * time.len() as f64) as usize;
        let from = guess.saturating_sub(NEAR);
        let near = time.get(from..guess.saturating_add(NEAR).min(time.len()));
        match near.unwrap_or_default() {
            near @ [a, .., b] if *a < t && t <= *b => from + near.partition_point(|x| *x < t),
            _ => time.partition_point(|x| *x < t),
        }
    }

    fn at(&self, t: f64) -> f64 {
        let next = self.next(t);
        let next = next.clamp(1, self.time.len().saturating_sub(1).max(1));
        let (Some(t1), Some(b)) = (self.time.get(next), self.sum.get(next)) else {
            return 0.0;
        };
        let (t0, a) = (self.time[next - 1], self.sum[next - 1]);
        let share = ((t - t0) / (t1 - t0)).clamp(0.0, 1.0);
        a + (b - a) * share
    }
}

/// A time with its weight in a difference, and the speed then.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Knot {
    pub(super) time: f64,
    pub(super) weight: f64,
    pub(super) speed: f64,
}

/// A difference between two or three fixes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Difference {
    pub(super) knots: [Knot; 3],
    /// Turn of the course, rad, or change of the change of speed, m/s.
    pub(super) observed: f64,
    /// Its standard deviation relative to others of its kind.
    pub(super) sigma: f64,
    /// Factor of the channel's constant in this difference.
    pub(super) drift: f64,
}

impl Difference {
    /// The same of fixes that are so much later, s.
    pub(super) fn later(mut self, seconds: f64) -> Self {
        self.knots.iter_mut().for_each(|knot| knot.time += seconds);
        self
    }
}

/// Differences of one kind and the integral that they are compared with.
#[derive(Debug, Clone)]
pub(super) struct Channel {
    pub(super) differences: Vec<Difference>,
    pub(super) integral: Integral,
    /// Whether the integral is that of a rotation: then the course may slip.
    pub(super) turns: bool,
    /// Weights of the assumptions on slip; none before [`Channel::assume`].
    pub(super) ridge: [f64; 2],
    /// The antenna's distance ahead of the sensor, m.
    pub(super) ahead_m: f64,
}

/// Fit of a channel at an offset.
struct Fit {
    square: f64,
    /// The integral's scale factor.
    scale: f64,
    /// Residuals over their relative standard deviations.
    residuals: Vec<f64>,
    /// Residuals of the assumptions on slip.
    assumed: [f64; 2],
}

impl Channel {
    pub(super) fn count(&self) -> usize {
        self.differences.len()
    }

    /// The same with `most` of its differences, evenly spread.
    pub(super) fn thinned(&self, most: usize) -> Self {
        let every = self.count().div_ceil(most).max(1);
        Self {
            differences: self.differences.iter().step_by(every).copied().collect(),
            ..self.clone()
        }
    }

    /// Weights the assumptions on slip by the residuals at `offset`.
    pub(super) fn assume(&mut self, offset: f64) {
        if self.turns {
            let variance = self.fit(offset).square / self.count() as f64;
            self.ridge = SLIP.map(|sigma| variance / (sigma * sigma));
        }
    }

    /// Whether the integral explains most of the differences at `offset`, or has the size that they
    /// say. Another motion that happens to fit a little has neither.
    pub(super) fn belongs(&self, offset: f64) -> bool {
        let fit = self.fit(offset);
        SCALES.contains(&fit.scale) || fit.square < UNEXPLAINED * self.observed()
    }

    /// Share of the squares of the differences that the integral leaves at `offset`.
    pub(super) fn unexplained(&self, offset: f64) -> f64 {
        self.fit(offset).square / self.observed()
    }

    fn observed(&self) -> f64 {
        let all = self.differences.iter();
        all.map(|of| (of.observed / of.sigma).powi(2)).sum()
    }

    /// Minus twice the log-likelihood of an offset.
    pub(super) fn cost(&self, offset: f64) -> f64 {
        self.count() as f64 * self.fit(offset).square.max(1e-300).ln()
    }

    fn row(&self, of: &Difference, offset: f64) -> Vector4<f64> {
        let mut row = Vector4::new(0.0, of.drift, 0.0, 0.0);
        for knot in of.knots.iter().filter(|knot| knot.weight != 0.0) {
            let t = knot.time + offset;
            row[0] += knot.weight * self.integral.at(t);
            if self.ridge[0] > 0.0 {
                let rate = knot.weight * self.integral.rate(t);
                row[2] += rate / knot.speed.max(1.0);
                row[3] += rate * knot.speed;
            }
        }
        row / of.sigma
    }

    fn fit(&self, offset: f64) -> Fit {
        let [ahead, slip] = self
            .ridge
            .map(|weight| if weight > 0.0 { weight } else { 1.0 });
        let mut normal = Matrix4::from_diagonal(&Vector4::new(0.0, 0.0, ahead, slip));
        let mut right = Vector4::new(0.0, 0.0, self.ridge[0] * self.ahead_m, 0.0);
        let all = self.differences.iter();
        let rows: Vec<(Vector4<f64>, f64)> = all
            .map(|of| (self.row(of, offset), of.observed / of.sigma))
            .collect();
        for (row, observed) in &rows {
            normal += row * row.transpose();
            right += row * *observed;
        }
        let solved = normal.try_inverse().map(|inverse| inverse * right);
        // a motion the other way round is no match
        let solved = solved.filter(|s| s[0] > 0.0).unwrap_or_else(Vector4::zeros);
        let residuals: Vec<f64> = rows
            .iter()
            .map(|(row, observed)| observed - row.dot(&solved))
            .collect();
        let off = [solved[2] - self.ahead_m, solved[3]];
        let assumed = [0, 1].map(|k| self.ridge[k].sqrt() * off[k]);
        let square = residuals.iter().chain(&assumed).map(|r| r * r).sum();
        Fit {
            square,
            scale: solved[0],
            residuals,
            assumed,
        }
    }

    /// Information of the channel on the offset: the curvature of half its cost, and the variance
    /// of its slope with residuals that depend on their neighbours.
    pub(super) fn information(&self, offset: f64) -> (f64, f64) {
        let h = 0.02;
        let fit = self.fit(offset);
        let [before, after] = [-h, h].map(|by| self.fit(offset + by));
        let slope = |(a, b): (&f64, &f64)| (b - a) / (2.0 * h);
        let slopes: Vec<f64> = before
            .residuals
            .iter()
            .zip(&after.residuals)
            .map(slope)
            .collect();
        let assumed: f64 = before
            .assumed
            .iter()
            .zip(&after.assumed)
            .map(slope)
            .map(|g| g * g)
            .sum();
        let variance = fit.square / (self.count().saturating_sub(CONSTANTS).max(1)) as f64;
        if variance <= 0.0 {
            return (0.0, 0.0);
        }
        let moment = |(r, g): (&f64, &f64)| r * g / variance;
        let moments: Vec<f64> = fit.residuals.iter().zip(&slopes).map(moment).collect();
        let lags = self.lags();
        let own: f64 = moments.iter().map(|m| m * m).sum();
        let shared: f64 = (1..=lags)
            .map(|lag| {
                let weight = 1.0 - lag as f64 / (lags + 1) as f64;
                let pairs = moments.iter().zip(&moments[lag.min(moments.len())..]);
                2.0 * weight * pairs.map(|(a, b)| a * b).sum::<f64>()
            })
            .sum();
        let assumed = assumed / variance;
        let curvature = slopes.iter().map(|g| g * g).sum::<f64>() / variance + assumed;
        (curvature, own.max(own + shared) + assumed)
    }

    /// Number of neighbours whose time a difference shares, and a few more.
    fn lags(&self) -> usize {
        let Some(first) = self.differences.first() else {
            return 0;
        };
        let last = first.knots.iter().map(|k| k.time).fold(f64::MIN, f64::max);
        let shares = |of: &&Difference| of.knots[0].time < last;
        self.differences.iter().take_while(shares).count() + 3
    }
}
