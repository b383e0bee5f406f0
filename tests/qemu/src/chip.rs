//! Programs over other people's drivers for the chip model (`tests/chip`, a workspace of its own):
//! how they are built, and what the model tells of their runs.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use crate::images::{TARGET, apart, target_directory};
use crate::judges::ask;

/// A crate of drivers that many chips have judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Driver {
    /// `stm32f4xx-hal`.
    Hal,
    /// `embassy-stm32`.
    Embassy,
}

impl Driver {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Hal, Self::Embassy];

    /// Its feature in `tests/chip`.
    #[must_use]
    pub const fn feature(self) -> &'static str {
        match self {
            Self::Hal => "hal",
            Self::Embassy => "embassy",
        }
    }

    /// Its program there.
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

/// What a word at the trace port is; the numbers are those of `chip::Report`.
pub mod told {
    /// A point of time.
    pub const MARK: u32 = 0;
    /// Hz of the core, of the slow and of the fast bus.
    pub const CLOCKS: [u32; 3] = [1, 2, 3];
    /// Bytes so far, at each read.
    pub const READ: u32 = 4;
    /// How often the line was idle.
    pub const IDLE: u32 = 5;
    /// A word of memory or of a bus.
    pub const WORD: u32 = 6;
    /// What a driver says of an error.
    pub const ERROR: u32 = 7;
    /// Flags of RCC_CSR.
    pub const CAUSE: u32 = 8;
    /// Seconds of the day.
    pub const SECONDS: u32 = 9;
    /// The date.
    pub const DATE: u32 = 10;
    /// Interrupts served.
    pub const INTERRUPTS: u32 = 12;
    /// The end.
    pub const DONE: u32 = 30;
}

/// What the model tells of a run.
#[derive(Debug, Default)]
pub struct Run {
    /// Words at the trace port: what it is, the word, when in microseconds.
    pub told: Vec<(u32, u32, f64)>,
    /// Starts, ms.
    pub starts: Vec<f64>,
    /// Hz of the core, of the slow and of the fast bus, as they are.
    pub clocks: Vec<u32>,
    /// Divider of the line, bits of a byte.
    pub line: Vec<u32>,
    /// What left on the line, hexadecimal.
    pub sent: String,
    /// When the last byte had left, us.
    pub last_us: f64,
    /// What ended the run before its end.
    pub wrong: Option<String>,
}

impl Run {
    /// The words of one kind.
    #[must_use]
    pub fn words(&self, kind: u32) -> Vec<u32> {
        let of = self.told.iter().filter(|told| told.0 == kind);
        of.map(|told| told.1).collect()
    }

    /// When the words of one kind were told, us.
    #[must_use]
    pub fn times(&self, kind: u32) -> Vec<f64> {
        let of = self.told.iter().filter(|told| told.0 == kind);
        of.map(|told| told.2).collect()
    }
}

/// Runs programs in the model, broken as told, and returns what it tells of each.
///
/// # Errors
/// The model fails, or tells what is not understood.
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
        ("told", [kind, word, at]) => run.told.push((kind.parse()?, word.parse()?, at.parse()?)),
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
