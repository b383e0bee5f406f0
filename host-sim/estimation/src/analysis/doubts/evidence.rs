//! A recording in short, with every change of what its files say applied to it: blocks of a second,
//! rotation and velocity gained in steps of a tenth of a second, and the fixes.

use super::change::Change;
use host_core::inertial::rotation::to_euler;
use host_io::recordings::InitialAttitude;
use host_io::recordings::record::{Record, TimedFix};
use nalgebra::Vector3;

/// Length of a block, less what the times jitter, s.
const BLOCK_S: f64 = 0.999;
/// Step of rotation and velocity, s.
const STEP_S: f64 = 0.1;

/// The means of about a second.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    /// Its end and its length, s.
    pub(super) end: f64,
    pub(super) seconds: f64,
    /// rad/s, m/s2.
    pub(super) rate: Vector3<f64>,
    pub(super) force: Vector3<f64>,
}

/// A recording in short.
#[derive(Debug, Clone)]
pub(super) struct Evidence {
    pub(super) blocks: Vec<Block>,
    /// Times, with the rotation, rad, and the velocity gained, m/s, up to them.
    sums: Sums,
    pub(super) fixes: Vec<TimedFix>,
    /// Start and end of the time for which the recording says that it stands, s.
    pub(super) declared: Option<[f64; 2]>,
    /// Time at which the recording states a heading, s, that heading and its standard deviation,
    /// rad.
    pub(super) heading: Option<(f64, [f64; 2])>,
    /// Samples a second by the time stamps.
    pub(super) rate_hz: f64,
}

impl Evidence {
    pub(super) fn of(record: &Record) -> Self {
        let (blocks, sums) = motion(record);
        let begins = record.first_epoch();
        let declared = match record.initial_attitude {
            Some(InitialAttitude::Standstill(s)) => Some([begins, begins + s as f64]),
            _ => None,
        };
        let heading = match record.initial_attitude {
            Some(InitialAttitude::Known(attitude)) => Some([to_euler(&attitude).2, 0.0]),
            _ => record.rough_heading,
        };
        let span = record.time.end().zip(record.time.start());
        let steps = record.time.len().saturating_sub(1) as f64;
        Self {
            blocks,
            sums,
            fixes: record.fixes.clone(),
            declared,
            heading: heading.map(|stated| (begins, stated)),
            rate_hz: span.map_or(f64::NAN, |(last, first)| steps / (last - first)),
        }
    }

    /// The recording as it is if `change` is right.
    pub(super) fn with(&self, change: &Change) -> Self {
        let mut changed = self.clone();
        for block in &mut changed.blocks {
            block.rate = change.rate(&block.rate);
            block.force = change.force(&block.force);
        }
        for (_, [angle, velocity]) in &mut changed.sums {
            *angle = change.rate(angle);
            *velocity = change.force(velocity);
        }
        for fix in &mut changed.fixes {
            *fix = change.fix(fix);
        }
        changed.declared = self.declared.map(|at| at.map(|t| change.time(t)));
        changed
    }

    /// Rotation about the down axis up to `t`, rad; `None` outside the samples.
    pub(super) fn turned(&self, t: f64) -> Option<f64> {
        self.up_to(t).map(|[angle, _]| angle.z)
    }

    /// Velocity gained by the specific force up to `t`, m/s; `None` outside the samples.
    pub(super) fn pushed(&self, t: f64) -> Option<Vector3<f64>> {
        self.up_to(t).map(|[_, velocity]| velocity)
    }

    /// Rotation and velocity gained up to `t`; `None` outside the samples.
    pub(super) fn up_to(&self, t: f64) -> Option<[Vector3<f64>; 2]> {
        let next = self.sums.partition_point(|(end, _)| *end < t);
        let ((t0, a), (t1, b)) = (self.sums.get(next.checked_sub(1)?)?, self.sums.get(next)?);
        let share = (t - t0) / (t1 - t0);
        Some([0, 1].map(|of| a[of] + (b[of] - a[of]) * share))
    }
}

/// Times, with the rotation and the velocity gained up to them.
type Sums = Vec<(f64, [Vector3<f64>; 2])>;

/// Blocks and sums of a recording.
fn motion(record: &Record) -> (Vec<Block>, Sums) {
    let Some(first) = record.time.start() else {
        return Default::default();
    };
    let ends: Vec<f64> = record.increments().take(2).map(|(end, _)| end).collect();
    let lead = ends.get(1).zip(ends.first()).map_or(0.0, |(b, a)| b - a);
    let mut start = match ends.first() == Some(&first) {
        true => first - lead,
        false => first,
    };
    let mut sum = [Vector3::zeros(); 2];
    let (mut blocks, mut sums) = (Vec::new(), vec![(start, [Vector3::zeros(); 2])]);
    let (mut total, mut before) = ([Vector3::zeros(); 2], start);
    for (end, increment) in record.increments() {
        sum[0] += increment.dtheta;
        sum[1] += increment.dv;
        total[0] += increment.dtheta;
        total[1] += increment.dv;
        if end - before > STEP_S - 1e-6 {
            sums.push((end, total));
            before = end;
        }
        let seconds = end - start;
        if seconds > BLOCK_S {
            blocks.push(Block {
                end,
                seconds,
                rate: sum[0] / seconds,
                force: sum[1] / seconds,
            });
            (start, sum) = (end, [Vector3::zeros(); 2]);
        }
    }
    (blocks, sums)
}
