//! The time offset between fixes and samples, found from the data.
//!
//! The motion of the vehicle shows it in two ways: its course turns as the gyros turn about the
//! vertical, and its acceleration changes as the accelerometers measure. So the differences between
//! fixes are compared with integrals of the samples over the same time, shifted by the offset `d`.
//! With the differences `D` between neighbouring fixes:
//!
//! ```text
//! D course   = s_1 D (integral of the rate w about down) + b_1 D t + l D (w / v) + k D (w v)
//! D D speed  = s_2 D D (integral of the force ahead less gravity by the pitch) + b_2
//! ```
//!
//! The scales `s` and constants `b` take up biases, tilt and scale factors. The course of a point
//! that lies `l` ahead of the one that does not slip leads that of the vehicle in a curve, and
//! tyres slip by `k` for an acceleration across: both look like wrong times as long as the speed is
//! the same. The pitch follows from the gyros; that its zero is not known, and a hill's slow part,
//! fall out of the second differences.
//!
//! All constants are solved for each offset. The offset of the least squares of both is the most
//! likely one for normal errors with the variances of the residuals there. Neighbouring differences
//! share fixes, so the standard deviation is that of estimates with correlated residuals (Newey and
//! West, Econometrica 55, 1987).

mod channel;
mod motion;

use crate::recordings::record::Record;
use channel::Channel;

/// Largest offset that is searched, s, in either direction.
pub const MOST_S: f64 = 5.0;
/// Step of the first search, s.
const STEP_S: f64 = 0.05;
/// Largest standard deviation of an offset that is accepted, s.
const USEFUL_S: f64 = 0.5;
/// Least difference of the log-likelihood to any other peak.
const MARGIN: f64 = 8.0;
/// Least number of differences.
const LEAST: usize = 20;

/// Offset as estimated from the data.
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
    Stationary,
    /// The motion is too uniform, or samples and fixes do not belong together.
    Even,
    /// The best offset is at the end of the range.
    Far,
}

impl Unknown {
    /// The reason as the rest of a sentence.
    #[must_use]
    pub fn why(self) -> &'static str {
        match self {
            Self::Stationary => "fewer than 20 pairs of fixes show the vehicle moving",
            Self::Even => {
                "it moves too evenly for the fixes to tell, or samples and fixes do not belong \
                 together"
            }
            Self::Far => "the best match is at the end of the range of 5 s either way",
        }
    }
}

/// Finds the offset that is to be added to the times of the fixes.
///
/// # Errors
/// Why it cannot be known.
pub fn estimate(record: &Record) -> Result<Estimate, Unknown> {
    let mut channels = motion::channels(record).ok_or(Unknown::Stationary)?;
    channels.retain(|channel| channel.count() >= LEAST);
    if channels.is_empty() {
        return Err(Unknown::Stationary);
    }
    // the assumptions on slip are weighted by the residuals
    let first = best(&channels)?;
    channels
        .iter_mut()
        .for_each(|channel| channel.assume(first));
    let best = best(&channels)?;
    let offset = refined(&channels, best);
    let sigma = sigma(&channels, offset).ok_or(Unknown::Even)?;
    let far = |other: &f64| (other - offset).abs() > 1.0_f64.max(4.0 * sigma);
    let rivals = offsets().filter(far).map(|other| cost(&channels, other));
    let rival = rivals.fold(f64::INFINITY, f64::min);
    if sigma > USEFUL_S || 0.5 * (rival - cost(&channels, offset)) < MARGIN {
        return Err(Unknown::Even);
    }
    Ok(Estimate {
        offset_s: offset,
        sigma_s: sigma,
    })
}

/// Minus twice the log-likelihood of an offset, with the most likely variances.
fn cost(channels: &[Channel], offset: f64) -> f64 {
    channels.iter().map(|channel| channel.cost(offset)).sum()
}

fn offsets() -> impl Iterator<Item = f64> {
    let steps = (MOST_S / STEP_S).round() as i32;
    (-steps..=steps).map(|k| f64::from(k) * STEP_S)
}

/// The offset of the least cost on a coarse grid.
fn best(channels: &[Channel]) -> Result<f64, Unknown> {
    let costs = offsets().map(|offset| (offset, cost(channels, offset)));
    let best = costs
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .ok_or(Unknown::Even)?;
    match best.0.abs() > MOST_S - 1.5 * STEP_S {
        true => Err(Unknown::Far),
        false => Ok(best.0),
    }
}

/// The least cost near `start`, by golden sections.
fn refined(channels: &[Channel], start: f64) -> f64 {
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
fn sigma(channels: &[Channel], offset: f64) -> Option<f64> {
    let (mut curvature, mut spread) = (0.0, 0.0);
    for channel in channels {
        let (own, scattered) = channel.information(offset);
        curvature += own;
        spread += scattered;
    }
    let sigma = spread.sqrt() / curvature;
    sigma.is_finite().then_some(sigma)
}

#[cfg(test)]
mod tests;
