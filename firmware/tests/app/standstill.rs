//! Activation `Standstill`: what counts as a standstill, and what does not.

use crate::activation::{Act, BEGINS, BIAS, ENDS, Knows, LEARN, config, drive, fastest, knows};
use firmware::app::Activation;

/// A standstill counts where no alignment is reported, if samples and receiver agree.
#[test]
fn a_standstill_counts_where_no_alignment_is_reported() {
    for (activation, counts) in [
        (Activation::Standstill, true),
        (Activation::Commanded, false),
    ] {
        let stands = Knows {
            still_s: 50,
            ..knows(20)
        };
        let seen = drive(
            config(activation),
            stands,
            &[LEARN, (0, Act::Fixes(Some(20)))],
        );
        let first = seen.force.iter().position(|f| *f != 0.0);
        assert_eq!(first.is_some(), counts);
        if let Some(first) = first {
            assert!((52..56).contains(&first), "{first}");
            assert!(seen.force[first..].iter().all(|f| *f == BIAS));
            assert!(seen.error_m < 10.0, "{}", seen.error_m);
        }
    }
}

/// A smooth cruise looks like a standstill to the samples. The receiver knows better, and when it
/// says nothing, the correction may not jump.
#[test]
fn a_cruise_is_no_standstill() {
    let still = || Knows {
        still_s: 50,
        ..knows(20)
    };
    let standstill = || config(Activation::Standstill);
    let slew = standstill().slew.accel;
    for speed in [10_000, 101] {
        let cruise = [LEARN, (0, Act::Fixes(Some(speed)))];
        let seen = drive(standstill(), still(), &cruise);
        assert!(seen.force.iter().all(|f| *f == 0.0), "{speed} mm/s");
    }
    // it has driven off, and then the receiver falls silent
    let silent = [
        LEARN,
        (0, Act::Fixes(Some(10_000))),
        (100, Act::Fixes(None)),
    ];
    let seen = drive(standstill(), still(), &silent);
    assert!(seen.force[..101].iter().all(|f| *f == 0.0));
    assert!(fastest(&seen.force) < 1.01 * slew);
    assert_eq!(seen.force[300], BIAS);
    // where alignments are reported, the correction does not jump at a stop
    let script = [LEARN, BEGINS, ENDS, (0, Act::Fixes(Some(20)))];
    let stops = Knows {
        still_s: 400,
        ..knows(380)
    };
    let seen = drive(standstill(), stops, &script);
    assert!(fastest(&seen.force) < 1.01 * slew);
    assert_eq!(*seen.force.last().expect("seconds"), BIAS);
}
