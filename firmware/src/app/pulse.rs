//! The receiver's time pulse: the exact age of a fix.
//!
//! A receiver raises a line at each whole second of its time. The board stamps the edges with its
//! own clock ([`TimePulse::rose`]). With the time of validity t of a fix, in the receiver's time,
//! and a pulse at the board's time p that marks the receiver's second s, the fix was valid at the
//! board's time
//!
//! ```text
//! p + (t - s) d      d: length of the receiver's second by the board's clock
//! ```
//!
//! Which second a pulse marks is not on the line. The first fix shows it: it comes within a second
//! of its validity. Whether the receiver counts seconds of GPS or of UTC does not matter, since
//! both are whole seconds apart.
//!
//! **Other seconds.** A line that is inverted, as by a chip for RS-232, rises at the end of the
//! pulse. Fixes then seem to come before they are valid, or nearly a second late. So an age must be
//! possible, and near to the configured delay where its standard deviation is configured.
//!
//! **Noise.** Five pulses evenly a second apart are believed. From the third on, only an edge where
//! the next pulse is expected counts. Other edges do no harm, whether they come twice, too often,
//! or in between. Some seconds without a pulse, and the relation is lost.

use crate::configuration::Receiver;

/// Edges that are stored until pulses are found among them.
const KEPT: usize = 12;
/// An edge so soon after another one is its echo, microseconds: a line without a driver, a switch.
const ECHO_US: u64 = 10_000;
/// The receiver's second by the board's clock, microseconds: its crystal is good to 0.01 %, the
/// oscillator that takes its place to 1 % at room temperature.
const SECOND_US: core::ops::RangeInclusive<u64> = 980_000..=1_020_000;
/// A pulse is this near to where it is expected, microseconds. Pulses of receivers are good to 1
/// microsecond, and the board's clock drifts much less in the seconds between.
const NEAR_US: u64 = 500;
/// Pulses where they were expected, after which they are believed.
const ENOUGH: u8 = 2;
/// Time without a pulse after which the relation is lost, before and after it is believed, s.
const LOST_S: [u64; 2] = [2, 5];
/// An age on arrival that is this many standard deviations off the configured one is not believed.
const SIGMAS: f32 = 5.0;
/// After so many fixes in a row whose age cannot be, pulses mark other seconds than was thought.
const WRONG: u8 = 5;
/// Ages of fixes, microseconds. A fix that comes at once may seem to be a little younger than 0,
/// since the sample that the age refers to came before it.
const AGE_US: core::ops::RangeInclusive<i32> = -20_000..=1_000_000;
/// A GPS week, ms.
const WEEK_MS: i32 = 604_800_000;

/// State of the pulses.
#[derive(Debug, Clone, Copy, Default)]
pub struct TimePulse {
    /// The last edges, while there is no rhythm; 0: none.
    edges: [u64; KEPT],
    next: usize,
    rhythm: Option<Rhythm>,
}

/// Pulses that are believed.
#[derive(Debug, Clone, Copy)]
struct Rhythm {
    /// Time of the last pulse, microseconds.
    last_us: u64,
    /// Time from one pulse to the next, microseconds.
    period_us: u64,
    /// Pulses where they were expected, at most [`ENOUGH`].
    seen: u8,
    /// The receiver's time at the last one, ms of the week.
    second_ms: Option<i32>,
    /// Fixes in a row whose age cannot be.
    wrong: u8,
}

impl TimePulse {
    /// The line has risen at this time of the board's clock, microseconds. Gives the receiver's
    /// second of the week that it marks, if that is known.
    #[inline(never)]
    pub fn rose(&mut self, at_us: u64) -> Option<u32> {
        self.forget(at_us);
        let Some(rhythm) = &mut self.rhythm else {
            self.look_for(at_us);
            return None;
        };
        let second_ms = rhythm.rose(at_us).then_some(rhythm.second_ms)??;
        Some(second_ms.unsigned_abs() / 1000)
    }

    /// Forgets the relation after too long a time without a pulse.
    fn forget(&mut self, now_us: u64) {
        let lost = |rhythm: &Rhythm| {
            let since = now_us.saturating_sub(rhythm.last_us);
            let [before, after] = LOST_S;
            let seconds = if rhythm.seen < ENOUGH { before } else { after };
            since > seconds * rhythm.period_us + NEAR_US
        };
        if self.rhythm.as_ref().is_some_and(lost) {
            *self = TimePulse::default();
        }
    }

