//! One flipped bit of the live stack in the STM32F405's own image, while it corrects, and while it
//! learns as well. Words and judge are those of `tests/upsets`.
//!
//! The board is stopped in the frame path, in the learner, and in the frame path that has
//! interrupted the learner. `STACK_FLIPS` sets how many bits are tried in each mode. Most numbers
//! give the same flip each time; some move with an interrupt, since QEMU runs in real time.

mod board;
mod trial;

use qemu::images::STM32F405;
use upsets::device::Scenario;
use upsets::judge::Verdict;

use board::Moment;
use trial::Trials;

/// Flips in each mode without `STACK_FLIPS`.
const FLIPS: usize = 12;

/// After any flip only good frames within the limit leave, or none. Where none leave any more, the
/// watchdog would reset the board, which QEMU does not have.
fn never_harms(scenario: Scenario) {
    let Some(image) = STM32F405.build_or_skip() else {
        return;
    };
    let asked = std::env::var("STACK_FLIPS").ok();
    let flips = asked.map_or(FLIPS, |text| text.parse().expect("STACK_FLIPS is a number"));
    let moment = Moment::driven(scenario, &image).expect("it drives");
    let trials = Trials::new(&moment).expect("without a flip all is as before");
    let (mut verdicts, mut harm) = (Vec::new(), Vec::new());
    for number in 0..flips {
        let (flip, verdict) = trials.flipped(number as u64).expect("a trial");
        println!("{number} {verdict:?}: {flip}");
        verdicts.push(verdict);
        if matches!(verdict, Verdict::Beyond | Verdict::Forged) {
            harm.push(format!("{number} {verdict:?}: {flip}"));
        }
    }
    for verdict in Verdict::ALL {
        let count = verdicts.iter().filter(|is| **is == verdict).count();
        println!("{scenario:?}, {verdict:?}: {count} of {flips}");
    }
    assert!(harm.is_empty(), "{harm:?}");
    let same = verdicts.iter().filter(|is| **is == Verdict::Same).count();
    assert!(same * 2 > flips, "{same} of {flips} as without");
}

#[test]
fn while_it_corrects() {
    never_harms(Scenario::Frozen);
}

#[test]
#[ignore = "its drive takes minutes: --run-ignored all"]
fn while_it_learns() {
    never_harms(Scenario::Learn);
}
