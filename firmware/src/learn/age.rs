//! The age of a fix when it arrives.
//!
//! A fix is computed by the receiver and then travels to the board. Without a time pulse the two
//! clocks have no common zero, so the sum of these delays is not observable. The settings therefore
//! state the least age, and only what exceeds it is measured: by how much longer after its time of
//! validity t a fix arrives, at time a, than the third earliest fix so far,
//!
//! ```text
//! excess(k) = excess(k-1) + (a(k) - a(k-1)) (1 - FORGET) - (t(k) - t(k-1))
//! age(k) = least age + max(0, excess(k))
//! ```
//!
//! The third earliest, and not the earliest: one fix that is stamped ahead of its time would make
//! all later ones seem late. What two others have not confirmed within a minute is forgotten.
//!
//! The time of arrival is that of the last sample before the first byte of the fix, because the
//! navigator stands on samples and because the same input then gives the same bits on every
//! machine. What the fix needs from then on until it is complete is counted in samples and added.
//! The reference forgets by the share `FORGET` of the time: a sample clock that is faster than the
//! receiver's by less than that does not age the fixes. A constant delay adds exactly nothing.
//!
//! With a time pulse the age comes with the fix ([`Fix::age`]) and is exact. The least age then
//! follows from it, so that ages go on without a step when the pulse stays away.

use crate::fix::{self, Fix, ms_since};

/// Share of the time by which the reference is forgotten: 100 ppm, twice what two crystals
/// differ by. A fix that is late after an hour of late fixes seems 0.36 s less late.
const FORGET_PER_MILLION: i64 = 100;

/// Greatest age at which a fix is used, s: the navigator goes back no further.
pub const MAX_AGE_S: f32 = 1.0;

/// After so many fixes in a row that are too late, the receiver's time has jumped rather than the
/// fixes been delayed: the reference is then searched for again.
const JUMP: u8 = 10;

/// Arrivals that were sooner than the reference are forgotten after this time, us.
const CONFIRM_US: i64 = 60_000_000;

/// Fixes closer to each other than this count as one of these, ms.
const SECOND_MS: u32 = 900;

/// A GPS week, ms.
const WEEK_MS: i64 = fix::WEEK_MS as i64; // lossless

/// An arrival sooner than the reference: by how much, us, >= 0, and the time since then, us.
#[derive(Debug, Clone, Copy, Default)]
struct Sooner {
    lead_us: i64,
    since_us: i64,
}

/// Measures by how much fixes are later than the third earliest.
#[derive(Debug, Clone, Copy, Default)]
pub struct FixAge {
    /// Sample number of arrival and time of validity (ms of the week) of the last fix.
    last: Option<(u32, u32)>,
    /// Excess of the last fix over the reference, us.
    excess_us: i64,
    /// The two earliest arrivals.
    earliest: [Sooner; 2],
    /// What the reference has forgotten since it was set, us.
    forgotten_us: i64,
    /// Fixes in a row that were too late, one in a second, at most [`JUMP`], and the time of
    /// validity of the last one.
    too_late: u8,
    too_late_ms: u32,
    /// How much sooner the reference is than before the last fix, us, >= 0.
    sooner_us: i64,
    /// Least age by the time pulse, s, instead of the configured one.
    least_s: Option<f32>,
}

impl FixAge {
    /// Age of a fix in seconds at sample `number` of a stream with this period. `configured_s` is
    /// the least age at its arrival; `keeps`: without a pulse, the age by the last pulses replaces
    /// it. `None`: the fix is older than [`MAX_AGE_S`].
    pub fn of(
        &mut self,
        number: u32,
        fix: &Fix,
        period_s: f64,
        configured_s: f32,
        keeps: bool,
    ) -> Option<f32> {
        let waited = fix.waited as f32 * period_s as f32;
        let least = self.least_s.filter(|_| keeps).unwrap_or(configured_s);
        let arrived = number.wrapping_sub(fix.waited);
        let by_arrival = self.arrived(arrived, fix.time_ms, period_s, least);
        let age = match fix.age {
            None => by_arrival? + waited,
            Some(age) => {
                let excess = self.excess_us.max(0) as f32 * 1e-6;
                self.least_s = Some((age - waited - excess).clamp(0.0, MAX_AGE_S));
                age
            }
        };
        (0.0..=MAX_AGE_S).contains(&age).then_some(age)
    }

