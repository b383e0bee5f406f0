//! What images may cost: `budgets.toml` at the top of the workspace.

use std::collections::BTreeMap;
use std::fs;

use anyhow::{Context, Result};
use serde::Deserialize;

use crate::images::workspace;

/// The whole file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budgets {
    /// By image name.
    pub image: BTreeMap<String, ImageBudget>,
    /// Instructions on the target, by the name the `instructions` image prints.
    pub instructions: BTreeMap<String, f64>,
}

/// Limits of one image.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImageBudget {
    /// Bytes of flash: code, constants, initial values of variables.
    pub flash: u64,
    /// Bytes of static variables; the stack has the rest.
    pub ram: u64,
    /// Whether code that can panic may be in it.
    pub panics: bool,
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