    /// Searches for two earlier edges that are evenly a second apart from this one.
    fn look_for(&mut self, at_us: u64) {
        let edges = || self.edges.iter().filter(|edge| **edge > 0);
        if edges().any(|edge| at_us.saturating_sub(*edge) < ECHO_US) {
            return;
        }
        let even = |middle: &u64| {
            let period = at_us.checked_sub(*middle)?;
            let first = middle.checked_sub(period)?;
            let near = || edges().any(|edge| edge.abs_diff(first) <= NEAR_US);
            (SECOND_US.contains(&period) && near()).then_some(period)
        };
        let period = edges().find_map(even);
        self.rhythm = period.map(|period_us| Rhythm {
            last_us: at_us,
            period_us,
            seen: 0,
            second_ms: None,
            wrong: 0,
        });
        if let Some(place) = self.edges.get_mut(self.next) {
            *place = at_us;
        }
        self.next = (self.next + 1) % KEPT;
    }

    /// Age in seconds, at the board's time `at_us`, of a fix that was valid at `time_ms` of the
    /// week and has arrived at `arrived_us`. `None` without pulses, and when it cannot be or
    /// contradicts the receiver's configuration.
    #[inline(never)]
    pub fn age(
        &mut self,
        time_ms: u32,
        arrived_us: u64,
        at_us: u64,
        configuration: Option<&Receiver>,
    ) -> Option<f32> {
        self.forget(at_us);
        let rhythm = self.rhythm.as_mut()?;
        if rhythm.seen < ENOUGH {
            return None;
        }
        let believed = |on_arrival_us: i32| {
            let off = |configuration: &Receiver| {
                (on_arrival_us as f32 * 1e-6 - configuration.fix_delay).abs()
            };
            let exact = |configuration: &Receiver| configuration.fix_delay_sigma == 0.0;
            configuration.is_none_or(|configuration| {
                exact(configuration) || off(configuration) <= SIGMAS * configuration.fix_delay_sigma
            })
        };
        rhythm.age(
            (time_ms % WEEK_MS as u32) as i32,
            arrived_us,
            at_us,
            believed,
        )
    }
}

impl Rhythm {
    /// An edge. It counts if it is a whole number of periods after the last one. Half of what it is
    /// off goes into the phase and an eighth into the period, so that an edge that is there by
    /// accident does not lead away from the true ones. True: it counts.
    fn rose(&mut self, at_us: u64) -> bool {
        let since = at_us.saturating_sub(self.last_us);
        let periods = (since + self.period_us / 2) / self.period_us.max(1);
        let expected = self.last_us + periods * self.period_us;
        if periods == 0 || at_us.abs_diff(expected) > NEAR_US {
            return false;
        }
        self.seen = self.seen.saturating_add(1).min(ENOUGH);
        let off = at_us.wrapping_sub(expected).cast_signed();
        self.last_us = expected.wrapping_add_signed(off / 2);
        self.period_us = self.period_us.wrapping_add_signed(off / 8);
        if let Some(second) = &mut self.second_ms {
            *second = (*second + 1000 * periods as i32) % WEEK_MS;
        }
        true
    }

    /// All differences are seconds, a week of ms at most, so 32 bits hold them.
    fn age(
        &mut self,
        time_ms: i32,
        arrived_us: u64,
        at_us: u64,
        believed: impl FnOnce(i32) -> bool,
    ) -> Option<f32> {
        let (period, last_us) = (self.period_us as i32, self.last_us);
        let fraction = time_ms % 1000;
        let share = (fraction as f32 * 1e-3 * period as f32) as i32;
        // to a fix that is valid at the same fraction of the second in which the last pulse came
        let since = |us: u64| (us.wrapping_sub(last_us) as i32).wrapping_sub(share);
        let second = *self.second_ms.get_or_insert_with(|| {
            // the youngest fix that has not come before its validity
            let seconds = since(arrived_us).checked_div_euclid(period);
            time_ms - fraction - 1000 * seconds.unwrap_or(0)
        });
        let ahead_ms =
            (time_ms - fraction - second + WEEK_MS / 2).rem_euclid(WEEK_MS) - WEEK_MS / 2;
        let ahead_us = (ahead_ms / 1000).wrapping_mul(period);
        let [on_arrival, age] = [arrived_us, at_us].map(|us| since(us).wrapping_sub(ahead_us));
        let possible = *AGE_US.start() <= on_arrival && AGE_US.contains(&age);
        if possible && believed(on_arrival) {
            self.wrong = 0;
            return Some(age.max(0) as f32 * 1e-6);
        }
        self.wrong = self.wrong.saturating_add(1);
        if self.wrong >= WRONG {
            self.second_ms = None;
        }
        None
    }
}

#[cfg(test)]
mod tests;
