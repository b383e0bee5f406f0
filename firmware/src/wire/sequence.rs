//! Units, rate and gap rule of a stream, and the gaps themselves.
//!
//! An overrun looks like plausible frozen data, so the counter of the sensor is stored and
//! compared, and never replaced. A gap of a whole turn of the counter cannot be detected: 256
//! internal samples of a STIM300 (128 ms), 128 frames of a KVH.

use super::Reading;
use crate::sample::Units;

/// Units, rate and gap rule of the samples of a stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stream {
    /// Units of a count.
    pub units: Units,
    /// Samples a second.
    pub rate: f64,
    /// How missing frames are detected.
    pub sequence: Sequence,
}

/// How missing frames are detected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sequence {
    /// By the sensor's counter.
    Counter(Rule),
    /// By the time in the frame.
    Time {
        /// Frames a second.
        rate: f64,
        /// The time starts from 0 again after so long, s.
        turn: f64,
    },
    /// Not by the frame.
    None,
}

/// Counter and time of the last frame.
#[derive(Debug, Clone, Copy, Default)]
pub struct Last {
    counter: Option<u16>,
    time: Option<f64>,
    /// Number of times in a row that counter or time have been the same since.
    repeats: u16,
}

/// A sensor whose counter, or time, stays the same for so many frames in a row is stuck.
const STUCK_AFTER: u16 = 10;

/// The longest gap that a time stamp shows, s. Where the time advances by more, the clock was set.
const LONGEST_GAP_S: f64 = 10.0;

impl Last {
    /// The sensor's counter.
    pub fn counter(&self) -> Option<u16> {
        self.counter
    }

    /// Whether counter or time have stopped.
    pub fn is_stuck(&self) -> bool {
        self.repeats >= STUCK_AFTER
    }
}

impl Stream {
    /// Gap between this frame and those before it.
    #[inline(always)]
    pub fn gap(&self, last: &mut Last, reading: &Reading) -> Gap {
        if let (Sequence::Counter(rule), Some(counter)) = (self.sequence, reading.counter)
            && last
                .counter
                .is_some_and(|before| rule.is_next(before, counter))
        {
            (last.counter, last.repeats) = (Some(counter), 0);
            return Gap::None;
        }
        self.gap_otherwise(last, reading)
    }

    #[inline(never)]
    fn gap_otherwise(&self, last: &mut Last, reading: &Reading) -> Gap {
        let before = last.time;
        let gap = match (self.sequence, reading.counter, reading.time) {
            (Sequence::Counter(rule), Some(counter), _) => rule.check(&mut last.counter, counter),
            (Sequence::Time { rate, turn }, _, Some(now)) => last
                .time
                .replace(now)
                .map_or(Gap::None, |before| time_gap(before, now, rate, turn)),
            _ => Gap::None,
        };
        match gap {
            // a time that advances by too little is another rate than the configured one
            Gap::Duplicate if before == last.time => {
                last.repeats = last.repeats.saturating_add(1);
            }
            _ => last.repeats = 0,
        }
        gap
    }

    /// Whether a frame of another kind repeats the last sample, or one shortly before it.
    pub fn repeats(&self, last: &Last, reading: &Reading) -> bool {
        match (self.sequence, reading.counter, reading.time) {
            (Sequence::Counter(_), Some(counter), _) => last.counter == Some(counter),
            (Sequence::Time { rate, .. }, _, Some(now)) => last
                .time
                .is_some_and(|before| now < before + 0.5 / rate && now > before - LATE_S),
            _ => false,
        }
    }

    /// Whether counter or time have restarted in a silence of `silent_s` seconds. Those that have
    /// come round meanwhile have not. False for those that come round too soon to show it.
    pub fn has_restarted(&self, last: &Last, reading: &Reading, silent_s: f64) -> bool {
        let goes_on = |advance_s: f64| {
            (advance_s - silent_s).abs() < SILENCE_SHARE * silent_s + SILENCE_FRAMES / self.rate
        };
        match (self.sequence, reading.counter, reading.time) {
            (Sequence::Counter(rule), Some(now), _) => {
                let begins = rule.modulus > 256 && u32::from(now) < rule.modulus / 16;
                begins
                    && last.counter.is_some_and(|before| {
                        let frames = f64::from(rule.advance(before, now)) / f64::from(rule.step);
                        now < before && !goes_on(frames / self.rate)
                    })
            }
            (Sequence::Time { turn, .. }, _, Some(now)) => {
                now < BEGINNING_S
                    && last
                        .time
                        .is_some_and(|before| now < before && !goes_on(now - before + turn))
            }
            _ => false,
        }
    }

