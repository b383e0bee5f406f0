//! The times at rest in a log, and where it moves.
//!
//! The mean rates and forces of neighbouring seconds are compared. At rest they differ by the
//! sensors' noise, which the quietest quarter of the differences shows; where they differ by eight
//! times as much, or by more than any sensor at rest, the log moves. So does a second that is much
//! rougher than the quietest quarter of them. For a force that turns slowly, its means over 10 and
//! 100 s and those of the first and the last quarter are compared, too.

use super::log::Log;
use host_core::inertial::units::DEG;
use nalgebra::Vector3;
use serde::Serialize;
use std::ops::Range;

/// Length of a block, s, and the least number of its samples.
const BLOCK_S: f64 = 1.0;
const LEAST_SAMPLES: f64 = 10.0;
/// Changes from one second to the next that no sensor at rest shows, rad/s and m/s2. Consumer
/// sensors have a fifth.
const MOST: [f64; 2] = [0.2 * DEG, 0.05];
/// A change is motion from so many standard deviations on.
const SIGMAS: f64 = 8.0;
/// The quarter of the lengths of a normal vector of three axes below which a quarter lies.
const QUARTER: f64 = 1.101;
/// A second is rough from so many times the quietest quarter on.
const ROUGH: f64 = 4.0;
/// A rest does not turn as fast as this changes the specific force, m/s3 (6 deg/h); warming by 30 K
/// in ten minutes is half of it.
const SLOWEST: f64 = 3e-4;
/// A time at rest has the rate of the slowest one within this, rad/s; otherwise it turns steadily.
const STEADY: f64 = 0.5 * DEG;
/// Blocks whose means are compared beside single ones.
const LONGER: [usize; 2] = [10, 100];

/// The mean of about a second.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    first: usize,
    /// rad/s, m/s2.
    pub(super) means: [Vector3<f64>; 2],
    /// Standard deviation of the samples around them.
    rough: [f64; 2],
    /// Samples are missing before it.
    after_gap: bool,
}

/// A time at rest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stretch {
    /// Numbers of its samples.
    #[serde(skip)]
    pub samples: Range<usize>,
    /// Start and end, s.
    pub from_s: f64,
    /// End, s.
    pub to_s: f64,
    /// Mean rate, rad/s.
    #[serde(serialize_with = "super::axes")]
    pub rate: Vector3<f64>,
    /// Mean specific force, m/s2.
    #[serde(serialize_with = "super::axes")]
    pub force: Vector3<f64>,
    /// Standard deviations of the two means by the scatter of their seconds.
    #[serde(skip)]
    pub sigma: [Vector3<f64>; 2],
}

impl Stretch {
    /// Its length, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.to_s - self.from_s
    }
}

/// A time that moves.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Move {
    /// Start, s.
    pub from_s: f64,
    /// End, s.
    pub to_s: f64,
    /// Largest change of the rate from a second to the next, deg/s.
    pub rate_dps: f64,
    /// Largest change of the specific force, m/s2.
    pub force_mps2: f64,
}

/// The times at rest of a log in order, and those at which it moves.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Rests {
    /// At rest, none shorter than was asked for.
    pub stretches: Vec<Stretch>,
    /// The longest time at rest, whether it is long enough or not, s.
    pub longest_s: f64,
    /// Moving.
    pub moves: Vec<Move>,
    /// Times before which samples are missing, s.
    pub gaps: Vec<f64>,
}

/// The times at rest of at least this length, s.
#[must_use]
pub fn rests(log: &Log, least_s: f64) -> Rests {
    let length = (BLOCK_S * log.rate_hz).max(LEAST_SAMPLES).round() as usize;
    let blocks = blocks(log, length);
    let moving = moving(&blocks);
    let mut found = Rests {
        gaps: log.begins.iter().skip(1).map(|(_, t)| *t).collect(),
        ..Rests::default()
    };
    let mut k = 0;
    while k < blocks.len() {
        let same = |j: usize| moving[j] == moving[k] && (moving[j] || !blocks[j].after_gap);
        let end = (k + 1..blocks.len())
            .find(|j| !same(*j))
            .unwrap_or(blocks.len());
        let (from, to) = (blocks[k].first, blocks[end - 1].first + length);
        let before_s = |sample: usize| log.time(sample) - 1.0 / log.rate_hz;
        if moving[k] {
            let [rate, force] = largest_change(&blocks, k..end);
            found.moves.push(Move {
                from_s: before_s(from),
                to_s: log.time(to - 1),
                rate_dps: rate / DEG,
                force_mps2: force,
            });
        } else if let Some(force) = turned(&blocks[k..end], length, log.rate_hz) {
            found.moves.push(Move {
                from_s: before_s(from),
                to_s: log.time(to - 1),
                rate_dps: 0.0,
                force_mps2: force,
            });
        } else {
            found.stretches.push(stretch(log, &blocks[k..end], length));
        }
        k = end;
    }
    found.keep(least_s - 0.5 / log.rate_hz);
    found
}

impl Rests {
    /// Keeps what does not turn steadily and lasts so long, s.
    fn keep(&mut self, least_s: f64) {
        let slowest = self.stretches.iter().map(|s| s.rate);
        let slowest = slowest.min_by(|a, b| a.norm().total_cmp(&b.norm()));
        let slowest = slowest.unwrap_or_default();
        let all = std::mem::take(&mut self.stretches).into_iter();
        let (still, turning): (Vec<_>, Vec<_>) =
            all.partition(|s| (s.rate - slowest).norm() < STEADY);
        let moves = turning.iter().map(|s| Move {
            from_s: s.from_s,
            to_s: s.to_s,
            rate_dps: (s.rate - slowest).norm() / DEG,
            force_mps2: 0.0,
        });
        self.moves.extend(moves);
        self.moves.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
        self.longest_s = still.iter().map(Stretch::seconds).fold(0.0, f64::max);
        self.stretches = still;
        self.stretches.retain(|s| s.seconds() >= least_s);
    }
}

