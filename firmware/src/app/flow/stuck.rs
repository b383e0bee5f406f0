//! Detects a stuck sensor: one whose values are constant.
//!
//! An overrun or a frozen sensor looks like plausible data. A sensor at rest does not repeat all
//! six values for long: white noise with a standard deviation of s counts lets one value round to
//! the same count with a probability of at most erf(1 / (2 s sqrt(2))), which is 0.96 for s = 0.25.
//! All six in 100 samples in a row then have 1e-11, and for s = 0.2 and 1000 samples 1e-33. Below
//! s = 0.15 equal values are possible, so the fault that follows only keeps the samples from being
//! learnt.

use crate::sample::RawSample;

/// Fewest equal samples in a row that are reported.
const SAMPLES: u32 = 100;
/// Shortest time of equal samples that is reported, s.
const TIME_S: f64 = 1.0;

/// Counts equal samples in a row.
#[derive(Debug)]
pub(in crate::app) struct StuckDetector {
    /// Bits of the last sample's first value.
    first: u32,
    /// The sample that comes again and again.
    sample: RawSample,
    /// Number of equal samples in a row.
    run: u32,
}

impl Default for StuckDetector {
    fn default() -> StuckDetector {
        let sample = RawSample::Counts {
            gyro: [0; 3],
            accel: [0; 3],
        };
        let (first, run) = (0, 0);
        StuckDetector { first, sample, run }
    }
}

impl StuckDetector {
    /// Whether the first value is that of the last sample: a look at one value, which suffices for
    /// most samples.
    #[inline(always)]
    pub fn may_repeat(&mut self, sample: &RawSample) -> bool {
        let first = match *sample {
            RawSample::Counts { gyro: [x, ..], .. } => x.cast_unsigned(),
            RawSample::Floats { gyro: [x, ..], .. } => x.to_bits(),
        };
        let same = self.first == first;
        if !same {
            (self.first, self.run) = (first, 0);
        }
        same
    }

    /// Takes a sample and returns whether it has come for too long, at `rate` samples a second.
    pub fn repeats_too_long(&mut self, sample: &RawSample, rate: f64) -> bool {
        if self.run == 0 || *sample != self.sample {
            (self.sample, self.run) = (*sample, 0);
        }
        self.run = self.run.saturating_add(1);
        self.run >= SAMPLES.max((rate * TIME_S) as u32)
    }
}
