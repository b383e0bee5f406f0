//! The report of `cargo xtask qemu` about each board.

use std::time::Duration;

use anyhow::{Result, ensure};
use firmware::wire::ImuFormat;
use serde::Serialize;

use crate::budget::{ApplicationBudget, Budgets};
use crate::drive::{Record, drive};
use crate::images::{Board, REPLAY};
use crate::machine::Clock;
use crate::protocol::{drives, serve};
use crate::replay::{Pace, config};
use crate::size::Size;
use crate::software::{Instructions, on_desktop, on_target};

/// Minutes of the long drive.
pub const MINUTES: u32 = 22;
/// Seconds of drive over which instructions are counted.
const COUNTED: u32 = 20;
/// Longest run of an image.
const LIMIT: Duration = Duration::from_secs(240);

/// One board; the format of `--json`, which stays stable.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Name.
    pub board: String,
    /// Sensor records of the long drive.
    #[serde(rename = "words")]
    pub samples: u32,
    /// FNV-1a of what the library on the desktop sends, hexadecimal.
    pub digest_host: String,
    /// FNV-1a of what the target sends, hexadecimal.
    pub digest_target: String,
    /// Whether all that was compared is equal: the long drive, each format counted, each format
    /// through the serial lines.
    pub equal: bool,
    /// Instructions for a STIM300 sample, with the interrupts of all its bytes.
    #[serde(rename = "instructions_per_word")]
    pub instructions_per_sample: f64,
    /// Instructions for a STIM300 sample with lines by DMA, with their interrupts.
    #[serde(rename = "instructions_per_word_dma")]
    pub instructions_per_sample_dma: f64,
    /// Instructions for the most expensive sample.
    #[serde(rename = "instructions_worst_word")]
    pub instructions_worst_sample: f64,
    /// From the interrupt of a frame's last byte to the first byte sent; the longest of all
    /// formats.
    pub latency_instructions: f64,
    /// Flash of the board's image, bytes.
    pub flash_bytes: u64,
    /// RAM of its static variables, bytes.
    pub ram_bytes: u64,
    /// The deepest use of its stack.
    pub stack_high_water_bytes: u64,
}

/// The report of one board; `long` is the drive of [`MINUTES`], as STIM300.
///
/// # Errors
/// Something fails to run. A difference is not an error; the report states it.
pub fn report(board: Board, long: &[Record]) -> Result<Report> {
    let replay = REPLAY.build()?;
    let image = board.image.build()?;
    let size = Size::of(&image)?;
    let free = (Pace::Record, Clock::Free, false);
    let here = on_desktop(config(ImuFormat::Stim300), long);
    let there = on_target(
        &replay,
        board.machine,
        ImuFormat::Stim300,
        free,
        long,
        LIMIT,
    )?;
    let mut equal = here.sent == there.sent && !here.sent.is_empty();
    let (mut equal_dma, mut costs, mut dma) = (true, Vec::new(), Vec::new());
    let mut stack = 0;
    for (format, seconds) in drives() {
        let (same, cost) = counted(board, format, Pace::Byte)?;
        equal &= same;
        costs.push(cost);
        let (same, cost) = counted(board, format, Pace::Dma)?;
        equal_dma &= same;
        dma.push(cost);
        let served = serve(board, &image, &drive(format, seconds)?)?;
        equal &= served.sent == served.expected;
        stack = stack.max(served.memory.stack_high_water()?);
    }
    let latency = costs.iter().map(|cost| cost.latency).fold(0.0, f64::max);
    Ok(Report {
        board: board.name.to_owned(),
        samples: here.samples,
        digest_host: format!("{:016x}", here.digest),
        digest_target: format!("{:016x}", there.digest),
        equal: equal && equal_dma,
        instructions_per_sample: costs[0].per_sample,
        instructions_per_sample_dma: dma[0].per_sample,
        instructions_worst_sample: costs[0].worst_sample,
        latency_instructions: latency,
        flash_bytes: size.flash,
        ram_bytes: size.ram,
        stack_high_water_bytes: stack,
    })
}

/// Whether the output for a short drive is equal, and what its samples cost on `board` with lines
/// that move bytes at this pace.
///
/// # Errors
/// Something fails to run.
pub fn counted(board: Board, format: ImuFormat, pace: Pace) -> Result<(bool, Instructions)> {
    let records = drive(format, COUNTED)?;
    let counted = (pace, Clock::Instructions, false);
    let here = on_desktop(config(format), &records);
    let there = on_target(
        &REPLAY.build()?,
        board.machine,
        format,
        counted,
        &records,
        LIMIT,
    )?;
    let same = here.sent == there.sent && !here.sent.is_empty();
    let cost = there.cost.ok_or_else(|| anyhow::anyhow!("not counted"))?;
    Ok((same, cost))
}

/// Checks `cost` against `budget`. `dma`: `cost` was counted with lines by DMA.
///
/// # Errors
/// Names what is over `budget`.
pub fn within(cost: Instructions, dma: bool, budget: ApplicationBudget) -> Result<()> {
    let sample = if dma {
        budget.sample_dma
    } else {
        budget.sample
    };
    for (what, count, limit) in [
        ("a sample", cost.per_sample, sample),
        (
            "the most expensive sample",
            cost.worst_sample,
            budget.worst_sample,
        ),
        (
            "the most expensive sample but the first",
            cost.worst_later,
            budget.worst_later,
        ),
        ("latency", cost.latency, budget.latency),
    ] {
        ensure!(
            count <= limit,
            "{what}: {count:.0} instructions, budget {limit:.0}"
        );
    }
    Ok(())
}

impl Report {
    /// # Errors
    /// Names the difference or the excess.
    pub fn check(&self, board: Board, budgets: &Budgets) -> Result<()> {
        ensure!(self.equal, "{}: target and desktop differ", self.board);
        let together = self.ram_bytes + self.stack_high_water_bytes;
        let limit = budgets.image.get(board.image.name);
        if let Some(limit) = limit.and_then(|budget| budget.ram_and_stack) {
            ensure!(
                together <= limit,
                "{}: {together} bytes of variables and stack, budget {limit}",
                self.board
            );
        }
        Ok(())
    }
}
