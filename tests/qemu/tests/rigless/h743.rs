//! The board `h743` on an STM32H743.

use std::path::PathBuf;
use std::sync::LazyLock;

use firmware::configuration::{Configuration, record};
use firmware::control::Mode;
use firmware::store::{Content, Progress, Store};
use firmware::wire::adis::Burst;
use qemu::boards::Family;
use qemu::emulator::{Chip, RunRequest, build_or_skip};
use qemu::protocol::set_up_configured;
use qemu::replay::nets;
use test_bench::flash::Flash;

use super::*;

/// The command link is USB, which the emulator does not have.
const H743: Wires = Wires(["USART6", "USART2", "UART4"]);
/// The two slots of the store.
const STORE: u64 = 0x081C_0000;
const SLOT: usize = 0x2_0000;

fn board() -> PathBuf {
    static BOARD: LazyLock<PathBuf> = LazyLock::new(|| {
        let family = Family::named("h743").expect("a board");
        built_copy("h743", || family.build())
    });
    BOARD.clone()
}

/// A unit whose samples are corrected from power-on.
fn unit() -> Configuration {
    let mut configuration = Configuration::default();
    configuration.correction.check_rate = false;
    configuration.correction.mode = Mode::Frozen;
    configuration
}

/// The flash of a device that has stored this configuration and its networks: once, or until a slot
/// has no room left. The other slot holds no record.
fn stored(configuration: &Configuration, full: bool) -> Vec<u8> {
    // the words of an STM32H7, never erased
    let flash = Flash::<SLOT, 32>::new(2 * SLOT);
    let mut store = Store::new(flash).expect("room");
    let (nets, record) = (nets(), record::encode(configuration));
    let content = Content::new(&nets, &record);
    store.save(&content).expect("a flash that works");
    while full && store.begin(&content).is_ok() {
        while store.go_on(&content).expect("it works") == Progress::GoesOn {}
    }
    store.into_inner().bytes
}

