//! The commit that a release is built from.

use std::process::Command;

use crate::images::workspace;
use anyhow::{Context, Result, ensure};

/// The commit that is checked out.
pub struct Source {
    pub commit: String,
    /// Its day, year-month-day.
    pub day: String,
    /// Whether files are changed or new.
    pub dirty: bool,
}

impl Source {
    /// Asks git.
    pub fn here() -> Result<Self> {
        Ok(Self {
            commit: git(&["rev-parse", "HEAD"])?,
            day: git(&["log", "-1", "--format=%cs"])?,
            dirty: !git(&["status", "--porcelain"])?.is_empty(),
        })
    }
}

fn git(arguments: &[&str]) -> Result<String> {
    let mut git = Command::new("git");
    let output = git
        .args(arguments)
        .current_dir(workspace())
        .output()
        .context("cannot start git")?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(
        output.status.success(),
        "git {}: {said}",
        arguments.join(" ")
    );
    Ok(String::from_utf8(output.stdout)?.trim().to_owned())
}
