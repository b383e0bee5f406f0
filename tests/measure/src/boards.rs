//! `cargo xtask boards`: builds the boards over third-party drivers (`firmware/boards`) and
//! compares flash and RAM with `budgets.toml`.

use std::process::ExitCode;

use anyhow::{Context, Result, bail, ensure};
use qemu::boards::{FAMILIES, examples, named};
use qemu::budget::Budgets;
use qemu::size::Size;

use crate::table::numbers;

/// Builds all of them, or one, and measures. Exceeding a budget is an error.
pub fn boards(only: Option<&str>) -> Result<ExitCode> {
    let budgets = Budgets::read()?.board;
    for name in budgets.keys() {
        named(name).context("budgets.toml")?;
    }
    let wanted = match only {
        Some(name) => vec![named(name)?],
        None => FAMILIES.to_vec(),
    };
    let mut table = numbers([
        "board",
        "flash, B",
        "budget",
        "RAM, B",
        "budget",
        "left for the stack, B",
        "functions that panic",
    ]);
    let mut exceeded = Vec::new();
    for family in wanted {
        let name = family.name;
        let budget = budgets
            .get(name)
            .with_context(|| format!("budgets.toml: no [board.{name}]"))?;
        let size = Size::of(&family.build()?)?;
        table.add_row([
            format!("{name}: {}", family.board),
            size.flash.to_string(),
            budget.flash.to_string(),
            size.ram.to_string(),
            budget.ram.to_string(),
            family.memory.saturating_sub(size.ram).to_string(),
            size.panics.len().to_string(),
        ]);
        let excess = [
            ("flash", size.flash, budget.flash),
            ("RAM", size.ram, budget.ram),
        ];
        let over = excess.into_iter().filter(|(_, is, most)| is > most);
        exceeded.extend(
            over.map(|(what, is, most)| format!("{name}: {is} bytes of {what}, budget {most}")),
        );
        ensure!(
            size.ram < family.memory,
            "{name}: {} bytes of RAM, the chip has {}",
            size.ram,
            family.memory
        );
    }
    println!("{table}");
    if !exceeded.is_empty() {
        bail!("over budget (budgets.toml):\n  {}", exceeded.join("\n  "));
    }
    if only.is_none() {
        examples()?;
    }
    Ok(ExitCode::SUCCESS)
}
