//! Programs over third-party drivers for the chip model (`tests/chip`, a workspace of its own): how
//! they are built, and what the model reports of their runs.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use crate::images::{TARGET, apart, target_directory};
use crate::judges::ask;

/// A driver crate that is proven on real chips.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Driver {
    /// `stm32f4xx-hal`.
    Hal,
    /// `embassy-stm32`.
    Embassy,
}

impl Driver {
    /// Both drivers.
    pub const ALL: [Self; 2] = [Self::Hal, Self::Embassy];

    /// Name of its feature in `tests/chip`.
    #[must_use]
    pub const fn feature(self) -> &'static str {
        match self {
            Self::Hal => "hal",
            Self::Embassy => "embassy",
        }
    }

    /// Name of its program in `tests/chip`.
    #[must_use]
    pub const fn program(self) -> &'static str {
        match self {
            Self::Hal => "chip-hal",
            Self::Embassy => "chip-embassy",
        }
    }

    /// Builds its program and returns the path.
    ///
    /// # Errors
    /// cargo cannot be started, or the build fails; cargo has printed why.
    pub fn build(self) -> Result<PathBuf> {
        let name = self.program();
        let mut build = apart("build", "tests/chip", "chip", Some(TARGET))?;
        build.args(["--features", self.feature(), "--bin", name]);
        let status = build.status().context("cannot start cargo")?;
        ensure!(status.success(), "building {name} failed");
        Ok(target_directory()?
            .join("chip")
            .join(TARGET)
            .join("debug")
            .join(name))
    }
}

/// Ports of the trace: what a word that a program reports is. The numbers are those of
/// `chip::Report`.
pub mod report {
    /// A point in time; the word has no meaning.
    pub const MARK: u32 = 0;
    /// Hz of the core, of the slow and of the fast bus.
    pub const CLOCKS: [u32; 3] = [1, 2, 3];
    /// Bytes received so far, at each read.
    pub const READ: u32 = 4;
    /// How often the line was idle.
    pub const IDLE: u32 = 5;
    /// A word of memory or of a bus.
    pub const WORD: u32 = 6;
    /// Result of an operation: 0, or the driver reported an error.
    pub const ERROR: u32 = 7;
    /// Flags of RCC_CSR.
    pub const CAUSE: u32 = 8;
    /// Seconds of the day.
    pub const SECONDS: u32 = 9;
    /// The date.
    pub const DATE: u32 = 10;
    /// Interrupts served.
    pub const INTERRUPTS: u32 = 12;
    /// The program has ended.
    pub const DONE: u32 = 30;
}

/// Results of a run in the model.
#[derive(Debug, Default)]
pub struct Run {
    /// Words at the trace port: port, word, time in us.
    pub reports: Vec<(u32, u32, f64)>,
    /// Times of the chip's starts, ms.
    pub starts: Vec<f64>,
    /// Clocks in the model: core, slow bus and fast bus, Hz.
    pub clocks: Vec<u32>,
    /// Divider of the line, and bits per character.
    pub line: Vec<u32>,
    /// Bytes sent on the line, hexadecimal.
    pub sent: String,
    /// When the last byte had left, us.
    pub last_us: f64,
    /// Why the run ended early, if it did.
    pub wrong: Option<String>,
}

impl Run {
    /// The words of one kind.
    #[must_use]
    pub fn words(&self, kind: u32) -> Vec<u32> {
        let of = self.reports.iter().filter(|report| report.0 == kind);
        of.map(|report| report.1).collect()
    }

    /// When the words of one kind were reported, us.
    #[must_use]
    pub fn times(&self, kind: u32) -> Vec<f64> {
        let of = self.reports.iter().filter(|report| report.0 == kind);
        of.map(|report| report.2).collect()
    }
}

/// Runs programs in the model, with the mutant `broken` if one is given, and returns the results of
/// each.
///
/// # Errors
/// The model fails, or its output is not understood.
pub fn run(python: &Path, broken: Option<&str>, runs: &[Value]) -> Result<Vec<Run>> {
    let asked = json!({"break": broken, "runs": runs}).to_string();
    let mut all: Vec<Run> = Vec::new();
    for line in ask(python, "stm32chip.py", asked.as_bytes())? {
        let (name, rest) = line.split_once(' ').unwrap_or((&line, ""));
        if name == "run" {
            all.push(Run::default());
            continue;
        }
        let run = all.last_mut().context("a line before the first run")?;
        read(run, name, rest).with_context(|| line.clone())?;
    }
    Ok(all)
}

fn read(run: &mut Run, name: &str, rest: &str) -> Result<()> {
    let words: Vec<&str> = rest.split_whitespace().collect();
    match (name, &words[..]) {
        ("report", [kind, word, at]) => {
            run.reports
                .push((kind.parse()?, word.parse()?, at.parse()?));
        }
        ("start", [at, _]) => run.starts.push(at.parse()?),
        ("clock", clocks) => {
            run.clocks = clocks
                .iter()
                .map(|hz| hz.parse())
                .collect::<Result<_, _>>()?;
        }
        ("line", [divider, bits, sent, last]) => {
            run.line = vec![divider.parse()?, bits.parse()?];
            run.sent = (*sent).to_owned();
            run.last_us = last.parse()?;
        }
        ("wrong", _) => run.wrong = Some(rest.to_owned()),
        _ => {}
    }
    Ok(())
}
