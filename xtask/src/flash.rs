//! `cargo xtask flash`: builds an image of the board and writes it with probe-rs, then shows its
//! log.

use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context, Result, bail, ensure};
use qemu::images::{BENCH, Image};

use crate::needs;
use crate::stage::succeed;

/// The default chip, by the name that probe-rs uses.
pub const CHIP: &str = "STM32F405RGTx";

/// Chips whose registers the board images set up.
const BOARD: [&str; 4] = ["STM32F405", "STM32F407", "STM32F415", "STM32F417"];
/// Chips that the bench image runs on, and those among them that have less than 128 KiB of memory
/// or at most 256 KiB of flash (`tests/silicon`).
const BENCHED: [&str; 3] = ["STM32F4", "STM32F7", "STM32H7"];
const SMALL: [&str; 9] = [
    "STM32F401",
    "STM32F410",
    "STM32F730",
    "STM32F750",
    "STM32H730",
    "STM32H750",
    "STM32H7B0",
    "STM32H7R",
    "STM32H7S",
];

/// Needs a debug probe at the board. It ends with Ctrl-C, the bench by itself.
pub fn flash(image: Image, chip: &str) -> Result<ExitCode> {
    fits(image, chip)?;
    needs::target()?;
    let Ok(known) = Command::new("probe-rs")
        .args(["chip", "info", chip])
        .stdout(Stdio::null())
        .status()
    else {
        bail!("probe-rs is missing; remedy: cargo install probe-rs-tools, or see https://probe.rs");
    };
    ensure!(
        known.success(),
        "--chip {chip}: probe-rs does not know this chip; remedy: a name of `probe-rs chip list`, \
         such as {CHIP} or STM32H743ZITx"
    );
    let built = image.build()?;
    let mut probe = Command::new("probe-rs");
    probe.args(["run", "--chip", chip]).arg(&built);
    succeed(&mut probe).with_context(|| {
        format!("is a probe connected, the board powered, and the chip on it a {chip} (--chip)?")
    })?;
    Ok(ExitCode::SUCCESS)
}

/// Whether the image is for this chip.
fn fits(image: Image, chip: &str) -> Result<()> {
    let of = |names: &[&str]| {
        let upper = chip.to_ascii_uppercase();
        names.iter().any(|name| upper.starts_with(name))
    };
    if image != BENCH {
        ensure!(
            of(&BOARD),
            "--chip {chip}: the board image sets up the registers of {}; remedy: one of these, or --bench, which runs on an F7 or H7 too",
            BOARD.join(", ")
        );
        return Ok(());
    }
    ensure!(
        of(&BENCHED),
        "--chip {chip}: the bench image is for {}; remedy: one of these, as STM32F767ZITx",
        BENCHED.join(", ")
    );
    ensure!(
        !of(&SMALL),
        "--chip {chip}: the bench image needs more than 256 KiB of flash and 128 KiB of memory at 0x20000000; remedy: a larger chip of the family"
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use qemu::images::{STM32F405, STM32F405_WINDOW};

    #[test]
    fn board_images_are_for_the_f405_and_its_sisters() {
        for image in [STM32F405, STM32F405_WINDOW] {
            assert!(fits(image, CHIP).is_ok() && fits(image, "stm32f417vgtx").is_ok());
            for other in [
                "STM32F446RETx",
                "STM32H743ZITx",
                "STM32F40",
                "nRF52840_xxAA",
                "",
            ] {
                let error = fits(image, other).expect_err(other).to_string();
                assert!(
                    error.contains("--bench") && error.contains("STM32F415"),
                    "{error}"
                );
            }
        }
    }

    #[test]
    fn the_bench_is_for_all_three_families_with_room_for_it() {
        for chip in [
            CHIP,
            "STM32F722RETx",
            "stm32f746zgtx",
            "STM32F767ZITx",
            "STM32H743ZITx",
        ] {
            assert!(fits(BENCH, chip).is_ok(), "{chip}");
        }
        for chip in ["STM32F103C8Tx", "STM32L476RGTx", "F767"] {
            let error = fits(BENCH, chip).expect_err(chip).to_string();
            assert!(error.contains("STM32H7"), "{error}");
        }
        for chip in [
            "STM32F401RETx",
            "STM32H750VBTx",
            "STM32F730R8Tx",
            "stm32h7s3l8hx",
        ] {
            let error = fits(BENCH, chip).expect_err(chip).to_string();
            assert!(error.contains("256 KiB"), "{error}");
        }
    }
}
