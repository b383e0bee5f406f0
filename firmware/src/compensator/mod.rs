//! Samples in, corrected samples out: block sums, two networks, limits, and a carried remainder.
//!
//! The networks step once a block of `block_samples` samples, because the noise of one sample hides
//! a laser gyro's bias by two orders of magnitude (see LEARNING). The estimate of a block stays in
//! force over the next one. Errors in proportion to the samples, by the maps, are taken off the
//! next sample: over any time their sum is right but for the first and last one. So the correction
//! of a sample is known before the sample arrives, and the latency is the same on all axes. With a
//! correction of zero the output is the input, bit for bit.

mod driven;
mod force;
mod integrity;
mod limit;
mod output_stream;
mod proportional;

use crate::inputs::{Inputs, OWN, Sources, Thermometer, Vibration};
use crate::model::Nets;
use crate::sample::{Axes, Counts, Lsb, RawSample, StreamScale};
use lrnn_nostd::learn::kalman::Maps;
use lrnn_nostd::{Fault, Net, State as NetState, Step};
use output_stream::{OutputStream, per_error, positive};
use proportional::Proportional;

pub use integrity::of_nets;
pub use limit::{ConfigError, Limit};
pub use output_stream::OUTPUT_STREAMS;

/// Configuration: networks, block length, count values, limits. Whole networks are exchanged
/// between blocks, never edited.
#[derive(Debug, Clone)]
pub struct Compensator {
    /// Gyro network: its [`Compensator::inputs`] in, rate error in rad/s out.
    gyro: Net,
    /// Accelerometer network: its inputs in, the specific force's error in m/s2 out.
    accel: Net,
    /// Errors in proportion to each sample, as [`Nets::maps`].
    maps: Maps<f32>,
    slew: Option<Limit>,
    inputs: Inputs,
    /// An input asks for the vibration.
    vibrates: bool,
    scale: StreamScale,
    block_s: f32,
    limit: Limit,
    /// Largest element of a map of gyros and accelerometers.
    map_limit: [f32; 2],
    // mean input of a block per summed count, SI
    input_per_count: [f32; 2],
    // counts per sample for an error of one SI unit, for each output stream
    counts_per_error: [[f32; 2]; OUTPUT_STREAMS],
    /// Output streams in use: those up to the last one that was set, at least stream 0.
    streams: usize,
    /// Check of all above: see [`integrity`].
    sum: u32,
}

/// State that changes from sample to sample.
#[derive(Debug, Clone, Default)]
pub struct State {
    gyro: NetState,
    accel: NetState,
    /// The networks have stepped, or have been given states.
    stepped: bool,
    sum: [[i64; 3]; 2],
    samples: u16,
    thermometer: Thermometer,
    vibration: Vibration,
    estimate: [[f32; 3]; 2], // rad/s and m/s2, in force
    maps: Maps<f32>,         // in force
    /// What the estimate moved to in the last block; `None`: other networks or another mode have
    /// come since.
    followed: Option<[[f32; 3]; 2]>,
    /// Check of the three above.
    estimate_sum: u32,
    proportional: Proportional,
    streams: [OutputStream; OUTPUT_STREAMS],
    /// The correction goes to zero, as fast as `slew` lets it, whatever the networks' output.
    pub off: bool,
    /// The correction stays as it is, whatever the networks' output.
    pub hold: bool,
    /// Blocks whose network step reported a fault since start.
    pub faults: u32,
    /// Blocks in which a correction was clipped since start.
    pub clipped: u32,
    /// Blocks given up since start: see [`Compensator::give_up_block`].
    pub given_up: u32,
    /// Times memory was found changed by nobody, and was mended, since start.
    pub mended: u32,
    /// The compensator itself has changed in memory and must be rebuilt. Until then the correction
    /// stays as it is.
    pub corrupted: bool,
    /// Number of changes of the correction, modulo 2^32.
    pub changes: u32,
}

impl State {
    /// The state before the first sample. A function of its own, so that it is built in place.
    #[inline(never)]
    pub fn clear(&mut self) {
        *self = State::default();
    }

    /// Constant part of the correction in force: rad/s and m/s2.
    pub fn estimate(&self) -> [[f32; 3]; 2] {
        self.estimate
    }

