//! Measures what is built, on this machine and in QEMU, and writes the figures of the pages. `cargo
//! xtask bench` and similar tasks run this program.

mod alone;
mod bench;
mod beside;
mod boards;
mod child;
mod facts;
mod figures;
mod growth;
mod markers;
mod pytorch;
mod qemu;
mod sign;
mod size;
mod table;
mod times;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use xtask::{needs, stage};

#[derive(Parser)]
#[command(bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Measures each piece of work: nanoseconds on this machine, instructions on a Cortex-M4F.
    Bench {
        /// Also writes the figures to this file.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Measures `lrnn-nostd` in a crate of its own: on five cores, whose digests it compares with
    /// the desktop's, and at every level of optimisation. Writes tables in lrnn-nostd/README.md.
    Alone,
    /// Compares the desktop side with the programs that a user would choose instead, and measures a
    /// recording of 24 h. Takes some minutes and 3 GB of disk. PYTHON names a Python with
    /// AllanTools, KFGINS the program KF-GINS; what is missing is left out. Writes tables in
    /// docs/PERFORMANCE.md.
    Beside,
    /// Builds the boards over third-party drivers (firmware/boards) and the examples of a custom
    /// main loop, and compares flash and RAM with budgets.toml.
    Boards {
        /// Only this board.
        only: Option<String>,
    },
    /// Versions of formats, and sizes of these images, a line each, for a release.
    #[command(hide = true)]
    Facts {
        /// Images.
        images: Vec<PathBuf>,
    },
    /// Makes tables and pictures of the pages again: the cheap ones, those named, or all.
    Figures(figures::Order),
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
    /// Builds a board's images for both slots with its loader, and signs the update of them.
    Sign(sign::Order),
    /// Compares flash and RAM of each image with budgets.toml.
    Size,
}

fn main() -> ExitCode {
    let done = match Arguments::parse().task {
        Task::Bench { json } => bench::bench(json.as_deref()),
        Task::Alone => alone::alone(),
        Task::Beside => beside::beside(),
        Task::Boards { only } => needs::targets().and_then(|()| boards::boards(only.as_deref())),
        Task::Facts { images } => facts::facts(&images),
        Task::Figures(order) => figures::figures(&order),
        Task::Growth => growth::growth(),
        Task::Qemu { json } => qemu::qemu(json.as_deref()),
        Task::Sign(order) => needs::targets().and_then(|()| sign::sign(&order)),
        Task::Size => needs::target().and_then(|()| size::size()),
    };
    match done {
        Ok(code) => code,
        Err(error) => {
            eprintln!("measure: {error:#}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use documents::{judge, shown};

    /// What the pages show of the tasks of this program has its options.
    #[test]
    fn tasks_in_the_documents_have_these_options() {
        let (mut seen, mut wrong) = (0, Vec::new());
        for shown in shown() {
            let words = shown.after("cargo xtask").unwrap_or_default();
            let tasks = <Arguments as clap::CommandFactory>::command();
            let ours = |word: &String| tasks.find_subcommand(word).is_some();
            if !words.first().is_some_and(ours) {
                continue;
            }
            let given = ["xtask"]
                .into_iter()
                .chain(words.iter().map(String::as_str));
            wrong.extend(judge(&shown, Arguments::try_parse_from(given)).err());
            seen += 1;
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
        assert!(seen > 20, "{seen} commands");
    }
}
