//! Corrections in proportion to the samples: maps of scale factors and misalignments.
//!
//! What a sample feels is taken off the next one, so that its correction is known before it comes.
//! Over any time the corrections add up to the map of the sum of the samples, but for the first
//! sample, which has none before it, and the last one.

use super::{Compensator, State};
use crate::remainder::{COUNT, LARGEST};
use crate::sample::{Axes, RawSample};
use lrnn_nostd::learn::kalman::Maps;

/// Maps for integer samples.
#[derive(Debug, Clone, Default)]
pub(super) struct Proportional {
    /// Elements in steps of 2^-32.
    pub(super) elements: [[[i32; 3]; 3]; 2],
    /// Whether one of them is not zero.
    acts: bool,
    /// Check of the elements: see [`super::integrity`].
    sum: u32,
}

impl Proportional {
    /// Of maps with elements below 0.5.
    pub(super) fn of(maps: &Maps<f32>) -> Self {
        // `as` saturates
        let elements = maps.map(|map| map.map(|row| row.map(|m| (m * COUNT) as i32)));
        let mut made = Self {
            elements,
            acts: maps.as_flattened().as_flattened().iter().any(|m| *m != 0.0),
            sum: 0,
        };
        made.sum = made.elements_sum();
        made
    }
}

impl Compensator {
    /// The sample of this output stream has left: prepares what is taken off the next one. An axis
    /// that the sensor calls invalid adds nothing to the others.
    #[inline(always)]
    pub fn anticipate(&self, state: &mut State, stream: usize, sample: &RawSample, valid: Axes) {
        if state.proportional.acts {
            if valid == Axes::ALL {
                self.feels(state, stream, sample);
            } else {
                self.feels(state, stream, &sample.only(valid));
            }
        }
    }

    #[inline(never)]
    fn feels(&self, state: &mut State, stream: usize, sample: &RawSample) {
        let maps = &state.proportional;
        let floats = matches!(sample, RawSample::Floats { .. });
        let of = state.streams.get(stream);
        let intact = maps.elements_sum() == maps.sum
            && of.is_some_and(|of| of.constant_sum() == of.constant_sum)
            && (!floats || state.is_estimate_intact());
        if !intact {
            self.mend_output_stream(state, stream);
        }
        let State {
            streams,
            proportional,
            maps,
            ..
        } = state;
        let Some(of) = streams.get_mut(stream) else {
            return;
        };
        match sample {
            RawSample::Counts { gyro, accel } => {
                let triads = of.due.iter_mut().zip(&of.constant).zip([gyro, accel]);
                for (((due, constant), felt), map) in triads.zip(&proportional.elements) {
                    for ((due, constant), row) in due.iter_mut().zip(constant).zip(map) {
                        let products = row.iter().zip(felt);
                        let sum: i64 = products
                            .map(|(m, felt)| i64::from(*m) * i64::from(*felt))
                            .fold(0, i64::wrapping_add); // each below 2^60
                        *due = sum.saturating_add(*constant).clamp(-LARGEST, LARGEST);
                    }
                }
            }
            RawSample::Floats { gyro, accel } => {
                let triads = of.due_float.iter_mut().zip(&of.constant_float);
                let triads = triads.zip([gyro, accel]);
                for (((due, constant), felt), map) in triads.zip(maps.iter()) {
                    for ((due, constant), row) in due.iter_mut().zip(constant).zip(map) {
                        let products = row.iter().zip(felt);
                        let sum = products.fold(0.0, |sum, (m, felt)| sum + m * felt);
                        *due = if sum.is_finite() {
                            *constant - sum
                        } else {
                            *constant
                        };
                    }
                }
            }
        }
        of.seal();
    }
}

#[cfg(test)]
mod tests;
