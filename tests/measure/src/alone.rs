//! `cargo xtask alone`: `lrnn-nostd` in a crate of its own, on every core and at every level of
//! optimisation. Writes the tables of its README.

use std::process::ExitCode;

use anyhow::{Result, ensure};
use qemu::alone::{CORES, LEVELS, M4F, REFERENCE, SMALL};

use crate::table::{markdown, thousands};
use crate::{markers, needs};

/// The file with the tables.
const README: &str = "lrnn-nostd/README.md";

/// The pieces of work in the tables, with the default network.
const WORKS: [&str; 3] = ["step_rational", "gradient_rational", "descent_rational"];

/// Measures and writes the tables. A digest that differs from the desktop's is an error.
pub fn alone() -> Result<ExitCode> {
    needs::alone()?;
    let tables = format!("{}\n{}", levels()?, cores()?);
    print!("{tables}");
    markers::write_in(README, "alone", &tables)?;
    Ok(ExitCode::SUCCESS)
}

/// Table of the Cortex-M4F at every level.
fn levels() -> Result<String> {
    let rows: Vec<_> = LEVELS
        .into_iter()
        .map(|level| {
            let built = M4F.build(level)?;
            let (counts, flash) = (built.count()?, built.flash()?);
            let mut row = vec![said(level)];
            row.extend(WORKS.map(|work| thousands(counts[work])));
            row.extend([flash.step, flash.descent].map(|bytes| thousands(bytes as f64)));
            Ok(row)
        })
        .collect::<Result<_>>()?;
    Ok(table("opt-level, on a Cortex-M4F", rows))
}

/// Table of every core at opt-level "s". Its digests are compared, too.
fn cores() -> Result<String> {
    let rows: Vec<_> = CORES
        .into_iter()
        .map(|core| {
            let built = core.build(SMALL)?;
            let run = built.agreement()?;
            ensure!(run.code == Some(0), "{}:\n{}", core.what, run.output);
            let (counts, flash) = (built.count()?, built.flash()?);
            let mut row = vec![core.what.to_owned()];
            row.extend(WORKS.map(|work| thousands(counts[work])));
            row.extend([flash.step, flash.descent].map(|bytes| thousands(bytes as f64)));
            Ok(row)
        })
        .collect::<Result<_>>()?;
    Ok(table("core, at opt-level \"s\"", rows))
}

/// A profile of `tests/alone` in words.
fn said(level: &str) -> String {
    let (letter, lto) = level
        .strip_suffix("-lto")
        .map_or((level, ""), |level| (level, ", `lto = \"fat\"`"));
    let letter = letter.trim_start_matches('o');
    let usual = if level == REFERENCE {
        " (cargo's `release`)"
    } else {
        ""
    };
    format!("{letter}{lto}{usual}")
}

fn table(first: &str, rows: Vec<Vec<String>>) -> String {
    let header = [
        first,
        "step",
        "with gradient",
        "and descent",
        "flash, B: step",
        "descent",
    ];
    markdown(&header.map(str::to_owned), rows.into_iter())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_in_words() {
        assert_eq!(said("o3"), "3 (cargo's `release`)");
        assert_eq!(said("os"), "s");
        assert_eq!(said("oz-lto"), "z, `lto = \"fat\"`");
    }
}
