//! `cargo xtask scale`: campaigns on Dask workers that are killed (`deploy/test_dask_campaign.py`),
//! and throughput against workers. Python's packages go to `target/scale`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context, Result, ensure};
use qemu::images::{target_directory, workspace};

use crate::markers;
use crate::stage::{cargo_with, succeed};

/// What helps where there is no environment.
const REMEDY: &str = "remedy: install python3 (3.11 or later) and python3-venv, and let pip reach \
                      the package index";

/// Tests; with `measure` it measures instead, draws `docs/scale.svg` and writes the table.
pub fn scale(measure: bool) -> Result<ExitCode> {
    succeed(&mut cargo_with(
        "build --quiet --release --package host-sim",
    ))?;
    let program = target_directory()?.join("release/host-sim");
    let deploy = workspace().join("deploy");
    let wanted = if measure {
        "requirements-measure.txt"
    } else {
        "requirements.txt"
    };
    let python = python(&target_directory()?.join("scale"), &deploy.join(wanted))?;
    let mut command = Command::new(python);
    command.current_dir(&deploy).env("HOST_SIM", program);
    command.env("PYTHONDONTWRITEBYTECODE", "1");
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

/// The interpreter of an environment in `home` with these packages, which are installed where they
/// are not yet.
fn python(home: &Path, requirements: &Path) -> Result<PathBuf> {
    let of = |file: &Path| fs::read_to_string(file).with_context(|| file.display().to_string());
    let mut wanted = of(requirements)?;
    let shorter = requirements.with_file_name("requirements.txt");
    if requirements != shorter {
        wanted += &of(&shorter)?; // which the longer list includes by its name
    }
    let environment = home.join("venv");
    let python = environment.join("bin/python");
    let stamp = home.join("installed");
    if python.exists() && fs::read_to_string(&stamp).is_ok_and(|have| have.contains(&wanted)) {
        return Ok(python);
    }
    fs::create_dir_all(home).with_context(|| home.display().to_string())?;
    let mut venv = Command::new("python3");
    succeed(venv.args(["-m", "venv", "--clear"]).arg(environment)).context(REMEDY)?;
    let install = "-m pip install --quiet --disable-pip-version-check --requirement";
    let mut pip = Command::new(&python);
    succeed(pip.args(install.split(' ')).arg(requirements)).context(REMEDY)?;
    fs::write(&stamp, wanted).with_context(|| stamp.display().to_string())?;
    Ok(python)
}
