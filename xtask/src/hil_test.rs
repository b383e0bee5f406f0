//! `cargo xtask hil-test`: a board on a bench. Writes its image, plays its sensor with USB-serial
//! adapters, and keeps what came of it in a file that its owner can send in.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use crate::flash::{chip_of, download, knows};
use crate::images::{CASES, STM32F405, cases, target_directory};
use crate::needs;
use crate::release::{git, sums::hex};
use crate::stage::{cargo_with, succeed};
use anyhow::{Context, Result};
use clap::Args;
use serde_json::{Value, json};

/// Formats that a board has to find by itself: counts and floats, short frames and long ones.
const FORMATS: [&str; 4] = ["stim300", "novatel", "vectornav", "xsens"];

/// A board and the ports at its lines.
#[derive(Args)]
pub struct Bench {
    /// The board: stm32f405, or one of firmware/boards.
    #[arg(value_name = "BOARD")]
    board: String,
    /// Port at the board's sensor line.
    #[arg(long, value_name = "PORT")]
    imu: String,
    /// Port at the board's navigation line.
    #[arg(long, value_name = "PORT")]
    nav: String,
    /// Port at the board's receiver line.
    #[arg(long, value_name = "PORT")]
    gnss: Option<String>,
    /// Port at the board's command link: without it, only bytes that pass unchanged are tried.
    #[arg(long, value_name = "PORT")]
    command: Option<String>,
    /// The chip, as `probe-rs chip list` calls it, where it is not the board's usual one.
    #[arg(long, value_name = "NAME")]
    chip: Option<String>,
    /// The board has its image, or is an emulator: nothing is written.
    #[arg(long, conflicts_with = "chip")]
    flashed: bool,
    /// Length of each drive, s.
    #[arg(long, value_name = "S", default_value_t = 60)]
    seconds: u32,
    /// File for the results; hil-test-BOARD.json without it.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Runs all steps, also after one that fails, and writes the file after each.
pub fn hil_test(bench: &Bench) -> Result<ExitCode> {
    let chip = chip_of(&bench.board, bench.chip.as_deref())?;
    if !bench.flashed {
        knows(&chip)?;
    }
    let out = bench.out.clone();
    let out = out.unwrap_or_else(|| format!("hil-test-{}.json", bench.board).into());
    let writable = || format!("{}: is it writable?", out.display());
    // before what takes minutes; earlier results stay until the first step has new ones
    let file = fs::OpenOptions::new().append(true).create(true).open(&out);
    file.with_context(writable)?;
    let source = git::Source::here().ok(); // none in an archive without a repository
    let mut result = json!({
        "board": bench.board,
        "image_sha256": null,
        "version": env!("CARGO_PKG_VERSION"),
        "commit": source.as_ref().map(|source| &source.commit),
        "changed": source.as_ref().map(|source| source.dirty),
        "steps": [],
    });
    let cases = bench.cases(&chip)?;
    succeed(&mut cargo_with(
        "build --quiet --release --package host-sim",
    ))?;
    let host_sim = target_directory()?.join("release/host-sim");
    let scratch = target_directory()?.join("hil-test.json");
    let mut failed = 0;
    let mut run = |steps: Vec<(String, Command)>, result: &mut Value| {
        for (name, command) in steps {
            println!("{name}");
            let step = carry_out(&name, command, &scratch)?;
            failed += usize::from(step["passed"] == false);
            if let Some(steps) = result["steps"].as_array_mut() {
                steps.push(step);
            }
            let text = serde_json::to_string_pretty(result)? + "\n";
            fs::write(&out, text).with_context(writable)?;
        }
        anyhow::Ok(())
    };
    run(cases, &mut result)?;
    if !bench.flashed {
        let built = download(&bench.board, bench.chip.clone())?;
        result["image_sha256"] = hex(&fs::read(built)?).into();
    }
    run(bench.steps(&host_sim, &scratch), &mut result)?;
    println!("{failed} steps failed; {} has all results", out.display());
    println!("send it in as an issue of the project: no board here has been tried on silicon");
    Ok(ExitCode::from(u8::from(failed > 0)))
}

impl Bench {
    /// The cases of the board's chip; probe-rs writes their image before the first. Other boards
    /// have none.
    fn cases(&self, chip: &str) -> Result<Vec<(String, Command)>> {
        if self.flashed || self.board != STM32F405.name {
            return Ok(Vec::new());
        }
        needs::target()?;
        let image = cases()?;
        let step = |name| {
            let mut probe = Command::new("probe-rs");
            probe.args(["run", "--preverify", "--exact", "--chip", chip]);
            probe.arg(&image).arg(format!("cases::{name}"));
            (format!("case {name}"), probe)
        };
        Ok(CASES.map(step).into())
    }

    /// The steps: their names and commands.
    fn steps(&self, host_sim: &Path, json: &Path) -> Vec<(String, Command)> {
        let mut steps = Vec::new();
        let mut drive = |name: String, more: &[&str]| {
            let mut run = Command::new(host_sim);
            run.args(["hil", "--imu", &self.imu, "--nav", &self.nav]);
            run.args(["--seconds", &self.seconds.to_string()])
                .args(more);
            run.arg("--json").arg(json);
            if let Some(gnss) = &self.gnss {
                run.args(["--gnss", gnss]);
            }
            if [&self.imu, &self.nav]
                .iter()
                .all(|port| port.starts_with("tcp:"))
            {
                run.arg("--fast");
            }
            steps.push((name, run));
        };
        for format in FORMATS {
            drive(format!("pass {format}"), &["--format", format]);
        }
        let Some(command) = &self.command else {
            return steps;
        };
        for format in FORMATS {
            let more = ["--format", format, "--command", command];
            drive(format!("correct {format}"), &more);
        }
        let mut info = Command::new(host_sim);
        info.args(["device", "--port", command, "info", "--json"]);
        steps.push(("info".into(), info));
        steps
    }
}

/// Runs a step, which writes JSON to this file or to standard output, and gives what it has found.
fn carry_out(name: &str, mut command: Command, scratch: &Path) -> Result<Value> {
    let _ = fs::remove_file(scratch); // of the step before
    let done = command.stderr(Stdio::piped()).output();
    let done = done.with_context(|| format!("cannot start {}", command.get_program().display()))?;
    let text = fs::read(scratch).unwrap_or_else(|_| done.stdout.clone());
    let found = serde_json::from_slice::<Value>(&text).ok();
    let mut says = String::from_utf8_lossy(&done.stderr).into_owned();
    if found.is_none() {
        says = String::from_utf8_lossy(&done.stdout).into_owned() + &says;
    }
    let says = says.trim();
    let mut passed = Value::from(done.status.success());
    if passed == true && name.starts_with("case ") && says.contains("skipped: ") {
        passed = Value::Null;
    }
    println!("    {}", if passed == true { "passed" } else { says });
    Ok(json!({"name": name, "passed": passed, "found": found, "says": says}))
}
