use super::*;
use crate::configuration::Configuration;

/// A receiver whose second has `period` microseconds of the board's clock, and whose pulse at its
/// second 0 came at `zero`.
struct Clocks {
    zero: u64,
    period: u64,
    pulse: TimePulse,
}

impl Clocks {
    fn new(zero: u64, period: u64) -> Clocks {
        Clocks {
            zero,
            period,
            pulse: TimePulse::default(),
        }
    }

    fn us(&self, second: f64) -> u64 {
        self.zero + (second * self.period as f64) as u64
    }

    fn pulses(&mut self, seconds: core::ops::Range<u32>) {
        for second in seconds {
            self.pulse.rose(self.us(second.into()));
        }
    }

    /// The age of a fix that comes so many seconds after its validity.
    fn age(&mut self, time_ms: u32, delay: f64) -> Option<f32> {
        self.age_told(time_ms, delay, None)
    }

    /// [`Self::age`] with a configured delay and its standard deviation, s.
    fn age_told(
        &mut self,
        time_ms: u32,
        delay: f64,
        configuration: Option<[f32; 2]>,
    ) -> Option<f32> {
        let us = self.us(f64::from(time_ms) / 1000.0 + delay);
        let configuration = configuration.map(|[fix_delay, fix_delay_sigma]| Receiver {
            fix_delay,
            fix_delay_sigma,
            ..Configuration::default().receiver
        });
        (self.pulse).age(time_ms % WEEK_MS as u32, us, us, configuration.as_ref())
    }
}

fn near(age: Option<f32>, want: f64) -> bool {
    age.is_some_and(|age| (f64::from(age) - want).abs() < 1e-3)
}

#[test]
fn the_age_is_exact_whatever_the_clocks_are() {
    for (zero, period) in [
        (7, 1_000_000),
        (123_456_789, 1_000_050),
        (5_000_000, 990_000),
    ] {
        for delay in [0.003, 0.1, 0.6, 0.95] {
            let mut clocks = Clocks::new(zero, period);
            clocks.pulses(0..4);
            assert_eq!(clocks.age(3000, delay), None, "four pulses may be noise");
            for second in 4..40 {
                clocks.pulses(second..second + 1);
                let share = period as f64 * 1e-6;
                // five fixes a second
                for ms in [0, 200, 400, 600, 800].map(|ms| second * 1000 + ms) {
                    let age = clocks.age(ms, delay);
                    assert!(near(age, delay * share), "{age:?} {delay} {period} {ms}");
                }
            }
        }
    }
}

/// It refers to the sample before the fix, which may have come before the fix was valid.
#[test]
fn a_fix_that_comes_at_once_has_no_negative_age() {
    let mut clocks = Clocks::new(1000, 1_000_000);
    clocks.pulses(0..5);
    assert_eq!(
        clocks.pulse.age(4000, 4_001_500, 3_997_000, None),
        Some(0.0)
    );
    assert!(near(clocks.age(5000, 0.6), 0.6));
}

#[test]
fn doubled_missing_and_stray_edges_do_no_harm() {
    let mut clocks = Clocks::new(1_000_000, 1_000_020);
    let mut noise = 12_345_u64;
    for second in 0..300_u32 {
        if second % 7 != 3 || second < 10 {
            clocks.pulses(second..second + 1);
            let at = clocks.us(second.into());
            for after in [3, 40, 5_000] {
                clocks.pulse.rose(at + after); // it bounces
            }
        }
        if second > 6 {
            assert!(near(clocks.age(second * 1000, 0.6), 0.6), "{second}");
        }
        // edges anywhere
        for k in 1..4 {
            noise = noise
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let share = f64::from((noise >> 40) as u32) / f64::from(1 << 24);
            let at =
                clocks.us(f64::from(second) + (f64::from(k) - 1.0 + share) / 3.0 * 0.98 + 0.01);
            clocks.pulse.rose(at);
        }
    }
}

#[test]
fn noise_alone_is_no_pulse() {
    let mut pulse = TimePulse::default();
    let (mut noise, mut at, mut ages) = (1_u64, 0, 0);
    for n in 0..10_000_u32 {
        noise = noise
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        at += (noise >> 33) % 700_000;
        pulse.rose(at);
        ages += u32::from(pulse.age(n * 100, at, at, None).is_some());
    }
    assert!(ages < 20, "{ages}");
}

