//! `cargo xtask mutants`: whether the tests of `lrnn-nostd` notice small changes of its code, with
//! `cargo mutants` (.cargo/mutants.toml). All of them take hours. One part of [`PARTS`] is tried,
//! another one after each commit.

use std::process::ExitCode;

use anyhow::{Result, ensure};

use crate::images::{target_directory, workspace};
use crate::stage::{cargo_with, quietly, succeed};

/// Parts of the mutants: each takes two to three minutes.
const PARTS: usize = 200;
/// The command that installs the tool.
const INSTALL: &str = "cargo install --locked cargo-mutants";

/// Tries the part of this commit, or another one.
pub fn mutants(part: Option<usize>) -> Result<ExitCode> {
    ensure!(installed(), "cargo-mutants is missing; remedy: {INSTALL}");
    try_part(part.unwrap_or_else(commits) % PARTS)?;
    Ok(ExitCode::SUCCESS)
}

/// The part of this commit, where `cargo mutants` is installed.
pub fn check() -> Result<()> {
    if !installed() {
        println!("mutants: not tried; remedy: {INSTALL}");
        return Ok(());
    }
    try_part(commits() % PARTS)
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

/// How many commits there are, 0 where git does not say.
fn commits() -> usize {
    let mut git = std::process::Command::new("git");
    let count = git
        .args(["rev-list", "--count", "HEAD"])
        .current_dir(workspace())
        .output();
    let count = count
        .ok()
        .and_then(|out| String::from_utf8(out.stdout).ok());
    count.and_then(|text| text.trim().parse().ok()).unwrap_or(0)
}

fn installed() -> bool {
    quietly(cargo_with("mutants").arg("--version"))
}
