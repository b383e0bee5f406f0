//! `cargo xtask flash`: builds an image of a board and writes it with probe-rs, then shows its log;
//! or writes it as a file for the chip's boot loader.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use crate::boards::{Family, M33};
use crate::images::{BENCH, Image, STM32F405};
use crate::stage::succeed;
use crate::{boards, load, needs};
use anyhow::{Context, Result, bail, ensure};

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

/// Way in which an image gets to the board.
#[derive(Debug, Default)]
pub struct FlashMethod {
    /// The chip, if it is not the default.
    pub chip: Option<String>,
    /// Instead of a probe: a file for the RP2350's drive.
    pub uf2: Option<PathBuf>,
    /// Instead of a probe: a file for ST's boot loader.
    pub dfu: Option<PathBuf>,
}

/// Writes our own board's image, or the bench.
pub fn flash(image: Image, way: &FlashMethod) -> Result<ExitCode> {
    let chip = way.chip.as_deref().unwrap_or(CHIP);
    fits(image, chip)?;
    served_by(way, false)?;
    needs::target()?;
    write(&image.build()?, chip, way)
}

/// Writes the image of a board.
pub fn flash_board(name: &str, way: &FlashMethod) -> Result<ExitCode> {
    let (built, chip) = built(name, way)?;
    write(&built, &chip, way)
}

/// Writes the image of a board with a debug probe, starts it, and gives the image's file.
pub fn download(name: &str, chip: Option<String>) -> Result<PathBuf> {
    let way = FlashMethod {
        chip,
        ..FlashMethod::default()
    };
    let (built, chip) = built(name, &way)?;
    knows(&chip)?;
    for word in ["download", "reset"] {
        let mut probe = Command::new("probe-rs");
        probe.args([word, "--chip", &chip]);
        if word == "download" {
            probe.arg(&built);
        }
        succeed(&mut probe).with_context(|| no_probe(&chip))?;
    }
    Ok(built)
}

/// The chip of a board: the given one, if the board's image runs on it, else its usual one.
pub fn chip_of(name: &str, given: Option<&str>) -> Result<String> {
    if name == STM32F405.name {
        let chip = given.unwrap_or(CHIP);
        fits(STM32F405, chip)?;
        return Ok(chip.into());
    }
    let family = boards::named(name)?;
    let chip = given.unwrap_or(family.chip);
    is_of(family, chip)?;
    Ok(chip.into())
}

/// Builds the image of a board. Gives it with the chip that it is for.
fn built(name: &str, way: &FlashMethod) -> Result<(PathBuf, String)> {
    let chip = chip_of(name, way.chip.as_deref())?;
    if name == STM32F405.name {
        served_by(way, false)?;
        needs::target()?;
        return Ok((STM32F405.build()?, chip));
    }
    let family = boards::named(name)?;
    served_by(way, family.target == M33)?;
    needs::targets()?;
    Ok((family.build()?, chip))
}

/// Checks that the board has the boot loader that a file is for.
fn served_by(way: &FlashMethod, rp2350: bool) -> Result<()> {
    ensure!(
        rp2350 || way.uf2.is_none(),
        "--uf2: only the RP2350's boot loader takes it; remedy: --dfu FILE for an STM32, or a probe"
    );
    ensure!(
        !rp2350 || way.dfu.is_none(),
        "--dfu: this is the format of ST's boot loader; remedy: --uf2 FILE"
    );
    Ok(())
}

/// Checks that a chip is the board's, apart from package and flash size.
fn is_of(family: Family, chip: &str) -> Result<()> {
    let (given, ours) = (chip.to_ascii_uppercase(), family.chip.to_ascii_uppercase());
    // "STM32F446RETx": the family and the number
    let number = given.get(..given.len().min(9).min(ours.len()));
    let alike = number.is_some_and(|number| number.len() > 5 && ours.starts_with(number));
    ensure!(
        alike,
        "--chip {chip}: the image {} is for {}; remedy: this chip, or the board that has yours \
         (docs/BOARDS.md)",
        family.name,
        family.chip
    );
    Ok(())
}

/// Writes to a file, or with a debug probe. The probe runs until Ctrl-C; the bench ends by itself.
fn write(built: &Path, chip: &str, way: &FlashMethod) -> Result<ExitCode> {
    if let Some(out) = &way.uf2 {
        load::uf2(built, out)?;
        println!(
            "{}: hold BOOTSEL while the board gets power, then copy this file to its drive",
            out.display()
        );
        return Ok(ExitCode::SUCCESS);
    }
    if let Some(out) = &way.dfu {
        load::dfu(built, out)?;
        println!(
            "{0}: hold BOOT0 high at a reset, then: dfu-util -a 0 -s :leave -D {0}",
            out.display()
        );
        return Ok(ExitCode::SUCCESS);
    }
    knows(chip)?;
    let mut probe = Command::new("probe-rs");
    probe.args(["run", "--chip", chip]).arg(built);
    succeed(&mut probe).with_context(|| no_probe(chip))?;
    Ok(ExitCode::SUCCESS)
}

/// Checks that probe-rs is there and knows the chip.
pub fn knows(chip: &str) -> Result<()> {
    let Ok(known) = Command::new("probe-rs")
        .args(["chip", "info", chip])
        .stdout(Stdio::null())
        .status()
    else {
        bail!(
            "probe-rs is missing; remedy: cargo install probe-rs-tools, or see https://probe.rs; \
             without a probe: `cargo xtask flash` with --uf2 FILE for the RP2350, --dfu FILE for \
             an STM32"
        );
    };
    ensure!(
        known.success(),
        "--chip {chip}: probe-rs does not know this chip; remedy: a name of `probe-rs chip list`, \
         such as {CHIP} or STM32H743ZITx"
    );
    Ok(())
}

fn no_probe(chip: &str) -> String {
    format!("is a probe connected, the board powered, and the chip on it a {chip} (--chip)?")
}

/// Checks that the image is for this chip.
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
    use crate::images::STM32F405_WINDOW;

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
    fn a_board_is_for_its_chip_and_its_boot_loader() {
        let h743 = boards::named("h743").expect("a board");
        let pico2 = boards::named("pico2").expect("a board");
        assert!(is_of(h743, "stm32h743vitx").is_ok() && is_of(pico2, "RP235x").is_ok());
        for (family, other) in [
            (h743, "STM32H723ZGTx"),
            (h743, "STM32"),
            (pico2, "RP2040"),
            (pico2, ""),
        ] {
            let error = is_of(family, other).expect_err(other).to_string();
            assert!(
                error.contains("remedy") && error.contains(family.chip),
                "{error}"
            );
        }
        let error = boards::named("nucleo").expect_err("no board").to_string();
        assert!(
            error.contains("nrf52840") && error.contains("stm32f405"),
            "{error}"
        );
        let (uf2, dfu) = (Some("a".into()), Some("b".into()));
        let way = FlashMethod {
            uf2,
            ..FlashMethod::default()
        };
        assert!(served_by(&way, true).is_ok() && served_by(&way, false).is_err());
        let way = FlashMethod {
            dfu,
            ..FlashMethod::default()
        };
        assert!(served_by(&way, false).is_ok() && served_by(&way, true).is_err());
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