/// Change of the force over a time without sudden motion that turns all the same, m/s2.
fn turned(blocks: &[Block], length: usize, rate_hz: f64) -> Option<f64> {
    let part = blocks.len() / 4;
    if part == 0 {
        return None;
    }
    let mean = |of: &[Block]| of.iter().map(|b| b.means[1]).sum::<Vector3<f64>>() / part as f64;
    let change = mean(&blocks[blocks.len() - part..]) - mean(&blocks[..part]);
    let seconds = (blocks.len() - part) as f64 * length as f64 / rate_hz;
    let change = change.norm();
    (change > 0.5 * MOST[1] && change > SLOWEST * seconds).then_some(change)
}

fn stretch(log: &Log, blocks: &[Block], length: usize) -> Stretch {
    let count = blocks.len() as f64;
    let first = blocks.first().map_or(0, |b| b.first);
    let samples = first..first + blocks.len() * length;
    let mean = |i: usize| blocks.iter().map(|b| b.means[i]).sum::<Vector3<f64>>() / count;
    let means = [mean(0), mean(1)];
    let sigma = |i: usize| {
        let squares = blocks
            .iter()
            .map(|b| (b.means[i] - means[i]).map(|x| x * x));
        let sum: Vector3<f64> = squares.sum();
        sum.map(|sum| (sum / (count - 1.0).max(1.0) / count).sqrt())
    };
    Stretch {
        from_s: log.time(samples.start) - 1.0 / log.rate_hz,
        to_s: log.time(samples.end - 1),
        rate: means[0],
        force: means[1],
        sigma: [sigma(0), sigma(1)],
        samples,
    }
}

/// The blocks between the gaps.
pub(super) fn blocks(log: &Log, length: usize) -> Vec<Block> {
    let mut all = Vec::new();
    let ends = log.begins.iter().skip(1).map(|(first, _)| *first);
    let ends = ends.chain([log.samples.len()]);
    for ((begin, _), end) in log.begins.iter().zip(ends) {
        let mut first = *begin;
        while first + length <= end {
            let samples = log.samples.block(first..first + length);
            let per_s = log.rate_hz;
            let rates = || samples.iter().map(|s| [s.dtheta * per_s, s.dv * per_s]);
            let mut means = [Vector3::zeros(); 2];
            for [rate, force] in rates() {
                means[0] += rate / length as f64;
                means[1] += force / length as f64;
            }
            let mut squares = [0.0; 2];
            for both in rates() {
                for ((square, value), mean) in squares.iter_mut().zip(both).zip(means) {
                    *square += (value - mean).norm_squared();
                }
            }
            all.push(Block {
                first,
                means,
                rough: squares.map(|sum| (sum / length as f64).sqrt()),
                after_gap: first == *begin && !all.is_empty(),
            });
            first += length;
        }
    }
    all
}

/// Whether each block moves.
fn moving(blocks: &[Block]) -> Vec<bool> {
    let mut moving = vec![false; blocks.len()];
    for (i, most) in MOST.into_iter().enumerate() {
        let changes: Vec<f64> = (1..blocks.len()).map(|k| change(blocks, k, i)).collect();
        // counts so coarse that neighbours are mostly equal: the least step is no motion
        let least = changes
            .iter()
            .copied()
            .filter(|c| *c > 0.0)
            .fold(most, f64::min);
        let noise = quarter(&changes) / QUARTER;
        let limit = (SIGMAS * noise).max(3.0 * least).min(most);
        let rough: Vec<f64> = blocks.iter().map(|b| b.rough[i]).collect();
        let quiet = quarter(&rough);
        for k in 0..blocks.len() {
            if quiet > 0.0 && rough[k] > ROUGH * quiet {
                // it begins or ends within a block beside it
                moving[k.saturating_sub(1)..(k + 2).min(blocks.len())].fill(true);
            }
            if k > 0 && changes[k - 1] > limit {
                (moving[k - 1], moving[k]) = (true, true);
            }
        }
    }
    for length in LONGER {
        for k in (length..blocks.len().saturating_sub(length)).step_by(length / 2) {
            let both = k - length..k + length;
            let known = both
                .clone()
                .any(|j| moving[j] || j > both.start && blocks[j].after_gap);
            let mean =
                |of: &[Block]| of.iter().map(|b| b.means[1]).sum::<Vector3<f64>>() / length as f64;
            let change = mean(&blocks[k..both.end]) - mean(&blocks[both.start..k]);
            if !known && change.norm() > MOST[1] {
                moving[both].fill(true);
            }
        }
    }
    moving
}

/// Change of the means of gyros or accelerometers before a block. 0 after a gap.
fn change(blocks: &[Block], k: usize, i: usize) -> f64 {
    match blocks[k].after_gap {
        true => 0.0,
        false => (blocks[k].means[i] - blocks[k - 1].means[i]).norm(),
    }
}

fn largest_change(blocks: &[Block], range: Range<usize>) -> [f64; 2] {
    [0, 1].map(|i| {
        let changes = range
            .clone()
            .filter(|k| *k > 0)
            .map(|k| change(blocks, k, i));
        changes.fold(0.0, f64::max)
    })
}

/// The value below which a quarter of them lies.
fn quarter(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 4).copied().unwrap_or_default()
}
