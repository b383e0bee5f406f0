//! `cargo xtask flash`: builds the board's image, or its bench, and writes it with probe-rs, then shows its log.

use std::process::{Command, ExitCode};

use anyhow::{Context, Result, bail};
use qemu::images::{BENCH, STM32F405};

use crate::needs;
use crate::stage::succeed;

/// The chip, as probe-rs calls it.
const CHIP: &str = "STM32F405RGTx";

/// With a debug probe at the board; ends with Ctrl-C, the bench by itself.
pub fn flash(bench: bool) -> Result<ExitCode> {
    needs::target()?;
    let image = if bench { BENCH } else { STM32F405 };
    let image = image.build()?;
    if Command::new("probe-rs").arg("--version").output().is_err() {
        bail!("probe-rs is missing; remedy: cargo install probe-rs-tools, or see https://probe.rs");
    }
    let mut probe = Command::new("probe-rs");
    probe.args(["run", "--chip", CHIP]).arg(&image);
    succeed(&mut probe).context("is a probe connected, and the board powered?")?;
    Ok(ExitCode::SUCCESS)
}
