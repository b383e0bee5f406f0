//! A short soak on the desktop.

use soak::disturb::KINDS;
use soak::{Memory, Plan, Report, run};

fn of(seed: u64, seconds: u32, rate: u32) -> Report {
    let mut memory = Box::new(Memory::ZEROED);
    let plan = Plan {
        seed,
        seconds,
        rate,
    };
    run(&mut memory, &plan, &mut ())
}

/// Two hours at 200 Hz: no violation, every kind of disturbance occurs, the learner navigates, and
/// the same seed gives the same bytes.
#[test]
fn two_hours_with_faults_of_every_kind() {
    let report = of(1, 7200, 200);
    println!("{report:?}");
    assert_eq!(report.violation, None);
    for ((kind, _), begun) in KINDS.iter().zip(report.begun) {
        assert!(begun > 0, "{kind:?}: {report:?}");
    }
    assert!(report.corrected > 10_000, "{report:?}");
    assert!(report.navigated > 1000, "{report:?}");
    assert!(report.stored > 0, "{report:?}");
    assert_eq!(report.samples, 7200 * 200);
}

/// At 250 Hz an ADIS of each form of burst can come: no violation, and bursts leave corrected.
#[test]
fn bursts_of_an_adis() {
    let report = of(2, 5400, 250);
    println!("{report:?}");
    assert_eq!(report.violation, None);
    assert!(report.power_ons > 4, "{report:?}");
    assert!(report.corrected_bursts > 10_000, "{report:?}");
}

#[test]
fn the_seed_decides() {
    let [first, again, other] = [7, 7, 8].map(|seed| of(seed, 300, 200));
    assert_eq!(first, again);
    assert!(first.digest != other.digest);
}
