//! Reads a number of damaged bytes of each protocol and prints the counts. A log records what is
//! done; an interrupted run continues where it stopped.

use clap::Parser;
use damage::figures::Figures;
use damage::protocol::{Protocol, all};
use damage::{CHUNK, judge};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::error::Error;
use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write, stderr, stdout};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Chunks between two lines of the log.
const BATCH: u64 = 20;

/// Damaged bytes for every protocol, and what was read from them.
#[derive(Parser)]
struct Arguments {
    /// Millions of bytes of each protocol.
    #[arg(long, default_value_t = 1)]
    millions: u64,
    /// Only this protocol.
    #[arg(long)]
    protocol: Option<String>,
    /// Log of the progress, a line for each 20 million bytes. An existing log is continued.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
}

/// A line of the log.
#[derive(Serialize, Deserialize)]
struct Done {
    protocol: String,
    /// Number of chunks, from chunk 0 on, that the figures include.
    chunks: u64,
    figures: Figures,
}

/// Prints a line. A reader may have closed the pipe.
fn print(line: &str) -> Result<(), Box<dyn Error>> {
    match writeln!(stdout(), "{line}") {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(format!("standard output: cannot be written ({error})").into())
        }
        _ => Ok(()),
    }
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(stderr(), "damage: {error}"); // nobody may be reading
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let wanted = |protocol: &Protocol| {
        let name = arguments.protocol.as_deref();
        name.is_none_or(|name| name == protocol.name())
    };
    let protocols: Vec<_> = all().into_iter().filter(wanted).collect();
    if protocols.is_empty() {
        return Err("no protocol of this name".into());
    }
    let mut done = arguments
        .log
        .as_deref()
        .map_or(Ok(BTreeMap::new()), before)?;
    let bar = ProgressBar::new(arguments.millions * protocols.len() as u64).with_style(
        ProgressStyle::with_template("{msg:12} {wide_bar} {pos}/{len} million bytes, {eta} left")?,
    );
    let mut broken = Vec::new();
    print(&head())?;
    for protocol in protocols {
        let name = protocol.name().to_owned();
        bar.set_message(name.clone());
        let (mut chunks, mut figures) = done.remove(&name).unwrap_or_default();
        bar.inc(chunks.min(arguments.millions));
        while chunks < arguments.millions {
            let end = (chunks + BATCH).min(arguments.millions);
            let read = |number| judge::chunk(protocol, number, CHUNK);
            let read: Result<Vec<_>, _> = (chunks..end).into_par_iter().map(read).collect();
            match read {
                Ok(all) => all.iter().for_each(|one| figures.add(one)),
                Err(what) => {
                    broken.push(what);
                    break;
                }
            }
            bar.inc(end - chunks);
            chunks = end;
            if let Some(log) = &arguments.log {
                let (protocol, figures) = (name.clone(), figures.clone());
                let line = serde_json::to_string(&Done {
                    protocol,
                    chunks,
                    figures,
                })?;
                let mut file = OpenOptions::new().create(true).append(true).open(log)?;
                writeln!(file, "{line}")?;
            }
        }
        if let Err(what) = figures.check(protocol) {
            broken.push(format!("{name}: {what}"));
        }
        bar.suspend(|| print(&row(protocol, &figures)))?;
    }
    bar.finish_and_clear();
    if broken.is_empty() {
        Ok(())
    } else {
        Err(broken.join("\n").into())
    }
}

/// Reads the finished work from a log: the last line of each protocol.
fn before(log: &Path) -> Result<BTreeMap<String, (u64, Figures)>, Box<dyn Error>> {
    if let Some(folder) = log.parent() {
        fs::create_dir_all(folder)?;
    }
    if !log.exists() {
        return Ok(BTreeMap::new());
    }
    let mut done = BTreeMap::new();
    for line in fs::read_to_string(log)?.lines() {
        let line: Done = serde_json::from_str(line)?;
        done.insert(line.protocol, (line.chunks, line.figures));
    }
    Ok(done)
}

fn head() -> String {
    let titles = "| protocol | bytes | damage | good frames | lost | in a row | late, bytes | late, frames \
                  | wrong checksums | right by chance: expected | counted | ... of them swapped pieces |";
    format!("{titles}\n|{}", "---|".repeat(12))
}

fn row(protocol: Protocol, figures: &Figures) -> String {
    let swapped = figures.accidents.get(&damage::kind::Kind::Swap);
    format!(
        "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {:.2} | {} | {} |",
        protocol.name(),
        figures.bytes,
        figures.damaged,
        figures.good,
        figures.lost,
        figures.lost_in_a_row,
        figures.late_bytes,
        figures.late_frames,
        figures.trials,
        figures.expected(protocol),
        figures.accidents(),
        swapped.copied().unwrap_or_default(),
    )
}
