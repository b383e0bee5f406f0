//! Stages: a line when one begins, its duration when it ends, the first failure ends the run.

use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use qemu::images::cargo;

/// Counts the stages of one run.
pub struct Stages {
    next: usize,
    total: usize,
}

impl Stages {
    /// A run of `total` stages.
    pub fn new(total: usize) -> Self {
        Self { next: 1, total }
    }

    /// Runs one stage.
    pub fn run(&mut self, name: &str, work: impl FnOnce() -> Result<()>) -> Result<()> {
        self.begin(name);
        let start = Instant::now();
        work().with_context(|| format!("stage `{name}` failed"))?;
        eprintln!("        {name}: {:.1} s", start.elapsed().as_secs_f64());
        Ok(())
    }

    /// Prints the line that says where we are. The last stage prints only that, so that the output
    /// ends with the closing lines of its own command.
    pub fn begin(&mut self, name: &str) {
        eprintln!("[{:>2}/{}] {name}", self.next, self.total);
        self.next += 1;
    }
}

/// cargo with these arguments, separated by spaces.
pub fn cargo_with(arguments: &str) -> Command {
    let mut cargo = cargo();
    cargo.args(arguments.split_whitespace());
    cargo
}

/// Runs a command whose failure is ours.
pub fn succeed(command: &mut Command) -> Result<()> {
    let status = command
        .status()
        .with_context(|| format!("cannot start {}", command.get_program().display()))?;
    if !status.success() {
        let words: Vec<_> = command
            .get_args()
            .map(|word| word.to_string_lossy())
            .collect();
        bail!(
            "{status}: {} {}",
            command.get_program().display(),
            words.join(" ")
        );
    }
    Ok(())
}
