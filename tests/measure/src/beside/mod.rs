//! `cargo xtask beside`: comparison with the programs that a user would choose instead, on the same
//! bytes in one run. Whole processes run in turn, several times, so that other load on the machine
//! affects all of them. It writes the part of `docs/PERFORMANCE.md` between the markers. No figure
//! there is written by hand.

mod allan;
mod day;
mod filter;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use qemu::images::target_directory;

use crate::child::Used;
use crate::markers;
use crate::stage::{cargo_with, succeed};

/// How often each program runs.
const ROUNDS: usize = 5;

/// The programs of this package, built, and a folder for their files.
struct Programs {
    /// `host-sim`.
    program: PathBuf,
    /// The example that does the same work as the other programs.
    ours: PathBuf,
    folder: PathBuf,
}

impl Programs {
    fn new() -> Result<Self> {
        succeed(&mut cargo_with(
            "build --quiet --release --package host-sim --package host-lab --bin host-sim \
             --example beside",
        ))?;
        let target = target_directory()?;
        let folder = target.join("xtask-beside");
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        Ok(Self {
            program: target.join("release/host-sim"),
            ours: target.join("release/examples/beside"),
            folder,
        })
    }
}

/// Measures, prints, writes. A result that differs from the other program's is an error, and so is
/// a day's recording that takes more memory than its budget.
pub fn beside() -> Result<ExitCode> {
    eprintln!("[1/4] programs");
    let programs = Programs::new()?;
    eprintln!("[2/4] Allan deviation beside AllanTools");
    let mut part = allan::measure(&programs)?;
    eprintln!("[3/4] filters beside KF-GINS");
    part += &filter::measure(&programs)?;
    eprintln!("[4/4] a recording of 24 h");
    let (day, exceeded) = day::measure(&programs)?;
    part += &day;
    println!("{part}");
    markers::write("beside", &part)?;
    anyhow::ensure!(exceeded.is_empty(), "over budget: {exceeded:?}");
    Ok(ExitCode::SUCCESS)
}

/// Median and range of seconds, for a table.
fn seconds([least, median, most]: [f64; 3]) -> String {
    format!("{median:.2} ({least:.2} .. {most:.2})")
}

/// Peak memory over all runs.
fn peak<'a>(runs: impl IntoIterator<Item = &'a Used>) -> String {
    let peaks = runs.into_iter().map(|used| used.peak_mib);
    let most = peaks.reduce(|a, b| Some(a?.max(b?))).flatten();
    most.map_or("unknown".to_owned(), |mib| format!("{mib:.0}"))
}
