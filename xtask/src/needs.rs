//! Tools that the machine must have. They are installed where that needs no confirmation, else the
//! error names the remedy.

use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};

use crate::boards::M33;
use crate::images::{TARGET, installed, workspace};
use crate::stage::{cargo_with, quietly, succeed};
use anyhow::{Context, Result, bail, ensure};

/// The emulator.
pub const QEMU: &str = "qemu-system-arm";

/// Environment variable with the path of another [`QEMU`] than that of `PATH`.
pub const OTHER: &str = "QEMU_SYSTEM_ARM";

/// The emulator of RISC-V; only `lrnn-nostd` alone runs there.
pub const QEMU_RISCV: &str = "qemu-system-riscv32";

/// The remedy when it is missing.
pub const REMEDY: &str = "install QEMU for ARM (Debian: apt-get install qemu-system-arm; Fedora: dnf install qemu-system-arm; \
                          macOS: brew install qemu)";

/// The remedy when the emulator of RISC-V is missing.
pub const REMEDY_RISCV: &str = "install QEMU for RISC-V (Debian: apt-get install qemu-system-misc; \
     Fedora: dnf install qemu-system-riscv; macOS: brew install qemu)";

/// The targets of `lrnn-nostd` alone.
pub const ALONE: [&str; 4] = [
    TARGET,
    M33,
    "thumbv6m-none-eabi",
    "riscv32imac-unknown-none-elf",
];

/// Whether the emulator can be started.
pub fn available() -> bool {
    can_start(QEMU)
}

/// Whether this emulator can be started.
pub fn can_start(emulator: &str) -> bool {
    quietly(start(emulator).arg("--version"))
}

/// A command for the emulator of this name, or for the one that [`OTHER`] names instead.
pub fn start(emulator: &str) -> Command {
    let other = std::env::var_os(OTHER).filter(|path| emulator == QEMU && !path.is_empty());
    Command::new(other.unwrap_or_else(|| emulator.into()))
}

/// Installs the core library of the boards' usual target, for the pinned toolchain.
pub fn target() -> Result<()> {
    core_library(TARGET)
}

/// Installs the core libraries of all boards' targets.
pub fn targets() -> Result<()> {
    target().and_then(|()| core_library(M33))
}

/// Installs what `lrnn-nostd` alone needs: the core libraries and both emulators.
pub fn alone() -> Result<()> {
    ALONE.into_iter().try_for_each(core_library)?;
    emulator()?;
    let missing = format!("{QEMU_RISCV} is missing; remedy: {REMEDY_RISCV}");
    provide(|| can_start(QEMU_RISCV), "qemu-system-misc", &missing)
}

/// Installs the core library of a target.
pub fn core_library(target: &str) -> Result<()> {
    if installed(target) {
        return Ok(());
    }
    let remedy = format!(
        "target {target} is missing and rustup could not add it; remedy: rustup target add {target}"
    );
    // rustup runs in the workspace and so adds to the toolchain that rust-toolchain.toml pins.
    eprintln!("        installs target {target}: rustup target add {target}");
    let mut rustup = Command::new("rustup");
    rustup
        .args(["target", "add", target])
        .current_dir(workspace());
    succeed(&mut rustup).context(remedy.clone())?;
    if !installed(target) {
        bail!(remedy);
    }
    Ok(())
}

/// The emulator.
pub fn emulator() -> Result<()> {
    let missing =
        format!("{QEMU} is missing; remedy: {REMEDY}; or leave QEMU out: cargo xtask test --fast");
    provide(available, "qemu-system-arm", &missing)
}

/// The browser in which the page of `host-sim serve` is tested.
pub fn browser() -> Result<()> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let found = || names.iter().any(|name| can_start(name));
    let missing = "Chromium is missing; remedy: Debian: apt-get install chromium";
    provide(found, "chromium", missing)
}

/// A compiler of C++, for the library of the fuzz targets.
pub fn cpp() -> Result<()> {
    let found = || {
        let name = std::env::var_os("CXX").unwrap_or_else(|| "c++".into());
        quietly(Command::new(name).arg("--version"))
    };
    let missing = "a compiler of C++ is missing; remedy: install g++";
    provide(found, "g++", missing)
}

/// A Python that makes virtual environments: `PYTHON` names another one than `python3`.
pub fn python() -> Result<std::ffi::OsString> {
    let python = std::env::var_os("PYTHON").unwrap_or_else(|| "python3".into());
    let found = || {
        // Debian has `venv` without the packages that it installs
        let asked = "import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))";
        quietly(Command::new(&python).args(["-c", asked]))
    };
    let missing = "a Python from 3.11 on with venv is missing; remedy: install python3-venv, or \
                   name one: PYTHON=...";
    provide(found, "python3-venv", missing)?;
    Ok(python)
}

/// A reader of PDF files, for the test of the unit report. Without it that part of the test is
/// skipped and says so.
pub fn pdf_reader() {
    let there = Command::new("pdftotext").arg("-v").output().is_ok();
    if !there && let Err(missing) = install("poppler-utils", "pdftotext is missing") {
        println!("{missing:#}; the text of the PDF is not tested; remedy: install poppler-utils");
    }
}

/// Installs the package of a tool that is not `found`.
fn provide(found: impl Fn() -> bool, package: &str, missing: &str) -> Result<()> {
    if found() {
        return Ok(());
    }
    install(package, missing)?;
    ensure!(found(), "{missing}");
    Ok(())
}

/// Installs a package of Debian, where that needs no confirmation; else the error is `missing`. One
/// at a time: apt takes no second.
fn install(package: &str, missing: &str) -> Result<()> {
    static ONE: Mutex<()> = Mutex::new(());
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    if !(root() && Path::new("/etc/debian_version").exists()) {
        bail!(missing.to_owned());
    }
    eprintln!("        installs {package}: apt-get install {package}");
    let install = format!("install -qq --yes --no-install-recommends {package}");
    for arguments in ["update -qq", &install] {
        let mut apt = Command::new("apt-get");
        apt.args(arguments.split_whitespace())
            .env("DEBIAN_FRONTEND", "noninteractive")
            .stdin(Stdio::null());
        succeed(&mut apt).with_context(|| missing.to_owned())?;
    }
    Ok(())
}

fn root() -> bool {
    let id = Command::new("id").arg("-u").output();
    id.is_ok_and(|output| output.stdout.trim_ascii() == b"0")
}

/// Whether `cargo nextest` is installed.
pub fn nextest() -> bool {
    quietly(&mut cargo_with("nextest --version"))
}
