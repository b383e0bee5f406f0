//! Course and speed of the vehicle, from the samples and from the fixes.

use super::LEAST;
use super::channel::{Channel, Difference, Integral, Knot};
use host_core::inertial::sins::Increment;
use host_io::recordings::record::Record;
use nalgebra::Vector3;
use std::sync::Arc;

/// Fixes that are compared are at least so far apart, s, by velocities and by positions, and at
/// most so many times that.
const APART_S: [f64; 2] = [0.9, 2.9];
const APART_MOST: f64 = 2.5;
/// Positions with a smaller standard deviation than this are compared as velocities are, m.
const FINE_M: f64 = 0.2;
/// Least speed by the fixes at which a course is used, m/s.
const COURSE_MPS: f64 = 2.0;
/// Time around a sample over which gravity shows where down is, s.
const DOWN_S: f64 = 5.0;
/// Gravity, m/s2: a pitch of 1 mrad pushes by a thousandth of it.
const GRAVITY: f64 = 9.8;
/// Least number of measured velocities for a recording to count as one with velocities.
const ENOUGH: usize = 20;
/// Samples farther apart than this do not show the motion between them, s.
const GAP_S: f64 = 0.5;

/// Course and speed of a recording.
pub(super) struct Motion {
    /// Differences of course and of speed between fixes.
    differences: [Vec<Difference>; 2],
    /// What the samples say of both.
    integrals: [Integral; 2],
    /// The antenna's distance ahead of the sensor, m.
    ahead_m: f64,
    /// Where samples are missing, s.
    gaps: Vec<[f64; 2]>,
}

impl Motion {
    /// `None` without samples, or when the fixes show too little. `offset`: what is to be added to
    /// the times of the fixes, s, as far as it is known.
    pub(super) fn of(record: &Record, offset: Option<f64>) -> Option<Self> {
        let (speeds, apart) = velocities(record);
        let differences = differences(&speeds, apart);
        if differences.iter().all(|all| all.len() < LEAST) {
            return None;
        }
        let speeds = offset.map_or_else(Vec::new, |offset| {
            let later = speeds.iter().map(|fix| [fix.time + offset, fix.speed()]);
            later.collect()
        });
        let integrals = integrals(record, &speeds)?;
        let gaps = integrals[0].time.windows(2);
        let gaps = gaps.filter(|w| w[1] - w[0] > GAP_S).map(|w| [w[0], w[1]]);
        Some(Self {
            gaps: gaps.collect(),
            differences,
            integrals,
            ahead_m: record.lever_arm_m.map_or(0.0, |[ahead, ..]| ahead),
        })
    }

    /// First and last time of the samples.
    pub(super) fn span(&self) -> [f64; 2] {
        let time = &self.integrals[0].time;
        [time.first(), time.last()].map(|t| t.copied().unwrap_or_default())
    }

    /// Course and speed where the fixes are `moved` s later, and offsets of `most` s leave them
    /// within the samples; only what has enough differences. Of each at most `count`.
    pub(super) fn channels(&self, moved: f64, most: f64, count: usize) -> Vec<Channel> {
        let [start, end] = self.span();
        let inside = |of: &Difference| {
            let used = of.knots.iter().filter(|knot| knot.weight != 0.0);
            let times = used.map(|knot| knot.time);
            let from = times.clone().fold(f64::MAX, f64::min) - most;
            let to = times.fold(f64::MIN, f64::max) + most;
            from > start && to < end && !self.gaps.iter().any(|[a, b]| *a < to && *b > from)
        };
        let all = self
            .differences
            .iter()
            .zip(&self.integrals)
            .zip([true, false]);
        let channels = all.map(|((differences, integral), turns)| {
            let moved = differences.iter().map(|of| of.later(moved));
            Channel {
                differences: moved.filter(inside).collect(),
                integral: integral.clone(),
                turns,
                ridge: [0.0; 2],
                ahead_m: self.ahead_m,
            }
            .thinned(count)
        });
        channels
            .filter(|channel| channel.count() >= LEAST)
            .collect()
    }
}

/// Rotation about down, rad, and velocity gained ahead, m/s. Down is where the mean specific force
/// of some seconds points from, less what holds the vehicle in its curve at these speeds (times,
/// s, and m/s): in a brisk corner that is half of gravity, and would pass for a roll that turns
/// the yaw into a pitch. Ahead is the vehicle's x axis, and its pitch that by the gyros.
///
/// The search accesses them at random hundreds of times, so they are in memory: 24 bytes a sample.
fn integrals(record: &Record, speeds: &[[f64; 2]]) -> Option<[Integral; 2]> {
    let count = record.increments().count();
    if count < 2 {
        return None;
    }
    let half = (0.5 * DOWN_S * record.rate_hz as f64) as usize;
    let mut after = Velocities::of(straight(record, speeds));
    let mut before = Velocities::of(straight(record, speeds));
    let mut all = record.increments().peekable();
    let mut times = Vec::with_capacity(count);
    let mut sums = [Vec::with_capacity(count), Vec::with_capacity(count)];
    let (mut turned, mut pushed, mut pitch) = (0.0, 0.0, 0.0);
    while let Some((t, increment)) = all.next() {
        let k = times.len();
        let mean = after.up_to(k + half) - before.up_to(k.saturating_sub(half));
        let down = -mean.try_normalize(1e-9).unwrap_or(-Vector3::z());
        turned += increment.dtheta.dot(&down);
        let right = down.cross(&Vector3::x());
        let step = all.peek().map_or(0.0, |(next, _)| next - t).min(GAP_S);
        pitch += increment.dtheta.dot(&right);
        pushed += increment.dv.x - GRAVITY * pitch * step;
        times.push(t);
        for (sums, sum) in sums.iter_mut().zip([turned, pushed]) {
            sums.push(sum);
        }
    }
    let time = Arc::new(times);
    Some(sums.map(|sum| Integral {
        time: Arc::clone(&time),
        sum: Arc::new(sum),
    }))
}

