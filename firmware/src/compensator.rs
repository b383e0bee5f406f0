//! Counts in, corrected counts out: block sums, two networks, clipping, and the remainder that is carried.
//!
//! The networks step once per block of `block_words` words (LEARNING: one word's noise hides a laser gyro's bias by two orders of
//! magnitude). The estimate of a block is held over the next one, so a word's correction is known before the word arrives and the
//! latency is the same on all axes. With a correction of zero the output is the input, bit for bit.

use crate::sample::{Counts, Lsb};
use lrnn_nostd::{Fault, Net, State as NetState};

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
    block_words: u16,
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
    correction: [[f32; 3]; 2], // counts per word, held
    remainder: [[f32; 3]; 2],
    /// Blocks whose network step reported a fault since start.
    pub faults: u32,
    /// Blocks in which a correction was clipped since start.
    pub clipped: u32,
}

/// Result of one block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block {
    /// Mean rate, rad/s, that went into the gyro network.
    pub rate: [f32; 3],
    /// Mean specific force, m/s2.
    pub force: [f32; 3],
    /// Estimated rate error after clipping, rad/s.
    pub rate_error: [f32; 3],
    /// Estimated specific-force error after clipping, m/s2.
    pub force_error: [f32; 3],
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
            block_words,
            limit,
            input_per_count: [(lsb.rad / block_s) as f32, (lsb.mps / block_s) as f32],
            counts_per_error: [
                (word_period_s / lsb.rad) as f32,
                (word_period_s / lsb.mps) as f32,
            ],
        })
    }

    /// One word in, one word out; at the end of a block also what the networks said of it, which takes effect with the next word.
    pub fn process(&self, state: &mut State, word: Counts) -> (Counts, Option<Block>) {
        let out = Counts {
            dtheta: subtract(word.dtheta, &state.correction[0], &mut state.remainder[0]),
            dv: subtract(word.dv, &state.correction[1], &mut state.remainder[1]),
        };
        for (sum, counts) in state.sum.iter_mut().zip([word.dtheta, word.dv]) {
            for (s, c) in sum.iter_mut().zip(counts) {
                *s += i64::from(c);
            }
        }
        state.words += 1;
        let block = (state.words >= self.block_words).then(|| self.end_block(state));
        (out, block)
    }

    fn end_block(&self, state: &mut State) -> Block {
        let mean = |sum: [i64; 3], k: f32| sum.map(|s| s as f32 * k);
        let rate = mean(state.sum[0], self.input_per_count[0]);
        let force = mean(state.sum[1], self.input_per_count[1]);
        state.sum = [[0; 3]; 2];
        state.words = 0;
        let g = self.gyro.step(&mut state.gyro, rate);
        let a = self.accel.step(&mut state.accel, force);
        let rate_error = g.error.map(|e| clip(e, self.limit.gyro));
        let force_error = a.error.map(|e| clip(e, self.limit.accel));
        let fault = g.fault.or(a.fault);
        state.faults = state.faults.wrapping_add(u32::from(fault.is_some()));
        let clipped = rate_error != g.error || force_error != a.error;
        state.clipped = state.clipped.wrapping_add(u32::from(clipped));
        state.correction = [
            rate_error.map(|e| e * self.counts_per_error[0]),
            force_error.map(|e| e * self.counts_per_error[1]),
        ];
        Block {
            rate,
            force,
            rate_error,
            force_error,
            fault,
        }
    }
}

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

