//! Checks of memory: whether the values that correct the samples are intact.
//!
//! A bit that flips in memory must not become a correction beyond the limit. So constant data has a
//! check word: the exclusive or of its words, which any single bit changes. It costs an instruction
//! or two a word: the correction is checked with each sample, all else at the end of a block,
//! before it is used.

use super::output_stream::OutputStream;
use super::proportional::Proportional;
use super::{Compensator, State};
use crate::model::Nets;
use lrnn_nostd::Net;
use lrnn_nostd::learn::kalman::Maps;

/// Exclusive or of the words of floats.
pub(super) fn floats(values: &[f32]) -> u32 {
    values.iter().fold(0, |sum, value| sum ^ value.to_bits())
}

/// Check of words of 64 bits.
fn wide(words: impl IntoIterator<Item = u64>) -> u32 {
    let sum = words.into_iter().fold(0, |sum, word| sum ^ word);
    (sum >> 32) as u32 ^ sum as u32
}

fn of_net(net: &Net) -> u32 {
    let scales = &net.normalisation;
    let weights = net.weights.iter();
    weights.fold(0, |sum, weight| sum ^ weight.to_bits())
        ^ floats(&scales.input_offset)
        ^ floats(&scales.input_scale)
        ^ floats(&scales.output_scale)
}

/// A check of both networks. The second one's is turned, so that equal networks do not cancel.
#[inline(never)]
pub fn of_nets(nets: &Nets) -> u32 {
    of_net(&nets.gyro) ^ of_net(&nets.accel).rotate_left(1) ^ of_maps(&nets.maps).rotate_left(3)
}

/// Check of an estimate that is followed.
pub(super) fn of_followed(estimate: &[[f32; 3]; 2]) -> u32 {
    floats(estimate.as_flattened()).rotate_left(5)
}

fn of_maps(maps: &Maps<f32>) -> u32 {
    floats(maps.as_flattened().as_flattened())
}

impl OutputStream {
    /// Check of the corrections of integer samples.
    #[inline(always)]
    pub(super) fn counts_sum(&self) -> u32 {
        wide(self.due.as_flattened().iter().map(|due| *due as u64))
    }

    /// Check of the corrections and remainders of float samples.
    #[inline(always)]
    pub(super) fn floats_sum(&self) -> u32 {
        floats(self.due_float.as_flattened()) ^ floats(self.remainder_float.as_flattened())
    }

    /// Check of the constant part of the corrections.
    pub(super) fn constant_sum(&self) -> u32 {
        let counts = wide(self.constant.as_flattened().iter().map(|due| *due as u64));
        counts ^ floats(self.constant_float.as_flattened())
    }
}

impl Proportional {
    /// Check of the elements.
    #[inline(always)]
    pub(super) fn elements_sum(&self) -> u32 {
        let elements = self.elements.as_flattened().as_flattened().iter();
        elements.fold(0, |sum, element| sum ^ *element as u32)
    }
}

impl State {
    /// The estimate is as it was put in force.
    pub(super) fn is_estimate_intact(&self) -> bool {
        self.estimate_sum() == self.estimate_sum
    }

    /// Check of estimate and maps in force, and of what the estimate follows.
    pub(super) fn estimate_sum(&self) -> u32 {
        floats(self.estimate.as_flattened())
            ^ of_maps(&self.maps).rotate_left(3)
            ^ self.followed.as_ref().map_or(0, of_followed)
    }
}

#[cfg(test)]
impl Compensator {
    /// Flips a bit of its memory.
    pub fn upset(&mut self) {
        self.limit.gyro = f32::from_bits(self.limit.gyro.to_bits() ^ 1 << 20);
    }
}

impl Compensator {
    /// To be called after every change of what [`Compensator::is_intact`] looks at.
    #[inline(never)]
    pub(super) fn seal(&mut self) {
        self.sum = self.constants_sum();
    }

    /// Whether nothing has changed but by the functions of this type.
    #[must_use]
    #[inline(never)]
    pub fn is_intact(&self) -> bool {
        self.sum == self.constants_sum()
    }

    fn constants_sum(&self) -> u32 {
        of_net(&self.gyro)
            ^ of_net(&self.accel).rotate_left(1)
            ^ of_maps(&self.maps).rotate_left(3)
            ^ self.others_sum()
    }

    /// [`Compensator::seal`] where the check of the networks is known ([`of_nets`]).
    pub(super) fn seal_with(&mut self, nets: u32) {
        self.sum = nets ^ self.others_sum();
    }

    /// Check of everything but the networks.
    #[inline(never)]
    fn others_sum(&self) -> u32 {
        let Self {
            gyro: _,
            accel: _,
            maps: _,
            slew,
            inputs,
            vibrates,
            scale,
            block_s,
            limit,
            map_limit,
            input_per_count,
            counts_per_error,
            streams,
            sum: _,
        } = self;
        let slewed = slew.map_or(1, |slew| floats(&[slew.gyro, slew.accel]));
        let timing = wide([
            scale.lsb.rad.to_bits(),
            scale.lsb.mps.to_bits(),
            scale.period_s.to_bits(),
            u64::from(scale.block_samples),
        ]);
        let sources = inputs.as_flattened().iter();
        let sources = sources.fold(0u32, |sum, source| sum.rotate_left(5) ^ *source as u32);
        let small = sources ^ u32::from(*vibrates).rotate_left(31) ^ (*streams as u32) << 28;
        slewed.rotate_left(2)
            ^ timing
            ^ small
            ^ floats(&[*block_s, limit.gyro, limit.accel])
            ^ floats(map_limit).rotate_left(7)
            ^ floats(input_per_count)
            ^ floats(counts_per_error.as_flattened())
    }

    /// Estimate or maps in force are corrupted. The estimate is restored from what the first output
    /// stream subtracts, the maps are those of the networks. The caller moves them and takes their
    /// sum.
    #[cold]
    #[inline(never)]
    pub(super) fn mend_estimate(&self, state: &mut State) {
        let [first, ..] = &state.streams;
        let [per_error, ..] = self.counts_per_error;
        let axes = state.estimate.iter_mut().zip(&first.constant_float);
        for ((estimate, due), per_error) in axes.zip(per_error) {
            *estimate = due.map(|counts| -counts / per_error);
        }
        state.estimate = self.within_limit(state.estimate);
        state.followed = None;
        state.maps = if state.off {
            Nets::NONE.maps
        } else {
            self.maps_within_limit()
        };
        state.mended = state.mended.saturating_add(1);
    }

    /// The correction of an output stream is corrupted: it is recomputed from the estimate.
    #[cold]
    #[inline(never)]
    pub(super) fn mend_output_stream(&self, state: &mut State, stream: usize) {
        if let Some(stream) = state.streams.get_mut(stream) {
            *stream = OutputStream::default();
        }
        if !state.is_estimate_intact() || !self.is_intact() {
            // a second upset at the same time: no correction rather than a wrong one
            (state.estimate, state.maps) = ([[0.0; 3]; 2], Nets::NONE.maps);
            state.followed = None;
        }
        state.mended = state.mended.saturating_add(1);
        self.is_in_force(state);
    }
}

#[cfg(test)]
mod tests;
