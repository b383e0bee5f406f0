//! `cargo xtask scale`: campaigns on Dask workers that are killed (`deploy/test_dask_campaign.py`),
//! and throughput against workers. Python's packages go to `target/scale`.

use std::process::{ExitCode, Stdio};

use anyhow::{Context, Result, ensure};
use qemu::images::{target_directory, workspace};

use crate::markers;
use crate::stage::{cargo_with, succeed};
use crate::venv::Environment;

/// Tests; with `measure` it measures instead, draws `docs/scale.svg` and writes the table.
pub fn scale(measure: bool) -> Result<ExitCode> {
    succeed(&mut cargo_with(
        "build --quiet --release --package host-sim",
    ))?;
    let program = target_directory()?.join("release/host-sim");
    let deploy = workspace().join("deploy");
    let (place, wanted) = if measure {
        ("scale/measure", "requirements-measure.txt")
    } else {
        ("scale/venv", "requirements.txt")
    };
    let mut command = Environment::of(place, &deploy.join(wanted))?.python();
    command.current_dir(&deploy).env("HOST_SIM", program);
    if !measure {
        let test = "-m pytest --quiet -p no:cacheprovider test_dask_campaign.py";
        succeed(command.args(test.split(' ')))?;
        return Ok(ExitCode::SUCCESS);
    }
    command.args(["measure_workers.py", "--svg"]);
    command.arg(workspace().join("docs/scale.svg"));
    let output = command
        .stderr(Stdio::inherit())
        .output()
        .context("measure_workers.py")?;
    ensure!(
        output.status.success(),
        "measure_workers.py: {}",
        output.status
    );
    let part = String::from_utf8(output.stdout).context("measure_workers.py: its output")?;
    markers::write("scale", &part)?;
    print!("{part}");
    Ok(ExitCode::SUCCESS)
}
