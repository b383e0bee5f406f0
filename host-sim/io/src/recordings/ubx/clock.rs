//! The clock of a receiver's sensor, and the times of fixes.

use super::log::Measured;
use crate::recordings::WEEK_S;
use firmware::wire::ubx::Pvt;

/// Ticks per second that receivers are known to have: 39.0625 us, and ms.
const KNOWN: [f64; 2] = [25_600.0, 1000.0];
/// Largest relative difference between the measured and a known rate of the tags.
const NEAR: f64 = 0.02;
/// Least time between the first and the last fix, ms.
const LEAST_MS: i64 = 10_000;
/// A week in ms.
const WEEK_MS: i64 = 1000 * WEEK_S as i64;

/// Time tags, unwrapped.
pub(super) fn unwrapped(measured: &[Measured]) -> Vec<i64> {
    let mut last = None;
    let on = |m: &Measured| {
        let now = match last {
            None => i64::from(m.tag),
            Some((tag, at)) => at + i64::from(m.tag.wrapping_sub(tag) as i32),
        };
        last = Some((m.tag, now));
        now
    };
    measured.iter().map(on).collect()
}

/// Times of week, ms, that continue over the end of a week.
pub(super) fn second_of_week<'a>(fixes: impl Iterator<Item = &'a Pvt>) -> Vec<i64> {
    let mut weeks = 0;
    let mut before = None;
    let on = |pvt: &Pvt| {
        let ms = i64::from(pvt.time_of_week);
        weeks += i64::from(before.is_some_and(|before| ms < before - WEEK_MS / 2));
        before = Some(ms);
        ms + weeks * WEEK_MS
    };
    fixes.map(on).collect()
}

/// Relation between the time tags of the samples and the times of the fixes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Clock {
    /// Ticks in a second.
    rate: f64,
    /// Reference tag.
    tag: i64,
    /// Time of week at the reference tag, ms, if the promptest fix came without delay.
    ms: i64,
}

impl Clock {
    /// The clock, found from the fixes of a log. `which` counts the measurements before a fix.
    pub(super) fn of(fixes: &[(Pvt, [usize; 2])], tags: &[i64], which: usize) -> Option<Self> {
        let times = second_of_week(fixes.iter().map(|(pvt, _)| pvt));
        let pair = |((pvt, before), ms): (&(Pvt, [usize; 2]), i64)| {
            let tag = *tags.get(before[which].checked_sub(1)?)?;
            pvt.is_good().then_some((tag, ms))
        };
        let pairs: Vec<(i64, i64)> = fixes.iter().zip(times).filter_map(pair).collect();
        let (first, last) = (pairs.first()?, pairs.last()?);
        let (ticks, ms) = (last.0 - first.0, last.1 - first.1);
        if ms < LEAST_MS || ticks <= 0 {
            return None;
        }
        let measured = ticks as f64 / (ms as f64 / 1e3);
        let near = |rate: &f64| (measured / rate - 1.0).abs() < NEAR;
        let rate = KNOWN.into_iter().find(near).unwrap_or(measured);
        let lateness =
            |(tag, ms): &(i64, i64)| (tag - first.0) as f64 / rate - (ms - first.1) as f64 * 1e-3;
        let promptest = pairs
            .iter()
            .min_by(|a, b| lateness(a).total_cmp(&lateness(b)))?;
        Some(Self {
            rate,
            tag: promptest.0,
            ms: promptest.1,
        })
    }

    /// Time of a tag, ns after the clock's reference tag.
    pub(super) fn ns(&self, tag: i64) -> i64 {
        ((tag - self.tag) as f64 * (1e9 / self.rate)).round() as i64
    }

    /// Time of a time of week (ms), ns after the clock's reference.
    pub(super) fn ns_of_week(&self, ms: i64) -> i64 {
        (ms - self.ms) * 1_000_000
    }

    /// A note for the user: rate of the clock, and age of the promptest fix.
    pub(super) fn note(&self, delay_s: f64) -> String {
        format!(
            "time tags count {:.1} a second; the promptest fix counts as {delay_s} s old, which \
             --fix-delay-s gives",
            self.rate
        )
    }
}