/// Subtracts a fractional correction in whole counts and carries what is left to the next word.
fn subtract(word: [i32; 3], correction: &[f32; 3], remainder: &mut [f32; 3]) -> [i32; 3] {
    let mut out = word;
    for ((o, c), r) in out.iter_mut().zip(correction).zip(remainder) {
        let due = *r + c;
        // round to nearest; `as` saturates and turns NaN into 0, so that nothing here can panic or stick
        let whole = if due >= 0.0 { due + 0.5 } else { due - 0.5 } as i32;
        *r = due - whole as f32;
        *o = o.saturating_sub(whole);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use lrnn_nostd::{Normalisation, Weights};
    use proptest::prelude::*;

    const LSB: Lsb = Lsb {
        rad: 4.848e-7,
        mps: 1.226e-3,
    };

    /// A network that says `error` whatever comes in.
    fn constant(error: [f32; 3]) -> Net {
        let mut weights = Weights::zero();
        weights.layers[2].b = error;
        Net::new(
            weights,
            Normalisation {
                input_offset: [0.0; 3],
                input_scale: [1.0; 3],
                output_scale: [1.0; 3],
            },
        )
    }

    fn compensator(gyro: [f32; 3], accel: [f32; 3], limit: f32) -> Compensator {
        let limit = Limit {
            gyro: limit,
            accel: limit,
        };
        Compensator::new(constant(gyro), constant(accel), LSB, 0.005, 200, limit).unwrap()
    }

    proptest! {
        #[test]
        fn zero_correction_is_the_identity(words in prop::collection::vec(any::<[i32; 6]>(), 1..500)) {
            let c = compensator([0.0; 3], [0.0; 3], 1.0);
            let mut state = State::default();
            for w in words {
                let word = Counts { dtheta: [w[0], w[1], w[2]], dv: [w[3], w[4], w[5]] };
                prop_assert_eq!(c.process(&mut state, word).0, word);
            }
        }

        #[test]
        fn sum_of_corrections_is_exact_to_one_count(e in -1e-4f32..1e-4, a in -0.1f32..0.1) {
            let c = compensator([e, -e, 0.0], [a, 0.0, -a], 1.0);
            let mut state = State::default();
            let mut sum = [0i64; 6];
            let n = 20_000;
            for _ in 0..n {
                let (w, _) = c.process(&mut state, Counts::default());
                for (s, x) in sum.iter_mut().zip(w.dtheta.iter().chain(&w.dv)) {
                    *s -= i64::from(*x);
                }
            }
            // the first block has no estimate yet
            let time = f64::from(n - 200) * 0.005;
            let want_g = f64::from(e) * time / LSB.rad;
            let want_a = f64::from(a) * time / LSB.mps;
            let close = |got: i64, want: f64| (got as f64 - want).abs() <= 1.0 + want.abs() * 1e-6;
            prop_assert!(close(sum[0], want_g) && close(sum[1], -want_g) && sum[2] == 0, "{:?} {}", sum, want_g);
            prop_assert!(close(sum[3], want_a) && sum[4] == 0 && close(sum[5], -want_a), "{:?} {}", sum, want_a);
        }
    }

    #[test]
    fn corrections_are_clipped_and_counted() {
        let c = compensator([1.0, 0.0, 0.0], [0.0; 3], 0.25);
        let mut state = State::default();
        let mut last = None;
        for _ in 0..400 {
            last = c.process(&mut state, Counts::default()).1.or(last);
        }
        assert_eq!(last.unwrap().rate_error, [0.25, 0.0, 0.0]);
        assert_eq!((state.clipped, state.faults), (2, 0));
    }

    #[test]
    fn block_mean_is_the_mean_input() {
        let c = compensator([0.0; 3], [0.0; 3], 1.0);
        let mut state = State::default();
        let mut block = None;
        for k in 0..200 {
            let word = Counts {
                dtheta: [k, 100, 0],
                dv: [0, 0, -40],
            };
            block = c.process(&mut state, word).1;
        }
        let b = block.unwrap();
        assert!((f64::from(b.rate[0]) - 99.5 * LSB.rad / 0.005).abs() < 1e-8);
        assert!((f64::from(b.force[2]) + 40.0 * LSB.mps / 0.005).abs() < 1e-5);
    }

    #[test]
    fn wrong_configuration_is_named() {
        let net = || constant([0.0; 3]);
        let limit = Limit {
            gyro: 1.0,
            accel: 1.0,
        };
        let build = |lsb, dt, n, limit| Compensator::new(net(), net(), lsb, dt, n, limit).err();
        assert_eq!(
            build(Lsb { rad: 0.0, mps: 1.0 }, 0.01, 1, limit),
            Some(ConfigError::Lsb)
        );
        assert_eq!(
            build(LSB, f64::NAN, 1, limit),
            Some(ConfigError::WordPeriod)
        );
        assert_eq!(build(LSB, 0.01, 0, limit), Some(ConfigError::BlockWords));
        assert_eq!(
            build(
                LSB,
                0.01,
                1,
                Limit {
                    gyro: -1.0,
                    accel: 0.0
                }
            ),
            Some(ConfigError::Limit)
        );
    }
}
