//! Stages: a line when one begins, its duration when it ends, the first failure ends the run. Two
//! threads may run stages side by side.

use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use crate::images::cargo;
use anyhow::{Context, Result, bail};

/// Counts the stages of one run.
pub struct Stages {
    next: AtomicUsize,
    total: usize,
}

impl Stages {
    /// A run of `total` stages.
    pub fn new(total: usize) -> Self {
        let next = AtomicUsize::new(1);
        Self { next, total }
    }

    /// Runs one stage.
    pub fn run(&self, name: &str, work: impl FnOnce() -> Result<()>) -> Result<()> {
        self.begin(name);
        let start = Instant::now();
        work().with_context(|| format!("stage `{name}` failed"))?;
        eprintln!("        {name}: {:.1} s", start.elapsed().as_secs_f64());
        Ok(())
    }

    /// Prints the line that shows the progress. The last stage prints only that, so that the output
    /// ends with the closing lines of its own command.
    pub fn begin(&self, name: &str) {
        let next = self.next.fetch_add(1, Ordering::Relaxed);
        eprintln!("[{next:>2}/{}] {name}", self.total);
    }
}

/// cargo with these arguments, separated by spaces.
pub fn cargo_with(arguments: &str) -> Command {
    let mut cargo = cargo();
    cargo.args(arguments.split_whitespace());
    cargo
}

/// Whether a command can be started and succeeds. It prints nothing.
pub fn quietly(command: &mut Command) -> bool {
    let status = command.stdout(Stdio::null()).stderr(Stdio::null()).status();
    status.is_ok_and(|status| status.success())
}

/// Runs a command; its failure is an error.
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
