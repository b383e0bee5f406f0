//! Counts in, corrected counts out: block sums, two networks, clipping, and the remainder that is carried.
//!
//! The networks step once per block of `block_words` words (LEARNING: one word's noise hides a laser gyro's bias by two orders of
//! magnitude). The estimate of a block is held over the next one, so a word's correction is known before the word arrives and the
//! latency is the same on all axes. With a correction of zero the output is the input, bit for bit.

use crate::model::Nets;
use crate::sample::{Counts, Lsb, RawSample, StreamScale};
use crate::wire::kvh;
use lrnn_nostd::{Fault, Net, State as NetState, Step};

/// Largest correction, per axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// Gyros, rad/s, >= 0.
    pub gyro: f32,
    /// Accelerometers, m/s2, >= 0.
    pub accel: f32,
}

/// Why a [`Compensator`] cannot be built; names the parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ConfigError {
    /// A count's value is not a positive finite number.
    Lsb,
    /// The word period is not a positive finite number.
    WordPeriod,
    /// A block has no word.
    BlockWords,
    /// A limit is negative or not a number.
    Limit,
}

impl core::fmt::Display for ConfigError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Lsb => "lsb: must be positive and finite",
            Self::WordPeriod => "word period: must be positive and finite",
            Self::BlockWords => "block_words: must be at least 1",
            Self::Limit => "limit: must be a number >= 0",
        })
    }
}

impl core::error::Error for ConfigError {}

/// Configuration: networks, block length, count values, clipping. Whole networks are swapped between blocks, never edited.
#[derive(Debug, Clone)]
pub struct Compensator {
    /// Gyro network: rate in rad/s in, rate error in rad/s out.
    pub gyro: Net,
    /// Accelerometer network: specific force in m/s2 in, its error in m/s2 out.
    pub accel: Net,
    /// Fastest change of the correction, rad/s per s and m/s2 per s; `None`: at once, for the time before the alignment.
    pub slew: Option<Limit>,
    meaning: StreamScale,
    block_s: f32,
    limit: Limit,
    // mean input of a block per summed count, SI
    input_per_count: [f32; 2],
    // counts per word for an error of one SI unit
    counts_per_error: [f32; 2],
}

/// What changes from word to word.
#[derive(Debug, Clone, Default)]
pub struct State {
    gyro: NetState,
    accel: NetState,
    sum: [[i64; 3]; 2],
    words: u16,
    estimate: [[f32; 3]; 2], // rad/s and m/s2, in force
    due: [[i64; 3]; 2],      // the same in counts per word, 2^-32
    due_float: [[f32; 3]; 2],
    remainder: [[i32; 3]; 2], // counts, 2^-32; at most half a count
    remainder_float: [[f32; 3]; 2],
    /// The correction goes to zero (as fast as `slew` lets it) whatever the networks say.
    pub off: bool,
    /// Blocks whose network step reported a fault since start.
    pub faults: u32,
    /// Blocks in which a correction was clipped since start.
    pub clipped: u32,
    /// Blocks that were given up since start: see [`Compensator::give_up_block`].
    pub given_up: u32,
}

impl State {
    /// Correction in force: rad/s and m/s2.
    pub fn estimate(&self) -> [[f32; 3]; 2] {
        self.estimate
    }

    /// The networks' states as before their first step, for other networks. The estimate stays in force until they step.
    pub fn reset_nets(&mut self) {
        self.set_nets([NetState::new(); 2]);
    }

    /// The networks' states as those of others that have seen the same blocks.
    pub fn set_nets(&mut self, [gyro, accel]: [NetState; 2]) {
        self.gyro = gyro;
        self.accel = accel;
    }
}

/// Result of one block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block {
    /// Mean rate, rad/s, that went into the gyro network.
    pub rate: [f32; 3],
    /// Mean specific force, m/s2.
    pub force: [f32; 3],
    /// Estimated rate error in force from the next word on, rad/s.
    pub rate_error: [f32; 3],
    /// Estimated specific-force error likewise, m/s2.
    pub force_error: [f32; 3],
    /// What the networks said, within the limit, whether it comes into force or not: rad/s and m/s2.
    pub said: [[f32; 3]; 2],
    /// The block's words, summed in steps.
    pub sum: [[i64; 3]; 2],
    /// Counts (or units of a float word) in a step: 1, or a power of two below.
    pub step: f32,
    /// First fault of the two networks, if any.
    pub fault: Option<Fault>,
}

