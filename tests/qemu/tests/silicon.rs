//! The bench image for boards. QEMU has no cycle counter: the image does every piece of work there
//! and reports that nothing was counted. On a model of other chips (`judges/stm32bench.py`) the
//! same image detects the chip.

use std::thread;
use std::time::Duration;

use qemu::budget::Budgets;
use qemu::images::{BENCH, BOARDS, Board};
use qemu::judges::{ask, python};
use qemu::live::Live;
use qemu::memory::Memory;

const OWN: &str = ", the kernel for this core";

/// The first five lines: chip, clock, flash, caches, memory; each contains the text given for it.
fn begins(log: &[String], lines: [&str; 5]) {
    assert!(log.len() > lines.len(), "{log:?}");
    for (line, wanted) in log.iter().zip(lines) {
        assert!(line.contains(wanted), "{line} | {wanted}");
    }
    assert!(log[0].starts_with("lrnn bench "), "{log:?}");
}

/// Every piece of work has a line: its name, `ending`, and which kernel is for this core.
fn works(lines: &[String], own_form: &str, ending: fn(&str) -> bool) {
    let (mut done, mut own) = (Vec::new(), Vec::new());
    for line in lines {
        let short = line.strip_suffix(OWN).unwrap_or(line);
        let (name, rest) = short.split_once(' ').expect(line);
        assert!(ending(rest), "{line}");
        done.push(name);
        if short.len() < line.len() {
            own.push(name);
        }
    }
    let expected = ["step", "gradient", "descent"].map(|work| work.to_owned() + own_form);
    assert_eq!(own, expected);
    done.sort_unstable();
    let budgets = Budgets::read().expect("budgets.toml").instructions;
    assert!(budgets.keys().eq(&done), "{done:?}, {:?}", budgets.keys());
}

#[test]
fn every_work_is_done_and_none_is_counted_without_a_counter() {
    let Some(image) = BENCH.build_or_skip() else {
        return;
    };
    let board = Board {
        image: BENCH,
        ..BOARDS[0]
    };
    let mut live = Live::start(board, &image).expect("it starts");
    let mut log = Vec::new();
    for _ in 0..600 {
        thread::sleep(Duration::from_millis(100));
        log = live
            .memory()
            .and_then(|memory| memory.log())
            .unwrap_or_default(); // not begun yet
        if log.last().is_some_and(|line| line == "done") {
            break;
        }
    }
    begins(
        &log,
        [
            "on a chip not known (id 0x0), Cortex-M4 (CPUID 0x410fc24",
            "clock: not known, left as it is",
            "flash: wait states not known",
            "caches: none in the core",
            "memory: SRAM",
        ],
    );
    assert_eq!(log[5], "no cycle counter (QEMU): nothing is counted");
    works(&log[6..log.len() - 1], "_m4", |rest| {
        rest == "done, not counted"
    });
}

const HSI: &str = "clock: internal oscillator of 16 MHz, as after reset";
const NONE: &str = "flash: 0 wait states (FLASH_ACR 0x0)";
const NO_CACHE: &str = "caches: none in the core";
const LARGE: &str = "caches: on, 16384 bytes for instructions, 16384 for data";
const DTCM: &str = "memory: all in DTCM, not cached";
const HALF_DTCM: &str = "memory: log in DTCM (64 KiB), stack in the SRAM behind it, cached";

/// Log of the image on the chips of the model.
#[rustfmt::skip]
const CHIPS: [(&str, [&str; 5]); 8] = [
    ("f405", [
        "on STM32F405/407/415/417 (id 0x413), Cortex-M4",
        "clock: 168000000 Hz, crystal 12 MHz",
        "flash: 5 wait states (FLASH_ACR 0x705)",
        NO_CACHE,
        "memory: SRAM",
    ]),
    ("f446", ["on STM32F446 (id 0x421), Cortex-M4", HSI, NONE, NO_CACHE, "memory: SRAM"]),
    ("f722", [
        "on STM32F72x/73x (id 0x452), Cortex-M7", HSI, NONE,
        "caches: on, 8192 bytes for instructions, 8192 for data",
        HALF_DTCM,
    ]),
    ("f746", [
        "on STM32F74x/75x (id 0x449), Cortex-M7", HSI, NONE,
        "caches: on, 4096 bytes for instructions, 4096 for data",
        HALF_DTCM,
    ]),
    ("f767", ["on STM32F76x/77x (id 0x451), Cortex-M7", HSI, NONE, LARGE, DTCM]),
    ("h743", H743),
    ("h743-faults", H743),
    ("nobody", [
        "on a chip not known (id 0x0), Cortex-M7",
        "clock: not known, left as it is",
        "flash: wait states not known",
        LARGE,
        "memory: not known",
    ]),
];

const H743: [&str; 5] = [
    "on STM32H74x/75x (id 0x450), Cortex-M7",
    "clock: internal oscillator of 64 MHz, as after reset",
    "flash: 7 wait states (FLASH_ACR 0x37)",
    LARGE,
    DTCM,
];

/// One image on eight chips. Each chip is identified, no register that it lacks is accessed, caches
/// and counter are turned on in the right order, and the log can be read behind the D-cache. The
/// figures are the model's and have no meaning.
#[test]
fn one_image_finds_its_way_on_f4_f7_and_h7() {
    let (Some(python), Some(image)) = (python(), BENCH.build_or_skip()) else {
        return;
    };
    for (chip, lines) in CHIPS {
        let asked = serde_json::json!({"image": image, "chip": chip}).to_string();
        let output = ask(&python, "stm32bench.py", asked.as_bytes()).expect(chip);
        let value = |name| {
            let line = output.iter().find_map(|line| line.strip_prefix(name));
            line.expect(name).trim()
        };
        assert_eq!(value("exit"), "0", "{chip}");
        let ram: Vec<u8> = value("ram").as_bytes().chunks(2).map(byte).collect();
        let log = Memory::new(&image, ram).and_then(|memory| memory.log());
        let log = log.expect(chip);
        begins(&log, lines);
        assert!(log[5].starts_with("loop of 1000000 turns: "), "{log:?}");
        assert_eq!(log[log.len() - 1], "done", "{chip}");
        let form = if lines[0].ends_with("M4") {
            "_m4"
        } else {
            "_m7"
        };
        works(&log[6..log.len() - 1], form, |rest| {
            let number = rest.strip_suffix(" cycles");
            number.is_some_and(|number| number.parse::<u32>().is_ok())
        });
    }
}

fn byte(digits: &[u8]) -> u8 {
    let digits = std::str::from_utf8(digits).expect("hexadecimal");
    u8::from_str_radix(digits, 16).expect("hexadecimal")
}
