//! The time offset between fixes and samples, found from the data.
//!
//! A moving vehicle tells it twice. Its course turns as the gyros turn about the vertical, and its
//! speed grows as the accelerometers push it forward. So the changes of course and of speed from fix
//! to fix are compared with the integrals of the samples over the same time, moved by the offset:
//!
//! ```text
//! course(t2) - course(t1) = s_1 * integral of the vertical rate w from t1 + d to t2 + d
//!                           + b_1 (t2 - t1) + l (w / v at t2 + d - w / v at t1 + d)
//! speed(t2) - speed(t1)   = s_2 * integral of the forward force from t1 + d to t2 + d
//!                           + b_2 (t2 - t1)
//! ```
//!
//! The scales `s` and rates `b` take up biases, tilt and scale factors. `l` is how far the antenna is
//! ahead of the point of the vehicle that does not slip: the course of such a point leads that of
//! the vehicle in a curve, as a fix with a wrong time would. All are solved for each offset `d`. The offset of the least squares of both is the most likely one for normal errors; the
//! variances are those of the residuals there. Neighbouring changes share fixes, so the standard
//! deviation is that of estimates with correlated residuals (Newey and West, Econometrica 55, 1987).

use crate::recordings::record::Record;
use nalgebra::{Matrix3, Vector3};

/// Offsets looked at are up to this, s, either way.
pub const MOST_S: f64 = 5.0;
/// Step of the first search, s.
const STEP_S: f64 = 0.05;
/// Fixes whose changes are compared are at least so far apart, s, by velocities and by positions,
/// and at most so many times that.
const APART_S: [f64; 2] = [0.9, 2.9];
const APART_MOST: f64 = 2.5;
/// Positions of a better standard deviation are compared as velocities are, m.
const FINE_M: f64 = 0.2;
/// Standard deviation of the antenna's distance ahead of the point that does not slip, m (assumed).
const AHEAD_M: f64 = 1.5;
/// Slower by the fixes, a course means nothing, m/s.
const COURSE_MPS: f64 = 2.0;
/// Time around a sample over which gravity shows where down is, s.
const DOWN_S: f64 = 5.0;
/// An offset is believed if it is known better than this, s.
const USEFUL_S: f64 = 0.5;
/// By how much the log-likelihood of any other peak must be lower.
const MARGIN: f64 = 8.0;
/// Changes that are needed at least.
const LEAST: usize = 20;

/// What the data say of the offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// To be added to the times of the fixes, s.
    pub offset_s: f64,
    /// Its standard deviation, s.
    pub sigma_s: f64,
}

/// Why an offset cannot be found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unknown {
    /// Too few fixes of a moving vehicle.
    Still,
    /// The motion is too even, or samples and fixes do not belong together.
    Even,
    /// The best offset is at the end of the range.
    Far,
}

impl Unknown {
    /// The reason as the rest of a sentence.
    #[must_use]
    pub fn why(self) -> &'static str {
        match self {
            Self::Still => "fewer than 20 pairs of fixes show the vehicle moving",
            Self::Even => {
                "it moves too evenly for the fixes to tell, or samples and fixes do not belong together"
            }
            Self::Far => "the best match is at the end of the range of 5 s either way",
        }
    }
}

/// A change between two fixes.
#[derive(Debug, Clone, Copy)]
struct Change {
    from: f64,
    to: f64,
    /// Turn of the course, rad, or change of speed, m/s.
    seen: f64,
    /// Its variance relative to others of its kind.
    variance: f64,
    /// Reciprocals of the speed, s/m; 0 where the antenna's distance does not matter.
    slowness: [f64; 2],
}

/// An integral over time, by its values at rising times.
#[derive(Debug, Default)]
struct Integral {
    time: Vec<f64>,
    sum: Vec<f64>,
}

