//! Gaps in the samples of a recording.
//!
//! They are found from the time stamps. A step of more than 1.5 samples is a gap, unless the stamps
//! after it catch up: then a recorder stalled, and no sample is missing. Where rounding alone makes
//! such steps ([`Pace`]), a gap is where all stamps from one on are later than rounding can make
//! them. The motion in a gap is not known. A short gap is bridged by the mean of the samples around
//! it, as the device bridges it by the sample before. A long one interrupts navigation.

use crate::recordings::pace::Pace;
use crate::recordings::record::Kind;
use host_core::error::Error;
use host_core::inertial::sins::Increment;
use host_core::list::{List, Writer};
use std::collections::VecDeque;

/// Longest gap that is bridged, s; the same as in the device.
pub const BRIDGE_S: f64 = 0.1;
/// A step between rates is interpolated up to so many samples.
const RATE_STEPS: f64 = 3.0;
/// Rounded stamps before and after a gap that are compared, and at least as many as it is long
/// twice.
const COMPARED: usize = 16;
/// They differ by more than this share of a step if a sample is missing; with fewer stamps behind,
/// by the second one.
const MOVED: [f64; 2] = [0.65, 1.5];

/// One gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// Index of the sample after it.
    pub next: usize,
    /// End of the interval of the sample before it, s.
    pub from: f64,
    /// Start of the interval of the next sample, s.
    pub to: f64,
    /// Its length, s: from one to the other, or that of the missing samples where stamps are
    /// rounded.
    pub length: f64,
}

/// All gaps of samples at `time`.
#[must_use]
pub fn gaps(time: &List<f64>, kind: Kind, pace: &Pace) -> Vec<Gap> {
    let step = pace.step;
    let measures = match kind {
        Kind::Rate => 0.0,
        Kind::Increment => step,
    };
    if pace.is_coarse() {
        return among_rounded(time, step, measures);
    }
    let mut out = Vec::new();
    for (k, [before, now]) in (1..).zip(pairs(time)) {
        let passed = now - before;
        if passed <= 1.5 * step || catches_up(time, k, [before, now], step) {
            continue;
        }
        let to = now - measures;
        let length = match pace.unit {
            Some(_) => ((to - before) / step).round() * step,
            None => to - before,
        };
        out.push(Gap {
            next: k,
            from: before,
            to,
            length,
        });
    }
    out
}

/// Gaps among stamps that are rounded to more than half of a step. The earliest stamps before and
/// after a gap, against equal steps, tell its length; rounding alone sets them hardly apart.
fn among_rounded(time: &List<f64>, step: f64, measures: f64) -> Vec<Gap> {
    let mut out = Vec::new();
    let mut lateness: VecDeque<f64> = VecDeque::with_capacity(COMPARED);
    let earliest = |all: &mut dyn Iterator<Item = f64>| all.fold(f64::INFINITY, f64::min);
    // when sample `k` is due
    let (mut begin, mut last) = (time.start().unwrap_or_default(), f64::NAN);
    for (k, now) in time.each().enumerate() {
        let late = |(k, t): (usize, f64)| t - begin - k as f64 * step;
        let before = earliest(&mut lateness.iter().copied());
        let beyond = |later: f64, moved: f64| later - before > moved * step;
        if beyond(late((k, now)), MOVED[0]) {
            let ahead = COMPARED.max((2.0 * (now - last) / step) as usize);
            let after = time.block(k..k.saturating_add(ahead));
            let moved = MOVED[usize::from(after.len() < COMPARED)];
            let after = earliest(&mut (k..).zip(after.iter().copied()).map(late));
            if beyond(after, moved) {
                let missing = ((after - before) / step).round();
                out.push(Gap {
                    next: k,
                    from: last,
                    to: now - measures,
                    length: (missing + 1.0) * step - measures,
                });
                begin += after - before;
            }
        }
        if lateness.len() == COMPARED {
            lateness.pop_front();
        }
        lateness.push_back(now - begin - k as f64 * step);
        last = now;
    }
    out
}

/// Gaps that are too long to bridge. `most`: the user's limit for rates.
#[must_use]
pub fn long(gaps: &[Gap], kind: Kind, step: f64, most: Option<f64>) -> Vec<Gap> {
    let longest = match kind {
        Kind::Rate => most.unwrap_or(BRIDGE_S.max(RATE_STEPS * step)),
        Kind::Increment => BRIDGE_S,
    };
    let all = gaps.iter().copied();
    all.filter(|gap| gap.length > longest + 1e-9).collect()
}