    /// The age on arrival of a fix valid at `time_ms` of the week that arrived after sample
    /// `number` of a stream with this period; `least_s` is the least age. `None`: it is older than
    /// [`MAX_AGE_S`].
    fn arrived(&mut self, number: u32, time_ms: u32, period_s: f64, least_s: f32) -> Option<f32> {
        if let Some((last_number, last_ms)) = self.last.replace((number, time_ms)) {
            let samples = number.wrapping_sub(last_number);
            // `as` saturates; a stream's period is at most 1 s
            let arrived_us = libm::round(f64::from(samples) * period_s * 1e6) as i64;
            let valid_us = (i64::from(time_ms) - i64::from(last_ms) + WEEK_MS / 2)
                .rem_euclid(WEEK_MS)
                .wrapping_sub(WEEK_MS / 2)
                .wrapping_mul(1000);
            let forgotten_us = arrived_us / (1_000_000 / FORGET_PER_MILLION);
            let change = arrived_us.wrapping_sub(forgotten_us).wrapping_sub(valid_us);
            self.excess_us = self.excess_us.saturating_add(change);
            self.refer(arrived_us, forgotten_us);
        }
        let mut age = least_s + self.excess_us.max(0) as f32 * 1e-6;
        if age > MAX_AGE_S {
            let since = ms_since(self.too_late_ms, time_ms);
            if self.too_late == 0 || since >= SECOND_MS {
                self.too_late = self.too_late.saturating_add(1);
                self.too_late_ms = time_ms;
            }
            if self.too_late < JUMP {
                return None;
            }
            self.excess_us = 0;
            self.earliest = Default::default();
            age = least_s;
        }
        self.too_late = 0;
        Some(age)
    }

    /// The last fix may be one of the three earliest. It arrived so long after the one before, and
    /// the reference has forgotten so much in that time, us.
    fn refer(&mut self, arrived_us: i64, forgotten_us: i64) {
        self.forgotten_us = self.forgotten_us.saturating_add(forgotten_us);
        self.sooner_us = 0;
        for of in &mut self.earliest {
            of.since_us = of.since_us.saturating_add(arrived_us);
            of.lead_us = if of.since_us > CONFIRM_US || of.lead_us == 0 {
                0
            } else {
                of.lead_us.saturating_add(forgotten_us)
            };
        }
        let mut new = Sooner {
            lead_us: self.excess_us.min(0).saturating_neg(),
            since_us: 0,
        };
        for of in &mut self.earliest {
            if new.lead_us > of.lead_us {
                core::mem::swap(of, &mut new);
            }
        }
        // what is left of the three is the new reference
        let lead = new.lead_us;
        if lead > 0 {
            self.earliest.iter_mut().for_each(|of| of.lead_us -= lead);
            self.excess_us = self.excess_us.saturating_add(lead);
            self.sooner_us = lead.saturating_sub(self.forgotten_us).max(0);
            self.forgotten_us = 0;
        }
    }

    /// What is known of the arrivals is no longer valid; the least age stays.
    pub fn begin_again(&mut self) {
        *self = Self {
            least_s: self.least_s,
            ..Self::default()
        };
    }

    /// The least age as the last time pulse has shown it, s.
    pub fn measured_s(&self) -> Option<f32> {
        self.least_s
    }