/// Finds the offset that is to be added to the times of the fixes.
///
/// # Errors
/// Why it cannot be known.
pub fn estimate(record: &Record) -> Result<Estimate, Unknown> {
    let [turned, pushed] = integrals(record).ok_or(Unknown::Still)?;
    let [turns, pushes] = changes(record);
    let within = |all: Vec<Change>| -> Vec<Change> {
        let span = turned.time.first().zip(turned.time.last());
        let inside =
            |c: &Change| span.is_some_and(|(a, b)| c.from - MOST_S > *a && c.to + MOST_S < *b);
        all.into_iter().filter(inside).collect()
    };
    let channels = [(within(turns), &turned), (within(pushes), &pushed)];
    let mut known: Vec<Channel<'_>> = channels
        .into_iter()
        .filter(|(changes, _)| changes.len() >= LEAST)
        .map(|(changes, integral)| Channel {
            changes,
            integral,
            ridge: 0.0,
        })
        .collect();
    if known.is_empty() {
        return Err(Unknown::Still);
    }
    // the antenna's distance is believed as far as the residuals allow
    let first = search(&known)?;
    for channel in &mut known {
        let variance = channel.fit(first.offset_s).square / channel.count();
        channel.ridge = variance / (AHEAD_M * AHEAD_M);
    }
    search(&known)
}

/// Changes of one kind and the integral that they are compared with.
struct Channel<'a> {
    changes: Vec<Change>,
    integral: &'a Integral,
    /// Weight of a short distance of the antenna.
    ridge: f64,
}

/// How a channel fits an offset.
struct Fit {
    /// Weighted sum of the squared residuals.
    square: f64,
    /// Scale.
    scale: f64,
    /// Residuals over their relative standard deviations.
    residuals: Vec<f64>,
}

impl Channel<'_> {
    fn fit(&self, offset: f64) -> Fit {
        let mut normal = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, self.ridge));
        let mut right = Vector3::zeros();
        let rows: Vec<(Vector3<f64>, f64)> = self
            .changes
            .iter()
            .map(|c| {
                let by = self.integral.between(c.from + offset, c.to + offset);
                let weight = c.variance.sqrt().recip();
                let [a, b] = [c.from, c.to].map(|t| self.integral.rate(t + offset));
                let ahead = b * c.slowness[1] - a * c.slowness[0];
                let ahead = if self.ridge > 0.0 { ahead } else { 0.0 };
                let row = Vector3::new(by, c.to - c.from, ahead);
                (row * weight, c.seen * weight)
            })
            .collect();
        for (row, seen) in &rows {
            normal += row * row.transpose();
            right += row * *seen;
        }
        if normal[(2, 2)] <= 0.0 {
            normal[(2, 2)] = 1.0;
        }
        let solved = normal
            .try_inverse()
            .map_or_else(Vector3::zeros, |n| n * right);
        // a rotation the other way round is no match
        let solved = if solved.x > 0.0 {
            solved
        } else {
            Vector3::zeros()
        };
        let residuals: Vec<f64> = rows
            .iter()
            .map(|(row, seen)| seen - row.dot(&solved))
            .collect();
        Fit {
            square: residuals.iter().map(|r| r * r).sum::<f64>() + self.ridge * solved.z * solved.z,
            scale: solved.x,
            residuals,
        }
    }

    fn count(&self) -> f64 {
        self.changes.len() as f64
    }
}