/// Each time but the first, with the one before it.
pub fn pairs(time: &List<f64>) -> impl Iterator<Item = [f64; 2]> {
    let mut all = time.each();
    let mut before = all.next();
    all.filter_map(move |now| Some([before.replace(now)?, now]))
}

/// Whether the samples after the late stamp `k`, `now`, follow so fast that none can be missing.
fn catches_up(time: &List<f64>, k: usize, [before, now]: [f64; 2], step: f64) -> bool {
    let late = (now - before) / step;
    let ahead = (2.0 * late).ceil() as usize;
    let at = k.saturating_add(ahead);
    let Some(later) = time.block(at..at.saturating_add(1)).first().copied() else {
        return false;
    };
    later - before < (ahead as f64 + 1.5) * step
}

/// Increments without gaps: an increment is inserted for each gap, with the mean motion around it.
/// `lead` is the length of the first one, s.
///
/// # Errors
/// Long lists need temporary files, and they cannot be written.
pub fn bridged(
    time: &List<f64>,
    increments: &List<Increment>,
    gaps: &[Gap],
    step: f64,
) -> Result<(List<f64>, List<Increment>), Error> {
    let mut out = (Writer::default(), Writer::default());
    let mut gaps = gaps.iter().peekable();
    let mut before = None;
    for (k, (t, increment)) in time.each().zip(increments.each()).enumerate() {
        if let Some(gap) = gaps.next_if(|gap| gap.next == k) {
            let before = before.unwrap_or(increment);
            let share = 0.5 * gap.length / step;
            out.0.push(gap.to)?;
            out.1.push(Increment {
                dtheta: (before.dtheta + increment.dtheta) * share,
                dv: (before.dv + increment.dv) * share,
            })?;
        }
        out.0.push(t)?;
        out.1.push(increment)?;
        before = Some(increment);
    }
    Ok((out.0.finish()?, out.1.finish()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    const PACE: Pace = Pace {
        step: 0.01,
        unit: None,
    };

    fn stamps(missing: impl Fn(usize) -> bool) -> List<f64> {
        let all = (1..=400).filter(|k| !missing(*k));
        all.map(|k| 0.01 * k as f64).collect()
    }

    #[test]
    fn missing_samples_are_found_and_late_stamps_are_not_missing() {
        assert_eq!(gaps(&stamps(|_| false), Kind::Increment, &PACE), []);
        let found = gaps(&stamps(|k| (100..105).contains(&k)), Kind::Increment, &PACE);
        assert_eq!((found.len(), found[0].next), (1, 99));
        assert!((found[0].from - 0.99).abs() < 1e-12 && (found[0].length - 0.05).abs() < 1e-9);
        let rates = gaps(&stamps(|k| (100..105).contains(&k)), Kind::Rate, &PACE);
        assert!((rates[0].length - 0.06).abs() < 1e-9);
        let mut stalled = stamps(|_| false);
        stalled.edit(|all| {
            for (k, t) in all.iter_mut().enumerate().take(106).skip(100) {
                *t = 1.065 + 1e-4 * k as f64; // six samples in the recorder's buffer
            }
        });
        assert_eq!(gaps(&stalled, Kind::Increment, &PACE), []);
    }

    #[test]
    fn only_long_gaps_interrupt() {
        let found = gaps(
            &stamps(|k| (100..105).contains(&k) || (200..260).contains(&k)),
            Kind::Increment,
            &PACE,
        );
        assert_eq!(found.len(), 2);
        let interrupting = long(&found, Kind::Increment, 0.01, None);
        assert_eq!(interrupting, found[1..]);
        let rates = |most| long(&found, Kind::Rate, 0.01, most).len();
        assert_eq!(
            [rates(None), rates(Some(0.02)), rates(Some(1.0))],
            [1, 2, 0]
        );
    }

    #[test]
    fn a_bridge_carries_the_mean_motion() {
        let time = stamps(|k| (100..105).contains(&k));
        let turning = |t: &f64| Increment {
            dtheta: Vector3::repeat(t * 0.01),
            dv: Vector3::repeat(0.1),
        };
        let increments: List<Increment> = time.iter().map(turning).collect();
        let found = gaps(&time, Kind::Increment, &PACE);
        let (times, all) = bridged(&time, &increments, &found, 0.01).unwrap();
        assert_eq!((times.len(), all.len()), (time.len() + 1, time.len() + 1));
        assert!(times.is_sorted());
        let sum: Increment = all.iter().fold(Increment::default(), |sum, w| Increment {
            dtheta: sum.dtheta + w.dtheta,
            dv: sum.dv + w.dv,
        });
        assert!((sum.dv.x - 40.0).abs() < 1e-9 && (sum.dtheta.x - 8.02).abs() < 1e-9);
    }
}
