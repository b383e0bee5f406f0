//! `cargo xtask test` and `cargo xtask check`. In each, the code for the target is checked in
//! parallel with the code for this machine: images are linked on one core, and both have folders of
//! their own. The tests come last, so that the output ends with the closing lines of their runner.

use std::process::{Command, ExitCode};
use std::thread;

use anyhow::Result;

use crate::boards::{DRIVERS, FAMILIES};
use crate::images::{AGREEMENT, DIFFERENT, TARGET, apart, for_target, target_directory};
use crate::runner::TestSet;
use crate::stage::{Stages, cargo_with, quietly, succeed};
use crate::{boards, comments, fuzz, mutants, needs, package, reproduce, supply, wheel};

/// Packages that are compiled for the target: each alone, so that it does not depend on other
/// packages' features.
const TARGET_PACKAGES: [&str; 6] = [
    "lrnn-nostd",
    "vectors",
    "firmware",
    "soak",
    "qemu",
    "silicon",
];

/// The workspaces whose format is checked.
const FORMATTED: [&str; 6] = [
    "fmt --all --check",
    "fmt --check --manifest-path tests/chip/Cargo.toml",
    "fmt --check --manifest-path tests/rigless/Cargo.toml",
    "fmt --check --manifest-path tests/rp2350/Cargo.toml",
    "fmt --all --check --manifest-path firmware/boards/Cargo.toml",
    "fmt --check --manifest-path tests/alone/Cargo.toml",
];

/// Lints that Clippy denies.
const DENIED: [&str; 2] = ["-D", "warnings"];

/// `cargo xtask test`: what a change must pass before review; `fast` leaves out what needs the
/// target or QEMU. The exit code is the test runner's.
pub fn test(fast: bool) -> Result<ExitCode> {
    let stages = Stages::new(if fast { 5 } else { 7 });
    let part = TestSet::Quick { qemu: !fast };
    stages.run("format, length of comments", || {
        FORMATTED
            .iter()
            .try_for_each(|options| succeed(&mut cargo_with(options)))?;
        comments::check()
    })?;
    let here = || {
        stages.run("lints", || {
            succeed(cargo_with("clippy --quiet --workspace --all-targets --").args(DENIED))
        })?;
        stages.run("build of tests", || part.build())?;
        stages.run("documentation tests", || {
            succeed(&mut cargo_with("test --quiet --workspace --doc"))
        })
    };
    if fast {
        here()?;
    } else {
        beside(here, || {
            stages.run("prepare: target, QEMU", || {
                needs::target().and_then(|()| needs::emulator())
            })?;
            stages.run("target builds: boards, agreement", || {
                build_alone("firmware")?;
                [AGREEMENT, DIFFERENT]
                    .into_iter()
                    .try_for_each(|image| image.build().map(drop))
            })
        })?;
    }
    part.run(&stages)
}

/// `cargo xtask check`: all other checks. The exit code is the test runner's.
pub fn check() -> Result<ExitCode> {
    let stages = Stages::new(16);
    stages.run("dependencies: licences, sources, duplicates", supply::check)?;
    let here = || {
        stages.run("documentation", documentation)?;
        stages.run("Python wheel: build, tests, notebooks", wheel::check)?;
        stages.run("fuzz targets", || fuzz::targets(4, None, Some(1)))?;
        stages.run("mutants of lrnn-nostd: a part", mutants::check)?;
        stages.run("queue of the two priorities under Miri", miri)?;
        stages.run("build of tests and of what measures", all_tests)
    };
    beside(here, || target(&stages))?;
    // all images are built by now
    stages.run("flash, RAM and panic budgets", || {
        ["size", "boards"].into_iter().try_for_each(measured)
    })?;
    TestSet::Slow.run(&stages)
}

/// Runs both at the same time.
fn beside(
    here: impl FnOnce() -> Result<()>,
    target: impl FnOnce() -> Result<()> + Send,
) -> Result<()> {
    thread::scope(|scope| {
        let theirs = scope.spawn(target);
        let ours = here();
        ours.and(theirs.join().expect("no panic in a stage"))
    })
}

/// Compiles the code for the target, all in the folder of the images. Missing tools are fetched
/// before, while the other thread computes.
fn target(stages: &Stages) -> Result<()> {
    stages.run("prepare: targets, QEMU, browser, reader of PDF", || {
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

/// Where a nightly has Miri, it runs what is unsafe on this machine: a race, a value dropped twice
/// or lost is an error.
fn miri() -> Result<()> {
    let nightly = || {
        let mut rustup = Command::new("rustup");
        rustup.args(["run", "nightly", "cargo", "miri"]);
        rustup
    };
    if !quietly(nightly().arg("--version")) {
        println!("Miri: not tried; remedy: rustup toolchain install nightly --component miri");
        return Ok(());
    }
    let mut tests = nightly();
    tests
        .args([
            "test",
            "--quiet",
            "--package",
            "firmware",
            "--lib",
            "--target-dir",
        ])
        .arg(target_directory()?.join("miri"))
        .args(["--", "link::spsc"]);
    succeed(&mut tests)
}

fn target_lints() -> Result<()> {
    TARGET_PACKAGES
        .iter()
        .try_for_each(|package| succeed(for_target("clippy", package)?.arg("--").args(DENIED)))
}

fn target_builds() -> Result<()> {
    TARGET_PACKAGES.into_iter().try_for_each(build_alone)?;
    for (feature, program) in DRIVERS {
        let mut build = apart("build", "tests/chip", "chip", Some(TARGET))?;
        succeed(build.args(["--features", feature, "--bin", program]))?;
    }
    succeed(&mut apart("build", "tests/rp2350", "rp2350", None)?)
}

/// Builds a package into the directory of the images, with their profile. So the size stage and the
/// tests find the images built.
fn build_alone(package: &str) -> Result<()> {
    succeed(&mut for_target("build", package)?)
}

/// Runs all tests. The features are those of the tests, so that nothing is compiled for the budgets
/// alone.
fn all_tests() -> Result<()> {
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