fn digits(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Clocks, DMA and both UARTs work: the input leaves unchanged. The emulator refuses DMA accesses
/// to core-coupled memory.
#[test]
fn it_passes_what_comes() {
    let Some(emulator) = build_or_skip() else {
        return;
    };
    for (format, period) in [(ImuFormat::Stim300, MS - 1250), (ImuFormat::Kvh, MS / 2)] {
        let mut asked = RunRequest::new(&board(), Chip::H743);
        let frames = frames(format, 200);
        let ends = H743.feed(&mut asked, (60 * MS, &[]), (period, BAUD), &frames);
        let outcome = run(&emulator, &asked);
        let (sent, _) = H743.sent(&outcome);
        let expected = desktops(&[], &frames);
        assert!(*sent == expected, "{} of {}", sent.len(), expected.len());
        let late = H743.latencies(&outcome, &frames, &ends);
        println!("h743: {format:?}: latency {late:.1?} us");
        assert!(late[0] < 25.0 && late[1] < 60.0, "{late:?}");
        forbidden(&outcome);
    }
}

/// Checks the accesses that the manual forbids, as the models report them. Both are the driver's,
/// and harmless (docs/BOARDS.md).
fn forbidden(outcome: &Outcome) {
    let registers = outcome.all("told").map(|line| {
        let words = line.split(' ').take(2);
        words.collect::<Vec<_>>().join(" ")
    });
    assert_eq!(registers.collect::<Vec<_>>(), ["RCC BDCR", "RCC PLLCKSELR"]);
    assert_eq!(outcome.all("refused").count(), 0, "{:?}", outcome.lines);
    assert_eq!(outcome.resets, []);
}

/// The store in the second bank is found, and the networks in it correct the samples.
#[test]
fn what_was_stored_corrects() {
    let Some(emulator) = build_or_skip() else {
        return;
    };
    let requests = set_up_configured(&unit(), Mode::Frozen).expect("requests");
    let mut asked = RunRequest::new(&board(), Chip::H743);
    asked.flash.push((STORE, digits(&stored(&unit(), false))));
    let frames = frames(ImuFormat::Stim300, 200);
    let ends = H743.feed(&mut asked, (60 * MS, &[]), (MS, BAUD), &frames);
    let outcome = run(&emulator, &asked);
    let (sent, _) = H743.sent(&outcome);
    let expected = desktops(&requests, &frames);
    assert_ne!(expected, desktops(&[], &frames), "nothing is corrected");
    assert!(*sent == expected, "{} of {}", sent.len(), expected.len());
    println!(
        "corrected: {:.1?}",
        H743.latencies(&outcome, &frames, &ends)
    );
}

/// Where a slot has no room for one more record, the board erases the other one at power-on and
/// writes the record there: a sector is erased in 1 s, and a word of 32 bytes can be written once.
/// The record is good, and is found after a reset.
#[test]
fn a_full_store_is_renewed_and_survives_a_reset() {
    let Some(emulator) = build_or_skip() else {
        return;
    };
    let flash = stored(&unit(), true);
    let mut before = Store::new(Flash::<SLOT, 32>::holding(flash.clone())).expect("room");
    let before = before.load().expect("this version").expect("a record");
    let mut asked = RunRequest::new(&board(), Chip::H743);
    asked.instructions = 40_000_000; // the core waits most of the time
    asked.flash.push((STORE, digits(&flash)));
    asked.memory.push((STORE, 2 * SLOT as u64));
    asked.resets.push(1500 * MS);
    let frames = frames(ImuFormat::Stim300, 50);
    H743.feed(&mut asked, (1600 * MS, &[]), (MS, BAUD), &frames);
    let outcome = run(&emulator, &asked);
    assert_eq!(outcome.resets.len(), 1, "{:?}", outcome.resets);
    let requests = set_up_configured(&unit(), Mode::Frozen).expect("requests");
    assert!(H743.sent(&outcome).0 == desktops(&requests, &frames));
    let after_reset = &outcome.memory[0];
    assert!(after_reset[..SLOT] == flash[..SLOT], "the old record stays");
    let mut after = Store::new(Flash::<SLOT, 32>::holding(after_reset.clone())).expect("room");
    let after = after.load();
    let after = after.expect("this version").expect("a record");
    assert_eq!(after.generation, before.generation + 1);
    assert!(after.nets == before.nets && after.record == before.record);
    assert!(
        after_reset[SLOT + SLOT / 2..]
            .iter()
            .all(|byte| *byte == 0xFF)
    );
}

/// Without a clock from the probe the board runs on the internal oscillator.
#[test]
fn without_a_crystal_it_runs() {
    let Some(emulator) = build_or_skip() else {
        return;
    };
    let mut asked = RunRequest::new(&board(), Chip::H743);
    asked.crystal = 0;
    let frames = frames(ImuFormat::Kvh, 50);
    H743.feed(&mut asked, (100 * MS, &[]), (MS, BAUD), &frames);
    let outcome = run(&emulator, &asked);
    assert!(H743.sent(&outcome).0 == desktops(&[], &frames));
}

/// An ADIS16507 at the SPI is found and read at its data-ready.
#[test]
fn an_adis_is_read() {
    let Some(emulator) = build_or_skip() else {
        return;
    };
    let bursts: Vec<Vec<u8>> = (0..100)
        .map(|counter| {
            let burst = Burst {
                gyro: [i32::from(counter), -70_000, 3],
                accel: [5, 6_000_000, -i32::from(counter)],
                temperature: 250,
                counter,
                ..Burst::default()
            };
            burst.emit32().to_vec()
        })
        .collect();
    let mut asked = RunRequest::new(&board(), Chip::H743);
    let at = |n: usize| 900 * MS + n as u64 * MS;
    let timed = bursts.iter().enumerate();
    let timed: Vec<_> = timed.map(|(n, burst)| (at(n), digits(burst))).collect();
    asked.adis = Some(serde_json::json!({
        "product": 16507, "range": 3, "hz": 1_000_000, "bursts": timed,
        "select": ["GPIOD", 14], "ready": ["GPIOF", 12],
    }));
    asked.until = at(bursts.len()) + 5 * MS;
    asked.listen.push("USART2");
    let outcome = run(&emulator, &asked);
    assert_eq!(outcome.all("adis").collect::<Vec<_>>(), [""; 0]);
    let sent = &outcome.left["USART2"].0;
    assert!(*sent == bursts.concat(), "{} of {}", sent.len(), 40 * 100);
}
