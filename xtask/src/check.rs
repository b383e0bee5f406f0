//! `cargo xtask test`: cheap and general checks come first. Then what is compiled for the target is
//! looked at beside what is compiled for this machine: images are linked on one core, and both have
//! folders of their own. The tests come last, so that the output ends with the closing lines of
//! their runner.

use std::num::NonZero;
use std::process::{Command, ExitCode};
use std::thread;

use anyhow::{Context, Result};

use crate::boards::{DRIVERS, FAMILIES};
use crate::images::{PROFILE, REQUIRE, TARGET, apart, target_directory, without_paths, workspace};

use crate::stage::{Stages, cargo_with, succeed};
use crate::{boards, comments, fuzz, needs, package, reproduce, supply, wheel};

/// What is compiled for the target: each alone, so that no other package's features help it.
const TARGET_PACKAGES: [&str; 6] = [
    "lrnn-nostd",
    "vectors",
    "firmware",
    "soak",
    "qemu",
    "silicon",
];

/// What Clippy is told.
const DENIED: [&str; 2] = ["-D", "warnings"];

/// Runs every stage; the exit code is the last one's.
pub fn test(fast: bool) -> Result<ExitCode> {
    let stages = Stages::new(if fast { 6 } else { 17 });
    stages.run("format, length of comments", || {
        succeed(&mut cargo_with("fmt --all --check"))?;
        succeed(&mut cargo_with(
            "fmt --check --manifest-path tests/chip/Cargo.toml",
        ))?;
        succeed(&mut cargo_with(
            "fmt --check --manifest-path tests/rigless/Cargo.toml",
        ))?;
        succeed(&mut cargo_with(
            "fmt --check --manifest-path tests/rp2350/Cargo.toml",
        ))?;
        succeed(&mut cargo_with(
            "fmt --all --check --manifest-path firmware/boards/Cargo.toml",
        ))?;
        succeed(&mut cargo_with(
            "fmt --check --manifest-path tests/alone/Cargo.toml",
        ))?;
        comments::check()
    })?;
    stages.run("dependencies: licences, sources, duplicates", supply::check)?;
    if fast {
        here(&stages)?;
    } else {
        thread::scope(|scope| {
            let beside = scope.spawn(|| target(&stages));
            let ours = here(&stages)
                .and_then(|()| stages.run("Python wheel: build, tests, notebooks", wheel::check))
                .and_then(|()| stages.run("fuzz targets", || fuzz::targets(4, None, Some(1))))
                .and_then(|()| stages.run("build of tests and of what measures", tests));
            let theirs = beside.join().expect("no panic in a stage");
            ours.and(theirs)
        })?;
        // all images are built by now
        stages.run("flash, RAM and panic budgets", || {
            ["size", "boards"].into_iter().try_for_each(measured)
        })?;
    }
    last(&stages, fast)
}

/// What is compiled for this machine.
fn here(stages: &Stages) -> Result<()> {
    stages.run("lints", || {
        succeed(cargo_with("clippy --quiet --workspace --all-targets --").args(DENIED))
    })?;
    stages.run("documentation", documentation)?;
    stages.run("documentation tests", || {
        succeed(&mut cargo_with("test --quiet --workspace --doc"))
    })
}

/// What is compiled for the target, all in the folder of the images. What the machine lacks is
/// fetched before, while the other thread computes.
fn target(stages: &Stages) -> Result<()> {
    stages.run("prepare: target, QEMU, browser, reader of PDF", || {
        needs::targets()?;
        needs::alone()?;
        needs::pdf_reader();
        needs::browser()
    })?;
    stages.run("target lints", target_lints)?;
    stages.run("target builds, each package alone", target_builds)?;
    stages.run(
        "lrnn-nostd alone: package, cores, oldest Rust",
        package::check,
    )?;
    stages.run("boards over other drivers: build", || {
        FAMILIES
            .into_iter()
            .try_for_each(|family| family.build().map(drop))?;
        boards::examples()
    })?;
    stages.run(
        "lints of boards, judges and lrnn-nostd alone",
        boards::lints,
    )?;
    stages.run("image is the same from another folder", || {
        reproduce::reproduce().map(drop)
    })
}

fn target_lints() -> Result<()> {
    let directory = target_directory()?.join("images");
    TARGET_PACKAGES.iter().try_for_each(|package| {
        let mut clippy = cargo_with("clippy --quiet --target");
        clippy
            .args([TARGET, "--profile", PROFILE, "--package", package])
            .arg("--target-dir")
            .arg(&directory)
            .arg("--")
            .args(DENIED);
        succeed(&mut clippy)
    })
}

/// Builds into the directory of the images, with their profile. So the size stage and the tests
/// find the images built.
fn target_builds() -> Result<()> {
    let directory = target_directory()?.join("images");
    TARGET_PACKAGES.iter().try_for_each(|package| {
        let mut build = cargo_with("build --quiet --target");
        build
            .args([
                TARGET,
                "--profile",
                PROFILE,
                "--package",
                package,
                "--target-dir",
            ])
            .arg(&directory);
        without_paths(&mut build, &workspace());
        succeed(&mut build)
    })?;
    for (feature, program) in DRIVERS {
        let mut build = apart("build", "tests/chip", "chip", Some(TARGET))?;
        succeed(build.args(["--features", feature, "--bin", program]))?;
    }
    succeed(&mut apart("build", "tests/rp2350", "rp2350", None)?)
}

/// With the features that the tests have, so that nothing is compiled for the budgets alone.
fn tests() -> Result<()> {
    let words = "build --quiet --workspace --tests --bin measure";
    succeed(&mut cargo_with(words))
}

/// A task of `tests/measure`, as [`tests`] has built it.
fn measured(task: &str) -> Result<()> {
    let program = target_directory()?.join("debug/measure");
    succeed(Command::new(program).arg(task))
}

fn documentation() -> Result<()> {
    let mut doc = cargo_with("doc --quiet --workspace --no-deps");
    succeed(doc.env("RUSTDOCFLAGS", "-D warnings"))
}

/// Unit, property and system tests, and the images in QEMU. Nothing is printed after the runner.
fn last(stages: &Stages, fast: bool) -> Result<ExitCode> {
    let mut runner = if needs::nextest() {
        stages.begin("tests (nextest)");
        let mut runner = cargo_with("nextest run --workspace --no-fail-fast");
        // some tests wait for a silence or for QEMU most of their time, so one more than cores
        let cores = thread::available_parallelism().map_or(1, NonZero::get);
        runner.args(["--test-threads", &(cores + 1).to_string()]);
        runner
    } else {
        stages.begin("tests");
        cargo_with("test --workspace --lib --bins --tests --no-fail-fast")
    };
    if fast {
        runner.args(["--exclude", "qemu"]);
    } else {
        runner.env(REQUIRE, "1").env("LRNN_REQUIRE_BROWSER", "1");
    }
    let status = runner.status().context("cannot start the test runner")?;
    Ok(if status.success() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(status.code().map_or(1, |code| code as u8))
    })
}
