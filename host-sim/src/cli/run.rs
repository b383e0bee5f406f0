//! `host-sim run`.

use crate::error::Error;
use crate::experiment::run::{Options, run};
use crate::experiment::scenario::Scenario;
use crate::output::write_atomic;
use crate::report::{json, page, table};
use clap::Args as ClapArgs;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Arguments of `run`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    /// Built-in scenario (medium, nav, tactical) or a TOML file
    #[arg(long, default_value = "medium", value_name = "NAME|FILE.toml")]
    scenario: String,
    /// Seed of everything random: unit, turn-ons, roads, noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The paper's own protocol: judge on the very drive that was learnt from
    #[arg(long)]
    in_sample: bool,
    /// Write the table as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Directory of the report [default: out/run-SCENARIO-SEED]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Args {
    /// Simulates, learns, judges, prints and writes.
    pub(super) fn run(&self) -> Result<(), Error> {
        let scenario = Scenario::load(&self.scenario)?;
        let options = Options {
            seed: self.seed,
            in_sample: self.in_sample,
        };
        let progress = Progress::new();
        let mut report = run(&scenario, &options, &|stage| progress.stage(stage))?;
        report.set_up.push(("command".into(), self.command()));
        let suffix = if self.in_sample { "-in-sample" } else { "" };
        let default = format!("out/run-{}-{}{suffix}", scenario.name, self.seed);
        let dir = self.out.clone().unwrap_or_else(|| PathBuf::from(default));
        progress.stage("writing the report");
        let done = finish(&report, &dir, self.json.as_deref());
        progress.end();
        done
    }

    fn command(&self) -> String {
        let in_sample = if self.in_sample { " --in-sample" } else { "" };
        format!(
            "cargo run --release -- run --scenario {} --seed {}{in_sample}",
            self.scenario, self.seed
        )
    }
}

/// Prints the table and writes report and JSON.
pub(super) fn finish(
    report: &crate::experiment::results::Report,
    dir: &Path,
    json_file: Option<&Path>,
) -> Result<(), Error> {
    // everything that can be wrong with the results is found before anything is written
    let text = json::json(&report.results)?;
    let index = page::write(dir, report)?;
    if let Some(file) = json_file {
        write_atomic(file, text.as_bytes())?;
    }
    println!("{}\n\n{}", report.title, table::table(&report.results));
    for note in &report.notes {
        println!("- {note}");
    }
    println!("\nreport: {}", index.display());
    Ok(())
}

/// A spinner with the present stage, on standard error; silent when that is not a terminal.
pub(super) struct Progress(ProgressBar);

impl Progress {
    pub(super) fn new() -> Self {
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(100));
        Self(bar)
    }

    pub(super) fn stage(&self, text: &str) {
        self.0.set_message(text.to_string());
    }

    pub(super) fn end(&self) {
        self.0.finish_and_clear();
    }
}
