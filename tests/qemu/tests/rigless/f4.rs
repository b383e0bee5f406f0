//! STM32F405 and F446 on an STM32F427.

use std::path::{Path, PathBuf};

use qemu::boards::Family;
use qemu::emulator::{Asked, Chip, build_or_skip};
use qemu::images::{STM32F405, STM32F405_WINDOW};
use qemu::protocol::set_up;

use super::*;

const F405: Wires = Wires(["USART1", "USART2", "UART4"]);
const F446: Wires = Wires(["USART1", "USART3", "USART2"]);

fn board(name: &str) -> PathBuf {
    let family = Family::named(name).expect("a board");
    family.build().expect("it builds")
}

/// What leaves equals the desktop's.
fn corrects(emulator: &Path, image: &Path, wires: &Wires, format: ImuFormat, period: u64) {
    let mut asked = Asked::new(image, Chip::F427);
    if wires.0 == F446.0 {
        asked.crystal = 8_000_000;
    }
    let frames = frames(format, 200);
    let requests = set_up().expect("requests");
    let ends = wires.feed(&mut asked, (60 * MS, &requests), (period, BAUD), &frames);
    let told = run(emulator, &asked);
    let (sent, _) = wires.sent(&told);
    let expected = desktops(&requests, &frames);
    assert!(*sent == expected, "{} of {}", sent.len(), expected.len());
    let late = wires.latencies(&told, &frames, &ends);
    println!("{}: {format:?}: latency {late:.1?} us", image.display());
}

#[test]
fn ours_sends_what_the_desktop_sends() {
    let Some(emulator) = build_or_skip() else {
        return;
    };
    for image in [STM32F405, STM32F405_WINDOW] {
        let image = image.build().expect("it builds");
        for (format, period) in [
            (ImuFormat::Stim300, MS - 1250),
            (ImuFormat::Kvh, MS / 2),
            (ImuFormat::Novatel, MS),
        ] {
            corrects(&emulator, &image, &F405, format, period);
        }
    }
}

#[test]
fn boards_over_embassy_send_what_the_desktop_sends() {
    let Some(emulator) = build_or_skip() else {
        return;
    };
    for (name, wires) in [("f405", F405), ("f446", F446)] {
        for (format, period) in [(ImuFormat::Stim300, MS - 1250), (ImuFormat::Kvh, MS / 2)] {
            corrects(&emulator, &board(name), &wires, format, period);
        }
    }
}
