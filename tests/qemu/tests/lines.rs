//! The boards' own images in QEMU at their serial lines: the tests run what is flashed to a board.

use std::path::Path;
use std::thread;
use std::time::Duration;

use firmware::wire::ImuFormat;
use firmware::wire::command::{CrashKind, fault};
use qemu::budget::Budgets;
use qemu::drive::drive;
use qemu::images::{BOARDS, Board};
use qemu::live::Live;
use qemu::memory::{Memory, address};
use qemu::protocol::{drives, health, learn_from_reference, reset, serve};
use qemu::size::Size;
use qemu::software::changed;

fn corrects(board: Board, format: ImuFormat, seconds: u32) {
    let Some(image) = board.image.build_or_skip() else {
        return;
    };
    let records = drive(format, seconds).expect("a drive");
    let served = serve(board, &image, &records).expect("the board serves");
    let what = format!("{}, {format:?}", board.name);
    let pairs = served.sent.iter().zip(&served.expected);
    let equal = pairs
        .take_while(|(sent, expected)| sent == expected)
        .count();
    assert!(
        served.sent == served.expected,
        "{what}: {} of {} bytes, the first {equal} are equal; {:?}",
        served.sent.len(),
        served.expected.len(),
        served.health
    );
    let changed = changed(&records, &served.sent).expect("one length");
    assert!(
        changed > served.samples,
        "{what}: {changed} bytes corrected"
    );

    fits(board, &image, &served.memory, &what);
}

/// Its variables and its stack are within the budget, and its stack within the bound that follows
/// from its instructions.
fn fits(board: Board, image: &Path, memory: &Memory, what: &str) {
    let stack = memory.stack_high_water().expect("painted");
    let ram = Size::of(image).expect("an ELF file").ram;
    let budgets = Budgets::read().expect("budgets.toml");
    let limit = budgets.image[board.image.name].ram_and_stack;
    let limit = limit.expect("a board has a budget for its stack");
    assert!(ram + stack <= limit, "{what}: {ram} + {stack} bytes");
    println!("{what}: {stack} bytes of stack");
    assert!(
        stack > 1000,
        "{what}: {stack} bytes cannot hold the application"
    );
}

#[test]
fn learning_from_references_fits_into_the_small_image() {
    let Some(image) = BOARDS[3].image.build_or_skip() else {
        return;
    };
    let records = drive(ImuFormat::Stim300, 44).expect("a drive");
    let (memory, used) = learn_from_reference(BOARDS[3], &image, &records).expect("it learns");
    assert_eq!(used, 1);
    fits(BOARDS[3], &image, &memory, "learning");
}

#[test]
fn stm32f405_corrects_every_format_as_the_desktop_does() {
    for (format, seconds) in drives() {
        corrects(BOARDS[0], format, seconds);
    }
}

#[test]
fn other_boards_do_the_same() {
    for board in [BOARDS[1], BOARDS[2], BOARDS[3]] {
        corrects(board, drives()[0].0, drives()[0].1);
    }
}

/// QEMU's SPI controller has no device at its bus. The search for an ADIS finds nothing and delays
/// nothing, and the missing sensor is reported.
#[test]
fn nobody_at_the_spi_and_nothing_on_the_sensor_line_is_told_as_silence() {
    let Some(image) = BOARDS[0].image.build_or_skip() else {
        return;
    };
    let mut live = Live::start(BOARDS[0], &image).expect("it starts");
    let silent = (0..50).any(|_| {
        thread::sleep(Duration::from_millis(100));
        health(&mut live.command).expect("it answers").faults & fault::SILENT != 0
    });
    assert!(silent);
    thread::sleep(Duration::from_millis(500)); // some looks more
    assert!(health(&mut live.command).is_ok());
    let log = live
        .memory()
        .and_then(|memory| memory.log())
        .expect("a log");
    assert!(!log.iter().any(|line| line.contains("ADIS")), "{log:?}");
}

#[test]
fn the_log_of_a_board_is_read_from_its_memory() {
    let Some(image) = BOARDS[0].image.build_or_skip() else {
        return;
    };
    let mut live = Live::start(BOARDS[0], &image).expect("it starts");
    let mut log = Vec::new();
    for _ in 0..100 {
        thread::sleep(Duration::from_millis(100));
        log = live
            .memory()
            .and_then(|memory| memory.log())
            .unwrap_or_default(); // not begun yet
        if log.len() > 1 {
            break;
        }
    }
    let [line, reset] = &log[..] else {
        panic!("two lines, not {log:?}")
    };
    assert!(
        line.contains("lrnn ") && line.contains("simulator"),
        "{line}"
    );
    assert!(reset.contains("reset by"), "{reset}");
}

/// The program runs its `main` once more with 16 bytes of stack left. QEMU has no memory below RAM
/// either: the board restarts and reports why.
#[test]
fn a_stack_that_overflows_is_told_after_the_reset() {
    for board in [BOARDS[0], BOARDS[3]] {
        let Some(image) = board.image.build_or_skip() else {
            return;
        };
        let bytes = std::fs::read(&image).expect("it");
        let symbol = |name| address(&bytes, name).expect("a symbol") as u32;
        let end = symbol("_stack_end");
        let mut live = Live::start(board, &image).expect("it starts");
        assert_eq!(reset(&mut live.command).expect("an answer").crash, None);
        let mut debugger = live.debugger().expect("it stops");
        debugger.set(13, end + 16).expect("the stack pointer");
        debugger.set(15, symbol("main") & !1).expect("the place");
        debugger.go_on().expect("it goes on");
        let crash = reset(&mut live.command).expect("an answer").crash;
        let crash = crash.expect("a record");
        assert_eq!(crash.kind, CrashKind::StackOverflow, "{crash:?}");
        // an interrupt that comes first cannot stack its frame: then the core knows no address
        let knows_address = crash.cfsr >> 15 & 1 == 1;
        assert!(
            !knows_address || (1..=64).contains(&(end - crash.bfar)),
            "{crash:?}"
        );
        assert_eq!((crash.number, crash.starts), (1, 1));
    }
}