    /// Frames that can be missing without a trace, because the counter has come round.
    pub fn turn(&self) -> Option<u32> {
        match self.sequence {
            Sequence::Counter(rule) => rule.modulus.checked_div(rule.step),
            Sequence::Time { .. } => Some(u32::MAX),
            Sequence::None => None,
        }
    }
}

/// Two logs of one sample come within this time, s.
const LATE_S: f64 = 1.0;
/// A sensor whose time is less has just started, s.
const BEGINNING_S: f64 = 10.0;

/// How well the length of a silence and the rate are known: this share, and so many frames.
const SILENCE_SHARE: f64 = 0.1;
const SILENCE_FRAMES: f64 = 16.0;

/// Step and range of a counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rule {
    /// Counts in one turn; a power of two.
    modulus: u32,
    /// Counts from one frame to the next.
    step: u32,
}

/// Result of comparing the counter with that of the frame before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gap {
    /// The first frame, or the next one.
    None,
    /// The frame repeats the one before.
    Duplicate,
    /// Number of missing frames, or this number and whole turns of the counter.
    Missed(u32),
    /// Not a whole number of frames: the sensor restarted, or another rate than the rule's.
    Jump,
}

impl Rule {
    /// A rule; `modulus` is rounded up to a power of two, `step` at least 1.
    pub const fn new(modulus: u32, step: u32) -> Rule {
        Rule {
            modulus: modulus
                .saturating_sub(1)
                .saturating_add(1)
                .next_power_of_two(),
            step: if step == 0 { 1 } else { step },
        }
    }

    /// Whether a counter is that of the next frame.
    #[inline(always)]
    fn is_next(self, before: u16, counter: u16) -> bool {
        self.advance(before, counter) == self.step
    }

    /// Counts from one value to another.
    #[inline(always)]
    fn advance(self, before: u16, counter: u16) -> u32 {
        u32::from(counter).wrapping_sub(u32::from(before)) & (self.modulus - 1)
    }

    /// Compares a frame's counter with the one before it, which it then replaces. Start with
    /// `None`.
    pub fn check(&self, last: &mut Option<u16>, counter: u16) -> Gap {
        let Some(before) = last.replace(counter) else {
            return Gap::None;
        };
        let advance = self.advance(before, counter);
        if advance == 0 {
            Gap::Duplicate
        } else if !advance.is_multiple_of(self.step) {
            Gap::Jump
        } else {
            match advance / self.step - 1 {
                0 => Gap::None,
                missed => Gap::Missed(missed),
            }
        }
    }
}

