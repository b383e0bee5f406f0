//! `cargo xtask reproduce`: the image of the STM32F405 is the same, to the byte, wherever it is
//! built.

use std::fs;
use std::path::Path;
use std::process::{Command, ExitCode};

use crate::images::{PROFILE, STM32F405, TARGET, cargo, workspace};
use anyhow::{Context, Result, ensure};

use crate::release::hex;
use crate::stage::succeed;

/// Builds the image here and from a copy of the sources in another folder, and compares both.
pub fn reproduce() -> Result<ExitCode> {
    let here = fs::read(STM32F405.build()?)?;
    let elsewhere = tempfile::tempdir()?;
    // a path of another length, so that a path in the image would shift what follows it
    let copy = elsewhere.path().join("another/folder");
    copy_sources(&workspace(), &copy)?;
    let directory = elsewhere.path().join("built");
    let mut build = cargo();
    build
        .args(["build", "--quiet", "--locked", "--profile", PROFILE])
        .args([
            "--target",
            TARGET,
            "--package",
            "firmware",
            "--bin",
            STM32F405.name,
        ])
        .arg("--target-dir")
        .arg(&directory)
        .current_dir(&copy);
    crate::images::without_paths(&mut build, &copy);
    succeed(&mut build)?;
    let there = fs::read(directory.join(TARGET).join(PROFILE).join(STM32F405.name))?;
    let sums = [&here, &there].map(|image| hex(image));
    println!("{}  here\n{}  elsewhere", sums[0], sums[1]);
    ensure!(
        sums[0] == sums[1],
        "the image depends on the folder where it is built"
    );
    Ok(ExitCode::SUCCESS)
}

/// Copies what git knows and what is new and not ignored, without anything that was built.
fn copy_sources(from: &Path, to: &Path) -> Result<()> {
    let list = Command::new("git")
        .args([
            "ls-files",
            "-z",
            "--cached",
            "--others",
            "--exclude-standard",
        ])
        .current_dir(from)
        .output()
        .context("cannot start git")?;
    ensure!(list.status.success(), "git ls-files failed");
    let names = String::from_utf8(list.stdout)?;
    for name in names.split_terminator('\0') {
        let (source, copy) = (from.join(name), to.join(name));
        if source.is_file() {
            fs::create_dir_all(copy.parent().unwrap_or(to))?;
            fs::copy(&source, &copy).with_context(|| name.to_owned())?;
        }
    }
    Ok(())
}
