//! `cargo xtask flash`: builds an image of the board and writes it with probe-rs, then shows its log.

use std::process::{Command, ExitCode};

use anyhow::{Context, Result, bail};
use qemu::images::Image;

use crate::needs;
use crate::stage::succeed;

/// The chip, as probe-rs calls it.
const CHIP: &str = "STM32F405RGTx";

/// With a debug probe at the board; ends with Ctrl-C, the bench by itself.
pub fn flash(image: Image) -> Result<ExitCode> {
    needs::target()?;
    let image = image.build()?;
    if Command::new("probe-rs").arg("--version").output().is_err() {
        bail!("probe-rs is missing; remedy: cargo install probe-rs-tools, or see https://probe.rs");
    }
    let mut probe = Command::new("probe-rs");
    probe.args(["run", "--chip", CHIP]).arg(&image);
    succeed(&mut probe).context("is a probe connected, and the board powered?")?;
    Ok(ExitCode::SUCCESS)
}