/// Gaps by the time in the frame, for sensors without a counter: `before` and `now` in seconds,
/// which start from 0 again after `turn` seconds; `rate` in Hz. Less than half a period is the same
/// frame. More than 10 s is a clock that was set: a receiver that finds its time, a leap of the
/// week. It says nothing about frames.
pub fn time_gap(before: f64, now: f64, rate: f64, turn: f64) -> Gap {
    let advance = if now < before - turn / 2.0 {
        now - before + turn
    } else {
        now - before
    };
    let frames = advance * rate;
    if frames.is_nan() || frames <= -0.5 || advance > LONGEST_GAP_S {
        return Gap::Jump;
    }
    match (frames + 0.5) as u32 {
        0 => Gap::Duplicate,
        1 => Gap::None,
        n => Gap::Missed(n - 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stim300_at_all_rates() {
        for step in [1u16, 2, 4, 8, 16] {
            let rule = Rule::new(256, step.into());
            let mut last = None;
            for n in 0..600u16 {
                assert_eq!(
                    rule.check(&mut last, n.wrapping_mul(step) & 0xFF),
                    Gap::None
                );
            }
            // three frames left out
            let next = ((599 + 4) * step) & 0xFF;
            assert_eq!(rule.check(&mut last, next), Gap::Missed(3));
            assert_eq!(rule.check(&mut last, next), Gap::Duplicate);
        }
        let mut last = Some(0);
        assert_eq!(Rule::new(256, 2).check(&mut last, 3), Gap::Jump);
        assert_eq!(last, Some(3));
    }

    #[test]
    fn every_loss_short_of_a_turn_is_counted() {
        for missed in 1..127 {
            let mut last = Some(100);
            let next = (101 + missed) % 128;
            assert_eq!(
                Rule::new(128, 1).check(&mut last, next),
                Gap::Missed(u32::from(missed))
            );
        }
        let mut last = Some(0xFFFF);
        assert_eq!(Rule::new(0x1_0000, 1).check(&mut last, 0), Gap::None);
    }

    #[test]
    fn time_gaps() {
        const WEEK: f64 = 604_800.0;
        assert_eq!(time_gap(10.0, 10.0101, 100.0, WEEK), Gap::None);
        assert_eq!(time_gap(10.0, 10.031, 100.0, WEEK), Gap::Missed(2));
        assert_eq!(time_gap(10.0, 10.0, 100.0, WEEK), Gap::Duplicate);
        assert_eq!(time_gap(10.0, 9.9, 100.0, WEEK), Gap::Jump);
        assert_eq!(time_gap(604_799.995, 0.005, 100.0, WEEK), Gap::None);
        assert_eq!(time_gap(f64::NAN, 0.0, 100.0, WEEK), Gap::Jump);
    }

    /// After half a second of silence a counter or a time that came round has gone on, and one that
    /// is small for no such reason began anew.
    #[test]
    fn coming_round_in_a_silence_is_no_restart() {
        const TURN: f64 = 4_294.967_296;
        let unit = crate::sample::Unit {
            quantity: crate::sample::Quantity::Rate,
            lsb: 1.0,
        };
        let of = |sequence| Stream {
            units: Units {
                gyro: unit,
                accel: unit,
            },
            rate: 2000.0,
            sequence,
        };
        let reading = |counter, time| Reading {
            counter,
            time,
            ..Reading::new(
                crate::sample::RawSample::Counts {
                    gyro: [0; 3],
                    accel: [0; 3],
                },
                crate::sample::Axes::ALL,
                crate::sample::Axes::ALL,
            )
        };
        let counted = of(Sequence::Counter(Rule::new(1 << 16, 1)));
        let every_second = of(Sequence::Counter(Rule::new(1 << 16, 2)));
        for (stream, before, now, restarted) in [
            (&counted, 65_000, 464, false), // exactly 1000 frames
            (&counted, 65_000, 410, false), // at a rate that is off by 5 %
            (&counted, 65_000, 20, true),
            (&counted, 40_000, 464, true),
            (&counted, 65_500, 3_000, true),
            (&every_second, 64_000, 464, false),
            (&every_second, 65_000, 464, true),
        ] {
            let last = Last {
                counter: Some(before),
                ..Last::default()
            };
            let now = reading(Some(now), None);
            assert_eq!(stream.has_restarted(&last, &now, 0.5), restarted, "{now:?}");
        }
        let timed = of(Sequence::Time {
            rate: 2000.0,
            turn: TURN,
        });
        for (before, now, restarted) in [
            (4_294.9, 0.433, false),
            (4_294.9, 0.3, true),
            (4_200.0, 0.43, true),
            (12.0, 0.1, true),
        ] {
            let last = Last {
                time: Some(before),
                ..Last::default()
            };
            let now = reading(None, Some(now));
            assert_eq!(timed.has_restarted(&last, &now, 0.5), restarted, "{now:?}");
        }
    }

    /// A receiver without time counts from its power-on. When it finds its time, hundreds of
    /// thousands of seconds pass at once, and no frame is missing.
    #[test]
    fn a_clock_that_is_set_is_no_gap() {
        const WEEK: f64 = 604_800.0;
        for (before, now) in [
            (12.0, 412_000.0),
            (412_000.0, 412_018.0),
            (604_000.0, 100.0),
        ] {
            assert_eq!(time_gap(before, now, 200.0, WEEK), Gap::Jump);
        }
        assert_eq!(time_gap(10.0, 19.99, 100.0, WEEK), Gap::Missed(998));
        assert_eq!(time_gap(604_799.0, 0.5, 100.0, WEEK), Gap::Missed(149));
    }
}
