//! `cargo xtask emulators`: our STM32 images in a third-party emulator (`tests/rigless`). It is not
//! in `cargo xtask check`, since compiling its code generator takes minutes of a processor.

use std::process::ExitCode;

use anyhow::Result;

use crate::images::{REQUIRE, apart};
use crate::needs;
use crate::stage::{cargo_with, succeed};

/// Builds the emulator, checks its lints, and runs its tests.
pub fn emulators() -> Result<ExitCode> {
    needs::targets()?;
    for command in ["build", "clippy"] {
        let mut cargo = apart(command, "tests/rigless", "rigless", None)?;
        cargo.arg("--ignore-rust-version"); // it requires a newer compiler, but builds with ours
        if command == "clippy" {
            cargo.args(["--all-targets", "--", "-D", "warnings"]);
        }
        succeed(&mut cargo)?;
    }
    let mut tests = cargo_with("test --package qemu --test rigless -- --nocapture");
    tests.env("LRNN_EMULATORS", "1").env(REQUIRE, "1");
    succeed(&mut tests)?;
    Ok(ExitCode::SUCCESS)
}
