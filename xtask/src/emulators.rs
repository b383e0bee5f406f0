//! `cargo xtask emulators`: our STM32 images in an emulator that others wrote (`tests/rigless`). It
//! is not in `cargo xtask test`, since compiling its code generator takes minutes of a processor.

use std::process::ExitCode;

use anyhow::Result;
use qemu::emulator::{ASKED_FOR, build};
use qemu::images::{REQUIRE, target_directory, workspace};

use crate::needs;
use crate::stage::{cargo_with, succeed};

/// Builds the emulator, looks at its lints, and runs its tests.
pub fn emulators() -> Result<ExitCode> {
    needs::targets()?;
    build()?;
    let mut clippy = cargo_with("clippy --quiet --locked --ignore-rust-version --all-targets");
    clippy
        .arg("--manifest-path")
        .arg(workspace().join("tests/rigless/Cargo.toml"))
        .arg("--target-dir")
        .arg(target_directory()?.join("rigless"))
        .args(["--", "-D", "warnings"]);
    succeed(&mut clippy)?;
    let mut tests = cargo_with("test --package qemu --test rigless -- --nocapture");
    tests.env(ASKED_FOR, "1").env(REQUIRE, "1");
    succeed(&mut tests)?;
    Ok(ExitCode::SUCCESS)
}
