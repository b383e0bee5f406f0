//! STM32H743.

use std::path::PathBuf;

use qemu::boards::Family;
use qemu::emulator::{Asked, Chip, build_or_skip};

use super::*;

const H743: Wires = Wires(["USART6", "USART2", "UART4"]);

fn board() -> PathBuf {
    let family = Family::named("h743").expect("a board");
    family.build().expect("it builds")
}

#[test]
fn it_passes_what_comes() {
    let Some(emulator) = build_or_skip() else {
        return;
    };
    for (format, period) in [(ImuFormat::Stim300, MS - 1250), (ImuFormat::Kvh, MS / 2)] {
        let mut asked = Asked::new(&board(), Chip::H743);
        let frames = frames(format, 200);
        let ends = H743.feed(&mut asked, (60 * MS, &[]), (period, BAUD), &frames);
        let told = run(&emulator, &asked);
        let (sent, _) = H743.sent(&told);
        let expected = desktops(&[], &frames);
        assert!(*sent == expected, "{} of {}", sent.len(), expected.len());
        let late = H743.latencies(&told, &frames, &ends);
        println!("{format:?}: latency {late:.1?} us");
    }
}
