//! `cargo xtask package`: whether `lrnn-nostd` could be published as it is.

use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context, Result, ensure};

use crate::images::{metadata, target_directory, workspace};
use crate::needs;
use crate::stage::{cargo_with, quietly, succeed};

/// The package, the only one of the workspace that is published.
const NAME: &str = "lrnn-nostd";

/// Packs the crate and builds the package; then [`check`], and the comparison of its interface with
/// the published one, where `cargo-semver-checks` is installed and there is one.
pub fn package() -> Result<ExitCode> {
    needs::alone()?;
    check()?;
    let directory = target_directory()?.join("package");
    succeed(
        cargo_with("publish --dry-run --allow-dirty --package")
            .args([NAME, "--target-dir"])
            .arg(directory),
    )?;
    if quietly(&mut cargo_with("semver-checks --version")) {
        succeed(&mut cargo_with("semver-checks --package lrnn-nostd"))?;
    } else {
        println!(
            "interface: not compared with the published one; remedy: \
             cargo install --locked cargo-semver-checks"
        );
    }
    Ok(ExitCode::SUCCESS)
}

/// The checks of a test run: the list of packed files, the library for each core without `std`, and
/// with the oldest Rust that its manifest names.
pub fn check() -> Result<()> {
    let directory = target_directory()?.join("package");
    let packed = cargo_with("package --list --allow-dirty --package")
        .arg(NAME)
        .output()
        .context("cannot start cargo")?;
    let list = String::from_utf8_lossy(&packed.stdout);
    ensure!(
        packed.status.success(),
        "{}",
        String::from_utf8_lossy(&packed.stderr)
    );
    for file in ["LICENSE-MIT", "LICENSE-APACHE", "README.md", "src/lib.rs"] {
        ensure!(list.lines().any(|name| name == file), "{file} is missing");
    }
    for target in needs::ALONE {
        succeed(
            cargo_with("check --quiet --lib --all-features --package")
                .args([NAME, "--target", target, "--target-dir"])
                .arg(&directory),
        )?;
    }
    oldest()
}

/// The library with the oldest Rust that its manifest names. In the lints stage, clippy has already
/// searched for newer parts of the standard library (`incompatible_msrv`); only the compiler itself
/// finds newer syntax. Without rustup, or where it can fetch nothing, a line says so.
fn oldest() -> Result<()> {
    let version = rust_version()?;
    let rustup = |arguments: &[&str]| {
        let mut rustup = Command::new("rustup");
        rustup.args(arguments).current_dir(workspace());
        rustup.stdin(Stdio::null()).stdout(Stdio::null());
        rustup
    };
    let install = ["toolchain", "install", &version, "--profile", "minimal"];
    let run = ["run", &version, "rustc", "--version"];
    let there = || quietly(&mut rustup(&run));
    if !(there() || quietly(&mut rustup(&install)) && there()) {
        println!(
            "Rust {version}: not checked; remedy: rustup {}",
            install.join(" ")
        );
        return Ok(());
    }
    let mut check = rustup(&["run", &version, "cargo", "check", "--quiet", "--lib"]);
    // The variables of the cargo that runs us name another compiler.
    for name in ["CARGO", "RUSTC", "RUSTUP_TOOLCHAIN", "RUSTFLAGS"] {
        check.env_remove(name);
    }
    check.args(["--all-features", "--package", NAME, "--target-dir"]);
    check.arg(target_directory()?.join("package").join(&version));
    succeed(&mut check).with_context(|| format!("it needs a younger Rust than {version}"))
}

/// `rust-version` of the package.
fn rust_version() -> Result<String> {
    let metadata = metadata()?;
    let packages = metadata["packages"].as_array().context("no packages")?;
    let ours = packages.iter().find(|package| package["name"] == NAME);
    let version = ours.and_then(|package| package["rust_version"].as_str());
    version.map(str::to_owned).context("no rust-version")
}
