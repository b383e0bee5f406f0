//! `cargo xtask boards`: builds the boards over other people's drivers (`firmware/boards`) and
//! compares flash and RAM with `budgets.toml`.

use std::process::ExitCode;

use anyhow::{Context, Result, bail, ensure};
use qemu::boards::{FAMILIES, Family, build};
use qemu::budget::Budgets;
use qemu::chip::Driver;
use qemu::images::{TARGET, target_directory, without_paths, workspace};
use qemu::size::Size;

use crate::stage::{cargo_with, succeed};
use crate::table::numbers;

/// Examples of a loop of one's own, which only have to build.
const EXAMPLES: [&str; 2] = ["loop-embassy", "loop-rtic"];

/// The board of a name.
pub fn named(name: &str) -> Result<Family> {
    let names = FAMILIES.map(|family| family.name).join(", ");
    Family::named(name)
        .with_context(|| format!("no board `{name}`; remedy: stm32f405 or one of {names}"))
}

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
        for example in EXAMPLES {
            build(example, TARGET)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Clippy over what has a workspace of its own, in the folders of their builds: each board alone,
/// since it needs its chip's features, the judges of the chip model, the emulator for the Pico 2,
/// and `lrnn-nostd` alone.
pub fn lints() -> Result<()> {
    let boards = FAMILIES.map(|family| (family.name, family.target));
    let examples = EXAMPLES.map(|example| (example, TARGET));
    for (package, target) in boards.into_iter().chain(examples) {
        let of = ["--release", "--package", package];
        clippy("firmware/boards", "boards", Some(target), &of)?;
    }
    for driver in Driver::ALL {
        let of = ["--features", driver.feature(), "--bin", driver.program()];
        clippy("tests/chip", "chip", Some(TARGET), &of)?;
    }
    clippy("tests/rp2350", "rp2350", None, &[])?;
    clippy(
        "tests/alone",
        "alone",
        Some(TARGET),
        &["--release", "--bins"],
    )
}

/// Of a workspace, for a target or for this machine; `folder` of the target directory is its own.
fn clippy(workspace_of: &str, folder: &str, target: Option<&str>, of: &[&str]) -> Result<()> {
    let mut clippy = cargo_with("clippy --quiet --locked");
    if let Some(target) = target {
        clippy.args(["--target", target]);
    }
    clippy
        .arg("--manifest-path")
        .arg(workspace().join(workspace_of).join("Cargo.toml"))
        .arg("--target-dir")
        .arg(target_directory()?.join(folder))
        .args(of)
        .args(["--", "-D", "warnings"]);
    without_paths(&mut clippy, &workspace());
    succeed(&mut clippy)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use qemu::images::workspace;

    /// Each line of the worked diff is in one of the two boards' files.
    #[test]
    fn the_worked_diff_is_of_these_boards() {
        let text = |path: &str| fs::read_to_string(workspace().join(path)).expect(path);
        let all = |board: &str| {
            ["Cargo.toml", "memory.x", "src/main.rs"]
                .map(|file| text(&format!("firmware/boards/{board}/{file}")))
                .concat()
        };
        let (from, to) = (all("f405"), all("f446"));
        let page = text("docs/add-a-board.md");
        let (mut within, mut seen) = (false, 0);
        for line in page.lines() {
            match (line.starts_with("```"), line.split_at_checked(1)) {
                (true, _) => within = line == "```diff",
                (_, Some((sign, rest))) if within => {
                    let of = if sign == "-" { &from } else { &to };
                    assert!(of.lines().any(|line| line == rest), "{line}");
                    seen += 1;
                }
                _ => {}
            }
        }
        assert!(seen > 30, "{seen} lines");
    }
}
