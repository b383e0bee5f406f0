//! `cargo xtask fuzz`: damaged bytes for every protocol, and fuzz targets that are guided by branch
//! coverage.
//!
//! The targets are built with the pinned compiler. `cargo fuzz` needs a nightly compiler only for
//! sanitizers; the branch counters are a pass of LLVM that every compiler has. Only the packages of
//! this workspace have counters.

use std::env::consts::EXE_SUFFIX;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::Instant;

use crate::images::{target_directory, workspace};
use anyhow::{Context, Result, bail, ensure};

use crate::needs;
use crate::stage::{cargo_with, succeed};

/// Calls the compiler so that it counts branches and comparisons.
const COUNTING: &str = "tests/fuzz/rustc-counting";
/// Seconds from which on the drive has 1200 s, in which a learnt correction is promoted.
const LONG_S: u32 = 120;
/// Targets that run at a time.
const AT_A_TIME: usize = 2;

/// Millions of damaged bytes of each protocol: 1, or in the long run 100. The long run writes a log
/// and continues where it was interrupted.
pub fn damage(long: bool) -> Result<ExitCode> {
    let mut run = cargo_with("run --quiet --release --package damage --");
    if long {
        let log = target_directory()?.join("damage/100-million.jsonl");
        eprintln!("log: {} (delete it to start again)", log.display());
        run.args(["--millions", "100", "--log"]).arg(log);
    }
    let status = run.status().context("cannot start cargo")?;
    Ok(if status.success() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

/// Builds every target and runs each for `seconds` from its corpus. The same seed tries the same
/// inputs in the same order, as many as there is time for.
pub fn targets(seconds: u32, only: Option<&str>, seed: Option<u32>) -> Result<()> {
    needs::cpp()?;
    let folder = workspace().join("tests/fuzz");
    let directory = target_directory()?.join("fuzz-runs");
    let program = build()?;
    let mut names = names(&folder)?;
    names.retain(|name| only.is_none_or(|only| only == name));
    ensure!(!names.is_empty(), "no fuzz target of this name");
    let start = Instant::now();
    let mut failed = Vec::new();
    let mut running: Vec<Run> = Vec::new();
    for name in &names {
        if running.len() == AT_A_TIME {
            failed.extend(running.remove(0).end()?);
        }
        running.push(Run::begin(
            &folder,
            &directory,
            &program,
            name,
            (seconds, seed),
        )?);
    }
    for run in running {
        failed.extend(run.end()?);
    }
    eprintln!(
        "        {} targets of {seconds} s in {:.0} s",
        names.len(),
        start.elapsed().as_secs_f64()
    );
    if !failed.is_empty() {
        bail!("fuzz targets failed:\n{}", failed.join("\n"));
    }
    Ok(())
}

/// Builds the program with all targets, in a profile of its own.
fn build() -> Result<PathBuf> {
    let mut build = cargo_with("build --quiet --profile fuzz --package fuzz --features guided");
    build.env("RUSTC_WORKSPACE_WRAPPER", workspace().join(COUNTING));
    succeed(&mut build)?;
    Ok(target_directory()?
        .join("fuzz")
        .join(format!("fuzz{EXE_SUFFIX}")))
}

/// The targets: the folders of their inputs.
fn names(folder: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder.join("corpus"))? {
        names.push(entry?.file_name().to_string_lossy().into_owned());
    }
    names.sort();
    Ok(names)
}

/// A running target.
struct Run {
    name: String,
    child: Child,
    log: PathBuf,
}

impl Run {
    fn begin(
        folder: &Path,
        directory: &Path,
        program: &Path,
        name: &str,
        (seconds, seed): (u32, Option<u32>),
    ) -> Result<Run> {
        let work = match seed {
            // from the committed corpus alone, independent of earlier runs
            Some(seed) => directory.join(format!("{name}-of-seed-{seed}")),
            None => directory.join(name),
        };
        if seed.is_some() && work.exists() {
            fs::remove_dir_all(&work)?;
        }
        let (found, log) = (work.join("found"), work.join("log"));
        fs::create_dir_all(&found)?;
        let committed = folder.join("corpus").join(name);
        let child = Command::new(program)
            .env("FUZZ_TARGET", name)
            .envs((seconds >= LONG_S).then_some(("FUZZ_LONG", "1")))
            .args([
                &format!("-max_total_time={seconds}"),
                "-timeout=20",
                "-rss_limit_mb=2048",
                "-len_control=0",
                "-print_final_stats=1",
            ])
            .args(seed.map(|seed| format!("-seed={seed}")))
            .arg(format!("-artifact_prefix={}/", work.display()))
            .args([&found, &committed])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(fs::File::create(&log)?)
            .spawn()
            .with_context(|| format!("cannot start fuzz target {name}"))?;
        let name = name.to_owned();
        Ok(Run { name, child, log })
    }

    /// Waits for it and prints its counts. Returns the failure, if any.
    fn end(mut self) -> Result<Option<String>> {
        let status = self.child.wait()?;
        let text = String::from_utf8_lossy(&fs::read(&self.log)?).into_owned();
        let stat = |key: &str| {
            let line = text.lines().find_map(|line| line.strip_prefix(key));
            line.map_or("?", str::trim).to_owned()
        };
        // the last line of its progress names branches (cov) and features (ft): these count how
        // often each branch was taken, too, and which values were compared
        let last = |key: &str| {
            let mut lines = text.lines().rev();
            let rest = lines.find_map(|line| Some(line.split_once(key)?.1));
            let word = rest.and_then(|rest| rest.split_whitespace().next());
            word.unwrap_or("?").to_owned()
        };
        eprintln!(
            "        {:13} {:>8} inputs, {:>6} a second, {:>6} branches, {:>6} features",
            self.name,
            stat("stat::number_of_executed_units:"),
            stat("stat::average_exec_per_sec:"),
            last("cov: "),
            last("ft: ")
        );
        let end = text.lines().rev().take(40).collect::<Vec<_>>();
        Ok((!status.success()).then(|| {
            let lines: Vec<_> = end.into_iter().rev().collect();
            format!(
                "{}: {status}, {}\n{}",
                self.name,
                self.log.display(),
                lines.join("\n")
            )
        }))
    }
}
