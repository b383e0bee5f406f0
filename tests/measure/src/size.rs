//! `cargo xtask size`: flash and RAM of each image with a budget, and whether it can panic.

use std::process::ExitCode;

use crate::table::numbers;
use anyhow::{Context, Result, bail};
use comfy_table::Table;
use qemu::budget::{Budgets, ImageBudget};
use qemu::images::{ALL, Image};
use qemu::size::{RAM, Size};

/// Builds and measures the images. Exceeding a budget is an error.
pub fn size() -> Result<ExitCode> {
    let budgets = Budgets::read()?;
    let mut table = numbers([
        "image",
        "flash, B",
        "budget",
        "RAM, B",
        "budget",
        "left for the stack, B",
        "core-coupled memory, B",
        "budget",
        "functions that panic",
    ]);
    let (mut exceeded, mut by_module) = (Vec::new(), Vec::new());
    for (name, budget) in &budgets.image {
        let image = ALL
            .iter()
            .find(|image| image.name == name)
            .with_context(|| format!("budgets.toml: no image `{name}`"))?;
        let size = measure(*image)?;
        table.add_row([
            name.clone(),
            size.flash.to_string(),
            budget.flash.to_string(),
            size.ram.to_string(),
            budget.ram.to_string(),
            RAM.saturating_sub(size.ram).to_string(),
            size.coupled.to_string(),
            budget.coupled.to_string(),
            size.panics.len().to_string(),
        ]);
        exceeded.extend(excess(budget, &size).map(|what| format!("{name}: {what}")));
        by_module.push(modules(name, &size));
    }
    println!("{table}");
    for table in by_module {
        println!("\n{table}");
    }
    if !exceeded.is_empty() {
        bail!("over budget (budgets.toml):\n  {}", exceeded.join("\n  "));
    }
    Ok(ExitCode::SUCCESS)
}

/// Memory of an image by crate and module, the largest first.
fn modules(image: &str, size: &Size) -> Table {
    let mut table = numbers([
        &format!("{image}: crate and module"),
        "flash, B",
        "core-coupled memory, B",
        "RAM, B",
    ]);
    let mut rows: Vec<_> = size.modules.iter().collect();
    rows.sort_by_key(|(_, sizes)| core::cmp::Reverse(sizes.iter().sum::<u64>()));
    for (name, sizes) in rows {
        let [flash, coupled, ram] = sizes.map(|size| size.to_string());
        table.add_row([name.clone(), flash, coupled, ram]);
    }
    table
}

fn measure(image: Image) -> Result<Size> {
    Size::of(&image.build()?)
}

fn excess(budget: &ImageBudget, size: &Size) -> impl Iterator<Item = String> {
    let flash = (size.flash > budget.flash)
        .then(|| format!("{} bytes of flash, budget {}", size.flash, budget.flash));
    let ram = (size.ram > budget.ram)
        .then(|| format!("{} bytes of RAM, budget {}", size.ram, budget.ram));
    let coupled = (size.coupled > budget.coupled).then(|| {
        format!(
            "{} bytes of core-coupled memory, budget {}",
            size.coupled, budget.coupled
        )
    });
    let panics = (!budget.panics && !size.panics.is_empty())
        .then(|| format!("can panic: {}", size.panics.join(", ")));
    [flash, ram, coupled, panics].into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_excess_is_named() {
        let budget = ImageBudget {
            flash: 100,
            ram: 10,
            coupled: 5,
            panics: false,
            ram_and_stack: None,
        };
        let within = Size {
            flash: 100,
            ram: 10,
            coupled: 5,
            ..Size::default()
        };
        assert_eq!(excess(&budget, &within).count(), 0);
        let beyond = Size {
            flash: 101,
            ram: 11,
            coupled: 6,
            panics: vec!["core::panicking::panic".into()],
            ..Size::default()
        };
        assert_eq!(excess(&budget, &beyond).count(), 4);
    }
}
