//! `cargo xtask wheel`: the Python wheel, from its sources to its notebooks.
//!
//! Everything happens in a virtual environment below the target folder. The wheel is compiled with
//! the profile and the features of the workspace's tests, so that what it shares with them is
//! compiled once.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Context, Result, bail};
use qemu::images::{target_directory, workspace};

use crate::needs;
use crate::stage::{cargo_with, succeed};

/// Folder of the package.
const PACKAGE: &str = "host-sim/python";

/// Builds, installs and checks; with `release` also the wheel that is given away.
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

/// The stage of `cargo xtask test`.
pub fn check() -> Result<()> {
    checked(&environment()?)
}

fn checked(venv: &Path) -> Result<()> {
    let target = target_directory()?;
    // the features of both packages are those of the workspace's tests
    succeed(&mut cargo_with(
        "build --quiet --package xtask --package host-sim --bin host-sim",
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

/// The virtual environment with what `requirements.txt` names; made anew after a change of it.
fn environment() -> Result<PathBuf> {
    let venv = target_directory()?.join("wheel/venv");
    let wanted = workspace().join(PACKAGE).join("requirements.txt");
    let (stamp, text) = (venv.join("requirements.txt"), fs::read_to_string(&wanted)?);
    if fs::read_to_string(&stamp).is_ok_and(|there| there == text) {
        return Ok(venv);
    }
    let interpreter = needs::python()?;
    let mut make = Command::new(interpreter);
    make.args(["-m", "venv", "--clear"]).arg(&venv);
    succeed(&mut make)?;
    let mut pip = python(&venv);
    pip.args([
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
    ]);
    succeed(pip.arg("-r").arg(&wanted)).context(
        "remedy: what requirements.txt names must be reachable by pip; or leave the wheel out: \
         cargo xtask test --fast",
    )?;
    fs::write(stamp, text)?;
    Ok(venv)
}

/// The environment's interpreter, in the folder of the package.
fn python(venv: &Path) -> Command {
    let mut python = Command::new(program(venv, "python"));
    python
        .current_dir(workspace().join(PACKAGE))
        .env("PYTHONDONTWRITEBYTECODE", "1");
    python
}

fn program(venv: &Path, name: &str) -> PathBuf {
    match cfg!(windows) {
        true => venv.join("Scripts").join(name),
        false => venv.join("bin").join(name),
    }
}

/// Builds the wheel into `folder`, which then holds no other.
fn build(venv: &Path, options: &str, folder: &Path) -> Result<PathBuf> {
    if folder.exists() {
        fs::remove_dir_all(folder)?;
    }
    let mut maturin = Command::new(program(venv, "maturin"));
    maturin
        .args(["build", "--quiet", "--locked"])
        .args(options.split_whitespace())
        .arg("--interpreter")
        .arg(program(venv, "python"))
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

/// Installs a wheel, and nothing that it needs: all of that is pinned.
fn install(venv: &Path, wheel: &Path) -> Result<()> {
    let options = "-m pip install --quiet --no-deps --force-reinstall --no-index \
                   --disable-pip-version-check";
    succeed(python(venv).args(options.split_whitespace()).arg(wheel))
}