impl Compensator {
    /// `word_period_s` is the time between words, `block_words` the network's period in words.
    ///
    /// # Errors
    /// Names the parameter that is out of range.
    pub fn new(
        gyro: Net,
        accel: Net,
        lsb: Lsb,
        word_period_s: f64,
        block_words: u16,
        limit: Limit,
    ) -> Result<Self, ConfigError> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        if !positive(lsb.rad) || !positive(lsb.mps) {
            return Err(ConfigError::Lsb);
        }
        if !positive(word_period_s) {
            return Err(ConfigError::WordPeriod);
        }
        if block_words == 0 {
            return Err(ConfigError::BlockWords);
        }
        if limit.gyro.is_nan() || limit.accel.is_nan() || limit.gyro < 0.0 || limit.accel < 0.0 {
            return Err(ConfigError::Limit);
        }
        let block_s = word_period_s * f64::from(block_words);
        Ok(Self {
            gyro,
            accel,
            meaning: StreamScale {
                lsb,
                period_s: word_period_s,
                block_words,
            },
            limit,
            slew: None,
            block_s: block_s as f32,
            input_per_count: [(lsb.rad / block_s) as f32, (lsb.mps / block_s) as f32],
            counts_per_error: [
                (word_period_s / lsb.rad) as f32,
                (word_period_s / lsb.mps) as f32,
            ],
        })
    }

    /// What the words mean.
    pub fn meaning(&self) -> StreamScale {
        self.meaning
    }

    /// The state at power-on. What the networks say before their first input, the bias of their output layer, is in force until the
    /// first block is over; with `off`, nothing is.
    pub fn power_on(&self, off: bool) -> State {
        let mut state = State {
            off,
            ..State::default()
        };
        if !off {
            let said = self.within_limit([self.gyro.initial_output(), self.accel.initial_output()]);
            self.put_in_force(&mut state, &said);
        }
        state
    }

    fn within_limit(&self, [gyro, accel]: [[f32; 3]; 2]) -> [[f32; 3]; 2] {
        [
            gyro.map(|e| clip(e, self.limit.gyro)),
            accel.map(|e| clip(e, self.limit.accel)),
        ]
    }

    /// One word in, one word out; at the end of a block also what the networks said of it, which takes effect with the next word.
    pub fn process(&self, state: &mut State, word: Counts) -> (Counts, Option<Block>) {
        let before = RawSample::Counts {
            gyro: word.dtheta,
            accel: word.dv,
        };
        let out = Counts {
            dtheta: subtract(word.dtheta, &state.due[0], &mut state.remainder[0]),
            dv: subtract(word.dv, &state.due[1], &mut state.remainder[1]),
        };
        (out, self.take_in(state, &before))
    }

    /// Correct one word by the estimate in force: all that must be done before a frame can leave.
    pub fn correct(&self, state: &mut State, words: &mut RawSample) {
        match words {
            RawSample::Counts { gyro, accel } => {
                *gyro = subtract(*gyro, &state.due[0], &mut state.remainder[0]);
                *accel = subtract(*accel, &state.due[1], &mut state.remainder[1]);
            }
            RawSample::Floats { gyro, accel } => {
                let [due_gyro, due_accel] = &state.due_float;
                let [left_gyro, left_accel] = &mut state.remainder_float;
                subtract_float(gyro, due_gyro, left_gyro);
                subtract_float(accel, due_accel, left_accel);
            }
        }
    }

    /// Add one *uncorrected* word to the block; its last one steps the networks.
    pub fn take_in(&self, state: &mut State, words: &RawSample) -> Option<Block> {
        let per_sum = match words {
            RawSample::Counts { gyro, accel } => {
                for (sum, counts) in state.sum.iter_mut().zip([gyro, accel]) {
                    for (s, c) in sum.iter_mut().zip(counts) {
                        *s = s.wrapping_add(i64::from(*c)); // no more than 2^16 of 32 bits
                    }
                }
                1.0
            }
            RawSample::Floats { gyro, accel } => {
                for (sum, floats) in state.sum.iter_mut().zip([gyro, accel]) {
                    for (s, f) in sum.iter_mut().zip(floats) {
                        // scaling by a power of two is exact; `as` saturates and makes 0 of NaN
                        *s = s.saturating_add((f * FLOAT_STEPS) as i64);
                    }
                }
                1.0 / FLOAT_STEPS
            }
        };
        state.words += 1;
        (state.words >= self.meaning.block_words).then(|| self.end_block(state, per_sum))
    }

    /// Other networks with their states. What is in force stays so until they step.
    pub fn exchange(&mut self, state: &mut State, nets: Nets, states: [NetState; 2]) {
        (self.gyro, self.accel) = (nets.gyro, nets.accel);
        state.set_nets(states);
    }

    /// The networks step on a block that others have stepped on before; what they say of it.
    pub fn step_again(&self, state: &mut State, block: &Block) -> [[f32; 3]; 2] {
        let g = step(&self.gyro, &mut state.gyro, block.rate);
        let a = step(&self.accel, &mut state.accel, block.force);
        [g.error, a.error]
    }

    /// Brings an estimate into force at once, within the limit.
    pub fn force(&self, state: &mut State, said: &[[f32; 3]; 2]) {
        state.estimate = self.within_limit(*said);
        self.make_due(state);
    }

    /// There is a hole in the stream: the networks do not step over it. The words since the last block are given up, the
    /// next word begins a new block, and until that is full the estimate and the networks' state stay as they are.
    pub fn give_up_block(&self, state: &mut State) {
        state.given_up = state.given_up.saturating_add(u32::from(state.words > 0));
        state.sum = [[0; 3]; 2];
        state.words = 0;
    }

    fn end_block(&self, state: &mut State, per_sum: f32) -> Block {
        let [per_gyro, per_accel] = self.input_per_count;
        let mean = |sum: [i64; 3], k: f32| sum.map(|s| s as f32 * k * per_sum);
        let rate = mean(state.sum[0], per_gyro);
        let force = mean(state.sum[1], per_accel);
        let sum = core::mem::take(&mut state.sum);
        state.words = 0;
        let g = step(&self.gyro, &mut state.gyro, rate);
        let a = step(&self.accel, &mut state.accel, force);
        let said = self.within_limit([g.error, a.error]);
        let fault = g.fault.or(a.fault);
        state.faults = state.faults.saturating_add(u32::from(fault.is_some()));
        let clipped = said != [g.error, a.error];
        state.clipped = state.clipped.saturating_add(u32::from(clipped));
        let target = if state.off { [[0.0; 3]; 2] } else { said };
        self.put_in_force(state, &target);
        let [rate_error, force_error] = state.estimate;
        Block {
            rate,
            force,
            rate_error,
            force_error,
            said,
            sum,
            step: per_sum,
            fault,
        }
    }

    /// Move the estimate to its target, within the slew limit, and work out what it is per word.
    fn put_in_force(&self, state: &mut State, target: &[[f32; 3]; 2]) {
        let slew = self
            .slew
            .map(|slew| [slew.gyro, slew.accel].map(|s| s * self.block_s));
        match slew {
            None => state.estimate = *target,
            Some(slew) => {
                for ((estimate, target), slew) in state.estimate.iter_mut().zip(target).zip(slew) {
                    for (e, t) in estimate.iter_mut().zip(target) {
                        *e += clip(t - *e, slew);
                    }
                }
            }
        }
        self.make_due(state);
    }

    /// The estimate in counts per word.
    fn make_due(&self, state: &mut State) {
        let due = state.due.iter_mut().zip(&mut state.due_float);
        let per_word = state.estimate.iter().zip(self.counts_per_error);
        for ((due, due_float), (estimate, per_error)) in due.zip(per_word) {
            let counts = estimate.map(|e| e * per_error);
            *due = counts.map(|c| ((c * COUNT) as i64).clamp(-MOST_DUE, MOST_DUE));
            *due_float = counts.map(|c| -c);
        }
    }
}

