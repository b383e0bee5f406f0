//! `cargo xtask supply` checks third-party dependencies with `cargo deny` (deny.toml); a release
//! lists them with `cargo cyclonedx`.

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};

use crate::images::workspace;
use crate::stage::{cargo_with, quietly, succeed};

/// Commands that install the tools.
const DENY: &str = "cargo install --locked cargo-deny";
pub const CYCLONEDX: &str = "cargo install --locked cargo-cyclonedx";

/// The workspaces, each with a `deny.toml`.
const WORKSPACES: [&str; 7] = [
    ".",
    "tests/chip",
    "tests/rigless",
    "tests/rp2350",
    "firmware/boards",
    "tests/alone",
    "lrnn-nostd/examples/cortex-m",
];

/// Checks everything, and advisories where their repository can be fetched.
pub fn supply() -> Result<ExitCode> {
    ensure!(
        installed("deny"),
        "cargo-deny is missing; remedy: {DENY}, or a binary of its releases"
    );
    check()?;
    if quietly(&mut cargo_with("deny fetch db")) {
        succeed(&mut cargo_with("deny check --disable-fetch advisories"))?;
    } else {
        println!("advisories: not asked for, their repository cannot be fetched from here");
    }
    Ok(ExitCode::SUCCESS)
}

/// Checks licences, sources and duplicates, where `cargo deny` is installed.
pub fn check() -> Result<()> {
    if !installed("deny") {
        println!("licences, sources, duplicates: not checked; remedy: {DENY}");
        return Ok(());
    }
    WORKSPACES.into_iter().try_for_each(|folder| {
        println!("{folder}");
        let mut deny = cargo_with("deny --locked --all-features --log-level error");
        deny.current_dir(workspace().join(folder));
        let what = "check -D unmatched-skip -D unnecessary-skip licenses sources bans";
        succeed(deny.args(what.split(' ')))
    })
}

/// Whether `cargo cyclonedx` is installed.
pub fn has_cyclonedx() -> bool {
    installed("cyclonedx")
}

/// Writes the bill of materials of the package in this folder, for a target, where `cargo
/// cyclonedx` is installed. It writes one beside the manifest of each package of the workspace.
pub fn bill(folder: &str, target: &str, out: &Path) -> Result<()> {
    if !has_cyclonedx() {
        return Ok(());
    }
    let mut cyclonedx = cargo_with(
        "cyclonedx --quiet --format json --spec-version 1.5 --override-filename bill-of-release \
         --target",
    );
    let manifest = workspace().join(folder).join("Cargo.toml");
    succeed(cyclonedx.arg(target).arg("--manifest-path").arg(&manifest))?;
    let written = workspace().join(folder).join("bill-of-release.json");
    fs::copy(&written, out).with_context(|| written.display().to_string())?;
    let mut metadata = cargo_with("metadata --no-deps --format-version 1 --manifest-path");
    let metadata = metadata.arg(manifest).output()?.stdout;
    let metadata: serde_json::Value = serde_json::from_slice(&metadata)?;
    for package in metadata["packages"].as_array().into_iter().flatten() {
        let beside = Path::new(package["manifest_path"].as_str().unwrap_or_default());
        let written = beside.with_file_name("bill-of-release.json");
        if written.exists() {
            fs::remove_file(written)?;
        }
    }
    Ok(())
}

fn installed(subcommand: &str) -> bool {
    quietly(cargo_with(subcommand).arg("--version"))
}