/// The increments less what the curve adds to the accelerometers' at these speeds; between them the
/// speed changes evenly.
fn straight(record: &Record, speeds: &[[f64; 2]]) -> impl Iterator<Item = (f64, Increment)> {
    let mut next = 0;
    record.increments().map(move |(t, increment)| {
        while speeds.get(next).is_some_and(|[time, _]| *time < t) {
            next += 1;
        }
        let before = next.checked_sub(1).and_then(|k| speeds.get(k));
        let speed = match (before, speeds.get(next)) {
            (Some([then, a]), Some([later, b])) => a + (b - a) * (t - then) / (later - then),
            (one, other) => one.or(other).map_or(0.0, |[_, speed]| *speed),
        };
        let Increment { dtheta, dv } = increment;
        let dv = dv - dtheta.cross(&(Vector3::x() * speed));
        (t, Increment { dtheta, dv })
    })
}

/// Sum of the accelerometers' increments over a growing number of samples.
struct Velocities<I> {
    left: I,
    taken: usize,
    sum: Vector3<f64>,
}

impl<I: Iterator<Item = (f64, Increment)>> Velocities<I> {
    fn of(left: I) -> Self {
        Self {
            left,
            taken: 0,
            sum: Vector3::zeros(),
        }
    }

    /// Sum of the first `count` increments; `count` must not decrease.
    fn up_to(&mut self, count: usize) -> Vector3<f64> {
        while self.taken < count {
            let Some((_, next)) = self.left.next() else {
                break;
            };
            self.sum += next.dv;
            self.taken += 1;
        }
        self.sum
    }
}

/// The differences of course and of speed between fixes.
fn differences(speeds: &[Velocity], apart: f64) -> [Vec<Difference>; 2] {
    let next = |k: usize| {
        let from = speeds.get(k)?.time;
        let far = |v: &Velocity| v.time - from >= apart;
        let next = k + speeds.get(k..)?.iter().position(far)?;
        (speeds[next].time - from <= APART_MOST * apart).then_some(next)
    };
    let mut out = [Vec::new(), Vec::new()];
    for (k, a) in speeds.iter().enumerate() {
        let Some((later, b)) = next(k).and_then(|n| Some((n, speeds.get(n)?))) else {
            continue;
        };
        if a.speed().min(b.speed()) > COURSE_MPS {
            out[0].push(turn(a, b));
        }
        if let Some(c) = next(later).and_then(|n| speeds.get(n)) {
            out[1].push(push(a, b, c));
        }
    }
    // the speeds of a vehicle that never moves are noise
    if out[0].len() < ENOUGH {
        out[1].clear();
    }
    out
}

/// The turn of the course between two fixes.
fn turn(a: &Velocity, b: &Velocity) -> Difference {
    let cross = a.north * b.east - a.east * b.north;
    let dot = a.north * b.north + a.east * b.east;
    let variance = a.variance / a.speed().powi(2) + b.variance / b.speed().powi(2);
    Difference {
        knots: [a.knot(-1.0), b.knot(1.0), Knot::default()],
        observed: cross.atan2(dot),
        sigma: variance.sqrt(),
        drift: b.time - a.time,
    }
}

/// The change between two changes of speed, each per second.
fn push(a: &Velocity, b: &Velocity, c: &Velocity) -> Difference {
    let (early, late) = ((b.time - a.time).recip(), (c.time - b.time).recip());
    let weights = [early, -early - late, late];
    let all = [a, b, c];
    let parts = weights.iter().zip(all);
    let variance: f64 = parts.clone().map(|(w, v)| w * w * v.variance).sum();
    Difference {
        knots: [0, 1, 2].map(|k| all[k].knot(weights[k])),
        observed: parts.map(|(w, v)| w * v.speed()).sum(),
        sigma: variance.sqrt(),
        drift: 1.0,
    }
}

/// A horizontal velocity.
#[derive(Debug, Clone, Copy)]
struct Velocity {
    time: f64,
    north: f64,
    east: f64,
    variance: f64,
}

impl Velocity {
    fn speed(&self) -> f64 {
        self.north.hypot(self.east)
    }

    fn knot(&self, weight: f64) -> Knot {
        Knot {
            time: self.time,
            weight,
            speed: self.speed(),
        }
    }
}

/// Horizontal velocities, and how far apart in time they are to be compared, s. A velocity that is
/// not measured is that between two positions, at the middle of their times.
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
    if measured.len() >= ENOUGH {
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
        let moved = b.position().ned_from(&a.position());
        out.push(Velocity {
            time: 0.5 * (a.time + b.time),
            north: moved.x / time,
            east: moved.y / time,
            variance: (a.sigmas[0].powi(2) + b.sigmas[0].powi(2)) / (time * time),
        });
    }
    (out, apart)
}