    /// Maps in force.
    pub fn maps(&self) -> &Maps<f32> {
        &self.maps
    }

    /// Samples pass as they are.
    pub fn is_zero(&self) -> bool {
        self.estimate == [[0.0; 3]; 2] && self.maps == Nets::NONE.maps
    }

    /// A reading of the sensor's thermometer, degrees C, in the block in progress.
    #[inline(always)]
    pub fn read_temperature(&mut self, celsius: f32) {
        self.thermometer.read(celsius);
    }

    /// Adds one sample to the block's sums.
    #[inline(always)]
    fn add_counts(&mut self, gyro: &[i32; 3], accel: &[i32; 3]) {
        for (sum, counts) in self.sum.iter_mut().zip([gyro, accel]) {
            for (s, c) in sum.iter_mut().zip(counts) {
                *s = s.wrapping_add(i64::from(*c)); // no more than 2^16 of 32 bits
            }
        }
    }

    /// The networks' states.
    pub fn nets(&self) -> [NetState; 2] {
        [self.gyro, self.accel]
    }

    /// Takes the networks' states from networks that have processed the same blocks.
    pub fn set_nets(&mut self, [gyro, accel]: [NetState; 2]) {
        self.gyro = gyro;
        self.accel = accel;
        self.stepped = true;
        self.slews();
    }

    /// Other networks or another mode: the way to their correction is no faster than the slew
    /// limit.
    fn slews(&mut self) {
        if let Some(followed) = self.followed.take() {
            self.estimate_sum ^= integrity::of_followed(&followed);
        }
    }
}

/// Result of one block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block {
    /// Quantities from which the networks' inputs were selected.
    pub sources: Sources,
    /// Estimated rate error in force from the next sample on, rad/s.
    pub rate_error: [f32; 3],
    /// Estimated specific-force error likewise, m/s2.
    pub force_error: [f32; 3],
    /// The networks' output within the limit, whether it comes into force or not: rad/s, m/s2.
    pub network_output: [[f32; 3]; 2],
    /// Sum of the block's samples, in steps.
    pub sum: [[i64; 3]; 2],
    /// Counts (or units of a float sample) in a step: 1, or a power of two below.
    pub step: f32,
    /// First fault of the two networks, if any.
    pub fault: Option<Fault>,
}

impl Compensator {
    /// `sample_period_s` is the time between samples, `block_samples` the networks' period in
    /// samples.
    ///
    /// # Errors
    /// Names the parameter that is out of range.
    pub fn new(
        gyro: Net,
        accel: Net,
        lsb: Lsb,
        sample_period_s: f64,
        block_samples: u16,
        limit: Limit,
    ) -> Result<Self, ConfigError> {
        let mut made = Self {
            gyro,
            accel,
            ..Self::BLANK
        };
        made.set_up(lsb, sample_period_s, block_samples, limit)?;
        made.seal();
        Ok(made)
    }

    /// A compensator of zeros, to be renewed.
    pub(crate) const BLANK: Compensator = Compensator {
        gyro: Nets::NONE.gyro,
        accel: Nets::NONE.accel,
        maps: Nets::NONE.maps,
        slew: None,
        inputs: OWN,
        vibrates: false,
        scale: StreamScale {
            lsb: Lsb { rad: 0.0, mps: 0.0 },
            period_s: 0.0,
            block_samples: 0,
        },
        block_s: 0.0,
        limit: Limit {
            gyro: 0.0,
            accel: 0.0,
        },
        map_limit: [0.0; 2],
        input_per_count: [0.0; 2],
        counts_per_error: [[0.0; 2]; OUTPUT_STREAMS],
        streams: 1,
        sum: 0,
    };

