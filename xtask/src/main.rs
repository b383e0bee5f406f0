//! The single entry point, on a developer's machine and in CI: `cargo xtask <task>`.

mod check;
mod comments;
mod emulators;
mod flash;
mod fuzz;
mod hil_test;
mod mutants;
mod package;
mod release;
mod reproduce;
mod runner;
mod scale;
mod supply;
mod vectors;
mod wheel;

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

use anyhow::{Context, Result};
use clap::{Args, Parser, Subcommand};
use xtask::images::{BENCH, STM32F405_WINDOW, cargo};
use xtask::{boards, images, load, needs, stage, table, venv};

/// The checks and measurements of this workspace.
#[derive(Parser)]
#[command(bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// What a change must pass: format, lints, the boards' images, the quick tests, and equal bits
    /// of desktop and target in QEMU.
    Test {
        /// Leaves out what needs the target or QEMU.
        #[arg(long)]
        fast: bool,
    },
    /// All other checks: boards, wheel, fuzz targets, budgets, dependencies, oldest Rust, target
    /// lints, documentation, and the slow tests, in QEMU and a browser too.
    Check,
    /// Measures each piece of work: nanoseconds on this machine, instructions on a Cortex-M4F.
    #[command(disable_help_flag = true)]
    Bench(Handed),
    /// Measures `lrnn-nostd` in a crate of its own, and writes tables in lrnn-nostd/README.md.
    #[command(disable_help_flag = true)]
    Alone(Handed),
    /// Whether `lrnn-nostd` could be published: packs it, builds what is packed, and checks it for
    /// each core without `std` and with the oldest Rust that it names.
    Package,
    /// Compares the desktop side with the programs that a user would choose instead, and measures a
    /// recording of 24 h.
    #[command(disable_help_flag = true)]
    Beside(Handed),
    /// Measures how cost grows with rate, networks, weights, runs and cores.
    #[command(disable_help_flag = true)]
    Growth(Handed),
    /// Runs every board in QEMU and compares it with the desktop, bit for bit.
    #[command(disable_help_flag = true)]
    Qemu(Handed),
    /// Builds the boards over third-party drivers (firmware/boards), and compares flash and RAM
    /// with budgets.toml.
    #[command(disable_help_flag = true)]
    Boards(Handed),
    /// Runs our STM32 images in a third-party emulator (tests/rigless), whose compilation takes
    /// minutes.
    Emulators,
    /// Writes the image of a board with probe-rs and shows its log; or writes it as a file for the
    /// chip's boot loader.
    Flash {
        /// The board: stm32f405, or one of firmware/boards.
        #[arg(value_name = "BOARD", default_value = "stm32f405")]
        #[arg(conflicts_with_all = ["bench", "window"])]
        board: String,
        /// The bench image instead, for an STM32F4, F7 or H7: it counts the cycles of the work
        /// whose instructions `bench` counts.
        #[arg(long)]
        bench: bool,
        /// The STM32F405's image without the learner from fixes and without ADIS: half the flash.
        #[arg(long, conflicts_with = "bench")]
        window: bool,
        /// The chip, as `probe-rs chip list` calls it: with `--bench` an STM32F4, F7 or H7, for
        /// stm32f405 one of STM32F405, F407, F415, F417.
        #[arg(long, value_name = "NAME")]
        chip: Option<String>,
        /// No probe: a file for the drive of an RP2350.
        #[arg(long, value_name = "FILE", conflicts_with = "chip")]
        uf2: Option<PathBuf>,
        /// No probe: a file for the boot loader of an STM32.
        #[arg(long, value_name = "FILE", conflicts_with_all = ["uf2", "chip"])]
        dfu: Option<PathBuf>,
    },
    /// Writes the image of a board with probe-rs, plays sensor, receiver and user at its lines, and
    /// writes what came of it into a file to send in.
    HilTest(hil_test::Bench),
    /// Makes tables and pictures of the pages again: the cheap ones, those named, or all.
    #[command(disable_help_flag = true)]
    Figures(Handed),
    /// Reads a million damaged bytes of every protocol and counts what is lost or wrongly accepted.
    Fuzz {
        /// A hundred million bytes of each, with a log; continues where it was interrupted.
        #[arg(long, conflicts_with = "targets")]
        long: bool,
        /// Instead: builds the fuzz targets and runs each from its corpus.
        #[arg(long)]
        targets: bool,
        /// How long each target runs, s.
        #[arg(long, default_value_t = 10, requires = "targets")]
        seconds: u32,
        /// Only this target.
        #[arg(long, value_name = "NAME", requires = "targets")]
        only: Option<String>,
        /// Seed of the inputs: the same number tries the same ones. Without it, others each time.
        #[arg(long, value_name = "NUMBER", requires = "targets")]
        seed: Option<u32>,
    },
    /// Checks licences, sources, duplicates and advisories of all dependencies with `cargo deny`.
    Supply,
    /// Whether the tests of `lrnn-nostd` notice small changes of its code: a part of the changes,
    /// with `cargo mutants`.
    Mutants {
        /// The part, from 0 on.
        #[arg(long, value_name = "NUMBER", default_value_t = 0)]
        part: usize,
    },
    /// Builds the content of a release into target/release-VERSION: images, host-sim, the Python
    /// wheel, bills of materials, checksums, a page.
    Release(release::Order),
    /// Builds the image of the STM32F405 in two folders and compares both.
    Reproduce,
    /// Campaigns on Dask workers that are killed in the middle: the bytes of one process. Installs
    /// Python's packages in target/scale.
    Scale,
    /// Builds a board's images for both slots with its loader, and signs the update of them; or
    /// makes a key.
    #[command(disable_help_flag = true)]
    Sign(Handed),
    /// Compares flash and RAM of each image with budgets.toml.
    #[command(disable_help_flag = true)]
    Size(Handed),
    /// Builds the Python wheel, installs it into a virtual environment below the target folder, and
    /// runs its tests, its notebooks and the check of its stub. PYTHON names another interpreter
    /// than `python3`.
    Wheel {
        /// Before that, builds it optimised into target/wheel/release, and measures calls.
        #[arg(long)]
        release: bool,
    },
    /// Writes the shared test vectors and their expected digests again, after an intended change of
    /// the arithmetic.
    Vectors,
}