#[test]
fn without_pulses_it_is_forgotten_and_comes_back() {
    let mut clocks = Clocks::new(1000, 1_000_000);
    clocks.pulses(0..10);
    assert!(near(clocks.age(9000, 0.2), 0.2));
    assert!(near(clocks.age(13_000, 0.2), 0.2));
    assert_eq!(clocks.age(14_500, 0.2), None);
    clocks.pulses(20..24);
    assert_eq!(clocks.age(23_000, 0.2), None);
    clocks.pulses(24..25);
    assert!(near(clocks.age(24_000, 0.2), 0.2));
    // pulses without fixes, for an hour, and at the end of the week
    let start = WEEK_MS as u32 / 1000 - 3600;
    clocks.pulses(start..start + 3601);
    assert!(near(clocks.age(WEEK_MS as u32, 0.3), 0.3));
    clocks.pulses(start + 3601..start + 3604);
    assert!(near(clocks.age(WEEK_MS as u32 + 3000, 0.3), 0.3));
}

/// Seconds of UTC are as good as those of GPS, and a leap second is noticed.
#[test]
fn after_a_jump_of_the_receivers_time_ages_come_back() {
    let mut clocks = Clocks::new(1000, 1_000_000);
    clocks.pulses(0..5);
    let age = |clocks: &mut Clocks, second: u32, jump: u32| {
        clocks.pulses(second..second + 1);
        let us = clocks.us(f64::from(second) + 0.4);
        clocks.pulse.age((second - jump) * 1000, us, us, None)
    };
    assert!((5..10).all(|second| near(age(&mut clocks, second, 0), 0.4)));
    let after: Vec<_> = (10..20).map(|second| age(&mut clocks, second, 1)).collect();
    assert!(after[..5].iter().all(Option::is_none), "{after:?}");
    assert!(after[5..].iter().all(|age| near(*age, 0.4)), "{after:?}");
}

/// The first fix came more than a second late, so its second is mistaken. The next ones show it.
#[test]
fn a_first_fix_that_is_too_late_misleads_only_for_a_while() {
    let mut clocks = Clocks::new(1000, 1_000_000);
    clocks.pulses(0..5);
    assert!(near(clocks.age(4000, 1.05), 0.05));
    let mut last = None;
    for second in 6..12 {
        clocks.pulses(second..second + 1);
        last = clocks.age(second * 1000, 0.3);
    }
    assert!(near(last, 0.3), "{last:?}");
}

/// The configured delay is wrong, so no age is believed for hours. Once it is right, ages come at
/// once.
#[test]
fn hours_of_unbelievable_ages_change_nothing() {
    let mut clocks = Clocks::new(1000, 1_000_000);
    clocks.pulses(0..5);
    for second in 5..5000 {
        clocks.pulses(second..second + 1);
        let age = clocks.age_told(second * 1000, 0.5, Some([0.1, 0.01]));
        assert_eq!(age, None, "{second}");
    }
    let age = clocks.age_told(4_999_000, 0.5, Some([0.5, 0.01]));
    assert!(near(age, 0.5), "{age:?}");
}

/// The line is inverted: it rises at the end of the pulse, `width` seconds late. Where fixes come
/// sooner than that, they would be 1 s - width too old. An age that may be is taken.
#[test]
fn an_inverted_pulse_does_not_make_fixes_old() {
    for (width, delay, configuration, believed) in [
        (0.1, 0.05, Some([0.1, 0.1]), false),
        (0.2, 0.05, Some([0.1, 0.1]), false),
        (0.5, 0.05, Some([0.05, 0.05]), false),
        (0.0, 0.05, Some([0.1, 0.1]), true),
        (0.0, 0.55, Some([0.1, 0.1]), true),
        (0.0, 0.65, Some([0.1, 0.1]), false),
        (0.0, 0.65, Some([0.1, 0.0]), true), // no standard deviation is configured
        (0.0, 0.65, None, true),
    ] {
        let mut clocks = Clocks::new(1_000_000, 1_000_000);
        let mut ages = 0;
        for second in 0..60_u32 {
            clocks.pulse.rose(clocks.us(f64::from(second) + width));
            let comes = second + u32::from(delay < width); // before the next pulse
            let age = clocks.age_told(comes * 1000, delay, configuration);
            assert!(age.is_none() || near(age, delay - width), "{width} {age:?}");
            ages += u32::from(age.is_some());
        }
        assert_eq!(
            ages > 50,
            believed,
            "{width} {delay} {configuration:?}: {ages}"
        );
        assert_eq!(
            ages == 0,
            !believed,
            "{width} {delay} {configuration:?}: {ages}"
        );
    }
}

/// A fix takes time to come whole. It cannot be valid after its first byte.
#[test]
fn a_fix_is_not_younger_than_its_way() {
    let mut clocks = Clocks::new(1_000_000, 1_000_000);
    clocks.pulses(0..5);
    let mut age = |arrived: f64| {
        let us = |late: f64| clocks.zero + (4e6 + late * 1e6) as u64;
        (clocks.pulse).age(4000, us(arrived), us(arrived + 0.15), None)
    };
    assert!(near(age(0.05), 0.2));
    assert_eq!(age(-0.05), None);
    assert!(near(age(0.05), 0.2));
}
