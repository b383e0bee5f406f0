//! The sample rate against the board's clock.
//!
//! Samples come in bursts: an adapter for USB delays them, and the frame path may wake late. So the
//! samples are counted over windows, and several windows in a row must disagree in the same sense.
//! A burst that a window misses is too much in the next one.
//!
//! | window | off by more than | in a row | raised after |
//! |---|---|---|---|
//! | 1 s | +20 %, -25 % | 3 | 3 to 4 s |
//! | 10 s | 2 % | 2 | 20 to 30 s |
//!
//! 2 %: the nearest rates that sensors have in common are 2.4 % apart (125 and 128 Hz, 1000 and
//! 1024 Hz). Crystals are within 0.01 %. The internal oscillator of an STM32F405 is within 1 % at
//! room temperature (DS8626, table 41), a MEMS sensor's own within 3 % at most: a rate that far off
//! spoils the learner's navigation, and the measured rate can be configured instead.

/// A rate that is off by no more than this share passes unnoticed.
const TOLERANCE: f32 = 0.02;

/// Time between two looks, microseconds.
const SECOND: u64 = 1_000_000;

/// Counters of the stream. They may wrap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StreamCounts {
    /// Samples, with those missing by the sensor's counter.
    pub samples: u32,
    /// Number of these that were missing.
    pub missed: u32,
    /// Anything that loses an unknown number of samples: damage, garbage, jumps of the counter.
    pub damage: u32,
}

/// Windows of one length.
#[derive(Debug, Clone, Copy)]
struct Meter {
    /// Least length, microseconds.
    length: u64,
    /// Largest excess and largest lack, as shares.
    tolerance: [f32; 2],
    /// The sensor's missing samples count as missing: a counter that always leaves out the same
    /// number belongs to another rate.
    without_missed: bool,
    since: u64,
    seen: StreamCounts,
    /// Windows in a row with too many (> 0) or too few (< 0) samples.
    wrong: i8,
    /// Windows in a row that agree.
    right: u8,
    /// The greatest ratio of the samples that came in a window to those expected.
    most: f32,
}

impl Meter {
    const fn new(length: u64, tolerance: [f32; 2], without_missed: bool) -> Meter {
        Meter {
            length,
            tolerance,
            without_missed,
            since: 0,
            seen: StreamCounts {
                samples: 0,
                missed: 0,
                damage: 0,
            },
            wrong: 0,
            right: 0,
            most: 0.0,
        }
    }

    fn begin(&mut self, now: u64, seen: StreamCounts) {
        (self.since, self.seen) = (now, seen);
    }

    fn look(&mut self, now: u64, rate: f32, seen: StreamCounts) {
        let elapsed = now.saturating_sub(self.since);
        let expected = rate * elapsed as f32 * 1e-6;
        let [excess, lack] = self.tolerance;
        if elapsed < self.length || expected * excess < 4.0 {
            return; // one sample more or less at either end must not matter
        }
        let mut samples = seen.samples.wrapping_sub(self.seen.samples);
        let came = samples.saturating_sub(seen.missed.wrapping_sub(self.seen.missed));
        if self.without_missed {
            samples = came;
        }
        self.most = self.most.max(came as f32 / expected);
        let damaged = seen.damage != self.seen.damage;
        self.begin(now, seen);
        let off = samples as f32 / expected - 1.0;
        if off < 0.0 && damaged {
            return; // how many samples are missing is not known
        }
        let ends = 2.0 / expected;
        if off > excess + ends {
            (self.wrong, self.right) = (self.wrong.max(0).saturating_add(1), 0);
        } else if off < -(lack + ends) {
            (self.wrong, self.right) = (self.wrong.min(0).saturating_sub(1), 0);
        } else {
            (self.wrong, self.right) = (0, self.right.saturating_add(1));
        }
    }

    fn is_wrong(&self, in_a_row: u8) -> bool {
        self.wrong.unsigned_abs() >= in_a_row
    }
}

/// Compares the rate of a stream with the clock.
#[derive(Debug)]
pub struct RateWatch {
    /// Time of the next look, microseconds. Never, for a watch that is off.
    due: u64,
    /// Configured rate, Hz; 0 before the first look.
    rate: f32,
    coarse: Meter,
    fine: Meter,
    wrong: bool,
}

impl RateWatch {
    /// A watch, or one that is off and finds nothing.
    #[must_use]
    pub const fn new(on: bool) -> RateWatch {
        RateWatch {
            due: if on { 0 } else { u64::MAX },
            rate: 0.0,
            coarse: Meter::new(SECOND, [0.20, 0.25], true),
            fine: Meter::new(10 * SECOND, [TOLERANCE, TOLERANCE], false),
            wrong: false,
        }
    }

    /// Largest ratio of measured to configured sample rate: of the 10 s window with the most
    /// samples, and no less than what passes unnoticed. 1 for a watch that is off.
    #[must_use]
    pub fn words(&self) -> f32 {
        if self.due == u64::MAX {
            1.0
        } else {
            self.fine.most.max(1.0 + TOLERANCE)
        }
    }

    /// Whether it is time for [`RateWatch::look`].
    #[inline(always)]
    #[must_use]
    pub fn is_due(&self, now: u64) -> bool {
        now >= self.due
    }

    /// Looks at the clock (microseconds), the configured rate (Hz), and the counters. `None` for
    /// the rate: samples are not being read, or the sensor is silent, and all windows restart.
    /// Returns whether the rate is wrong.
    pub fn look(&mut self, now: u64, rate: Option<f32>, seen: StreamCounts) -> bool {
        self.due = now.saturating_add(SECOND);
        match rate {
            Some(rate) if rate == self.rate => {
                self.coarse.look(now, rate, seen);
                self.fine.look(now, rate, seen);
            }
            _ => {
                self.rate = rate.unwrap_or_default();
                for meter in [&mut self.coarse, &mut self.fine] {
                    (meter.wrong, meter.right) = (0, 0);
                    meter.begin(now, seen);
                }
            }
        }
        if self.coarse.is_wrong(3) || self.fine.is_wrong(2) {
            self.wrong = true;
        } else if self.coarse.wrong == 0 && self.fine.right >= 2 {
            self.wrong = false;
        }
        self.wrong
    }
}

#[cfg(test)]
mod tests;