    /// [`Compensator::new`] of networks with this check ([`of_nets`]), with these inputs and this
    /// slew limit, built in place of an old one. The first frame of a stream waits for it, and each
    /// copy would cost as much as a sample.
    ///
    /// # Errors
    /// As [`Compensator::new`].
    pub(crate) fn renew(
        &mut self,
        (nets, nets_sum): (&Nets, u32),
        (lsb, sample_period_s, block_samples): (Lsb, f64, u16),
        (limit, map_limit): (Limit, [f32; 2]),
        (inputs, slew): (Option<Inputs>, Option<Limit>),
    ) -> Result<(), ConfigError> {
        self.set_up(lsb, sample_period_s, block_samples, limit)?;
        (self.gyro, self.accel, self.maps) = (nets.gyro, nets.accel, nets.maps);
        self.map_limit = map_limit;
        (self.slew, self.streams) = (slew, 1);
        self.take_inputs(inputs.unwrap_or(OWN));
        self.seal_with(nets_sum);
        Ok(())
    }

    /// All but networks, inputs and slew limit.
    fn set_up(
        &mut self,
        lsb: Lsb,
        period_s: f64,
        block_samples: u16,
        limit: Limit,
    ) -> Result<(), ConfigError> {
        if !positive(lsb.rad) || !positive(lsb.mps) {
            return Err(ConfigError::Lsb);
        }
        if !positive(period_s) {
            return Err(ConfigError::SamplePeriod);
        }
        if block_samples == 0 {
            return Err(ConfigError::BlockSamples);
        }
        if limit.gyro.is_nan() || limit.accel.is_nan() || limit.gyro < 0.0 || limit.accel < 0.0 {
            return Err(ConfigError::Limit);
        }
        let block_s = period_s * f64::from(block_samples);
        self.scale = StreamScale {
            lsb,
            period_s,
            block_samples,
        };
        self.limit = limit;
        self.block_s = block_s as f32;
        self.input_per_count = [(lsb.rad / block_s) as f32, (lsb.mps / block_s) as f32];
        self.counts_per_error = [per_error(lsb, period_s); OUTPUT_STREAMS];
        Ok(())
    }

    /// Fastest change of the correction, rad/s per s and m/s2 per s. `None` before the alignment:
    /// the correction then changes at once.
    pub fn slew(&self) -> Option<Limit> {
        self.slew
    }

    /// Limits the changes of the correction from now on.
    pub fn set_slew(&mut self, slew: Option<Limit>) {
        self.slew = slew;
        self.seal();
    }

    /// The networks.
    pub fn nets(&self) -> Nets {
        Nets {
            gyro: self.gyro,
            accel: self.accel,
            maps: self.maps,
        }
    }

    /// Scale and timing of the samples.
    pub fn scale(&self) -> StreamScale {
        self.scale
    }

    /// The state at power-on. The networks' initial output, which is the bias of their output
    /// layer, is in force until the first block is over; with `off`, the correction is zero.
    pub fn power_on(&self, off: bool) -> State {
        let mut state = State {
            off,
            ..State::default()
        };
        if !off {
            self.put_in_force(
                &mut state,
                &self.initial_output(),
                &self.maps_within_limit(),
            );
        }
        state
    }

    /// The networks' output before their first step, within the limit.
    pub fn initial_output(&self) -> [[f32; 3]; 2] {
        self.within_limit([self.gyro.initial_output(), self.accel.initial_output()])
    }

    /// One sample in, one sample out. At the end of a block also the networks' output, which takes
    /// effect with the next sample.
    pub fn process(&self, state: &mut State, sample: Counts) -> (Counts, Option<Block>) {
        let before = RawSample::Counts {
            gyro: sample.dtheta,
            accel: sample.dv,
        };
        let (corrected, _) = self.corrected(state, 0, &before, false);
        self.anticipate(state, 0, &before, Axes::ALL);
        let out = match corrected {
            RawSample::Counts { gyro, accel } => Counts {
                dtheta: gyro,
                dv: accel,
            },
            RawSample::Floats { .. } => sample, // counts stay counts
        };
        (out, self.accumulate(state, &before))
    }

    /// Adds one *uncorrected* sample to the block; the last one steps the networks.
    #[inline(always)]
    pub fn accumulate(&self, state: &mut State, sample: &RawSample) -> Option<Block> {
        match sample {
            RawSample::Counts { gyro, accel } if !self.vibrates => state.add_counts(gyro, accel),
            _ => self.add(state, sample),
        }
        state.samples += 1;
        if state.samples < self.scale.block_samples {
            return None;
        }
        self.end_if_sound(state, sample)
    }

