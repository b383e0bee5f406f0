//! The cases for a board (`tests/chip`, image `stm32-cases`), which `cargo xtask hil-test` runs on
//! silicon: here in QEMU, which has the core alone, and in the chip model, also broken.

use std::fs;
use std::path::Path;

use object::{Object, ObjectSection, ObjectSymbol};
use qemu::images::{CASES, cases, here_or_skip, missing};
use qemu::judges::{ask, python};
use qemu::machine::NETDUINOPLUS2;
use serde_json::{Value, json};

/// Name and entry of each case, as probe-rs reads them from the image.
fn listed(image: &Path) -> Vec<(String, u32)> {
    let bytes = fs::read(image).expect("the image");
    let elf = object::File::parse(&*bytes).expect("an ELF file");
    let section = elf.section_by_name(".embedded_test").expect("the cases");
    let entries = section.data().expect("the cases");
    let all = elf.symbols().filter(|symbol| symbol.size() == 12);
    let all = all.filter(|symbol| symbol.section_index() == Some(section.index()));
    let read = |symbol: object::Symbol<'_, '_>| {
        let case: Value = serde_json::from_str(symbol.name().expect("a name")).expect("JSON");
        let at = symbol.address() as usize;
        let entry = entries[at..at + 4].try_into().expect("four bytes");
        let name = case["name"].as_str().expect("a name");
        (name.to_owned(), u32::from_le_bytes(entry))
    };
    all.map(read).collect()
}

/// What a case says in QEMU, and whether it passes.
fn in_qemu(image: &Path, entry: u32) -> (String, bool) {
    let mut qemu = NETDUINOPLUS2.command(image);
    qemu.args(["-serial", "none", "-monitor", "none", "-semihosting-config"]);
    let run = format!("enable=on,target=native,arg=run_addr,arg={entry}");
    let done = qemu.arg(run).output().expect("QEMU starts");
    let says = String::from_utf8_lossy(&done.stdout).into_owned();
    (says, done.status.success())
}

#[test]
fn every_case_passes_in_qemu_or_says_what_is_missing() {
    if !here_or_skip(missing()) {
        return;
    }
    let image = cases().expect("it builds");
    let listed = listed(&image);
    let mut names: Vec<&str> = listed.iter().map(|case| &*case.0).collect();
    names.sort_unstable();
    let mut expected = CASES;
    expected.sort_unstable();
    assert_eq!(names, expected);
    for (name, entry) in &listed {
        let (says, passed) = in_qemu(&image, *entry);
        assert!(passed, "{name}: {says}");
        assert_eq!(says.starts_with("skipped: "), name != "digests", "{says}");
    }
    // one bit of one expected digest
    let mut bytes = fs::read(&image).expect("the image");
    let digest = vectors::CHECKS[0].expected.to_le_bytes();
    let at = bytes.windows(8).position(|bytes| bytes == digest);
    bytes[at.expect("the digest")] ^= 1;
    let other = tempfile::NamedTempFile::new().expect("a file");
    fs::write(&other, bytes).expect("it is written");
    let (_, entry) = listed.iter().find(|case| case.0 == "digests").expect("it");
    let (says, passed) = in_qemu(other.path(), *entry);
    assert!(
        !passed && says.contains("step, rational: DIFFERENT"),
        "{says}"
    );
}

/// A chip or a store, the case that meets it, and what the case says last but one, if it fails.
#[test]
fn cases_pass_in_the_chip_model_and_fail_in_a_broken_one() {
    let (Some(python), true) = (python(), here_or_skip(missing())) else {
        return;
    };
    let image = cases().expect("it builds");
    let listed = listed(&image);
    let whole = || json!({});
    let mutant = |name: &str| json!({"break": name});
    let crystal = |mhz: u32| json!({"chip": {"crystal": mhz}});
    for (name, chip, passes, text) in [
        ("clock", whole(), true, "a second of the host is 1000059 us"),
        ("flash", whole(), true, "1000000 us to erase it"),
        ("lines", whole(), true, "USART3 at 115200 bit/s: 256 bytes"),
        ("cycles", whole(), true, "168 cycles a microsecond"),
        ("clock", crystal(8), false, "LRNN_CRYSTAL_MHZ=8"),
        ("clock", crystal(0), false, "no crystal"),
        ("clock", mutant("clock-pll"), false, "another clock"),
        ("flash", mutant("flash-no-erase"), false, "not blank"),
        ("flash", json!({"chip": {"volts": 2.6}}), false, "Supply"),
        (
            "flash",
            json!({"flash": [[0x080F_FFFF, "7f"]]}),
            true,
            "skipped: ",
        ),
        ("lines", mutant("uart-no-fraction"), false, "us were due"),
        ("lines", mutant("dma-count"), false, "128 of 256 bytes"),
        ("cycles", mutant("clock-timers"), false, "timers disagree"),
    ] {
        let (_, entry) = listed.iter().find(|case| case.0 == name).expect(name);
        let mut asked = chip.clone();
        asked["image"] = json!(image);
        asked["case"] = json!(entry);
        let said = ask(&python, "stm32cases.py", asked.to_string().as_bytes()).expect(name);
        let code = if passes { "exit 0" } else { "exit 1" };
        assert_eq!(
            said.last().map(String::as_str),
            Some(code),
            "{chip} {said:#?}"
        );
        assert!(said.join("\n").contains(text), "{name} {chip}: {said:#?}");
    }
}
