//! A third-party emulator (`tests/rigless`, a workspace of its own): how it is built, its input and
//! its output. Its chips are an STM32F427 and an STM32H743.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;

use anyhow::{Context, Result, ensure};
use serde::Serialize;

use crate::drive::{hex, unhex};
use crate::images::{apart, here_or_skip, target_directory};

/// Environment variable with which the tests build the emulator and run.
pub const ASKED_FOR: &str = "LRNN_EMULATORS";

/// A chip of the emulator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Chip {
    /// An STM32F427; an F405 has a subset of its peripherals.
    F427,
    /// An STM32H743.
    H743,
}

/// Input of a run. Times are in ns.
#[derive(Clone, Debug, Serialize)]
pub struct RunRequest {
    image: PathBuf,
    chip: Chip,
    /// Hz of the crystal; 0: there is none.
    pub crystal: u64,
    /// Instructions per second: one a cycle, as in the chip model.
    pub instructions: u64,
    /// End of the run.
    pub until: u64,
    /// Bytes received at each UART: when, at which bit rate, and the bytes, hexadecimal.
    pub lines: BTreeMap<&'static str, Vec<(u64, u64, String)>>,
    /// Packets sent to a UART, each when the one before has been answered.
    pub conversations: BTreeMap<&'static str, Conversation>,
    /// UARTs whose output is recorded.
    pub listen: Vec<&'static str>,
    /// When the reset pin is pulled low.
    pub resets: Vec<u64>,
    /// Registers that are written to from outside: when, address and value.
    pub writes: Vec<(u64, u64, u64)>,
    /// Content of the flash beside the image: address, and bytes, hexadecimal.
    pub flash: Vec<(u64, String)>,
    /// Memory that is printed at the end: address and length in bytes.
    pub memory: Vec<(u64, u64)>,
    /// Registers whose accesses are printed: address and length in bytes.
    pub trace: Vec<(u64, u64)>,
    /// An ADIS at the SPI.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adis: Option<serde_json::Value>,
}

/// A host at a UART that waits for its answers. Times are in ns.
#[derive(Clone, Debug, Serialize)]
pub struct Conversation {
    from: u64,
    baud: u64,
    packets: Vec<String>,
    rest: u64,
}

impl Conversation {
    /// Packets from a time on at a bit rate. The run ends a time after the last answer, `rest`.
    #[must_use]
    pub fn new(from: u64, baud: u64, packets: &[Vec<u8>], rest: u64) -> Self {
        Self {
            from,
            baud,
            packets: packets.iter().map(|packet| hex(packet)).collect(),
            rest,
        }
    }
}

impl RunRequest {
    /// A run of an image at the full speed of its board.
    #[must_use]
    pub fn new(image: &Path, chip: Chip) -> Self {
        let (crystal, instructions) = match chip {
            Chip::F427 => (12_000_000, 168_000_000),
            Chip::H743 => (8_000_000, 400_000_000),
        };
        Self {
            image: image.to_owned(),
            chip,
            crystal,
            instructions,
            until: 0,
            lines: BTreeMap::new(),
            conversations: BTreeMap::new(),
            listen: Vec::new(),
            resets: Vec::new(),
            writes: Vec::new(),
            flash: Vec::new(),
            memory: Vec::new(),
            trace: Vec::new(),
            adis: None,
        }
    }

    /// Bytes at a UART from a time on.
    pub fn send(&mut self, line: &'static str, at: u64, baud: u64, bytes: &[u8]) {
        let line = self.lines.entry(line).or_default();
        line.push((at, baud, hex(bytes)));
    }
}

/// Output of a run.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Output of each recorded UART: the bytes, and when the stop bit of each ended.
    pub left: BTreeMap<String, (Vec<u8>, Vec<u64>)>,
    /// Memory at the end, in the order asked for.
    pub memory: Vec<Vec<u8>>,
    /// When the chip was reset, and why.
    pub resets: Vec<(u64, String)>,
    /// Registers without a model: instance and register.
    pub unimplemented: Vec<(String, String)>,
    /// All other lines: accesses that the manual forbids (`told`), accesses that the bus refused,
    /// addresses that are not mapped.
    pub lines: Vec<String>,
}

impl Outcome {
    /// The rest of the lines that begin with `name`.
    pub fn all<'t>(&'t self, name: &'t str) -> impl Iterator<Item = &'t str> {
        let lines = self.lines.iter();
        lines.filter_map(move |line| line.strip_prefix(name)?.strip_prefix(' '))
    }
}

/// For tests: the emulator, built, or `None` with a line on standard error.
///
/// # Panics
/// The build fails.
#[must_use]
pub fn build_or_skip() -> Option<PathBuf> {
    let asked = std::env::var_os(ASKED_FOR).is_some();
    if !asked {
        // Not eprintln, which the test harness swallows when the test passes.
        let text = "skipped: building the emulator costs minutes; remedy: cargo xtask emulators\n";
        let _ = std::io::stderr().write_all(text.as_bytes());
    }
    (asked && here_or_skip(crate::images::missing())).then(|| build().expect("it builds"))
}

/// Builds the emulator.
///
/// # Errors
/// cargo cannot be started, or the build fails; cargo has printed why.
pub fn build() -> Result<PathBuf> {
    let mut build = apart("build", "tests/rigless", "rigless", None)?;
    // it requires a newer compiler, but builds with ours
    let status = build.arg("--ignore-rust-version").status();
    let status = status.context("cannot start cargo")?;
    ensure!(status.success(), "building the emulator failed");
    Ok(target_directory()?.join("rigless/debug/rigless-judge"))
}

/// Runs an image.
///
/// # Errors
/// The emulator fails, or its output is not understood.
pub fn run(emulator: &Path, asked: &RunRequest) -> Result<Outcome> {
    let mut child = Command::new(emulator)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()?;
    let mut stdin = child.stdin.take().context("no standard input")?;
    let text = serde_json::to_string(asked)?;
    let output = thread::scope(|scope| {
        scope.spawn(move || stdin.write_all(text.as_bytes()));
        child.wait_with_output()
    })?;
    let complaint = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{complaint}");
    let mut outcome = Outcome::default();
    for line in String::from_utf8(output.stdout)?.lines() {
        read(&mut outcome, line).with_context(|| line.to_owned())?;
    }
    Ok(outcome)
}

fn read(outcome: &mut Outcome, line: &str) -> Result<()> {
    let words: Vec<&str> = line.split(' ').collect();
    match words[..] {
        ["left", name, digits] => outcome.left.entry(name.into()).or_default().0 = unhex(digits)?,
        ["times", name, ref times @ ..] => {
            let times = times.iter().filter(|time| !time.is_empty());
            let times = times.map(|time| time.parse()).collect::<Result<_, _>>()?;
            outcome.left.entry(name.into()).or_default().1 = times;
        }
        ["memory", _, digits] => outcome.memory.push(unhex(digits)?),
        ["reset", at, ref why @ ..] => outcome.resets.push((at.parse()?, why.join(" "))),
        ["unimplemented", instance, register, ..] => {
            outcome
                .unimplemented
                .push((instance.into(), register.into()));
        }
        _ => outcome.lines.push(line.to_owned()),
    }
    Ok(())
}
