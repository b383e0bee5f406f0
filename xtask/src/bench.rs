//! `cargo xtask bench`: time on this machine (criterion) and instructions on the Cortex-M4F (QEMU), against the budgets.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, bail, ensure};
use comfy_table::{CellAlignment, Table, presets};
use qemu::budget::Budgets;
use qemu::count::{self, Counts, Known};
use qemu::images::{INSTRUCTIONS, target_directory};
use serde::Serialize;

use crate::needs;
use crate::stage::{cargo_with, succeed};

/// Nanoseconds of each host benchmark, by name.
type Times = BTreeMap<String, f64>;

/// The `--json` format; it stays stable.
#[derive(Serialize)]
struct Figures {
    m4f: OnTarget,
    host: OnHost,
}

/// Instructions on the Cortex-M4F.
#[derive(Serialize)]
struct OnTarget {
    /// One step of the default network (rational hidden activation, identity output).
    step_instructions: f64,
    /// One step, its exact gradient, and one weight update.
    gradient_step_instructions: f64,
}

/// Nanoseconds on this machine, the same work.
#[derive(Serialize)]
struct OnHost {
    step_ns: f64,
    gradient_step_ns: f64,
}

/// Measures, prints, and writes `json` if asked; exceeding a budget is an error.
pub fn bench(json: Option<&Path>) -> Result<ExitCode> {
    needs::target()?;
    needs::emulator()?;
    let budgets = Budgets::read()?.instructions;
    let (known, counts) = count::run(&INSTRUCTIONS.build()?)?;
    let times = host_times()?;
    println!("{}", table(known, &counts, &budgets, &times));
    if let Some(path) = json {
        let figures = Figures {
            m4f: OnTarget {
                step_instructions: named(&counts, "step_rational")?,
                gradient_step_instructions: named(&counts, "learn_rational")?,
            },
            host: OnHost {
                step_ns: named(&times, "step_rational")?,
                gradient_step_ns: named(&times, "learn_rational")?,
            },
        };
        let text = serde_json::to_string_pretty(&figures)? + "\n";
        fs::write(path, text).with_context(|| path.display().to_string())?;
    }
    let exceeded: Vec<_> = counts
        .iter()
        .filter(|(name, count)| budgets.get(*name).is_none_or(|budget| *count > budget))
        .collect();
    ensure!(
        exceeded.is_empty(),
        "over budget, or without one (budgets.toml): {exceeded:.1?}"
    );
    ensure!(
        (known.measured - known.executed).abs() < 12.0,
        "the loop of known length was miscounted: {known:?}"
    );
    Ok(ExitCode::SUCCESS)
}

fn named(values: &BTreeMap<String, f64>, name: &str) -> Result<f64> {
    values
        .get(name)
        .copied()
        .with_context(|| format!("`{name}` was not measured, only {:?}", values.keys()))
}

fn table(known: Known, counts: &Counts, budgets: &BTreeMap<String, f64>, times: &Times) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::ASCII_MARKDOWN);
    table.set_header([
        "one ...",
        "Cortex-M4F, instructions",
        "budget",
        "this machine, ns",
    ]);
    table
        .column_iter_mut()
        .skip(1)
        .for_each(|column| column.set_cell_alignment(CellAlignment::Right));
    let executed = format!("{:.0} executed", known.executed);
    table.add_row([
        "loop of known length".into(),
        format!("{:.0}", known.measured),
        executed,
        String::new(),
    ]);
    let mut names: Vec<&String> = counts.keys().chain(times.keys()).collect();
    names.sort();
    names.dedup();
    for name in names {
        let cell = |value: Option<&f64>, digits| {
            value.map_or_else(String::new, |value| format!("{value:.digits$}"))
        };
        table.add_row([
            name.clone(),
            cell(counts.get(name), 1),
            cell(budgets.get(name), 0),
            cell(times.get(name), 1),
        ]);
    }
    table
}

/// Runs the benchmarks of `lrnn-nostd` for a second each and reads criterion's estimates.
fn host_times() -> Result<Times> {
    let home = target_directory()?.join("xtask-criterion");
    if home.exists() {
        fs::remove_dir_all(&home).with_context(|| home.display().to_string())?; // no figure of an older run survives
    }
    let arguments = "bench --quiet --package lrnn-nostd --bench network -- --warm-up-time 0.5 --measurement-time 1 --noplot";
    succeed(cargo_with(arguments).env("CRITERION_HOME", &home))?;
    let mut times = Times::new();
    collect(&home, "", &mut times)?;
    if times.is_empty() {
        bail!("criterion left no estimates in {}", home.display());
    }
    Ok(times)
}

/// `<name>/new/estimates.json`, at any depth (criterion's groups are directories).
fn collect(directory: &Path, name: &str, times: &mut Times) -> Result<()> {
    for entry in fs::read_dir(directory).with_context(|| directory.display().to_string())? {
        let path = entry?.path();
        let estimates = path.join("new/estimates.json");
        let inner = path.file_name().unwrap_or_default().to_string_lossy();
        let inner = if name.is_empty() {
            inner.into_owned()
        } else {
            format!("{name}/{inner}")
        };
        if estimates.is_file() {
            times.insert(inner, median(&fs::read_to_string(&estimates)?)?);
        } else if path.is_dir() {
            collect(&path, &inner, times)?;
        }
    }
    Ok(())
}

fn median(estimates: &str) -> Result<f64> {
    let estimates: serde_json::Value = serde_json::from_str(estimates)?;
    estimates["median"]["point_estimate"]
        .as_f64()
        .context("criterion's estimates have no median")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn criterions_median_is_read() {
        let text = r#"{"mean":{"point_estimate":9.0},"median":{"confidence_interval":{},"point_estimate":7.5}}"#;
        assert!((median(text).expect("well formed") - 7.5).abs() < 1e-12);
        assert!(median("{}").is_err());
    }
}