/// Arguments that are passed on to `tests/measure`, including `--help`.
#[derive(Args)]
struct Handed {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    words: Vec<OsString>,
}

/// The program of `tests/measure`, with a task.
fn measure(task: &str) -> Command {
    let mut run = cargo();
    run.args(["run", "--quiet", "--package", "measure", "--", task]);
    run
}

/// Runs it, and ends with its exit code.
fn hand(task: &str, handed: Handed) -> Result<ExitCode> {
    let status = measure(task).args(handed.words).status();
    let code = status.context("cannot start cargo")?.code();
    Ok(code.map_or(ExitCode::FAILURE, |code| ExitCode::from(code as u8)))
}

fn main() -> ExitCode {
    let done = match Arguments::parse().task {
        Task::Test { fast } => check::test(fast),
        Task::Check => check::check(),
        Task::Bench(handed) => hand("bench", handed),
        Task::Alone(handed) => hand("alone", handed),
        Task::Package => package::package(),
        Task::Beside(handed) => hand("beside", handed),
        Task::Growth(handed) => hand("growth", handed),
        Task::Qemu(handed) => hand("qemu", handed),
        Task::Boards(handed) => hand("boards", handed),
        Task::Emulators => emulators::emulators(),
        Task::Flash {
            board,
            bench,
            window,
            chip,
            uf2,
            dfu,
        } => {
            let way = flash::FlashMethod { chip, uf2, dfu };
            match (bench, window) {
                (true, _) => flash::flash(BENCH, &way),
                (_, true) => flash::flash(STM32F405_WINDOW, &way),
                _ => flash::flash_board(&board, &way),
            }
        }
        Task::HilTest(bench) => hil_test::hil_test(&bench),
        Task::Figures(handed) => hand("figures", handed),
        Task::Fuzz {
            targets: true,
            seconds,
            only,
            seed,
            ..
        } => fuzz::targets(seconds, only.as_deref(), seed).map(|()| ExitCode::SUCCESS),
        Task::Fuzz { long, .. } => fuzz::damage(long),
        Task::Supply => supply::supply(),
        Task::Mutants { part } => mutants::mutants(part),
        Task::Release(order) => release::release(&order),
        Task::Reproduce => needs::target().and_then(|()| reproduce::reproduce()),
        Task::Scale => scale::scale(),
        Task::Sign(handed) => hand("sign", handed),
        Task::Size(handed) => hand("size", handed),
        Task::Wheel { release } => wheel::wheel(release),
        Task::Vectors => vectors::regenerate(),
    };
    match done {
        Ok(code) => code,
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use documents::{judge, shown};

    /// What the pages show of `cargo xtask` are tasks with their options. Those of tests/measure
    /// are parsed there.
    #[test]
    fn tasks_in_the_documents_are_tasks() {
        let (mut seen, mut wrong) = (0, Vec::new());
        for shown in shown() {
            let Some(words) = shown.after("cargo xtask") else {
                continue;
            };
            let words = words.iter().filter(|word| *word != "...");
            let given = ["xtask"].into_iter().chain(words.map(String::as_str));
            wrong.extend(judge(&shown, Arguments::try_parse_from(given)).err());
            seen += 1;
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
        assert!(seen > 30, "{seen} commands");
    }
}