    /// How much sooner than before the last fix that fix is now to which the least age belongs, s,
    /// drift of the clocks apart.
    pub fn sooner_s(&self) -> f32 {
        self.sooner_us as f32 * 1e-6
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 0.01;
    const LEAST_S: f32 = 0.1;

    /// Fixes at whole seconds that arrive with these delays, in samples.
    fn ages(age: &mut FixAge, from_s: u32, delays: &[u32]) -> Vec<Option<f32>> {
        let of = |(k, delay): (usize, &u32)| {
            let second = from_s + k as u32;
            let time_ms = (u64::from(second) * 1000 % WEEK_MS as u64) as u32;
            let number = second.wrapping_mul(100).wrapping_add(*delay);
            age.arrived(number, time_ms, PERIOD_S, LEAST_S)
        };
        delays.iter().enumerate().map(of).collect()
    }

    #[test]
    fn a_constant_delay_gives_the_least_age_bit_for_bit() {
        for delay in [0, 10, 250] {
            let mut age = FixAge::default();
            let got = ages(&mut age, 100, &[delay; 5000]);
            assert!(got.iter().all(|age| *age == Some(LEAST_S)));
        }
    }

    #[test]
    fn a_late_fix_is_older_by_what_it_is_late() {
        let mut age = FixAge::default();
        let got = ages(&mut age, 0, &[10, 10, 60, 10, 10, 45, 10]);
        for (got, want) in got.iter().zip([0.1, 0.1, 0.6, 0.1, 0.1, 0.45, 0.1]) {
            let got = got.unwrap();
            // what the reference has forgotten since it was set
            assert!((got - want).abs() < 5e-4, "{got} {want}");
        }
        assert_eq!(got[3], Some(LEAST_S));
    }

    /// Two fixes that are stamped ahead of their time age no other one. A third one in a minute is
    /// believed, as is a receiver that is sooner from now on.
    #[test]
    fn fixes_that_are_stamped_ahead_do_not_age_the_others() {
        let mut age = FixAge::default();
        let mut delays = [90; 400];
        for k in [40, 50, 120, 300] {
            delays[k] = 10;
        }
        let got = ages(&mut age, 0, &delays);
        assert!(got.iter().all(|age| *age == Some(LEAST_S)), "{got:?}");
        let got = ages(&mut age, 400, &[90, 50, 50, 50, 50, 50, 50, 90]);
        let late = got[7].unwrap();
        assert_eq!(got[..7], [Some(LEAST_S); 7]);
        assert!((late - LEAST_S - 0.4).abs() < 1e-3, "{late}");
    }

    /// The first fix after power-on is often late.
    #[test]
    fn a_late_beginning_does_not_last() {
        let got = ages(&mut FixAge::default(), 0, &[70, 10, 10, 10, 10, 20]);
        assert_eq!(got[..5], [Some(LEAST_S); 5]);
        assert!((got[5].unwrap() - LEAST_S - 0.1).abs() < 1e-3);
    }

    #[test]
    fn a_fix_beyond_the_range_is_refused_and_the_next_is_not() {
        let mut age = FixAge::default();
        let got = ages(&mut age, 0, &[10, 10, 101, 10]);
        assert_eq!(got, [Some(LEAST_S), Some(LEAST_S), None, Some(LEAST_S)]);
        // the least age may be the range itself
        assert_eq!(FixAge::default().arrived(0, 0, 0.01, 1.0), Some(1.0));
    }

    #[test]
    fn a_week_that_ends_changes_nothing() {
        let mut age = FixAge::default();
        let got = ages(&mut age, 604_797, &[10, 10, 10, 10, 30, 10]);
        assert!((got[4].unwrap() - 0.3).abs() < 2e-4);
        assert_eq!((got[3], got[5]), (Some(LEAST_S), Some(LEAST_S)));
    }

    #[test]
    fn drifting_clocks_do_not_age_the_fixes() {
        for drift in [-50e-6, 50e-6] {
            let mut age = FixAge::default();
            let mut most = 0.0_f32;
            for second in 0..6 * 3600_u32 {
                // the sample clock runs fast or slow by `drift`, with a start that keeps it
                // positive
                let number = (f64::from(second) * (1.0 + drift) / PERIOD_S + 1e4).floor() as u32;
                let of = age.arrived(number, second * 1000, PERIOD_S, LEAST_S);
                most = most.max(of.unwrap());
            }
            // a sample's period, by which the arrival is known
            assert!(most < LEAST_S + 0.0101, "{drift} {most}");
        }
    }

    #[test]
    fn after_a_jump_of_the_receivers_time_fixes_come_back() {
        let mut age = FixAge::default();
        ages(&mut age, 1000, &[10; 20]);
        // a restart: for one fix the time is 18 s ahead, then right again
        assert_eq!(
            age.arrived(102_010, 1_038_000, PERIOD_S, LEAST_S),
            Some(LEAST_S)
        );
        let got = ages(&mut age, 1021, &[10; 20]);
        assert!(got.iter().all(|age| *age == Some(LEAST_S)), "{got:?}");
        // and the time is another altogether
        let got = ages(&mut age, 400_000, &[10; 20]);
        assert!(got.iter().filter(|age| age.is_none()).count() < usize::from(JUMP));
        assert_eq!(got.last(), Some(&Some(LEAST_S)));
    }

    /// The first byte decides, however long the rest takes; what it takes is added.
    #[test]
    fn what_a_fix_waits_for_is_added() {
        let mut age = FixAge::default();
        for (second, waited) in [0, 0, 50, 20, 70, 0].into_iter().enumerate() {
            let second = second as u32;
            let fix = Fix {
                time_ms: 1000 * second,
                waited,
                ..Fix::EMPTY
            };
            let number = 100 * second + 10 + waited;
            let got = age.of(number, &fix, PERIOD_S, LEAST_S, true).unwrap();
            let want = LEAST_S + waited as f32 * PERIOD_S as f32;
            assert!((got - want).abs() < 1e-6, "{got} {want}");
        }
        let fix = Fix {
            time_ms: 6000,
            waited: 91,
            ..Fix::EMPTY
        };
        assert_eq!(age.of(610 + 91, &fix, PERIOD_S, LEAST_S, true), None);
    }

    /// With a pulse the age is measured and not the configured one; when the pulse stays away, the
    /// measured age remains.
    #[test]
    fn the_pulse_replaces_the_configured_age() {
        let mut age = FixAge::default();
        let mut of = |second: u32, delay: u32, waited: u32, exact: Option<f32>| {
            let fix = Fix {
                time_ms: 1000 * second,
                waited,
                age: exact,
                ..Fix::EMPTY
            };
            age.of(100 * second + delay + waited, &fix, PERIOD_S, LEAST_S, true)
        };
        let near = |age: Option<f32>, want: f32| (age.unwrap() - want).abs() < 1e-3;
        assert_eq!(of(1, 60, 0, None), Some(LEAST_S));
        assert_eq!(of(2, 60, 0, Some(0.602)), Some(0.602));
        assert_eq!(of(3, 75, 10, Some(0.852)), Some(0.852));
        assert!(near(of(4, 60, 0, None), 0.602));
        assert!(near(of(5, 70, 10, None), 0.802));
        assert_eq!(of(6, 60, 0, Some(1.1)), None);
    }

    /// After a break of unknown length the delay is still what it was.
    #[test]
    fn a_break_is_no_other_delay() {
        let mut age = FixAge::default();
        ages(&mut age, 0, &[10; 20]);
        for second in 20..30 {
            if second == 20 {
                age.begin_again();
            }
            // 50 samples are missing that nobody has counted
            let got = age.arrived(100 * second + 10 - 50, second * 1000, PERIOD_S, LEAST_S);
            assert_eq!((got, age.sooner_s()), (Some(LEAST_S), 0.0));
        }
    }

    #[test]
    fn sample_numbers_wrap() {
        let mut age = FixAge::default();
        let first = age.arrived(u32::MAX - 49, 5000, PERIOD_S, LEAST_S);
        let second = age.arrived(50, 6000, PERIOD_S, LEAST_S);
        assert_eq!((first, second), (Some(LEAST_S), Some(LEAST_S)));
    }
}
