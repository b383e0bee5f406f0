//! The serial lines of `firmware/boards/f405`, whose bytes DMA moves over `embassy-stm32`: without
//! a pause, with damaged bytes, reopened, and in broken models.

use std::path::PathBuf;

use firmware::wire::command::Request;
use qemu::boards::Family;
use qemu::protocol::packet_of;
use serde_json::{Value, json};

use super::adis::counters;
use super::*;

/// Cycles of a byte at [`BAUD`], as the model's sensor sends it.
const BYTE: u32 = 1823;

fn f405() -> Option<(PathBuf, PathBuf)> {
    let python = python()?;
    let board = Family::named("f405").expect("a board");
    Some((python, board.build().expect("it builds")))
}

fn corrected(tools: &(PathBuf, PathBuf), frames: &[Record], period: u32, world: &Value) -> Done {
    let set_up = set_up().expect("requests");
    run_in(&tools.0, &tools.1, &set_up, frames, (period, BAUD), world)
}

/// A continuous stream of bytes: the line is never idle, so the loop finds them once a millisecond.
/// None is lost, and they leave without a pause. The output line is 0.9 % slower than the input, so
/// each byte waits longer than the one before.
#[test]
fn a_line_without_a_pause_loses_nothing() {
    let Some(tools) = f405() else { return };
    let mut frames = frames(ImuFormat::Kvh, 1);
    frames.truncate(300);
    let period = frames[0].bytes.len() as u32 * BYTE;
    let done = corrected(&tools, &frames, period, &json!({}));
    assert!(done.sent == desktops(&frames), "{}", done.sent.len() / 2);
    let late = (0..done.came.len()).map(|n| done.left[n] - done.came[n]);
    let most = late.skip(done.came.len() / 4).fold(0.0, f64::max) / 168.0;
    println!("latency of a byte at most {most:.0} us; {:?}", done.served);
    assert!(most < 3500.0, "{most}");
    assert!(done.served(SENSOR) < 3, "{:?}", done.served);
}

/// Noise, a wrong stop bit and a lost byte are reported once each, and the stream goes on: every
/// complete frame leaves, and the output equals that of our drivers. Three frames identify the
/// format and are not counted.
#[test]
fn an_error_of_the_line_costs_no_other_frame() {
    let (Some(tools), Some(ours)) = (f405(), STM32F405_WINDOW.build_or_skip()) else {
        return;
    };
    let mut frames = frames(ImuFormat::Kvh, 1);
    frames.truncate(160);
    let damage = [(60, 5, "noise"), (80, 35, "framing"), (120, 17, "overrun")];
    let request = hex(&packet_of(1, &Request::GetCounters).expect("a packet"));
    let world = json!({"damage": damage, "ask": [request]});
    let [theirs, ours] = [tools.1.clone(), ours].map(|image| {
        let tools = (tools.0.clone(), image);
        corrected(&tools, &frames, MILLISECOND / 2, &world)
    });
    for (name, done) in [("theirs", &theirs), ("ours", &ours)] {
        let counted = counters(&done.command);
        println!("{name}: {counted:?}");
        assert_eq!(counted.lost, 3, "{name}: {counted:?}");
        assert_eq!(counted.frames, 160 - 3 - 1, "{name}: {counted:?}");
    }
    // once per frame when the line falls idle, and once per error
    let served = theirs.served(SENSOR);
    assert!((160..=163).contains(&served), "{served}");
    assert!(
        theirs.sent == ours.sent,
        "{} {}",
        theirs.sent.len(),
        ours.sent.len()
    );
}

/// The core stalls for 8 ms, as while flash is erased, and the stream overwrites bytes that nobody
/// has read. That is reported once. Only the overwritten frames are missing.
#[test]
fn bytes_overwritten_in_the_ring_are_reported() {
    let Some(tools) = f405() else { return };
    let mut frames = frames(ImuFormat::Kvh, 1);
    frames.truncate(160);
    let stall = 8 * MILLISECOND; // 16 frames, 576 bytes
    let request = hex(&packet_of(1, &Request::GetCounters).expect("a packet"));
    let world = json!({"stalls": [[60 * MILLISECOND / 2, stall]], "ask": [request]});
    let done = run_in(
        &tools.0,
        &tools.1,
        &[],
        &frames,
        (MILLISECOND / 2, BAUD),
        &world,
    );
    let counted = counters(&done.command);
    assert_eq!(counted.lost, 1, "{counted:?}");
    assert!(counted.frames >= 160 - 3 - 18, "{counted:?}");
    let after: String = frames[78..].iter().map(|of| hex(&of.bytes)).collect();
    assert!(done.sent.ends_with(&after), "{}", done.sent.len() / 72);
}

/// Another rate, parity and two stop bits, as configured in the unit file.
#[test]
fn lines_over_their_driver_are_reopened() {
    let Some(tools) = f405() else { return };
    let frames = frames(ImuFormat::Stim300, 1);
    let frames = &frames[..200];
    let bytes: String = frames.iter().map(|frame| hex(&frame.bytes)).collect();
    for (parity, two_stop_bits, bits) in [(Parity::Odd, true, 12), (Parity::Even, false, 11)] {
        let mut configuration = Configuration {
            lines: SerialLines {
                sensor_baud: 1_843_200,
                parity,
                two_stop_bits,
                receiver_baud: 9600,
                ..SerialLines::DEFAULT
            },
            ..Configuration::default()
        };
        configuration.correction.check_rate = false;
        let commands = configure(&configuration).expect("packets");
        let pace = (MILLISECOND, 1_826_087);
        let done = run_in(&tools.0, &tools.1, &commands, frames, pace, &json!({}));
        let expected = [(bits, 46), (bits, 23), (10, 4375), (10, 46)];
        assert_eq!(done.lines, expected);
        assert!(done.served(SENSOR) > 150, "{:?}", done.served);
        assert!(done.sent == bytes, "{parity:?}: {}", done.sent);
    }
}

/// The output shows when what the lines rely on is broken: a ring that wraps at its end, and an
/// interrupt when the line is idle.
#[test]
fn broken_rings_and_lines_are_noticed() {
    let Some(tools) = f405() else { return };
    let mut frames = frames(ImuFormat::Kvh, 1);
    frames.truncate(100);
    let run = |broken: Option<&str>| {
        let world = json!({"break": broken});
        corrected(&tools, &frames, MILLISECOND / 2, &world)
    };
    let whole = run(None);
    assert!(whole.sent == desktops(&frames));
    assert!(run(Some("dma-no-wrap")).sent.len() < whole.sent.len() / 2);
    let never_idle = run(Some("uart-no-idle"));
    assert_eq!((never_idle.served(SENSOR), whole.served(SENSOR)), (0, 100));
}
