//! Figures that are measured in QEMU or read from images, and committed: docs/figures/works.csv,
//! path.csv and images.csv. Tests of the same measurements fail when these files are outdated.

use anyhow::{Context, Result, ensure};
use qemu::boards::FAMILIES;
use qemu::budget::Budgets;
use qemu::committed::Committed;
use qemu::count;
use qemu::images::{ALL, BOARDS, INSTRUCTIONS};
use qemu::machine::NETDUINOPLUS2;
use qemu::protocol::drives;
use qemu::replay::Pace;
use qemu::report::counted;
use qemu::size::Size;

use crate::needs;
use crate::table::{markdown, thousands};

/// The frames in the table of the path, by their names and order in docs/ICD.md.
const FRAMES: [(&str, &str); 10] = [
    ("stim300", "STIM300 0x91, 28 bytes"),
    ("kvh", "KVH A, 36 bytes"),
    ("epson", "Epson, 32-bit rates, 36 bytes"),
    ("sbgecom", "sbgECom IMU_SHORT, 41 bytes"),
    ("hg4930", "HG4930 0x02, 44 bytes"),
    ("adis-uart", "ADIS-UART, 44 bytes"),
    ("novatel", "NovAtel RAWIMUSX, 56 bytes"),
    ("xsens", "Xsens increments, 58 bytes"),
    ("vectornav", "VectorNav increments, 64 bytes"),
    ("mavlink", "MAVLink 2 HIGHRES_IMU, 74 bytes"),
];

/// A table that `cargo xtask figures FIGURE` makes.
pub fn committed(name: &str, figure: &str, header: &[&str], rows: Vec<Vec<String>>) -> Committed {
    Committed {
        name: name.to_owned(),
        made_by: format!("cargo xtask figures {figure}"),
        header: header.iter().map(|&column| column.to_owned()).collect(),
        rows,
    }
}

/// Instructions of each piece of work.
pub fn works() -> Result<()> {
    needs::target()?;
    needs::emulator()?;
    let (known, counts) = count::run(NETDUINOPLUS2, &INSTRUCTIONS.build()?)?;
    known.check()?;
    let rows = counts.into_iter();
    let rows = rows.map(|(name, count)| vec![name, format!("{count:.1}")]);
    committed("works", "works", &["work", "instructions"], rows.collect()).write()
}

/// Instructions of a sample on its way through the device, with every format.
pub fn path() -> Result<()> {
    needs::target()?;
    needs::emulator()?;
    let header = [
        "format",
        "sample, byte",
        "sample, DMA",
        "worst, byte",
        "worst, DMA",
        "later, byte",
        "later, DMA",
        "latency, byte",
        "latency, DMA",
    ];
    let mut rows = Vec::new();
    for (format, _) in drives() {
        eprintln!("{}", format.name());
        let mut costs = Vec::new();
        for pace in [Pace::Byte, Pace::Dma] {
            let (same, cost) = counted(BOARDS[0], format, pace)?;
            ensure!(same, "{format:?}: the target sends other bytes");
            costs.push([
                cost.per_sample,
                cost.worst_sample,
                cost.worst_later,
                cost.latency,
            ]);
        }
        let mut row = vec![format.name().to_owned()];
        for what in 0..4 {
            row.extend(costs.iter().map(|cost| format!("{:.0}", cost[what])));
        }
        rows.push(row);
    }
    committed("path", "path", &header, rows).write()
}

/// Flash and variables of each image with a budget.
pub fn images() -> Result<()> {
    needs::targets()?;
    let budgets = Budgets::read()?;
    let header = ["image", "flash, B", "variables, B", "core-coupled, B"];
    let mut rows = Vec::new();
    for name in budgets.image.keys() {
        let image = ALL.iter().find(|image| image.name == name);
        let image = image.with_context(|| format!("budgets.toml: no image `{name}`"))?;
        let size = Size::of(&image.build()?)?;
        let bytes = [size.flash, size.ram, size.coupled].map(|bytes| bytes.to_string());
        let mut row = vec![name.clone()];
        row.extend(bytes);
        rows.push(row);
    }
    for family in FAMILIES {
        let size = Size::of(&family.build()?)?;
        let mut row = vec![family.name.to_owned()];
        row.extend([size.flash, size.ram].map(|bytes| bytes.to_string()));
        row.push(String::new());
        rows.push(row);
    }
    committed("images", "images", &header, rows).write()
}

