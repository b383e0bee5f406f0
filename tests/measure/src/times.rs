//! Times on this machine, measured with criterion.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};
use qemu::images::target_directory;

use crate::stage::{cargo_with, succeed};

/// Nanoseconds of each host benchmark, by name; those of a group are `group/name`.
pub type Times = BTreeMap<String, f64>;

/// Runs one file of benchmarks of a package for a second each and reads criterion's medians.
pub fn host_times(package: &str, bench: &str) -> Result<Times> {
    let home = target_directory()?.join("xtask-criterion").join(bench);
    if home.exists() {
        // No figure of an older run survives.
        fs::remove_dir_all(&home).with_context(|| home.display().to_string())?;
    }
    let arguments = format!(
        "bench --quiet --package {package} --bench {bench} -- --warm-up-time 0.5 --measurement-time 1 --noplot"
    );
    succeed(cargo_with(&arguments).env("CRITERION_HOME", &home))?;
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
