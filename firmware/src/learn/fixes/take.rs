//! Samples, ends of blocks and fixes, each with all that it leads to.
//!
//! ```text
//! sample   standstill - navigator - the turn of a fix that waits
//! block    interval: transition, means, antenna, rehearsals - feedback - covariances - rest -
//!          networks
//! fix      interval - innovation - antenna - covariances, hypotheses - rehearsals - choice
//! ```

use super::FixLearner;
use crate::fix::{Fix, OBSERVATIONS};
use crate::inputs::Sources;
use crate::sample::Counts;

/// A fix that is compared with the navigator: its age, s, and variances.
#[derive(Debug, Clone, Copy)]
pub(super) struct Compared {
    pub fix: Fix,
    pub age: f32,
    pub variance: [f32; OBSERVATIONS],
}

/// A fix while nothing navigates: its age, s, and the velocity's standard deviation of a vehicle
/// that stands, m/s, if it does.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fresh {
    pub fix: Fix,
    pub age: f32,
    pub stands: Option<f32>,
}

/// Result of processing a fix.
#[derive(Debug, Clone, Copy)]
pub(super) enum Looked {
    Unused,
    Compare(Compared),
    Start(Fresh),
}

impl FixLearner<'_> {
    /// Takes a sample; none is missing before it.
    pub(super) fn take_sample(&mut self, number: u32, counts: &Counts) {
        self.gather(number, counts);
        self.navigation.course.sample(counts);
        if let Some((number, fix)) = self.fix_times.pending.sample() {
            self.take_fix(number, &fix);
        }
    }

    /// Bridges `missing` samples before the one that comes next, which is `counts`.
    #[inline(never)]
    pub(super) fn go_across(&mut self, missing: u32, counts: &Counts) {
        let of = self.samples.last.map_or(*counts, |(_, counts)| counts);
        let missing = self.bridge(missing);
        if let Some(navigator) = self.navigation.course.navigator_mut() {
            navigator.coast(&of, missing);
        }
    }

    /// A block has ended.
    #[inline(never)]
    pub(super) fn end_block(&mut self, sources: &Sources) {
        self.fix_times.pending.block();
        let navigates = self.interval_is_over();
        let moved = navigates && self.take_transition();
        if moved {
            self.move_means();
        }
        if navigates && let Some(error) = self.correct() {
            self.corrected(&error);
        }
        let inputs = self.take_inputs(sources);
        self.memory.antenna.update(&self.memory.scratch.block);
        let bank = &mut self.memory.bank;
        if moved {
            bank.propagate_covariance(&mut self.memory.scratch);
        }
        self.learn_from_rest();
        self.memory.bank.step(inputs);
    }

    /// A fix that arrived after sample `number`.
    #[inline(never)]
    pub(super) fn take_fix(&mut self, number: u32, fix: &Fix) {
        match self.look_at(number, fix) {
            Looked::Unused => {}
            Looked::Compare(compared) => self.learn_from(&compared),
            Looked::Start(fresh) => self.start_from(&fresh),
        }
    }

    /// The hypotheses learn from a fix, and the best is selected again.
    fn learn_from(&mut self, compared: &Compared) {
        if !self.interval_is_over() {
            return;
        }
        let moved = self.take_transition();
        if moved {
            self.move_means();
        }
        let Some((z, counts)) = self.compare(compared) else {
            return;
        };
        let variance = compared.variance;
        let of_antenna = self.memory.antenna.update(&self.memory.scratch.block);
        let (bank, rehearsal) = (&mut self.memory.bank, &mut self.memory.rehearsal);
        if moved {
            bank.propagate_covariance(&mut self.memory.scratch);
        }
        rehearsal.fix(&z, &variance);
        let measured = variance.map(f32::is_finite);
        let (z, variance) = of_antenna.unwrap_or((z, variance));
        self.motion.rests.fix();
        let refused = bank.fix(&z, &variance, counts);
        if bank.has_equal_scales() {
            bank.give_up_map();
        }
        rehearsal.start(bank);
        self.tally.refused = self.tally.refused.saturating_add(u32::from(refused != 0));
        if counts {
            self.navigation.probation.fix(&z, &measured, refused);
        }
        self.choose();
    }
}
