//! Pairs the raw and the corrected values of the same sample, which arrive on two lines at slightly
//! different times. Only in such a pair is the difference the correction.

use crate::samples::{DecodedSample, Sample};
use crate::taps::Side;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Number of samples of one line that wait for those of the other.
const WAITING: usize = 1024;
/// Longest wait: the counter of a STIM300 at 250 Hz repeats every 128 ms, and an older sample with
/// the same counter is another one.
const LONGEST: Duration = Duration::from_millis(60);

/// Finds the pairs.
#[derive(Default)]
pub struct Pairs {
    waiting: [VecDeque<(Instant, DecodedSample)>; 2],
}

impl Pairs {
    /// Adds a sample of a line. Passes complete pairs to `take`, and samples without a partner.
    pub fn push(&mut self, side: Side, found: DecodedSample, mut take: impl FnMut(Side, &Sample)) {
        let now = Instant::now();
        self.waiting[side as usize].push_back((now, found));
        let [raw, corrected] = &mut self.waiting;
        for (side, waiting) in [(Side::Raw, &mut *raw), (Side::Corrected, &mut *corrected)] {
            let full = waiting.len() > WAITING;
            while let Some((_, found)) =
                waiting.pop_front_if(|(at, _)| full || now.duration_since(*at) > LONGEST)
            {
                take(side, &found.sample);
                if full {
                    break;
                }
            }
        }
        while let (Some((_, a)), Some((_, b))) = (raw.front(), corrected.front()) {
            if a.key == b.key {
                take(Side::Raw, &a.sample);
                take(Side::Corrected, &b.sample);
                raw.pop_front();
                corrected.pop_front();
            } else if raw.iter().any(|(_, of)| of.key == b.key) {
                take(Side::Raw, &a.sample); // it has not left the device
                raw.pop_front();
            } else if corrected.iter().any(|(_, of)| of.key == a.key) {
                take(Side::Corrected, &b.sample); // damaged on the sensor's line
                corrected.pop_front();
            } else {
                break; // the partner of one of them may still come
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::Key;

    /// The samples that are passed on when these counters arrive on both lines, raw first.
    fn taken(raw: &[u16], corrected: &[u16]) -> Vec<(Side, f64)> {
        let mut pairs = Pairs::default();
        let mut all = Vec::new();
        for (side, counters) in [(Side::Raw, raw), (Side::Corrected, corrected)] {
            for counter in counters {
                let found = DecodedSample {
                    key: Key::Counter(*counter),
                    sample: [f64::from(*counter); 6],
                };
                pairs.push(side, found, |side, of| all.push((side, of[0])));
            }
        }
        all
    }

    #[test]
    fn a_sample_waits_for_its_partner() {
        let (r, c) = (Side::Raw, Side::Corrected);
        assert_eq!(taken(&[1, 2], &[1]), [(r, 1.0), (c, 1.0)]);
        assert_eq!(taken(&[1, 2], &[2]), [(r, 1.0), (r, 2.0), (c, 2.0)]);
        assert_eq!(taken(&[2], &[1, 2]).last(), Some(&(c, 2.0)));
        assert!(taken(&[], &[1, 2]).is_empty());
        let many: Vec<u16> = (0..3000).collect();
        assert!(taken(&many, &[]).len() >= 3000 - WAITING);
    }
}
