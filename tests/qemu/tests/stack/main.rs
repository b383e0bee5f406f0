//! One flipped bit of the live stack in the STM32F405's own image, while it corrects, and while it
//! learns as well: the words and the judge are those of `tests/upsets`.
//!
//! `STACK_FLIPS` sets how many are tried in each mode. The seed gives the same flips again, unless
//! QEMU gets the processor so late that an interrupt moves.
//!
//! QEMU has no watchdog: where nothing leaves any more, or QEMU gives up since the core locks up,
//! it would reset the board (`hang`).

mod board;
mod trial;

use std::collections::BTreeMap;

use qemu::images::STM32F405;
use upsets::device::Scenario;
use upsets::judge::Verdict;

use board::Moment;
use trial::{Flip, Trials};

/// Flips in each mode without `STACK_FLIPS`.
const FLIPS: u64 = 40;

fn tried(scenario: Scenario) -> Option<Vec<(Flip, Verdict)>> {
    let image = STM32F405.build_or_skip()?;
    let asked = std::env::var("STACK_FLIPS").ok();
    let flips = asked.map_or(FLIPS, |text| text.parse().expect("STACK_FLIPS is a number"));
    let moment = Moment::driven(scenario, &image).expect("it drives");
    let trials = Trials::new(&moment).expect("without a flip all is as before");
    let mut all = Vec::new();
    let mut counts = BTreeMap::new();
    let from = std::env::var("STACK_FROM").map_or(0, |text| text.parse().expect("number"));
    for number in from..from + flips {
        let (flip, verdict) = trials.flipped(number).expect("a trial");
        println!("{number} {verdict:?}: {flip}");
        *counts.entry(verdict).or_insert(0) += 1;
        all.push((flip, verdict));
    }
    let found = Verdict::ALL.map(|verdict| counts.get(&verdict).copied().unwrap_or(0));
    println!("{scenario:?}: {found:?} of {:?}", Verdict::ALL);
    Some(all)
}

#[test]
fn while_it_corrects() {
    tried(Scenario::Frozen);
}

#[test]
fn while_it_learns() {
    tried(Scenario::Learn);
}
