//! The application over simulated drives: the target sends what the desktop sends, byte for byte,
//! within its budgets.

use std::time::Duration;

use firmware::wire::ImuFormat;
use qemu::budget::Budgets;
use qemu::committed::Committed;
use qemu::drive::drive;
use qemu::images::{BOARDS, REPLAY};
use qemu::machine::{Clock, NETDUINOPLUS2};
use qemu::protocol::drives;
use qemu::replay::{Pace, config};
use qemu::report::{MINUTES, counted, within};
use qemu::software::{changed, on_desktop, on_target};

#[test]
fn a_drive_of_22_minutes_is_the_same_on_the_target() {
    let Some(image) = REPLAY.build_or_skip() else {
        return;
    };
    let format = ImuFormat::Stim300;
    let records = drive(format, MINUTES * 60).expect("a drive");
    let here = on_desktop(config(format), &records);
    assert!(here.samples > 264_000, "{} samples", here.samples);
    let changed = changed(&records, &here.sent).expect("one length");
    assert!(changed > here.samples as usize, "{changed} bytes corrected");
    let free = (Pace::Record, Clock::Free, false);
    let limit = Duration::from_secs(60);
    let there = on_target(&image, NETDUINOPLUS2, format, free, &records, limit).expect("it runs");
    assert_eq!((here.samples, here.digest), (there.samples, there.digest));
    assert!(here.sent == there.sent);
}

#[test]
fn one_wrong_bit_of_the_input_changes_the_digest() {
    let Some(image) = REPLAY.build_or_skip() else {
        return;
    };
    let format = ImuFormat::Novatel;
    let mut records = drive(format, 5).expect("a drive");
    let here = on_desktop(config(format), &records);
    let last = records.last_mut().expect("some");
    last.bytes[20] ^= 1;
    let free = (Pace::Record, Clock::Free, false);
    let limit = Duration::from_secs(60);
    let there = on_target(&image, NETDUINOPLUS2, format, free, &records, limit).expect("it runs");
    assert_ne!(here.digest, there.digest);
}

#[test]
fn every_format_is_corrected_the_same_and_within_budget() {
    if REPLAY.build_or_skip().is_none() {
        return;
    }
    let budgets = Budgets::read().expect("budgets.toml").application;
    assert_eq!(budgets.len(), drives().len());
    let committed = Committed::read("path").expect("docs/figures");
    for (format, _) in drives() {
        for (pace, column) in [(Pace::Byte, "sample, byte"), (Pace::Dma, "sample, DMA")] {
            let (same, cost) = counted(BOARDS[0], format, pace).expect("it runs");
            println!("{}, {pace:?}: {cost:?}", format.name());
            assert!(same, "{format:?}");
            let near = committed.near(format.name(), column, cost.per_sample);
            near.expect("the figure of the pages");
            within(cost, pace == Pace::Dma, budgets[format.name()]).expect("within budget");
            assert!(
                cost.latency > 200.0 && cost.worst_sample > cost.per_sample,
                "{format:?}: {cost:?} cannot hold a checksum; was nothing counted?"
            );
        }
    }
}
