//! `cargo xtask fuzz`: damaged bytes for every protocol, and fuzz targets that are led by the
//! branches they reach.
//!
//! The targets are built with the pinned compiler. What `cargo fuzz` asks of a nightly one are
//! sanitizers; the counters of branches are a pass of LLVM that every compiler has.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use qemu::images::{cargo, target_directory, workspace};

use crate::needs;
use crate::stage::{cargo_with, succeed};

/// What makes the compiler count branches and comparisons.
const COUNTERS: &str = "-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
    -Cllvm-args=-sanitizer-coverage-trace-compares --cfg fuzzing";
/// Targets that run at a time.
const AT_A_TIME: usize = 2;

/// Millions of damaged bytes of each protocol: 1, or in the long run 100. The long run writes a log
/// and goes on where it was interrupted.
pub fn damage(long: bool) -> Result<ExitCode> {
    let mut run = cargo_with("run --quiet --release --package damage --");
    if long {
        let log = target_directory()?.join("damage/100-million.jsonl");
        eprintln!("log: {} (delete it to begin anew)", log.display());
        run.args(["--millions", "100", "--log"]).arg(log);
    }
    let status = run.status().context("cannot start cargo")?;
    Ok(if status.success() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

/// Builds every target and runs it for so many seconds from its corpus.
pub fn targets(seconds: u32, only: Option<&str>) -> Result<()> {
    needs::cpp()?;
    let folder = workspace().join("tests/fuzz");
    let directory = target_directory()?.join("fuzz");
    let programs = build(&folder, &directory)?;
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
        running.push(Run::begin(&folder, &directory, &programs, name, seconds)?);
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

/// Builds all targets and gives the folder where they are.
fn build(folder: &Path, directory: &Path) -> Result<PathBuf> {
    let host = host()?;
    let mut build = cargo();
    build
        .args(["build", "--quiet", "--release", "--target", &host])
        .arg("--target-dir")
        .arg(directory)
        .env("RUSTFLAGS", COUNTERS)
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .current_dir(folder);
    succeed(&mut build)?;
    Ok(directory.join(host).join("release"))
}

/// Build scripts and macros are not instrumented if a target is named, the same one too.
fn host() -> Result<String> {
    let output = Command::new("rustc")
        .arg("-vV")
        .current_dir(workspace())
        .output()?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let host = text.lines().find_map(|line| line.strip_prefix("host: "));
    Ok(host.context("rustc names no host")?.to_owned())
}

/// The targets: the files of their folder.
fn names(folder: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder.join("fuzz_targets"))? {
        let path = entry?.path();
        names.extend(
            path.file_stem()
                .and_then(|name| name.to_str())
                .map(str::to_owned),
        );
    }
    names.sort();
    Ok(names)
}

/// A target that runs.
struct Run {
    name: String,
    child: Child,
    log: PathBuf,
}

impl Run {
    fn begin(
        folder: &Path,
        directory: &Path,
        programs: &Path,
        name: &str,
        seconds: u32,
    ) -> Result<Run> {
        let work = directory.join("runs").join(name);
        let (found, log) = (work.join("found"), work.join("log"));
        fs::create_dir_all(&found)?;
        let committed = folder.join("corpus").join(name);
        ensure!(committed.is_dir(), "{} is missing", committed.display());
        let child = Command::new(programs.join(name))
            .args([
                &format!("-max_total_time={seconds}"),
                "-timeout=20",
                "-rss_limit_mb=2048",
                "-len_control=0",
                "-print_final_stats=1",
            ])
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

    /// Waits for it and prints its counts. Gives what went wrong.
    fn end(mut self) -> Result<Option<String>> {
        let status = self.child.wait()?;
        let text = String::from_utf8_lossy(&fs::read(&self.log)?).into_owned();
        let stat = |key: &str| {
            let line = text.lines().find_map(|line| line.strip_prefix(key));
            line.map_or("?", str::trim).to_owned()
        };
        let branches = text.lines().rev().find_map(|line| {
            let rest = line.split_once("cov: ")?.1;
            rest.split_whitespace().next()
        });
        eprintln!(
            "        {:13} {:>8} inputs, {} branches",
            self.name,
            stat("stat::number_of_executed_units:"),
            branches.unwrap_or("?")
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
