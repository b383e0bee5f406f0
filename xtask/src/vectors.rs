//! `cargo xtask vectors`: writes the shared vectors and digests again.

use std::process::ExitCode;

use anyhow::Result;

use crate::stage::{cargo_with, succeed};

/// Runs twice: the second run computes its digests from the vectors that the first one wrote.
pub fn regenerate() -> Result<ExitCode> {
    for _ in 0..2 {
        succeed(&mut cargo_with(
            "run --quiet --package vectors --example regenerate",
        ))?;
    }
    succeed(&mut cargo_with("test --quiet --package vectors"))?;
    Ok(ExitCode::SUCCESS)
}
