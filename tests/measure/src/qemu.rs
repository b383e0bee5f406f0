//! `cargo xtask qemu`: every board in QEMU, at its serial lines and over a long drive, compared
//! with the library on the desktop.

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result};
use comfy_table::Table;
use firmware::wire::ImuFormat;
use qemu::budget::Budgets;
use qemu::drive::drive;
use qemu::images::BOARDS;
use qemu::live::Live;
use qemu::protocol::drives;
use qemu::replay::Pace;
use qemu::report::{MINUTES, Report, counted, report, within};
use qemu::software::Instructions;

use crate::needs;
use crate::table::{numbers, thousands};

/// Runs, prints, and writes `json` if asked. A difference or an excess is an error.
pub fn qemu(json: Option<&Path>) -> Result<ExitCode> {
    needs::target()?;
    needs::emulator()?;
    let budgets = Budgets::read()?;
    let long = drive(ImuFormat::Stim300, MINUTES * 60)?;
    let mut reports = Vec::new();
    for board in BOARDS {
        eprintln!("{} ({})", board.name, board.machine.name);
        reports.push(report(board, &long)?);
    }
    println!("{}", table(&reports));
    log()?;
    if let Some(path) = json {
        let text = serde_json::to_string_pretty(&reports)? + "\n";
        fs::write(path, text).with_context(|| path.display().to_string())?;
    }
    for (board, report) in BOARDS.into_iter().zip(&reports) {
        report.check(board, &budgets)?;
    }
    let mut costs = Vec::new();
    for (format, _) in drives() {
        let [byte, dma] = [Pace::Byte, Pace::Dma].map(|pace| counted(BOARDS[0], format, pace));
        costs.push((format, byte?.1, dma?.1));
    }
    println!("{}", path(&costs));
    for (format, byte, dma) in costs {
        let budget = budgets.application.get(format.name());
        let budget = budget.with_context(|| format!("no budget for {format:?}"))?;
        for (cost, is_dma) in [(byte, false), (dma, true)] {
            within(cost, is_dma, *budget).with_context(|| format!("{format:?}"))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The table of the whole path in docs/PERFORMANCE.md.
fn path(costs: &[(ImuFormat, Instructions, Instructions)]) -> Table {
    let mut table = numbers([
        "per sample, instructions",
        "an interrupt per byte",
        "DMA",
        "the most expensive, DMA",
        "from the tenth on, DMA",
        "last byte in to first byte out, DMA",
    ]);
    for (format, byte, dma) in costs {
        let counts = [
            byte.per_sample,
            dma.per_sample,
            dma.worst_sample,
            dma.worst_later,
            dma.latency,
        ];
        let mut row = vec![format.name().to_owned()];
        row.extend(counts.map(thousands));
        table.add_row(row);
    }
    table
}

fn table(reports: &[Report]) -> Table {
    let mut header = vec![format!("{MINUTES} min as STIM300")];
    header.extend(reports.iter().map(|report| report.board.clone()));
    let mut table = numbers(header);
    type Column = fn(&Report) -> String;
    let rows: [(&str, Column); 11] = [
        ("samples", |r| r.samples.to_string()),
        ("digest, desktop", |r| r.digest_host.clone()),
        ("digest, target", |r| r.digest_target.clone()),
        ("all equal", |r| r.equal.to_string()),
        ("instructions per sample", |r| {
            format!("{:.0}", r.instructions_per_sample)
        }),
        ("... with lines by DMA", |r| {
            format!("{:.0}", r.instructions_per_sample_dma)
        }),
        ("... the most expensive", |r| {
            format!("{:.0}", r.instructions_worst_sample)
        }),
        ("... last byte in to first byte out", |r| {
            format!("{:.0}", r.latency_instructions)
        }),
        ("flash, B", |r| r.flash_bytes.to_string()),
        ("variables, B", |r| r.ram_bytes.to_string()),
        ("deepest stack, B", |r| r.stack_high_water_bytes.to_string()),
    ];
    for (name, value) in rows {
        let mut row = vec![name.to_owned()];
        row.extend(reports.iter().map(value));
        table.add_row(row);
    }
    table
}

/// Prints the log of the first board, read from its memory.
fn log() -> Result<()> {
    let mut live = Live::start(BOARDS[0], &BOARDS[0].image.build()?)?;
    std::thread::sleep(std::time::Duration::from_millis(500));
    for line in live.memory()?.log()? {
        println!("log of {}: {line}", BOARDS[0].name);
    }
    Ok(())
}