/// The table of docs/ICD.md, section 3: an interrupt a byte, and DMA.
pub fn path_table(of: &Committed) -> Result<String> {
    let header = [
        "frame",
        "last byte in to first byte out",
        "a sample, first byte in to last byte out, mean",
        "the most expensive sample, at which both networks step",
    ];
    let mut rows = Vec::new();
    for (format, frame) in FRAMES {
        let mut row = vec![frame.to_owned()];
        for what in ["latency", "sample", "later"] {
            let cell = |pace| of.cell(format, &format!("{what}, {pace}"));
            row.push(format!("{} / {}", cell("byte")?, cell("DMA")?));
        }
        rows.push(row);
    }
    ensure!(rows.len() == of.rows.len(), "a format without words");
    Ok(markdown(&header.map(str::to_owned), rows.into_iter()))
}

/// Operations of a network. Pieces of work are named `STEP_FORM`, with the form of the code.
const STEPS: [&str; 5] = ["activation", "step", "gradient", "descent", "learn"];
const FORMS: [&str; 6] = ["rational", "cubic", "tanh", "micromath", "m4", "m7"];

/// The tables of docs/PERFORMANCE.md: networks by their forms, and the rest in a list.
pub fn works_table(of: &Committed) -> Result<String> {
    let cell = |work: &str| -> Result<String> {
        let count: f64 = of.cell(work, "instructions")?.parse()?;
        Ok(thousands(count))
    };
    let is_network = |work: &str| {
        let parts = work.split_once('_');
        parts.is_some_and(|(step, form)| STEPS.contains(&step) && FORMS.contains(&form))
    };
    let mut header = vec!["form".to_owned()];
    header.extend(STEPS.map(|step| format!("`{step}`")));
    let forms = FORMS.iter().map(|form| {
        let mut row = vec![format!("`{form}`")];
        row.extend(STEPS.map(|step| cell(&format!("{step}_{form}")).unwrap_or_default()));
        row
    });
    let mut rest = Vec::new();
    for work in of.rows.iter().filter_map(|row| row.first()) {
        if !is_network(work) {
            rest.push(vec![format!("`{work}`"), cell(work)?]);
        }
    }
    let header_of_rest = ["work", "instructions"].map(str::to_owned);
    let networks = markdown(&header, forms);
    Ok(format!(
        "{networks}\n{}",
        markdown(&header_of_rest, rest.into_iter())
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every piece of work is in one of the two tables.
    #[test]
    fn no_piece_of_work_is_left_out() {
        let works = Committed::read("works").expect("works");
        let tables = works_table(&works).expect("tables");
        let cells = tables.lines().flat_map(|line| line.split('|').skip(2));
        let counts = cells.filter(|cell| cell.trim().starts_with(|c: char| c.is_ascii_digit()));
        assert_eq!(counts.count(), works.rows.len());
        let cell = |work: &str| {
            let count = works.cell(work, "instructions").expect("a cell");
            thousands(count.parse().expect("a count"))
        };
        let [step, gradient, descent] = ["step_m7", "gradient_m7", "descent_m7"].map(cell);
        let row = format!("| `m7` |  | {step} | {gradient} | {descent} |  |");
        assert!(tables.contains(&row), "{row} in\n{tables}");
    }

    /// Each budget has a figure, and none is above its budget.
    #[test]
    fn committed_figures_are_within_their_budgets() {
        let budgets = Budgets::read().expect("budgets.toml");
        let works = Committed::read("works").expect("works");
        let path = Committed::read("path").expect("path");
        let images = Committed::read("images").expect("images");
        let within = |of: &Committed, row: &str, column: &str, budget: f64| {
            let value = of.cell(row, column).expect("a cell");
            let value: f64 = value.parse().expect("a number");
            assert!(
                value <= budget,
                "{}: {row}, {column}: {value} of {budget}",
                of.name
            );
        };
        for (name, budget) in &budgets.instructions {
            within(&works, name, "instructions", *budget);
        }
        assert_eq!(works.rows.len(), budgets.instructions.len());
        for (name, budget) in &budgets.application {
            within(&path, name, "sample, byte", budget.sample);
            within(&path, name, "sample, DMA", budget.sample_dma);
            within(&path, name, "later, byte", budget.worst_later);
            within(&path, name, "worst, byte", budget.worst_sample);
            within(&path, name, "latency, byte", budget.latency);
        }
        for (name, budget) in &budgets.image {
            within(&images, name, "flash, B", budget.flash as f64);
            within(&images, name, "variables, B", budget.ram as f64);
        }
        for (name, budget) in &budgets.board {
            within(&images, name, "flash, B", budget.flash as f64);
            within(&images, name, "variables, B", budget.ram as f64);
        }
    }
}
