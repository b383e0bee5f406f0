//! The cases for a board (`tests/chip`, image `stm32-cases`), which `cargo xtask hil-test` runs on
//! silicon: here in QEMU, which has the core alone, and in the chip model, also broken.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use object::{Object, ObjectSection, ObjectSymbol};
use qemu::images::{CASES, cases, here_or_skip, missing};
use qemu::judges::{ask, python};
use qemu::machine::NETDUINOPLUS2;
use serde_json::{Value, json};

/// Name and entry of each case, as probe-rs reads them from the image.
fn listed(image: &Path) -> BTreeMap<String, u32> {
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
    let mut expected = CASES;
    expected.sort_unstable();
    assert!(listed.keys().eq(&expected), "{listed:?}");
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
    let (says, passed) = in_qemu(other.path(), listed["digests"]);
    let noticed = says.contains("step, rational: DIFFERENT");
    assert!(!passed && noticed, "{says}");
}

/// Cases, the chip that each meets, whether it passes, and some of what it says.
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
    let in_use = json!({"flash": [[0x080F_FFFF, "7f"]]});
    for (name, mut chip, code, text) in [
        ("clock", whole(), 0, "a second of the host is 10000"),
        ("flash", whole(), 0, "1000000 us to erase a sector"),
        ("lines", whole(), 0, "USART3: 256 bytes in 22"),
        ("cycles", whole(), 0, "168 cycles a microsecond"),
        ("clock", crystal(8), 1, "LRNN_CRYSTAL_MHZ=8"),
        ("clock", crystal(0), 1, "no crystal"),
        ("clock", mutant("clock-pll"), 1, "another clock"),
        ("flash", mutant("flash-no-erase"), 1, "not blank"),
        ("flash", json!({"chip": {"volts": 2.6}}), 1, "Supply"),
        ("flash", in_use, 0, "skipped: "),
        ("lines", mutant("uart-no-fraction"), 1, "us are due"),
        ("lines", mutant("dma-count"), 1, "USART1: 128 bytes"),
        ("cycles", mutant("clock-timers"), 1, "timers disagree"),
    ] {
        chip["image"] = json!(image);
        chip["case"] = json!(listed[name]);
        let said = ask(&python, "stm32cases.py", chip.to_string().as_bytes()).expect(name);
        let said = said.join("\n");
        let ends = said.ends_with(&format!("exit {code}"));
        assert!(ends && said.contains(text), "{name} {chip}: {said}");
    }
}
