//! Frames of a format without counter or time that get lost: the clock finds them.

use crate::device::Device;
use crate::frames::{Fields, Kind};
use crate::record::configured;
use firmware::app::Config;
use firmware::control::Mode;
use firmware::sample::RawSample;
use firmware::wire::vectornav::{Repr, Values};

/// Runs a sensor for some seconds over a line that delivers in bursts of 64 bytes. Of each ten
/// seconds the first `lost` frames are missing. `real`: samples come in real time. Gives what is
/// missing and how often blocks were given up.
fn run(kind: Kind, seconds: u32, lost: u32, real: bool) -> (u32, u32, u32) {
    run_frames(kind, |n, fields| kind.frame(n, fields), seconds, lost, real)
}

/// The same with frames of another making, configured as this kind is.
fn run_frames(
    kind: Kind,
    frame: impl Fn(u32, Fields) -> Vec<u8>,
    seconds: u32,
    lost: u32,
    real: bool,
) -> (u32, u32, u32) {
    let mut unit = configured(kind);
    unit.correction.mode = Mode::Shadow;
    unit.correction.silence_us = 100_000;
    unit.correction.check_rate = real;
    let mut device = Device::new(Config::of(&unit));
    let rate = kind.rate() as u32;
    let (mut burst, mut dma) = (Vec::new(), Vec::new());
    for n in 0..seconds * rate {
        let fields = Fields {
            accel: [n as i32 % 13, 3, 900],
            ..Fields::default()
        };
        if n < 10 * rate || n % (10 * rate) >= lost {
            burst.extend(frame(n, fields));
        }
        // some frames are late by a fifth of a period
        let random = u64::from(n.wrapping_mul(2_654_435_761) >> 16); // of 16 bits
        let late = (random * 200_000 / u64::from(rate)) >> 16;
        while burst.len() >= 64 {
            dma.extend(burst.drain(..64));
        }
        let due = u64::from(n) * 1_000_000 / u64::from(rate) + late;
        let now = device.time.get();
        device.pass_us(due.saturating_sub(now));
        if dma.is_empty() {
            device.settle();
        } else {
            device.feed(&std::mem::take(&mut dma));
        }
        device.lines.navigation.sent.clear();
    }
    let counters = device.counters();
    (counters.missed, counters.jumps, counters.given_up)
}

#[test]
fn frames_without_a_counter_that_get_lost_are_found() {
    for kind in [Kind::HG4930, Kind::S_CLASS] {
        let (missed, jumps, given_up) = run(kind, 600, 0, true);
        assert_eq!((missed, jumps, given_up), (0, 0, 0), "{kind:?}");
        let (missed, jumps, given_up) = run(kind, 605, 6, true);
        assert_eq!((missed, jumps), (360, 0), "{kind:?}");
        assert!((50..=120).contains(&given_up), "{kind:?} {given_up}");
        // a recording that is sent faster has no clock
        assert_eq!(run(kind, 60, 6, false).0, 0);
    }
}

/// A VectorNav that sends no time stamp is as blind as these. Its messages look like those of one
/// that does.
#[test]
fn vectornav_messages_without_a_time_stamp_that_get_lost_are_found() {
    let increments = |_, fields: Fields| {
        // common group: DeltaTheta alone
        let mut repr = Repr::with_header(Values::Sensors, &[0x01, 0x00, 0x08]).expect("a header");
        repr.sample = RawSample::Floats {
            gyro: [1e-3, 2e-3, 3e-3],
            accel: fields.accel.map(|count| count as f32 * 1e-5),
        };
        let mut bytes = vec![0; 256];
        let len = repr.emit(&mut bytes).expect("room");
        bytes.truncate(len);
        bytes
    };
    let kind = Kind::VECTORNAV;
    assert_eq!(run_frames(kind, increments, 60, 0, true), (0, 0, 0));
    let (missed, jumps, given_up) = run_frames(kind, increments, 65, 60, true);
    assert_eq!((missed, jumps), (360, 0));
    assert!(given_up >= 6, "{given_up}");
}
