//! The inputs of the networks, from the sums of a block.

use super::{Compensator, State, step};
use crate::inputs::{Inputs, Source, Sources, settles};
use lrnn_nostd::Step;

impl Compensator {
    /// Inputs of the networks: [`crate::inputs::OWN`], unless [`Compensator::set_inputs`] has set
    /// other sources.
    pub fn inputs(&self) -> &Inputs {
        &self.inputs
    }

    /// Other sources enter the networks, from the next block on.
    pub fn set_inputs(&mut self, inputs: Inputs) {
        self.take_inputs(inputs);
        self.seal();
    }

    /// [`Self::set_inputs`] without the check.
    pub(super) fn take_inputs(&mut self, inputs: Inputs) {
        self.inputs = inputs;
        self.vibrates = inputs.as_flattened().contains(&Source::Vibration);
    }

    /// Counts `samples` as missing: time that the thermometer has to include.
    pub fn miss(&self, state: &mut State, samples: u32) {
        let seconds = f64::from(samples) * self.scale.period_s;
        state.thermometer.give_up(seconds as f32);
    }

    /// Steps both networks on their inputs.
    pub(super) fn step_both(&self, state: &mut State, sources: &Sources) -> [Step; 2] {
        let [gyro, accel] = &self.inputs;
        if !core::mem::replace(&mut state.stepped, true) && settles(&self.inputs) {
            self.gyro.settle(&mut state.gyro, sources.select(gyro));
            self.accel.settle(&mut state.accel, sources.select(accel));
        }
        [
            step(&self.gyro, &mut state.gyro, sources.select(gyro)),
            step(&self.accel, &mut state.accel, sources.select(accel)),
        ]
    }

    /// Inputs from the block that ends.
    pub(super) fn sources(&self, state: &mut State, per_sum: f32) -> Sources {
        let [per_gyro, per_accel] = self.input_per_count;
        let mean = |sum: [i64; 3], k: f32| sum.map(|s| s as f32 * k * per_sum);
        let [temperature, temperature_rate] = state.thermometer.end_block(self.block_s);
        let vibration = if self.vibrates {
            let samples = self.scale.block_samples;
            let per_sample = per_accel * f32::from(samples);
            state.vibration.mean_square(samples, per_sample)
        } else {
            0.0
        };
        Sources {
            rate: mean(state.sum[0], per_gyro),
            force: mean(state.sum[1], per_accel),
            temperature,
            temperature_rate,
            vibration,
        }
    }
}
