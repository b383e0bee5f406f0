//! STM32F405 and F446 on an STM32F427: it has the same clocks, UARTs, streams, timers and watchdog.
//! It has no register DCKCFGR2, which our F446 leaves at its reset value, and no flash that can be
//! written.

use std::path::{Path, PathBuf};

use firmware::configuration::{Configuration, Parity, SerialLines};
use qemu::boards::Family;
use qemu::emulator::{Chip, RunRequest, build_or_skip};
use qemu::images::{STM32F405, STM32F405_WINDOW};
use qemu::protocol::{configure, set_up};

use super::*;

const F405: Wires = Wires(["USART1", "USART2", "UART4"]);
const F446: Wires = Wires(["USART1", "USART3", "USART2"]);

fn board(name: &str) -> PathBuf {
    let family = Family::named(name).expect("a board");
    family.build().expect("it builds")
}

fn asked(image: &Path, wires: &Wires) -> RunRequest {
    let mut asked = RunRequest::new(image, Chip::F427);
    if wires.0 == F446.0 {
        asked.crystal = 8_000_000;
    }
    asked
}

/// No access that the manual forbids, and no reset.
fn allowed(outcome: &Outcome) {
    assert_eq!(outcome.all("told").collect::<Vec<_>>(), [""; 0]);
    assert_eq!(outcome.all("refused").collect::<Vec<_>>(), [""; 0]);
    assert_eq!(outcome.resets, []);
}

/// The output equals the desktop's. Returns the latency: median and maximum, us.
fn corrects(
    emulator: &Path,
    image: &Path,
    wires: &Wires,
    format: ImuFormat,
    period: u64,
) -> [f64; 2] {
    let mut asked = asked(image, wires);
    let frames = frames(format, 200);
    let requests = set_up().expect("requests");
    let ends = wires.feed(&mut asked, (60 * MS, &requests), (period, BAUD), &frames);
    let outcome = run(emulator, &asked);
    let (sent, _) = wires.sent(&outcome);
    let expected = desktops(&requests, &frames);
    assert!(*sent == expected, "{} of {}", sent.len(), expected.len());
    allowed(&outcome);
    let late = wires.latencies(&outcome, &frames, &ends);
    println!("{}: {format:?}: latency {late:.1?} us", image.display());
    late
}

const DRIVES: [(ImuFormat, u64); 2] = [(ImuFormat::Stim300, MS - 1250), (ImuFormat::Kvh, MS / 2)];

#[test]
fn ours_sends_what_the_desktop_sends() {
    let Some(emulator) = build_or_skip() else {
        return;
    };
    for image in [STM32F405, STM32F405_WINDOW] {
        let image = image.build().expect("it builds");
        for (format, period) in DRIVES {
            let late = corrects(&emulator, &image, &F405, format, period);
            assert!(late[0] < 15.0 && late[1] < 20.0, "{late:?}");
        }
        let late = corrects(&emulator, &image, &F405, ImuFormat::Novatel, MS);
        assert!(late[1] < 20.0, "{late:?}");
    }
}

#[test]
fn boards_over_embassy_send_what_the_desktop_sends() {
    let Some(emulator) = build_or_skip() else {
        return;
    };
    for (name, wires) in [("f405", F405), ("f446", F446)] {
        for (format, period) in DRIVES {
            let late = corrects(&emulator, &board(name), &wires, format, period);
            assert!(late[0] < 30.0 && late[1] < 60.0, "{late:?}");
        }
    }
}

/// Without a crystal each board runs on the internal oscillator, at the same rates.
#[test]
fn without_a_crystal_each_runs() {
    let Some(emulator) = build_or_skip() else {
        return;
    };
    let ours = STM32F405.build().expect("it builds");
    for (image, wires) in [(ours, F405), (board("f405"), F405), (board("f446"), F446)] {
        let mut asked = RunRequest::new(&image, Chip::F427);
        asked.crystal = 0;
        let frames = frames(ImuFormat::Kvh, 50);
        wires.feed(&mut asked, (100 * MS, &[]), (MS, BAUD), &frames);
        let outcome = run(&emulator, &asked);
        let (sent, times) = wires.sent(&outcome);
        assert!(*sent == desktops(&[], &frames), "{}", image.display());
        let byte = times.windows(2).map(|two| two[1] - two[0]).min();
        assert_eq!(byte, Some(10_952), "46 cycles of 42 MHz a bit");
    }
}

/// The configured bit rate, parity and stop bits are set: the duration of a sent byte shows it.
#[test]
fn lines_are_opened_as_configured() {
    let Some(emulator) = build_or_skip() else {
        return;
    };
    let mut configuration = Configuration {
        lines: SerialLines {
            sensor_baud: 1_843_200,
            parity: Parity::Odd,
            two_stop_bits: true,
            ..SerialLines::DEFAULT
        },
        ..Configuration::default()
    };
    configuration.correction.check_rate = false;
    let requests = configure(&configuration).expect("packets");
    for image in [STM32F405.build().expect("it builds"), board("f405")] {
        let mut asked = asked(&image, &F405);
        let frames = frames(ImuFormat::Stim300, 60);
        F405.feed(&mut asked, (60 * MS, &requests), (MS, 1_826_087), &frames);
        let done = run(&emulator, &asked);
        let (sent, times) = F405.sent(&done);
        let bytes: Vec<u8> = frames
            .iter()
            .flat_map(|frame| frame.bytes.clone())
            .collect();
        assert!(*sent == bytes, "{}: {}", image.display(), sent.len());
        let byte = times.windows(2).map(|two| two[1] - two[0]).min();
        assert_eq!(byte, Some(6571), "12 bits of 23 cycles of 42 MHz");
    }
}

/// The counter that wakes the loop is stopped, so nobody feeds the independent watchdog, which
/// resets the chip 10 s later. After that bytes pass.
#[test]
fn a_loop_that_sleeps_for_ever_is_reset() {
    let Some(emulator) = build_or_skip() else {
        return;
    };
    for (name, wires, counter) in [("f405", F405, 0x4000_0C00), ("f446", F446, 0x4000_0C00)] {
        let mut asked = asked(&board(name), &wires);
        asked.writes.push((300 * MS, counter, 0));
        let frames = frames(ImuFormat::Kvh, 50);
        wires.feed(&mut asked, (10_400 * MS, &[]), (MS, BAUD), &frames);
        let outcome = run(&emulator, &asked);
        let [(at, ref why)] = outcome.resets[..] else {
            panic!("{name}: {:?}", outcome.resets);
        };
        assert!(why.contains("IWDG"), "{name}: {why}");
        assert!((10_250..10_350).contains(&(at / MS)), "{name}: {at}");
        assert!(*wires.sent(&outcome).0 == desktops(&[], &frames), "{name}");
    }
}
