//! Streams of samples of one sensor that are corrected beside each other.
//!
//! A sensor may send the same motion in two kinds of frames, each with its own scale. A client
//! reads one of them, so each must be right to its last remainder.

use super::{Compensator, ConfigError, State};
use crate::model::Nets;
use crate::remainder::{COUNT, HALF, LARGEST, Owed, add_float, add_float_early, subtract};
use crate::sample::{Axes, Lsb, RawSample};

/// Streams of samples that can be corrected beside each other.
pub const OUTPUT_STREAMS: usize = 4;

/// Corrections owed to one output stream.
#[derive(Debug, Clone)]
pub(super) struct OutputStream {
    /// Correction of the next sample: of counts in steps of 2^-32, and of floats with its sign
    /// turned.
    pub(super) due: [[i64; 3]; 2],
    pub(super) due_float: [[f32; 3]; 2],
    /// The estimate's part of it.
    pub(super) constant: [[i64; 3]; 2],
    pub(super) constant_float: [[f32; 3]; 2],
    /// Check of that part.
    pub(super) constant_sum: u32,
    left: [[u32; 3]; 2], // steps of 2^-32 counts carried over, and `HALF` more
    pub(super) remainder_float: [[f32; 3]; 2],
    /// Checks of the corrections of integer and of float samples: see [`super::integrity`].
    counts_sum: u32,
    floats_sum: u32,
}

impl Default for OutputStream {
    fn default() -> OutputStream {
        OutputStream {
            due: [[0; 3]; 2],
            due_float: [[0.0; 3]; 2],
            constant: [[0; 3]; 2],
            constant_float: [[0.0; 3]; 2],
            constant_sum: 0,
            left: [[HALF; 3]; 2],
            remainder_float: [[0.0; 3]; 2],
            counts_sum: 0,
            floats_sum: 0,
        }
    }
}

impl OutputStream {
    /// The constant part was this before. `maps`: the last sample has added to it.
    fn moves(&mut self, before: ([[i64; 3]; 2], [[f32; 3]; 2]), maps: bool) {
        if !maps {
            (self.due, self.due_float) = (self.constant, self.constant_float);
            return;
        }
        let (counts, floats) = before;
        let counts = counts
            .as_flattened()
            .iter()
            .zip(self.constant.as_flattened());
        for (due, (before, now)) in self.due.as_flattened_mut().iter_mut().zip(counts) {
            let felt = due.saturating_sub(*before);
            *due = felt.saturating_add(*now).clamp(-LARGEST, LARGEST);
        }
        let floats = floats
            .as_flattened()
            .iter()
            .zip(self.constant_float.as_flattened());
        for (due, (before, now)) in self.due_float.as_flattened_mut().iter_mut().zip(floats) {
            *due = (*due - before) + now;
        }
    }

    /// To be called after every change of the correction.
    pub(super) fn seal(&mut self) {
        self.counts_sum = self.counts_sum();
        self.floats_sum = self.floats_sum();
    }
}

impl State {
    /// Correction and remainder of a sample of this output stream, in the order of gyros and
    /// accelerometers: of counts, or the bits of floats. Zero for a stream that does not exist.
    pub fn owed(&self, stream: usize, floats: bool) -> [Owed; 6] {
        let mut owed = [Owed::default(); 6];
        let Some(of) = self.streams.get(stream) else {
            return owed;
        };
        let due = of
            .due
            .as_flattened()
            .iter()
            .zip(of.due_float.as_flattened());
        let left = of
            .left
            .as_flattened()
            .iter()
            .zip(of.remainder_float.as_flattened());
        for ((owed, (count, float)), (left, left_float)) in owed.iter_mut().zip(due).zip(left) {
            *owed = if floats {
                Owed {
                    due: float.to_bits().into(),
                    left: left_float.to_bits(),
                }
            } else {
                Owed {
                    due: count.cast_unsigned(),
                    left: left ^ HALF,
                }
            };
        }
        owed
    }

    /// Restores the remainders of an output stream.
    pub fn set_left(&mut self, stream: usize, floats: bool, left: [u32; 6]) {
        let Some(of) = self.streams.get_mut(stream) else {
            return;
        };
        if floats {
            let places = of.remainder_float.as_flattened_mut().iter_mut();
            places
                .zip(left)
                .for_each(|(place, bits)| *place = f32::from_bits(bits));
            of.floats_sum = of.floats_sum();
        } else {
            let places = of.left.as_flattened_mut().iter_mut();
            places
                .zip(left)
                .for_each(|(place, bits)| *place = bits ^ HALF);
        }
    }

    /// Bits of the remainders that the samples of the first output stream carry over to the next
    /// one: of counts, or of floats.
    pub fn carried(&self, floats: bool) -> [[u32; 3]; 2] {
        let [stream, ..] = &self.streams;
        if floats {
            stream.remainder_float.map(|triad| triad.map(f32::to_bits))
        } else {
            stream.left.map(|triad| triad.map(|left| left ^ HALF))
        }
    }

    /// Restores the remainders that [`State::carried`] gave.
    pub fn carry(&mut self, floats: bool, bits: [[u32; 3]; 2]) {
        let [stream, ..] = &mut self.streams;
        if floats {
            stream.remainder_float = bits.map(|triad| triad.map(f32::from_bits));
            stream.floats_sum = stream.floats_sum();
        } else {
            stream.left = bits.map(|triad| triad.map(|bits| bits ^ HALF));
        }
    }
}

