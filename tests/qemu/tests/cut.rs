//! Cut-through in the board's own image, on the chip model with lines at their bit rate
//! (`judges/stm32f405.py`): how long every byte takes from one line to the other.

use firmware::app::{Config, Hardware};
use firmware::control::Mode;
use firmware::wire::ImuFormat;
use qemu::drive::{Record, drive, hex};
use qemu::images::STM32F405;
use qemu::judges::{ask, python};
use qemu::protocol::{cut_through, set_up_configured};
use qemu::replay::Input;
use qemu::software::on_desktop;

/// Core cycles per second.
const CORE: f64 = 168e6;
/// Duration of a byte at 921 600 bit/s, us.
const BYTE_US: f64 = 10e6 / 921_600.0;
/// Frames until the loop hands over to the interrupt in a gap, and the line has caught up.
const BEGIN: usize = 40;
/// Longest time that the interrupt takes, us.
const INTERRUPT_US: f64 = 1.7;

/// Delays of all bytes of the frames after the first ones, us: from the end of the stop bit on the
/// sensor line to the start of the start bit on the navigation line.
fn delays(format: ImuFormat, seconds: u32, period: u32, mode: Mode) -> Option<Vec<f64>> {
    let (Some(python), Some(built)) = (python(), STM32F405.build_or_skip()) else {
        return None;
    };
    let configuration = cut_through(format);
    let records = drive(format, seconds).expect("a drive");
    let frames: Vec<&Record> = records
        .iter()
        .filter(|r| r.input == Input::Sensor)
        .collect();
    let commands = set_up_configured(&configuration, mode).expect("packets");
    // spaced by the number of samples that come before them
    let mut fixes = Vec::new();
    let mut before = 0u64;
    for record in &records {
        match record.input {
            Input::Sensor => before += 1,
            Input::Gnss => fixes.push((before * u64::from(period), hex(&record.bytes))),
            _ => {}
        }
    }
    let sensor: Vec<_> = frames.iter().map(|frame| hex(&frame.bytes)).collect();
    let asked = serde_json::json!({
        "image": built, "command": commands.iter().map(|c| hex(c)).collect::<Vec<_>>(),
        "sensor": sensor, "period": period, "adis": null, "gnss": fixes, "times": true,
    });
    let output = ask(&python, "stm32f405.py", asked.to_string().as_bytes()).expect("it runs");
    let line = |name: &str| {
        let found = output.iter().find_map(|line| line.strip_prefix(name));
        found.expect("a line").trim().to_owned()
    };
    let times = |name| -> Vec<f64> {
        let numbers = line(name);
        numbers
            .split(' ')
            .map(|n| n.parse().expect("a number"))
            .collect()
    };
    let (came, left) = (times("came "), times("left "));
    assert_eq!(came.len(), left.len(), "every byte leaves once");
    if mode == Mode::Frozen {
        let mut input: Vec<_> = commands
            .into_iter()
            .map(|bytes| Record {
                input: Input::Command,
                at_us: 0,
                bytes,
            })
            .collect();
        input.extend(frames.iter().map(|frame| (*frame).clone()));
        let expected = on_desktop(Config::unconfigured(Hardware::DESKTOP), &input).sent;
        assert!(
            line("navigation ") == hex(&expected),
            "as without cut-through"
        );
    }
    // a message that is not a frame is held until its end, and the frames after it until the line
    // has caught up
    let usual = frames.last().expect("frames").bytes.len();
    let (mut delays, mut at, mut behind) = (Vec::new(), 0, 0);
    for frame in &frames {
        let len = frame.bytes.len();
        behind = if len == usual { behind + 1 } else { 0 };
        if behind > BEGIN {
            let times = came.iter().zip(&left).skip(at).take(len);
            delays.extend(times.map(|(came, left)| (left - came) / CORE * 1e6));
        }
        at += len;
    }
    Some(delays)
}

fn holds(format: ImuFormat, seconds: u32, period: u32, mode: Mode) {
    let Some(delays) = delays(format, seconds, period, mode) else {
        return;
    };
    let least = delays.iter().copied().fold(f64::MAX, f64::min);
    let most = delays.iter().copied().fold(0.0, f64::max);
    println!(
        "{format:?}, {mode:?}: {least:.1} to {most:.1} us of {} bytes",
        delays.len()
    );
    assert!(least >= 2.0 * BYTE_US - 0.1, "{least}");
    assert!(least <= 2.0 * BYTE_US + INTERRUPT_US, "{least}");
    assert!(most <= 3.0 * BYTE_US, "{most}");
    // learning or not: the bit rates differ by 0.9 %, so each further byte of the frame waits 0.1
    // us longer, and nothing else varies
    let growth = 0.11 * longest(format);
    assert!(most - least <= growth + 0.5, "{least} to {most}");
    assert!(most - least <= BYTE_US, "{least} to {most}");
}

/// Longest frame of a format, bytes.
fn longest(format: ImuFormat) -> f64 {
    match format {
        ImuFormat::Stim300 => 28.0,
        ImuFormat::Kvh => 36.0,
        _ => 56.0,
    }
}

/// Cycles in a millisecond.
const MILLISECOND: u32 = 168_000;

#[test]
fn bytes_of_a_stim300_leave_two_bytes_later() {
    holds(ImuFormat::Stim300, 4, MILLISECOND - 210, Mode::Frozen);
}

#[test]
fn bytes_of_a_kvh_leave_two_bytes_later() {
    holds(ImuFormat::Kvh, 1, MILLISECOND / 2, Mode::Frozen);
}

#[test]
fn bytes_of_a_novatel_leave_two_bytes_later() {
    holds(ImuFormat::Novatel, 4, MILLISECOND, Mode::Frozen);
}

#[test]
fn learning_delays_no_byte_of_a_stim300() {
    holds(ImuFormat::Stim300, 4, MILLISECOND - 210, Mode::Learn);
}

#[test]
fn learning_delays_no_byte_of_a_kvh() {
    holds(ImuFormat::Kvh, 1, MILLISECOND, Mode::Learn);
}

#[test]
fn learning_delays_no_byte_of_a_novatel() {
    holds(ImuFormat::Novatel, 2, MILLISECOND, Mode::Learn);
}