/// One copy for all that steps.
#[inline(never)]
fn step(net: &Net, state: &mut NetState, input: [f32; 3]) -> Step {
    net.step(state, input)
}

/// Steps of a whole count in sums and remainders of corrections, 2^32.
const COUNT: f32 = 4_294_967_296.0;

/// Most that a word may be changed by, 2^30 counts: with the remainder it stays within 64 bits.
const MOST_DUE: i64 = 1 << 62;

/// Steps of 1.0 in the sums of float words: 2^40, so that 10^-12 rad still counts.
const FLOAT_STEPS: f32 = 1_099_511_627_776.0;

/// Limits to `[-limit, limit]`; NaN becomes zero.
fn clip(x: f32, limit: f32) -> f32 {
    if x > limit {
        limit
    } else if x < -limit {
        -limit
    } else if x.is_nan() {
        0.0
    } else {
        x
    }
}

/// Subtracts a fractional correction in whole counts and carries what is left to the next word: in integers, so that the sum of
/// all corrections is exact however many words there are.
fn subtract(word: [i32; 3], due: &[i64; 3], remainder: &mut [i32; 3]) -> [i32; 3] {
    let mut out = word;
    for ((o, d), r) in out.iter_mut().zip(due).zip(remainder) {
        let sum = d.wrapping_add(i64::from(*r));
        *r = sum as i32; // the lower half as a signed number: what the nearest whole count leaves
        let whole = (sum.wrapping_add(1 << 31) >> 32) as i32;
        *o = o.saturating_sub(whole);
    }
    out
}

/// The same for floats; `due` has the sign of what is added.
fn subtract_float(words: &mut [f32; 3], due: &[f32; 3], remainder: &mut [f32; 3]) {
    for ((w, d), r) in words.iter_mut().zip(due).zip(remainder) {
        *w = kvh::correct(*w, *d, r);
    }
}

#[cfg(test)]
mod tests;
