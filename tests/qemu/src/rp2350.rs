//! A third-party emulator of the Raspberry Pi Pico 2 (`tests/rp2350`, a workspace of its own): how
//! its program is built, and the output of a run.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::images::{apart, target_directory};

/// Builds the program and returns its path.
///
/// # Errors
/// cargo cannot be started, or the build fails; cargo has printed why.
pub fn build() -> Result<PathBuf> {
    let mut build = apart("build", "tests/rp2350", "rp2350", None)?;
    let status = build.status().context("cannot start cargo")?;
    ensure!(status.success(), "building rp2350 failed");
    Ok(target_directory()?.join("rp2350/debug/rp2350"))
}

/// Output of a run. Times are in cycles of 150 MHz from the first frame on.
#[derive(Debug, Default)]
pub struct Run {
    /// Bytes sent to the navigation computer, hexadecimal.
    pub sent: String,
    /// Bytes sent on the command link, hexadecimal.
    pub command: String,
    /// Bytes sent to the navigation computer before the power went off, hexadecimal.
    pub before: String,
    /// When the stop bit of each byte on the sensor line ended.
    pub came: Vec<f64>,
    /// When the start bit of each byte on the navigation line began.
    pub left: Vec<f64>,
    /// How often each interrupt was served.
    pub served: Vec<(u32, usize)>,
    /// Instructions outside interrupts and in them.
    pub executed: Vec<u64>,
    /// Why the image started, for each start.
    pub starts: Vec<String>,
    /// The log's bytes, hexadecimal.
    pub log: String,
    /// Sectors of flash erased, pages programmed.
    pub flash: Vec<usize>,
    /// Errors that the program found.
    pub wrong: Vec<String>,
}

impl Run {
    /// How often this interrupt was served.
    #[must_use]
    pub fn served(&self, number: u32) -> usize {
        let found = self.served.iter().find(|(of, _)| *of == number);
        found.map_or(0, |(_, count)| *count)
    }
}

/// Runs an image; what is asked is described in `tests/rp2350/src/main.rs`.
///
/// # Errors
/// The program fails, or its output is not understood.
pub fn run(program: &Path, asked: &Value) -> Result<Run> {
    let mut child = Command::new(program)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()?;
    let mut stdin = child.stdin.take().context("no standard input")?;
    let text = asked.to_string();
    let output = thread::scope(|scope| {
        scope.spawn(move || stdin.write_all(text.as_bytes()));
        child.wait_with_output()
    })?;
    ensure!(output.status.success(), "rp2350: {}", output.status);
    let mut run = Run::default();
    for line in String::from_utf8(output.stdout)?.lines() {
        let (name, rest) = line.split_once(' ').unwrap_or((line, ""));
        read(&mut run, name, rest).with_context(|| line.to_owned())?;
    }
    Ok(run)
}

fn numbers<T: std::str::FromStr>(text: &str) -> Result<Vec<T>>
where
    T::Err: std::error::Error + Send + Sync + 'static,
{
    let all = text.split_whitespace().map(str::parse);
    all.collect::<Result<_, _>>().context("a number")
}

fn read(run: &mut Run, name: &str, rest: &str) -> Result<()> {
    match name {
        "navigation" => run.sent = rest.to_owned(),
        "command" => run.command = rest.to_owned(),
        "before" => run.before = rest.to_owned(),
        "came" => run.came = numbers(rest)?,
        "left" => run.left = numbers(rest)?,
        "interrupts" => {
            let (number, count) = rest.split_once(' ').context("two numbers")?;
            run.served.push((number.parse()?, count.parse()?));
        }
        "executed" => run.executed = numbers(rest)?,
        "start" => run.starts.push(rest.to_owned()),
        "log" => run.log = rest.to_owned(),
        "flash" => run.flash = numbers(rest)?,
        "wrong" => run.wrong.push(rest.to_owned()),
        _ => {}
    }
    Ok(())
}
