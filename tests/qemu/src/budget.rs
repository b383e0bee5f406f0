//! Limits on the cost of images: `budgets.toml` at the top of the workspace.

use std::collections::BTreeMap;
use std::fs;

use anyhow::{Context, Result};
use serde::Deserialize;

use crate::images::workspace;

/// The whole file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budgets {
    /// Instructions of the longest pass of the main loop.
    pub longest_pass: f64,
    /// Flash and memory, by image name.
    pub image: BTreeMap<String, ImageBudget>,
    /// Limits of the boards over third-party drivers, by package.
    pub board: BTreeMap<String, BoardBudget>,
    /// Instructions on the target, by the name the `instructions` image prints.
    pub instructions: BTreeMap<String, f64>,
    /// Instructions of the whole application, by the sensor's format.
    pub application: BTreeMap<String, ApplicationBudget>,
    /// Instructions on the target for one more network, candidate and the like, by the kind of work
    /// that grows.
    pub one_more: BTreeMap<String, f64>,
    /// Bursts of an ADIS over SPI.
    pub adis: AdisBudget,
    /// `lrnn-nostd` in a crate of its own.
    pub alone: AloneBudget,
    /// Most memory of a command of `host-sim` with a recording of 24 h at 200 Hz, MiB.
    pub day_mib: BTreeMap<String, f64>,
}

/// Limits of the application, instructions on the Cortex-M4F.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ApplicationBudget {
    /// Mean of all passes for a sample.
    pub sample: f64,
    /// As `sample`, with lines by DMA.
    pub sample_dma: f64,
    /// All passes for the most expensive sample.
    pub worst_sample: f64,
    /// As `worst_sample`, without the first samples of a stream.
    pub worst_later: f64,
    /// From the last byte of a frame to the first byte sent.
    pub latency: f64,
}

/// Limits of a burst that DMA fetches and that leaves uncorrected: all instructions on the
/// Cortex-M4F.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdisBudget {
    /// At 2000 bursts a second.
    pub burst_2000: f64,
    /// At 4000 bursts a second, of an ADIS1649x.
    pub burst_4000: f64,
    /// At 2000 bursts a second on the board `f405`, over the drivers of `embassy-stm32`.
    pub over_embassy_2000: f64,
    /// At 4000 bursts a second on that board.
    pub over_embassy_4000: f64,
}

/// Limits of `lrnn-nostd` in a crate of its own (`tests/alone`).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AloneBudget {
    /// Step, gradient and descent on a core with an FPU: at most this many times the instructions
    /// of opt-level 3 at every other level.
    pub times: f64,
    /// As `times`, for a learning pass of one step.
    pub learn_times: f64,
    /// By core.
    pub core: BTreeMap<String, AloneCore>,
}

/// Limits on one core at opt-level "s".
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AloneCore {
    /// Instructions of a step.
    pub step: f64,
    /// Instructions of a step with gradient and descent.
    pub descent: f64,
    /// Bytes of flash of a network that steps.
    pub step_flash: u64,
    /// Bytes of flash of one that also learns.
    pub descent_flash: u64,
}

/// Limits of one image.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImageBudget {
    /// Bytes of flash: code, constants, initial values of variables.
    pub flash: u64,
    /// Bytes of static variables; the stack has the rest.
    pub ram: u64,
    /// Bytes of core-coupled memory; an image without this line has none.
    #[serde(default)]
    pub coupled: u64,
    /// Whether code that can panic may be in it.
    pub panics: bool,
    /// Bytes of static variables and of the stack at its deepest, where it is measured.
    pub ram_and_stack: Option<u64>,
}

/// Limits of the image of a board over third-party drivers. These can panic.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardBudget {
    /// Bytes of flash: code, constants, initial values of variables.
    pub flash: u64,
    /// Bytes of static variables; the stack has the rest.
    pub ram: u64,
}

impl Budgets {
    /// Reads the file.
    ///
    /// # Errors
    /// The file is missing or malformed; the error names the line.
    pub fn read() -> Result<Self> {
        let path = workspace().join("budgets.toml");
        let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        toml::from_str(&text).with_context(|| path.display().to_string())
    }
}
