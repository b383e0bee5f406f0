//! Gaps in a sensor's own counter.
//!
//! An overrun looks like plausible frozen data, so the counter of the sensor is kept and compared, and never made anew.
//! A gap of a whole turn of the counter cannot be seen: 256 internal samples of a STIM300 (128 ms), 128 frames of a KVH.

/// How a counter advances.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rule {
    /// Counts in one turn; a power of two.
    modulus: u32,
    /// Counts from one frame to the next.
    step: u32,
}

/// What the counter says about the frames before this one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gap {
    /// The first frame, or the next one.
    None,
    /// The same frame again.
    Duplicate,
    /// So many frames are missing, or that many and whole turns.
    Missed(u32),
    /// Not a whole number of frames: the sensor restarted, or another rate than the rule's.
    Jump,
}

impl Rule {
    /// KVH sequence number, 0 to 127.
    pub const KVH: Rule = Rule::new(128, 1);
    /// ADIS DATA_CNTR.
    pub const ADIS: Rule = Rule::new(0x1_0000, 1);

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

    /// STIM300: 2000 Hz samples, by [`super::stim300::config::Config::counter_step`].
    pub const fn stim300(step: u16) -> Rule {
        Rule::new(256, step as u32)
    }

    /// Compare a frame's counter with the one before it, which it then replaces. Start with `None`.
    pub fn check(&self, last: &mut Option<u16>, counter: u16) -> Gap {
        let Some(before) = last.replace(counter) else {
            return Gap::None;
        };
        let advance = u32::from(counter).wrapping_sub(u32::from(before)) & (self.modulus - 1);
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

/// Gaps by the time in the frame, for `NovAtel`, which has no counter: `before` and `now` in seconds of the week (a
/// change of week is allowed for), `rate` in Hz. Less than half a period counts as the same frame.
pub fn time_gap(before: f64, now: f64, rate: f64) -> Gap {
    const WEEK: f64 = 604_800.0;
    let advance = if now < before - WEEK / 2.0 {
        now - before + WEEK
    } else {
        now - before
    };
    let frames = advance * rate;
    if frames.is_nan() || frames <= -0.5 {
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
            let rule = Rule::stim300(step);
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
        assert_eq!(Rule::stim300(2).check(&mut last, 3), Gap::Jump);
        assert_eq!(last, Some(3));
    }

    #[test]
    fn every_loss_short_of_a_turn_is_counted() {
        for missed in 1..127 {
            let mut last = Some(100);
            let next = (101 + missed) % 128;
            assert_eq!(
                Rule::KVH.check(&mut last, next),
                Gap::Missed(u32::from(missed))
            );
        }
        let mut last = Some(0xFFFF);
        assert_eq!(Rule::ADIS.check(&mut last, 0), Gap::None);
    }

    #[test]
    fn time_gaps() {
        assert_eq!(time_gap(10.0, 10.0101, 100.0), Gap::None);
        assert_eq!(time_gap(10.0, 10.031, 100.0), Gap::Missed(2));
        assert_eq!(time_gap(10.0, 10.0, 100.0), Gap::Duplicate);
        assert_eq!(time_gap(10.0, 9.9, 100.0), Gap::Jump);
        assert_eq!(time_gap(604_799.995, 0.005, 100.0), Gap::None);
        assert_eq!(time_gap(f64::NAN, 0.0, 100.0), Gap::Jump);
    }
}
