//! One bit in a thousand of a device's memory, alone, and together with another.
//! `cargo run --release -p upsets -- --every 1` tries all of them.

use std::path::Path;
use upsets::child::{Second, Trials};
use upsets::device::{RINGS, Scenario};
use upsets::judge::{Judge, Verdict};
use upsets::parent::{UpsetResults, run};

fn sampled(scenario: Scenario, second: Option<Second>) -> UpsetResults {
    let trials = Trials {
        scenario,
        seconds: 6,
        from: 0,
        every: 1009,
        second,
    };
    let found = run(Path::new(env!("CARGO_BIN_EXE_upsets")), trials, |_, _| {});
    found.expect("the trials run")
}

/// After any upset the device sends only good frames within the limit, or none. Only a flipped
/// count of a ring can send up to the ring's bytes once more.
fn never_harms(found: &UpsetResults) {
    for verdict in [
        Verdict::Beyond,
        Verdict::Forged,
        Verdict::Silent,
        Verdict::Hang,
    ] {
        let again = |name: &str| verdict == Verdict::Forged && name == RINGS;
        let bits: Vec<_> = found
            .bits(verdict)
            .filter(|(name, _)| !again(name))
            .collect();
        assert!(bits.is_empty(), "{verdict:?}: {bits:?}");
    }
    let same = found.verdicts.values();
    let same = same.filter(|verdict| **verdict == Verdict::Same).count();
    assert!(found.verdicts.len() > 600 && same * 4 > found.verdicts.len() * 3);
}

#[test]
fn in_bypass_every_frame_is_whole() {
    let found = sampled(Scenario::Bypass, None);
    never_harms(&found);
    let harmless = [Verdict::Same, Verdict::Lost, Verdict::Fault, Verdict::Check];
    let other = found.verdicts.values().find(|v| !harmless.contains(v));
    assert_eq!(other, None);
}

#[test]
fn with_two_networks() {
    never_harms(&sampled(Scenario::Frozen, None));
}

#[test]
fn while_it_learns() {
    never_harms(&sampled(Scenario::Learn, None));
}

#[test]
fn two_bits_at_once() {
    for second in [Second::Neighbour, Second::Any] {
        never_harms(&sampled(Scenario::Learn, Some(second)));
    }
}

/// The judge detects values beyond the limit, another counter, a missing frame, and an additional
/// frame.
#[test]
fn the_judge_sees() {
    use firmware::sample::RawSample;
    use firmware::wire::{Change, Checked, ImuFormat};
    use upsets::device::{Device, configured};

    let mut device = Device::driven(Scenario::Frozen, 3).expect("a drive");
    let without = device.trial(&[]);
    let configuration = configured(Scenario::Frozen);
    let judge = Judge::new(Scenario::Frozen, &configuration, without.clone()).expect("a stream");
    let judged = |left| judge.judge(device.came(), &left);
    assert_eq!(judged(without.clone()), Verdict::Same);
    let settings = configuration.wire_settings();
    let shifted = |number: usize, counts: i32| {
        let mut left = without.clone();
        let frame = &mut left.after[number];
        let mut checked = Checked::new(ImuFormat::Stim300, frame).expect("a frame");
        let mut sample = checked.read().expect("values").sample;
        if let RawSample::Counts { gyro, .. } = &mut sample {
            gyro[1] += counts;
        }
        let change = Change {
            sample: &sample,
            mark: false,
            settings: &settings,
        };
        checked.change(&change).expect("in range");
        left
    };
    assert_eq!(judged(shifted(10, 1)), Verdict::Recovered);
    let last = without.after.len() - 1;
    assert_eq!(judged(shifted(last, 1)), Verdict::Bounded);
    assert_eq!(judged(shifted(10, 4000)), Verdict::Beyond);
    let mut other = without.clone();
    other.after[10] = other.after[11].clone();
    assert_eq!(judged(other), Verdict::Forged, "the counter is another");
    let mut missing = without.clone();
    missing.after[10].clear();
    assert_eq!(judged(missing), Verdict::Lost);
    let mut silent = without.clone();
    silent.after[last].clear();
    assert_eq!(judged(silent), Verdict::Silent);
    let mut twice = without.clone();
    let frame = twice.after[10].clone();
    twice.after[10] = frame.repeat(3);
    assert_eq!(judged(twice), Verdict::Forged);
}
