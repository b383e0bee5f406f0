//! `cargo xtask wheel`: the Python wheel, from its sources to its notebooks.
//!
//! Everything happens in a virtual environment below the target folder. The wheel is compiled with
//! the profile and the features of the workspace's tests, so that shared packages are compiled
//! once.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use crate::images::{target_directory, workspace};
use anyhow::{Result, bail};

use crate::stage::{cargo_with, succeed};
use crate::venv::Environment;

/// Folder of the package.
pub const PACKAGE: &str = "host-sim/python";

/// Builds, installs and checks; with `release` also the wheel for a release.
pub fn wheel(release: bool) -> Result<ExitCode> {
    let venv = environment()?;
    if release {
        let folder = target_directory()?.join("wheel/release");
        let built = build(&venv, "--release", &folder)?;
        install(&venv, &built)?;
        let bytes = fs::metadata(&built)?.len();
        println!("{}: {bytes} bytes", built.display());
        succeed(python(&venv).arg("benches/calls.py"))?;
    }
    checked(&venv)?;
    Ok(ExitCode::SUCCESS)
}

/// The stage of `cargo xtask check`.
pub fn check() -> Result<()> {
    checked(&environment()?)
}

fn checked(venv: &Environment) -> Result<()> {
    let target = target_directory()?;
    // with the features of the workspace's tests, as the wheel
    succeed(&mut cargo_with(
        "build --quiet --package imu-compensation-python --package host-sim --bin host-sim \
         --features imu-compensation-python/in-workspace",
    ))?;
    let wheel = build(
        venv,
        "--profile dev --features in-workspace",
        &target.join("wheel/dev"),
    )?;
    install(venv, &wheel)?;
    succeed(
        python(venv)
            .args(["-m", "pytest", "-q"])
            .env("HOST_SIM", target.join("debug/host-sim")),
    )?;
    succeed(python(venv).args(["-m", "mypy.stubtest", "lrnn_imu"]))
}

/// The environment with the packages of `requirements.txt`, including maturin.
pub fn environment() -> Result<Environment> {
    let wanted = workspace().join(PACKAGE).join("requirements.txt");
    Environment::of("wheel/venv", &wanted)
}

/// The environment's interpreter, in the folder of the package.
fn python(venv: &Environment) -> Command {
    let mut python = venv.python();
    python.current_dir(workspace().join(PACKAGE));
    python
}

/// Builds the wheel into `folder`, and removes others there.
fn build(venv: &Environment, options: &str, folder: &Path) -> Result<PathBuf> {
    if folder.exists() {
        fs::remove_dir_all(folder)?;
    }
    let mut maturin = Command::new(venv.program("maturin"));
    maturin
        .args(["build", "--quiet", "--locked"])
        .args(options.split_whitespace())
        .arg("--interpreter")
        .arg(venv.program("python"))
        .arg("--out")
        .arg(folder)
        .current_dir(workspace().join(PACKAGE));
    succeed(&mut maturin)?;
    let mut wheels = fs::read_dir(folder)?.flatten().map(|entry| entry.path());
    match wheels.find(|path| path.extension().is_some_and(|end| end == "whl")) {
        Some(wheel) => Ok(wheel),
        None => bail!("{}: maturin left no wheel there", folder.display()),
    }
}

/// Installs a wheel without its dependencies, which are pinned.
fn install(venv: &Environment, wheel: &Path) -> Result<()> {
    let options = ["--no-deps", "--force-reinstall", "--no-index"];
    succeed(venv.pip().args(options).arg(wheel))
}
