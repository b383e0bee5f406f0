//! The Allan deviation of one column in memory, beside `AllanTools`.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use host_core::simulator::imu::{ErrorModelName, ImuSpec};
use host_estimation::analysis::allan::at_rest;
use qemu::images::workspace;
use serde::Deserialize;

use super::{Programs, ROUNDS, peak, seconds};
use crate::child::{self, Used, spread};
use crate::table::{markdown, thousands};

/// 10^7 samples at 200 a second.
const SECONDS: u32 = 50_000;
/// Largest relative difference of two deviations by the same estimator: the rounding of sums of
/// 10^7 terms.
const AGREE: f64 = 1e-9;
/// The remedy where `AllanTools` is missing.
const REMEDY: &str = "python3 -m venv V && V/bin/pip install allantools==2024.6, then \
                      PYTHON=V/bin/python cargo xtask beside";

/// The output of either program.
#[derive(Deserialize)]
struct Printed {
    #[serde(default)]
    version: String,
    /// Elapsed time and processor time, s.
    seconds: [f64; 2],
    /// Averaging time, s, and deviation, rad/s.
    curve: Vec<(f64, f64)>,
}

/// Measures both programs, and returns the table.
pub fn measure(programs: &Programs) -> Result<String> {
    let spec = ImuSpec::preset("medium").context("no preset medium")?;
    let spec = spec.error_model(ErrorModelName::Linear);
    let mut columns = at_rest(&spec, SECONDS, 1)?;
    let rate = spec.rate_hz;
    let series = columns.swap_remove(0).series()?;
    drop(columns);
    let samples = series.increments.len();
    let file = programs.folder.join("increments.f64");
    let bytes: Vec<u8> = series
        .increments
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    fs::write(&file, &bytes).with_context(|| file.display().to_string())?;
    drop((series, bytes));
    let python = python();
    let mut ours: Vec<(Used, Printed)> = Vec::new();
    let mut theirs: Vec<(Used, Printed)> = Vec::new();
    for round in 0..ROUNDS {
        eprintln!("      round {} of {ROUNDS}", round + 1);
        let mut command = Command::new(&programs.ours);
        command.arg("allan").arg(&file).arg(rate.to_string());
        ours.push(printed(command.env("RAYON_NUM_THREADS", "1"))?);
        if let Some(python) = &python {
            let mut command = Command::new(python);
            command
                .arg(workspace().join("host-sim/examples/allan.py"))
                .arg(&file)
                .arg(rate.to_string())
                .env("OMP_NUM_THREADS", "1");
            let curve = &ours[0].1.curve;
            let averages = curve.iter().map(|(tau, _)| tau * f64::from(rate));
            command.args(averages.map(|m| format!("{m:.0}")));
            theirs.push(printed(&mut command)?);
        }
    }
    fs::remove_file(&file).with_context(|| file.display().to_string())?;
    let off = theirs.iter().map(|(_, p)| apart(&ours[0].1, p));
    let off = largest(off.collect::<Result<Vec<_>>>()?.into_iter());
    ensure!(
        off < AGREE,
        "the deviations differ by {off:.1e} of themselves"
    );
    Ok(text(samples, &ours, &theirs, off))
}

fn text(samples: usize, ours: &[(Used, Printed)], theirs: &[(Used, Printed)], off: f64) -> String {
    let times = ours[0].1.curve.len();
    let mut out = format!(
        "**Allan deviation** of one column of {} samples in memory, {times} averaging times, one \
         core, processor time; medians and ranges of {ROUNDS} processes in turn. Ours includes \
         intervals and the fit of five noises, the other one only the deviations.\n\n",
        thousands(samples as f64)
    );
    let header = ["", "s", "peak of the process, MiB"].map(str::to_owned);
    let row = |name: String, runs: &[(Used, Printed)]| {
        let times = spread(runs.iter().map(|(_, p)| p.seconds[1]).collect());
        vec![
            name,
            seconds(times),
            peak(runs.iter().map(|(used, _)| used)),
        ]
    };
    let mut rows = vec![row("`host-sim allan`, its analysis".to_owned(), ours)];
    if let Some((_, first)) = theirs.first() {
        rows.push(row(
            format!("AllanTools {}, `oadev`", first.version),
            theirs,
        ));
    }
    out += &markdown(&header, rows.into_iter());
    out += &match theirs.is_empty() {
        true => "\nAllanTools was not there.\n\n".to_owned(),
        false => format!("\nThe deviations of both agree to {off:.0e} of themselves.\n\n"),
    };
    out
}

/// The largest relative difference of the deviations.
fn apart(ours: &Printed, theirs: &Printed) -> Result<f64> {
    ensure!(
        ours.curve.len() == theirs.curve.len(),
        "{} deviations, and theirs are {}",
        ours.curve.len(),
        theirs.curve.len()
    );
    let pairs = ours.curve.iter().zip(&theirs.curve);
    let off = pairs.map(|((_, a), (_, b))| (a / b - 1.0).abs());
    Ok(largest(off))
}

/// The largest value; NaN if there is one.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most: f64, x| {
        let keep = most.is_nan() || x <= most;
        if keep { most } else { x }
    })
}

fn printed(command: &mut Command) -> Result<(Used, Printed)> {
    let used = child::run(command)?;
    let line = used.output.trim();
    let printed = serde_json::from_str(line).with_context(|| format!("it printed {line:?}"))?;
    Ok((used, printed))
}

/// A Python with `AllanTools`, which `PYTHON` names.
fn python() -> Option<std::ffi::OsString> {
    let python = std::env::var_os("PYTHON").unwrap_or_else(|| "python3".into());
    let there = Command::new(&python)
        .args(["-c", "import allantools"])
        .output();
    if there.is_ok_and(|output| output.status.success()) {
        return Some(python);
    }
    let python = Path::new(&python).display();
    eprintln!("skipped: AllanTools, which {python} cannot import; to see it beside us: {REMEDY}");
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_difference_is_found_and_a_missing_deviation_is_an_error() {
        let with = |curve: &[(f64, f64)]| Printed {
            version: String::new(),
            seconds: [1.0; 2],
            curve: curve.to_vec(),
        };
        let ours = with(&[(1.0, 2.0), (2.0, 1.0)]);
        assert_eq!(apart(&ours, &ours).expect("the same"), 0.0);
        let off = apart(&ours, &with(&[(1.0, 2.0), (2.0, 2.0)])).expect("as many");
        assert_eq!(off, 0.5);
        let nan = apart(&ours, &with(&[(1.0, f64::NAN), (2.0, 1.0)])).expect("as many");
        assert!(nan.is_nan());
        assert!(apart(&ours, &with(&[(1.0, 2.0)])).is_err());
    }
}
