//! Uncertainty from missing samples.
//!
//! A gap is bridged with the sample before it. The motion of the vehicle meanwhile is not known,
//! but its recent motion is: the root mean square of its rate and of the change of its specific
//! force over some ten seconds. Times the length of the gap they are the standard deviations of the
//! missed motion. While the attitude stays in the range of the linear equations the navigator goes
//! on with a larger covariance. Else it is dropped, and an alignment in motion begins.

use super::FixLearner;
use crate::inputs::Sources;
use crate::nav::vector::{V32, add, dot, scale};

/// Blocks that the memory of the motion spans.
const MEMORY: f32 = 10.0;
/// Share of the vehicle's usual rate and acceleration that a gap may always hide (assumed).
const LEAST: f32 = 0.02;
/// The longest gap that the motion before it says anything about, s.
const LONGEST_S: f64 = 10.0;
/// Standard deviation of the attitude up to which the bank's errors are linear, rad.
const LINEAR: f32 = 0.3;
/// Angle that a gap may hide, rad.
const TURN: f32 = 0.1;
/// The longest gap that an alignment in motion bridges, s: it does not count what was missed.
const SHORT_S: f64 = 0.1;
/// Gravity, m/s2, which a wrong attitude takes for an acceleration.
const GRAVITY: f32 = 9.8;

/// Recent motion of the vehicle.
#[derive(Debug, Clone, Copy, Default)]
pub struct Recent {
    /// Mean squares of the rate and of the change of specific force.
    square: [f32; 2],
    force: V32,
    blocks: u16,
}

impl Recent {
    /// A block. `usual`: the vehicle's usual rate and change of specific force.
    pub fn block(&mut self, sources: &Sources, usual: [f32; 2]) {
        let change = add(sources.force, scale(self.force, -1.0));
        self.force = sources.force;
        if self.blocks == 0 {
            // nothing is known yet
            self.square = usual.map(|x| x * x);
            self.blocks = 1;
            return;
        }
        let now = [dot(sources.rate, sources.rate), dot(change, change)];
        for (square, now) in self.square.iter_mut().zip(now) {
            let mean = *square + (now - *square) / MEMORY;
            // a NaN is forgotten
            *square = if mean.is_finite() { mean } else { *square };
        }
    }

    /// Standard deviations of rate (rad/s) and acceleration (m/s2) that a gap may hide.
    fn missed(&self, usual: [f32; 2]) -> [f32; 2] {
        core::array::from_fn(|i| {
            if self.blocks == 0 {
                usual[i]
            } else {
                libm::sqrtf(self.square[i]).max(LEAST * usual[i])
            }
        })
    }
}

impl FixLearner<'_> {
    /// Samples that are missing before `number`.
    pub(super) fn missing(&self, number: u32) -> u32 {
        let since = |(last, _)| number.wrapping_sub(last).wrapping_sub(1);
        self.samples.last.map_or(0, since)
    }

    /// Bridges `missing` samples; no work is left. Gives how many of them the navigator has to go
    /// on for.
    pub(super) fn bridge(&mut self, missing: u32) -> u32 {
        let Some((_, counts)) = self.samples.last else {
            return 0;
        };
        let time = f64::from(missing) * self.samples.stream.map_or(0.0, |stream| stream.period_s);
        if let Some(align) = &mut self.navigation.align {
            align.gap();
        }
        if let Some(motion) = self.navigation.course.motion_mut() {
            if time > SHORT_S {
                motion.gap();
            } else {
                (0..missing).for_each(|_| motion.sample(&counts));
            }
        }
        if !self.navigation.course.navigates() {
            return 0;
        }
        let bank = &mut self.memory.bank;
        let [rate, force] = self.motion.recent.missed(self.settings.sheet.range);
        let t = time as f32;
        let turn = rate * t;
        let known = (0..3).fold(0.0_f32, |most, i| most.max(bank.error_sigma(i)));
        let attitude = libm::hypotf(known, turn);
        if time > LONGEST_S || !(turn <= TURN && attitude <= LINEAR) {
            self.lose();
            return 0;
        }
        // the lean grows with the turn
        let push = libm::hypotf(force * t, GRAVITY * turn * t * 0.5);
        let way = push * t * 0.5;
        let [turn, push, way] = [turn, push, way].map(|x| x * x);
        let variance = [turn, turn, turn, push, push, push, way, way, way];
        bank.inflate(&variance);
        self.memory.antenna.inflate(&variance);
        missing
    }
}
