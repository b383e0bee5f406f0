//! Independent decoders that read the device's bytes: Python packages in an environment of their
//! own under `target`.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;

use anyhow::{Context, Result, ensure};

use crate::images::target_directory;

fn here(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("judges")
        .join(file)
}

/// The interpreter with the packages of `requirements.txt`, which are installed if they are
/// missing; `None`, with a line on standard error, on a machine without Python or without the
/// packages.
#[must_use]
pub fn python() -> Option<PathBuf> {
    match environment() {
        Ok(python) => Some(python),
        Err(error) => {
            // Not eprintln, which the test harness swallows when the test passes.
            let text = format!(
                "skipped: no third-party decoders: {error:#}; remedy: python3 with venv, and the package index in reach\n"
            );
            let _ = std::io::stderr().write_all(text.as_bytes());
            None
        }
    }
}

fn environment() -> Result<PathBuf> {
    let home = target_directory()?.join("judges");
    fs::create_dir_all(&home)?;
    let lock = File::create(home.join("lock"))?;
    lock.lock()?; // two tests may start at once
    let wanted = fs::read_to_string(here("requirements.txt"))?;
    let python = home.join("venv/bin/python");
    let stamp = home.join("installed");
    if python.exists() && fs::read_to_string(&stamp).is_ok_and(|have| have == wanted) {
        return Ok(python);
    }
    run(Command::new("python3")
        .args(["-m", "venv", "--clear"])
        .arg(home.join("venv")))?;
    run(Command::new(&python)
        .args([
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
            "--requirement",
        ])
        .arg(here("requirements.txt")))?;
    fs::write(&stamp, wanted)?;
    Ok(python)
}

fn run(command: &mut Command) -> Result<()> {
    let what = command_line(command);
    let output = command
        .stdin(Stdio::null())
        .output()
        .with_context(|| what.clone())?;
    let complaint = String::from_utf8_lossy(&output.stderr);
    let last = complaint.lines().last().unwrap_or_default();
    ensure!(output.status.success(), "{what}: {}: {last}", output.status);
    Ok(())
}

fn command_line(command: &Command) -> String {
    let words = command.get_args().map(|word| word.to_string_lossy());
    let words: Vec<_> = words.collect();
    format!("{} {}", command.get_program().display(), words.join(" "))
}

/// Runs a judge over `bytes` and returns the lines of its standard output.
///
/// # Errors
/// The judge fails; the error contains its message.
pub fn ask(python: &Path, judge: &str, bytes: &[u8]) -> Result<Vec<String>> {
    ask_with(python, judge, &[], bytes)
}

/// As [`ask`], with arguments for the judge.
///
/// # Errors
/// As [`ask`].
pub fn ask_with(
    python: &Path,
    judge: &str,
    arguments: &[&str],
    bytes: &[u8],
) -> Result<Vec<String>> {
    let mut child = Command::new(python)
        .arg(here(judge))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()?;
    let mut stdin = child.stdin.take().context("no standard input")?;
    let output = thread::scope(|scope| {
        scope.spawn(move || stdin.write_all(bytes));
        child.wait_with_output()
    })?;
    let complaint = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{judge}: {complaint}");
    let text = String::from_utf8(output.stdout)?;
    Ok(text.lines().map(str::to_owned).collect())
}
