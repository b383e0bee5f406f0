//! Streams of samples with bursts, delays, holes and damage.

use super::*;
use std::vec::Vec;

/// Samples at `hz` for `seconds`, counted at each arrival; `delay` is how long a sample that is due
/// at a time waits, s. Gives when the fault was there.
fn watched(
    watch: &mut RateWatch,
    configured: f32,
    (start, seconds): (f64, f64),
    hz: f64,
    delay: impl Fn(f64) -> f64,
) -> Vec<(f64, bool)> {
    let mut out = Vec::new();
    let mut samples = (start * hz) as u32;
    let mut t = start;
    while t < start + seconds {
        t += 1e-3;
        while (f64::from(samples) + 1.0) / hz + delay((f64::from(samples) + 1.0) / hz) <= t {
            samples += 1;
        }
        let now = (t * 1e6) as u64;
        if watch.is_due(now) {
            let seen = StreamCounts {
                samples,
                ..StreamCounts::default()
            };
            out.push((t - start, watch.look(now, Some(configured), seen)));
        }
    }
    out
}

#[test]
fn a_wrong_rate_is_raised_and_goes_again() {
    for (configured, hz, within) in [
        (1000.0, 5000.0, 5.0),
        (1000.0, 500.0, 5.0),
        (100.0, 200.0, 6.0),
        (125.0, 128.0, 32.0),
        (1000.0, 1024.0, 32.0),
        (1000.0, 970.0, 32.0),
        (1062.5, 1000.0, 32.0),
    ] {
        let mut watch = RateWatch::new(true);
        let seen = watched(&mut watch, configured, (0.0, 60.0), hz, |_| 0.0);
        let first = seen.iter().find(|(_, wrong)| *wrong).map(|(t, _)| *t);
        assert!(
            first.is_some_and(|t| t <= within),
            "{configured}, {hz}: {first:?}"
        );
        let since = seen.iter().skip_while(|(_, wrong)| !wrong);
        assert!(
            since.clone().all(|(_, wrong)| *wrong),
            "{configured}, {hz}: it stays"
        );
        // the sensor is set right; the windows in progress still hold the wrong rate
        let mut watch_on = watched(
            &mut watch,
            configured,
            (60.0, 60.0),
            configured.into(),
            |_| 0.0,
        );
        let (t, still) = watch_on.remove(35);
        assert!(!still, "{configured}: still wrong after {t} s");
    }
}

#[test]
fn late_bursts_and_slow_clocks_are_no_wrong_rate() {
    let bursts = |every: f64| move |t: f64| every - t % every; // delivered every so often
    let hiccup = |t: f64| {
        if (30.0..30.3).contains(&t) {
            30.3 - t
        } else {
            0.0
        }
    };
    let late = |t: f64| if t % 7.0 < 0.05 { 0.05 - t % 7.0 } else { 0.0 };
    for (configured, hz) in [
        (1000.0, 1000.0),
        (100.0, 100.0),
        (2000.0, 2000.0 * 1.01),
        (4000.0, 4000.0 * 0.985),
        (10.0, 10.0),
        (1.0, 1.0),
        (125.0, 125.0),
    ] {
        let delays: [&dyn Fn(f64) -> f64; 5] =
            [&|_| 0.0, &bursts(0.016), &bursts(0.1), &hiccup, &late];
        for (number, delay) in delays.iter().enumerate() {
            let mut watch = RateWatch::new(true);
            let seen = watched(&mut watch, configured, (0.0, 600.0), hz, delay);
            let wrong = seen.iter().find(|(_, wrong)| *wrong);
            assert_eq!(wrong, None, "{configured}, {hz}, delay {number}");
        }
    }
}

#[test]
fn damage_hides_samples_and_regular_holes_are_another_rate() {
    let look = |damage: u32, missed: u32, samples: u32| {
        let mut watch = RateWatch::new(true);
        (0..100).fold(false, |_, second| {
            let seen = StreamCounts {
                samples: second * samples,
                missed: second * missed,
                damage: second * damage,
            };
            watch.look(u64::from(second) * 1_000_000, Some(1000.0), seen)
        })
    };
    assert!(look(0, 0, 950), "a lack that nothing explains");
    assert!(!look(1, 0, 950), "frames are damaged");
    assert!(look(1, 0, 1050), "damage makes no samples");
    assert!(!look(0, 30, 1000), "some are missing, and known to be");
    assert!(
        look(0, 500, 1000),
        "a STIM300 at 500 Hz, configured for 1000: every other one is missing"
    );
}

#[test]
fn silence_begins_anew_and_a_watch_that_is_off_finds_nothing() {
    let mut watch = RateWatch::new(true);
    let mut samples = 0;
    for second in 0..200u32 {
        let silent = second % 20 > 12;
        samples += if silent { 0 } else { 1000 };
        let seen = StreamCounts {
            samples,
            ..StreamCounts::default()
        };
        let rate = (!silent).then_some(1000.0);
        // the second in which the silence ends has no windows
        let wrong = watch.look(u64::from(second) * 1_000_000, rate, seen);
        assert!(!wrong, "{second} s");
    }
    assert!(!RateWatch::new(false).is_due(u64::MAX - 1));
}
