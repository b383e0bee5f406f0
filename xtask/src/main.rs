//! The one front door, the same on a developer's machine and in CI: `cargo xtask <task>`.

mod alone;
mod bench;
mod beside;
mod check;
mod child;
mod comments;
mod flash;
mod fuzz;
mod growth;
mod markers;
mod needs;
mod package;
mod pytorch;
mod qemu;
mod reproduce;
mod size;
mod stack;
mod stage;
mod supply;
mod table;
mod times;
mod vectors;

use std::path::PathBuf;
use std::process::ExitCode;

use ::qemu::images::{BENCH, STM32F405, STM32F405_WINDOW};
use clap::{Parser, Subcommand};

/// The checks and measurements of this workspace.
#[derive(Parser)]
#[command(bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Every check: format, lints, target builds, size and panic budgets, documentation, all tests,
    /// those in QEMU too.
    Test {
        /// Leaves out what needs the target or QEMU.
        #[arg(long)]
        fast: bool,
    },
    /// Measures each piece of work: nanoseconds on this machine, instructions on a Cortex-M4F.
    Bench {
        /// Also writes the figures to this file.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Measures `lrnn-nostd` in a crate of its own: on five cores, whose digests it compares with
    /// the desktop's, and at every level of optimisation. Writes tables in lrnn-nostd/README.md.
    Alone,
    /// Whether `lrnn-nostd` could be published: packs it, builds what is packed, and checks it for
    /// each core without `std` and with the oldest Rust that it names.
    Package,
    /// Measures the desktop side beside what a user would pick instead, and a recording of 24 h.
    /// Takes some minutes and 3 GB of disk. PYTHON names a Python with AllanTools, KFGINS the
    /// program KF-GINS; what is missing is left out. Writes tables in docs/PERFORMANCE.md.
    Beside,
    /// Measures how cost grows with rate, networks, weights, runs and cores. Takes minutes. Writes
    /// docs/growth-*.svg and tables in docs/PERFORMANCE.md.
    Growth,
    /// Runs every board in QEMU: serial lines, a drive of 22 minutes, instructions, stack. Compares
    /// the target with the desktop, bit for bit.
    Qemu {
        /// Also writes the figures to this file.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Writes the image to an STM32F405 with probe-rs and shows its log.
    Flash {
        /// The bench image instead, for an STM32F4, F7 or H7: it counts the cycles of the work
        /// whose instructions `bench` counts.
        #[arg(long)]
        bench: bool,
        /// The image without the learner from fixes and without ADIS: 90 KiB of flash.
        #[arg(long, conflicts_with = "bench")]
        window: bool,
        /// The chip, as `probe-rs chip list` calls it: with `--bench` an STM32F4, F7 or H7, else
        /// one of STM32F405, F407, F415, F417.
        #[arg(long, value_name = "NAME", default_value = flash::CHIP)]
        chip: String,
    },
    /// Reads a million damaged bytes of every protocol and counts what is lost or wrongly accepted.
    Fuzz {
        /// A hundred million bytes of each, with a log; goes on where it was interrupted.
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
        /// Of the inputs that are tried: the same number tries the same ones. Without it, others
        /// each time.
        #[arg(long, value_name = "NUMBER", requires = "targets")]
        seed: Option<u32>,
    },
    /// Checks licences, sources and duplicates of all dependencies; and advisories, where
    /// `cargo deny` is installed and can fetch them.
    Supply,
    /// Writes a bill of materials (CycloneDX) for each package, with cargo-cyclonedx.
    Sbom,
    /// Builds the image of the STM32F405 in two folders and compares both.
    Reproduce,
    /// Compares flash and RAM of each image with budgets.toml.
    Size,
    /// Bounds each board's stack from its call graph, and compares the bound with the room.
    Stack {
        /// Also writes the figures to this file.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Writes the shared test vectors and their expected digests again, after an intended change of
    /// the arithmetic.
    Vectors,
}

fn main() -> ExitCode {
    let done = match Arguments::parse().task {
        Task::Test { fast } => check::test(fast),
        Task::Bench { json } => bench::bench(json.as_deref()),
        Task::Alone => alone::alone(),
        Task::Package => package::package(),
        Task::Beside => beside::beside(),
        Task::Growth => growth::growth(),
        Task::Qemu { json } => qemu::qemu(json.as_deref()),
        Task::Flash {
            bench,
            window,
            chip,
        } => {
            let image = match (bench, window) {
                (true, _) => BENCH,
                (_, true) => STM32F405_WINDOW,
                _ => STM32F405,
            };
            flash::flash(image, &chip)
        }
        Task::Fuzz {
            targets: true,
            seconds,
            only,
            seed,
            ..
        } => fuzz::targets(seconds, only.as_deref(), seed).map(|()| ExitCode::SUCCESS),
        Task::Fuzz { long, .. } => fuzz::damage(long),
        Task::Supply => supply::supply(),
        Task::Sbom => supply::sbom(),
        Task::Reproduce => needs::target().and_then(|()| reproduce::reproduce()),
        Task::Size => needs::target().and_then(|()| size::size()),
        Task::Stack { json } => needs::target().and_then(|()| stack::stack(json.as_deref())),
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