    /// Ends the block.
    #[inline(never)]
    fn end_if_sound(&self, state: &mut State, sample: &RawSample) -> Option<Block> {
        state.corrupted = !self.is_intact();
        (!state.corrupted).then(|| self.end_block(state, step_of(sample)))
    }

    /// Adds one sample to the block's sums.
    #[inline(never)]
    fn add(&self, state: &mut State, sample: &RawSample) {
        if self.vibrates {
            state.vibration.add(state.samples == 0, sample);
        }
        match sample {
            RawSample::Counts { gyro, accel } => state.add_counts(gyro, accel),
            RawSample::Floats { gyro, accel } => {
                for (sum, floats) in state.sum.iter_mut().zip([gyro, accel]) {
                    for (s, f) in sum.iter_mut().zip(floats) {
                        // scaling by a power of two is exact; `as` saturates and makes 0 of NaN
                        *s = s.saturating_add((f * FLOAT_STEPS) as i64);
                    }
                }
            }
        }
    }

    /// Ends the block that another compensator, found corrupted, could not end; `sample` was its
    /// last.
    pub fn end_in_place(&self, state: &mut State, sample: &RawSample) -> Option<Block> {
        state.corrupted = false;
        let full = state.samples >= self.scale.block_samples;
        full.then(|| self.end_block(state, step_of(sample)))
    }

    /// Other networks with their states. The estimate in force stays until they step.
    pub fn exchange(&mut self, state: &mut State, nets: Nets, states: [NetState; 2]) {
        (self.gyro, self.accel, self.maps) = (nets.gyro, nets.accel, nets.maps);
        self.seal();
        state.set_nets(states);
    }

    /// Steps the networks on a block that other networks have stepped on before, and gives their
    /// output.
    pub fn step_again(&self, state: &mut State, block: &Block) -> [[f32; 3]; 2] {
        let [g, a] = self.step_both(state, &block.sources);
        [g.error, a.error]
    }

    /// The stream has a gap, and the networks do not step over it. The samples since the last block
    /// are given up and the next sample begins a new block. Until that is full, the estimate and
    /// the networks' states stay as they are.
    pub fn give_up_block(&self, state: &mut State) {
        state.given_up = state.given_up.saturating_add(u32::from(state.samples > 0));
        self.miss(state, state.samples.into());
        state.sum = [[0; 3]; 2];
        state.samples = 0;
    }

    fn end_block(&self, state: &mut State, per_sum: f32) -> Block {
        let sources = self.sources(state, per_sum);
        let sum = core::mem::take(&mut state.sum);
        state.samples = 0;
        let [g, a] = self.step_both(state, &sources);
        let output = self.within_limit([g.error, a.error]);
        let fault = g.fault.or(a.fault);
        state.faults = state.faults.saturating_add(u32::from(fault.is_some()));
        let clipped = output != [g.error, a.error];
        state.clipped = state.clipped.saturating_add(u32::from(clipped));
        let (target, maps) = if state.off {
            ([[0.0; 3]; 2], Nets::NONE.maps)
        } else {
            (output, self.maps_within_limit())
        };
        if state.hold {
            state.slews();
        } else {
            self.put_in_force(state, &target, &maps);
        }
        let [rate_error, force_error] = state.estimate;
        Block {
            sources,
            rate_error,
            force_error,
            network_output: output,
            sum,
            step: per_sum,
            fault,
        }
    }
}

/// Not inlined, so that the network's code is in the image once.
#[inline(never)]
fn step(net: &Net, state: &mut NetState, input: [f32; 3]) -> Step {
    net.step(state, input)
}

/// Steps of 1.0 in the sums of float samples: 2^40, so that 10^-12 rad still counts.
const FLOAT_STEPS: f32 = 1_099_511_627_776.0;

/// Counts, or units of a float sample, in a step of the sums.
fn step_of(sample: &RawSample) -> f32 {
    match sample {
        RawSample::Counts { .. } => 1.0,
        RawSample::Floats { .. } => 1.0 / FLOAT_STEPS,
    }
}

#[cfg(test)]
mod tests;
