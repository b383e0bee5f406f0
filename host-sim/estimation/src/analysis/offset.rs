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

use channel::Channel;
use host_io::recordings::record::Record;
use motion::Motion;

/// Largest offset that is searched, s, in either direction: leap seconds are within it.
pub const MOST_S: f64 = 40.0;
/// Largest offset that is searched in a recording too short for [`MOST_S`], s.
const LEAST_S: f64 = 5.0;
/// Steps of the search, s: the first one, and the one around its best offsets.
const COARSE_S: f64 = 0.25;
const STEP_S: f64 = 0.05;
/// The first search uses no more differences of a kind than these.
const COARSE: usize = 4000;
/// Largest standard deviation of an offset that is accepted, s.
const USEFUL_S: f64 = 0.5;
/// Least difference of the log-likelihood to any other peak.
const MARGIN: f64 = 8.0;
/// Larger offsets are looked for around so many multiples of this, s, so that the parts overlap.
const FAR: i32 = 24;
const FAR_S: f64 = 75.0;
/// Differences of time zones, half hours.
const ZONES: i32 = 28;
const HALF_HOUR_S: f64 = 1800.0;
/// Longest recording in which they are looked for, s.
const ZONES_S: f64 = 6.0 * 3600.0;
/// The largest offset as a share of the recording.
const IN_COMMON: f64 = 0.7;
/// An offset within 40 s that leaves more of the squares is compared with those beyond.
const DOUBTFUL: f64 = 0.5;
/// That search uses no more differences of a kind than these and these steps, s, and tries so many
/// of its best parts.
const FAR_COARSE: usize = 250;
const FAR_STEP_S: f64 = 0.5;
const FAR_TRIED: usize = 3;
/// Largest standard deviation of an offset that is accepted there, s: chance has many parts.
const FAR_SIGMA_S: f64 = 0.1;
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
                "it moves too evenly for the fixes to show it, or samples and fixes do not belong \
                 together"
            }
            Self::Far => "the best match is at the end of the range of 40 s either way",
        }
    }
}

/// Finds the offset that is to be added to the times of the fixes, within 40 s of 0, or within 5 s
/// where the recording is too short for more. If there is none, it is looked for up to half an hour
/// away, and around the differences of time zones, as far as samples and fixes are in common then.
///
/// # Errors
/// Why it cannot be known.
pub fn estimate(record: &Record) -> Result<Estimate, Unknown> {
    let rough = search(record)?;
    // where the fixes belong is known by now, and so is the speed at each sample
    let motion = Motion::of(record, Some(rough.offset_s)).ok_or(Unknown::Stationary)?;
    let refined = within(&motion, rough.offset_s, LEAST_S);
    Ok(refined.map_or(rough, |refined| Estimate {
        offset_s: rough.offset_s + refined.offset_s,
        ..refined
    }))
}

fn search(record: &Record) -> Result<Estimate, Unknown> {
    let motion = Motion::of(record, None).ok_or(Unknown::Stationary)?;
    match within(&motion, 0.0, MOST_S) {
        // most recordings have a small one, which more of the recording can show
        Ok(found) if found.offset_s.abs() < LEAST_S - 1.0 => {
            within(&motion, 0.0, LEAST_S).or(Ok(found))
        }
        Ok(found) => Ok(nearly_even(&motion, found)),
        Err(far) => within(&motion, 0.0, LEAST_S).or_else(|near| {
            far_away(&motion).ok_or(match near {
                Unknown::Far => far,
                near => near,
            })
        }),
    }
}

/// A motion that repeats itself, as in waves, also fits a little at wrong offsets. Where one leaves
/// much of it, another that leaves far less is the right one.
fn nearly_even(motion: &Motion, found: Estimate) -> Estimate {
    let left = |offset: f64| -> f64 {
        let few = motion.channels(offset, LEAST_S, FAR_COARSE);
        few.iter().map(|channel| channel.unexplained(0.0)).product()
    };
    let near = left(found.offset_s);
    let far = (near > DOUBTFUL).then(|| far_away(motion)).flatten();
    far.filter(|far| left(far.offset_s) < 0.5 * near)
        .unwrap_or(found)
}