/// Minus twice the log-likelihood of an offset, with the variances that make it largest.
fn cost(channels: &[Channel<'_>], offset: f64) -> f64 {
    let one = |channel: &Channel<'_>| channel.count() * channel.fit(offset).square.max(1e-300).ln();
    channels.iter().map(one).sum()
}

fn search(channels: &[Channel<'_>]) -> Result<Estimate, Unknown> {
    let steps = (MOST_S / STEP_S).round() as i32;
    let at = |k: i32| f64::from(k) * STEP_S;
    let costs: Vec<(f64, f64)> = (-steps..=steps)
        .map(|k| (at(k), cost(channels, at(k))))
        .collect();
    let best = costs
        .iter()
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .ok_or(Unknown::Even)?
        .0;
    if best.abs() > MOST_S - 1.5 * STEP_S {
        return Err(Unknown::Far);
    }
    let offset = refined(channels, best);
    let sigma = sigma(channels, offset).ok_or(Unknown::Even)?;
    let far = |other: f64| (other - offset).abs() > 1.0_f64.max(4.0 * sigma);
    let rival = costs.iter().filter(|c| far(c.0)).map(|c| c.1);
    let rival = rival.fold(f64::INFINITY, f64::min);
    if sigma > USEFUL_S || 0.5 * (rival - cost(channels, offset)) < MARGIN {
        return Err(Unknown::Even);
    }
    Ok(Estimate {
        offset_s: offset,
        sigma_s: sigma,
    })
}

/// The least cost near `start`, by golden sections.
fn refined(channels: &[Channel<'_>], start: f64) -> f64 {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (start - STEP_S, start + STEP_S);
    while high - low > 1e-4 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if cost(channels, a) < cost(channels, b) {
            high = b;
        } else {
            low = a;
        }
    }
    0.5 * (low + high)
}

/// Standard deviation of the offset; `None` if nothing depends on it.
fn sigma(channels: &[Channel<'_>], offset: f64) -> Option<f64> {
    let h = 0.02;
    let (mut curvature, mut spread) = (0.0, 0.0);
    for channel in channels {
        let fit = channel.fit(offset);
        let [before, after] = [-h, h].map(|by| channel.fit(offset + by).residuals);
        let slopes: Vec<f64> = before
            .iter()
            .zip(&after)
            .map(|(a, b)| (b - a) / (2.0 * h))
            .collect();
        let variance = fit.square / (channel.count() - 3.0);
        if fit.scale <= 0.0 || variance <= 0.0 {
            continue;
        }
        let moments: Vec<f64> = fit
            .residuals
            .iter()
            .zip(&slopes)
            .map(|(r, g)| r * g / variance)
            .collect();
        curvature += slopes.iter().map(|g| g * g).sum::<f64>() / variance;
        // neighbours within the time of a change and a half
        let lags = lags(&channel.changes);
        let own: f64 = moments.iter().map(|m| m * m).sum();
        let shared: f64 = (1..=lags)
            .map(|lag| {
                let weight = 1.0 - lag as f64 / (lags + 1) as f64;
                let pairs = moments.iter().zip(&moments[lag.min(moments.len())..]);
                2.0 * weight * pairs.map(|(a, b)| a * b).sum::<f64>()
            })
            .sum();
        spread += own.max(own + shared);
    }
    let sigma = spread.sqrt() / curvature;
    sigma.is_finite().then_some(sigma)
}

/// Number of neighbours whose time a change shares, and a few more.
fn lags(changes: &[Change]) -> usize {
    let Some(first) = changes.first() else {
        return 0;
    };
    changes.iter().take_while(|c| c.from < first.to).count() + 3
}

impl Integral {
    fn between(&self, from: f64, to: f64) -> f64 {
        self.at(to) - self.at(from)
    }

    /// Mean rate around `t`.
    fn rate(&self, t: f64) -> f64 {
        self.between(t - 0.1, t + 0.1) / 0.2
    }

    fn at(&self, t: f64) -> f64 {
        let next = self
            .time
            .partition_point(|x| *x < t)
            .clamp(1, self.time.len() - 1);
        let (t0, t1) = (self.time[next - 1], self.time[next]);
        let share = ((t - t0) / (t1 - t0)).clamp(0.0, 1.0);
        self.sum[next - 1] + (self.sum[next] - self.sum[next - 1]) * share
    }
}

/// Rotation about down, rad, and velocity gained ahead, m/s. Down is where the mean specific force
/// of some seconds points from; ahead is the vehicle's x axis.
fn integrals(record: &Record) -> Option<[Integral; 2]> {
    let (time, increments) = record.increments();
    if time.len() < 2 {
        return None;
    }
    let half = (0.5 * DOWN_S * record.rate_hz as f64) as usize;
    let mut sums = vec![Vector3::zeros()];
    for increment in &increments {
        let last = sums.last().copied().unwrap_or_default();
        sums.push(last + increment.dv);
    }
    let mut out = [Integral::default(), Integral::default()];
    let (mut turned, mut pushed) = (0.0, 0.0);
    for (k, (t, increment)) in time.iter().zip(&increments).enumerate() {
        let mean = sums[(k + half).min(increments.len())] - sums[k.saturating_sub(half)];
        let down = -mean.try_normalize(1e-9).unwrap_or(-Vector3::z());
        turned += increment.dtheta.dot(&down);
        let ahead = Vector3::x() - down * down.x;
        pushed += increment.dv.dot(&ahead);
        for (integral, sum) in out.iter_mut().zip([turned, pushed]) {
            integral.time.push(*t);
            integral.sum.push(sum);
        }
    }
    Some(out)
}

/// The changes of course and of speed that the fixes show. A velocity that is not measured is that
/// between two positions, at the middle of their times.
fn changes(record: &Record) -> [Vec<Change>; 2] {
    let (speeds, apart) = velocities(record);
    let mut out = [Vec::new(), Vec::new()];
    for (k, a) in speeds.iter().enumerate() {
        let later = speeds[k + 1..].iter().find(|b| b.time - a.time >= apart);
        let Some(b) = later.filter(|b| b.time - a.time <= APART_MOST * apart) else {
            continue;
        };
        let [fast_a, fast_b] = [a, b].map(|v| v.north.hypot(v.east));
        let change = |seen: f64, variance: f64, slowness: [f64; 2]| Change {
            from: a.time,
            to: b.time,
            seen,
            variance,
            slowness,
        };
        out[1].push(change(fast_b - fast_a, a.variance + b.variance, [0.0; 2]));
        if fast_a.min(fast_b) > COURSE_MPS {
            let turn =
                (a.north * b.east - a.east * b.north).atan2(a.north * b.north + a.east * b.east);
            let variance = a.variance / fast_a.powi(2) + b.variance / fast_b.powi(2);
            out[0].push(change(turn, variance, [fast_a.recip(), fast_b.recip()]));
        }
    }
    // a vehicle that never moves has no changes of speed but noise
    if out[0].len() < LEAST {
        out[1].clear();
    }
    out
}

/// A horizontal velocity.
#[derive(Debug, Clone, Copy)]
struct Velocity {
    time: f64,
    north: f64,
    east: f64,
    variance: f64,
}

/// Horizontal velocities, and how far apart in time they are to be compared, s.
fn velocities(record: &Record) -> (Vec<Velocity>, f64) {
    let fixes = &record.fixes;
    let measured = fixes
        .iter()
        .filter(|fix| fix.has(3..5))
        .map(|fix| Velocity {
            time: fix.time,
            north: fix.velocity[0],
            east: fix.velocity[1],
            variance: 0.5 * (fix.sigmas[3].powi(2) + fix.sigmas[4].powi(2)),
        });
    let measured: Vec<Velocity> = measured.collect();
    if measured.len() >= LEAST {
        return (measured, APART_S[0]);
    }
    let placed: Vec<_> = fixes.iter().filter(|fix| fix.has_position()).collect();
    let fine = placed.iter().all(|fix| fix.sigmas[0] < FINE_M);
    let apart = if fine { APART_S[0] } else { APART_S[1] };
    let mut out = Vec::new();
    for (k, a) in placed.iter().enumerate() {
        let later = placed[k + 1..].iter().find(|b| b.time - a.time >= apart);
        let Some(b) = later.filter(|b| b.time - a.time <= APART_MOST * apart) else {
            continue;
        };
        let time = b.time - a.time;
        let moved = b.place().ned_from(&a.place());
        out.push(Velocity {
            time: 0.5 * (a.time + b.time),
            north: moved.x / time,
            east: moved.y / time,
            variance: (a.sigmas[0].powi(2) + b.sigmas[0].powi(2)) / (time * time),
        });
    }
    (out, apart)
}

#[cfg(test)]
mod tests;