impl Compensator {
    /// Sets the scale and the timing of the samples of another output stream than 0, in which the
    /// same sensor sends the same motion once more. Each stream carries its own remainder, so that
    /// the output of each is exact. Blocks are made of stream 0 alone. A stream that was not set is
    /// not corrected.
    ///
    /// # Errors
    /// Names the parameter that is out of range.
    pub fn set_output_stream(
        &mut self,
        state: &mut State,
        stream: usize,
        lsb: Lsb,
        sample_period_s: f64,
    ) -> Result<(), ConfigError> {
        if !positive(lsb.rad) || !positive(lsb.mps) {
            return Err(ConfigError::Lsb);
        }
        if !positive(sample_period_s) {
            return Err(ConfigError::SamplePeriod);
        }
        let per_error_of = self.counts_per_error.get_mut(stream);
        *per_error_of.ok_or(ConfigError::OutputStream)? = per_error(lsb, sample_period_s);
        self.streams = self.streams.max(stream + 1);
        self.seal();
        self.make_due(state);
        Ok(())
    }

    /// Corrects one sample of an output stream by the estimate in force: all that must be done
    /// before a frame can leave. Returns it and the axes whose count saturated at 32 bits. Nothing
    /// happens at a stream that does not exist. `early`: the first byte of a float leaves before
    /// its last one has come ([`crate::remainder::add_early`]).
    #[inline(always)]
    pub fn corrected(
        &self,
        state: &mut State,
        stream: usize,
        sample: &RawSample,
        early: bool,
    ) -> (RawSample, Axes) {
        let intact = match (state.streams.get(stream), sample) {
            (Some(of), RawSample::Counts { .. }) => of.counts_sum() == of.counts_sum,
            (Some(of), RawSample::Floats { .. }) => of.floats_sum() == of.floats_sum,
            (None, _) => return (*sample, Axes::NONE),
        };
        if !intact {
            self.mend_output_stream(state, stream);
        }
        let Some(stream) = state.streams.get_mut(stream) else {
            return (*sample, Axes::NONE);
        };
        match sample {
            RawSample::Counts { gyro, accel } => {
                let [left_gyro, left_accel] = &mut stream.left;
                let (gyro, gyro_over) = subtract(gyro, &stream.due[0], left_gyro);
                let (accel, accel_over) = subtract(accel, &stream.due[1], left_accel);
                let over = Axes::new(gyro_over, accel_over);
                (RawSample::Counts { gyro, accel }, over)
            }
            RawSample::Floats { gyro, accel } => {
                let [due_gyro, due_accel] = &stream.due_float;
                let [left_gyro, left_accel] = &mut stream.remainder_float;
                let (mut gyro, mut accel) = (*gyro, *accel);
                let add = if early { add_float_early } else { add_float };
                add(&mut gyro, due_gyro, left_gyro);
                add(&mut accel, due_accel, left_accel);
                stream.floats_sum = stream.floats_sum();
                (RawSample::Floats { gyro, accel }, Axes::NONE)
            }
        }
    }

    /// [`Compensator::corrected`] of a sample that leaves when it is known as a whole, in its
    /// place. Returns the axes that saturated.
    pub fn correct(&self, state: &mut State, stream: usize, sample: &mut RawSample) -> Axes {
        let (corrected, over) = self.corrected(state, stream, sample, false);
        self.anticipate(state, stream, sample, Axes::ALL);
        *sample = corrected;
        over
    }

    /// Computes the estimate in counts per sample, for the streams in use; what the last sample has
    /// added in proportion stays. Floats are owed nothing
    /// any more where the correction is zero: a remainder would change a value with a finer last
    /// digit.
    pub(super) fn make_due(&self, state: &mut State) {
        state.changes = state.changes.wrapping_add(1);
        let zero = state.is_zero();
        let maps = state.maps != Nets::NONE.maps;
        let streams = state.streams.iter_mut().zip(self.counts_per_error);
        for (stream, per_error) in streams.take(self.streams) {
            let before = (stream.constant, stream.constant_float);
            let per_sample = state.estimate.iter().zip(per_error);
            let constant = stream.constant.iter_mut().zip(&mut stream.constant_float);
            let constant = constant.zip(&mut stream.remainder_float);
            for (((due, due_float), left), (estimate, per_error)) in constant.zip(per_sample) {
                let counts = estimate.map(|e| e * per_error);
                *due = counts.map(|c| ((c * COUNT) as i64).clamp(-LARGEST, LARGEST));
                *due_float = counts.map(|c| -c);
                if counts == [0.0; 3] && !maps || zero {
                    *left = [0.0; 3];
                }
            }
            stream.moves(before, maps);
            stream.constant_sum = stream.constant_sum();
            stream.seal();
        }
    }
}

/// Counts per sample for an error of 1 rad/s and 1 m/s2.
pub(super) fn per_error(lsb: Lsb, period_s: f64) -> [f32; 2] {
    [(period_s / lsb.rad) as f32, (period_s / lsb.mps) as f32]
}

pub(super) fn positive(x: f64) -> bool {
    x.is_finite() && x > 0.0
}
