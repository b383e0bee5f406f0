//! `cargo xtask scale`: campaigns on Dask workers that are killed (`deploy/test_dask_campaign.py`).
//! Python's packages go to `target/scale`.

use std::process::ExitCode;

use crate::images::{target_directory, workspace};
use anyhow::Result;

use crate::stage::{cargo_with, succeed};
use crate::venv::Environment;

/// Builds the program and runs the test.
pub fn scale() -> Result<ExitCode> {
    succeed(&mut cargo_with(
        "build --quiet --release --package host-sim --bin host-sim",
    ))?;
    let program = target_directory()?.join("release/host-sim");
    let deploy = workspace().join("deploy");
    let venv = Environment::of("scale/venv", &deploy.join("requirements.txt"))?;
    let test = "-m pytest --quiet -p no:cacheprovider test_dask_campaign.py";
    let mut python = venv.python();
    python.args(test.split(' ')).current_dir(&deploy);
    succeed(python.env("HOST_SIM", program))?;
    Ok(ExitCode::SUCCESS)
}
