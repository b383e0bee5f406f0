//! `cargo xtask mutants`: whether the tests of `lrnn-nostd` notice small changes of its code, with
//! `cargo mutants` (.cargo/mutants.toml). All of them take hours: one part of [`PARTS`] is tried.

use std::process::ExitCode;

use anyhow::{Result, ensure};

use crate::images::{target_directory, workspace};
use crate::stage::{cargo_with, quietly, succeed};

/// Parts of the mutants: the first takes one and a half minutes.
const PARTS: usize = 200;
/// The command that installs the tool.
const INSTALL: &str = "cargo install --locked cargo-mutants";

/// Tries a part.
pub fn mutants(part: usize) -> Result<ExitCode> {
    ensure!(installed(), "cargo-mutants is missing; remedy: {INSTALL}");
    ensure!(
        part < PARTS,
        "--part {part}: there are {PARTS} parts, from 0 on"
    );
    try_part(part)?;
    Ok(ExitCode::SUCCESS)
}

/// The first part, where `cargo mutants` is installed.
pub fn check() -> Result<()> {
    if !installed() {
        println!("mutants: not tried; remedy: {INSTALL}");
        return Ok(());
    }
    try_part(0)
}

/// In a copy of the tree, with compiled dependencies that stay. A mutant that no test notices is an
/// error.
fn try_part(part: usize) -> Result<()> {
    let directory = target_directory()?.join("mutants");
    std::fs::create_dir_all(&directory)?;
    println!("part {part} of {PARTS}; again: cargo xtask mutants --part {part}");
    let mut mutants = cargo_with("mutants --package lrnn-nostd --sharding round-robin --shard");
    mutants
        .arg(format!("{part}/{PARTS}"))
        .arg("--output")
        .arg(&directory)
        .current_dir(workspace())
        .env("CARGO_TARGET_DIR", directory.join("build"));
    succeed(&mut mutants)
}

fn installed() -> bool {
    quietly(cargo_with("mutants").arg("--version"))
}