/// The offset beyond 40 s at which samples and fixes match best, if it explains enough.
fn far_away(motion: &Motion) -> Option<Estimate> {
    let [start, end] = motion.span();
    let most = IN_COMMON * (end - start);
    let near = (1..=FAR).map(|k| f64::from(k) * FAR_S);
    let zones = (1..=ZONES).map(|half| f64::from(half) * HALF_HOUR_S);
    let middles = near.chain(zones.filter(|_| end - start < ZONES_S));
    let middles = middles.filter(|middle| *middle < most);
    let coarse = middles
        .flat_map(|middle| [middle, -middle])
        .filter_map(|middle| {
            let few = motion.channels(middle, MOST_S, FAR_COARSE);
            let (offset, _) = least(&few, steps(0.0, MOST_S, FAR_STEP_S))?;
            let left: f64 = few
                .iter()
                .map(|channel| channel.unexplained(offset))
                .product();
            Some((middle, left))
        });
    let mut coarse: Vec<(f64, f64)> = coarse.collect();
    coarse.sort_by(|a, b| a.1.total_cmp(&b.1));
    coarse.iter().take(FAR_TRIED).find_map(|(middle, _)| {
        let found = within(motion, *middle, MOST_S).ok()?;
        (found.sigma_s < FAR_SIGMA_S).then_some(Estimate {
            offset_s: middle + found.offset_s,
            ..found
        })
    })
}

/// The offset within `most` s of 0 of fixes that are `moved` s later.
fn within(motion: &Motion, moved: f64, most: f64) -> Result<Estimate, Unknown> {
    let mut channels = motion.channels(moved, most, usize::MAX);
    if channels.is_empty() {
        return Err(Unknown::Stationary);
    }
    let found = by(&mut channels, most)?;
    let all = channels.len();
    channels.retain(|channel| channel.belongs(found.offset_s));
    match channels.len() {
        0 => Err(Unknown::Even),
        left if left < all => by(&mut channels, most),
        _ => Ok(found),
    }
}

/// The offset within `most` s of 0 by these channels.
fn by(channels: &mut [Channel], most: f64) -> Result<Estimate, Unknown> {
    // the assumptions on slip are weighted by the residuals
    let first = best(channels, most)?;
    channels
        .iter_mut()
        .for_each(|channel| channel.assume(first));
    let best = best(channels, most)?;
    let offset = refined(channels, best);
    let sigma = sigma(channels, offset).ok_or(Unknown::Even)?;
    let few: Vec<Channel> = channels.iter().map(|c| c.thinned(COARSE)).collect();
    let share = |of: &[Channel]| of.iter().map(Channel::count).sum::<usize>() as f64;
    let share = share(channels) / share(&few);
    let far = |other: &f64| (other - offset).abs() > 1.0_f64.max(4.0 * sigma);
    let rivals = steps(0.0, most, COARSE_S).filter(far);
    let rival = least(&few, rivals).map_or(f64::INFINITY, |(rival, _)| {
        let near = steps(rival, COARSE_S, STEP_S).filter(far);
        least(&few, near).map_or(f64::INFINITY, |(_, cost)| cost)
    });
    if sigma > USEFUL_S || 0.5 * share * (rival - cost(&few, offset)) < MARGIN {
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

/// Offsets up to `most` on either side of `middle`.
fn steps(middle: f64, most: f64, step: f64) -> impl Iterator<Item = f64> {
    let count = (most / step).round() as i32;
    (-count..=count).map(move |k| middle + f64::from(k) * step)
}

/// The offset of the least cost, and its cost.
fn least(channels: &[Channel], offsets: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let costs = offsets.map(|offset| (offset, cost(channels, offset)));
    costs.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The offset of the least cost: first on a coarse grid with some of the differences, then on a
/// fine one around it with all.
fn best(channels: &[Channel], most: f64) -> Result<f64, Unknown> {
    let few: Vec<Channel> = channels.iter().map(|c| c.thinned(COARSE)).collect();
    let (coarse, _) = least(&few, steps(0.0, most, COARSE_S)).ok_or(Unknown::Even)?;
    let fine = steps(coarse, 2.0 * COARSE_S, STEP_S);
    let (best, _) = least(channels, fine).ok_or(Unknown::Even)?;
    match best.abs() > most - 1.5 * COARSE_S {
        true => Err(Unknown::Far),
        false => Ok(best),
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
