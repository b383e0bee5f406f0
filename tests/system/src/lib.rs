//! Tests of the built `host-sim` as its user sees it: output, files, exit codes. The tests are in
//! `tests/`.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Path of the `host-sim` executable, built once in a test process.
///
/// It is built in the profile of the tests, which optimises: a release build would compile every
/// dependency once more. Both give the same figures, bit for bit.
///
/// # Panics
/// When cargo cannot build it.
#[must_use]
pub fn host_sim_binary() -> &'static PathBuf {
    static BINARY: OnceLock<PathBuf> = OnceLock::new();
    BINARY.get_or_init(|| {
        let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        // `--workspace`: with the features that the tests themselves were built with
        let status = Command::new(cargo)
            .args(["build", "--quiet", "--workspace", "--bin", "host-sim"])
            .current_dir(&root)
            .status();
        assert!(
            status.is_ok_and(|s| s.success()),
            "cargo build --workspace --bin host-sim failed"
        );
        let target =
            std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from);
        target
            .join("debug")
            .join(format!("host-sim{}", std::env::consts::EXE_SUFFIX))
    })
}

/// The contents of a JSON file.
///
/// # Panics
/// There is no such file, or it is not JSON.
#[must_use]
pub fn json(file: &Path) -> Value {
    let bytes = std::fs::read(file).expect("the file was written");
    serde_json::from_slice(&bytes).expect("it is JSON")
}

/// The horizontal error of `scheme` at `t_min` in the results of `run` or `replay`.
///
/// # Panics
/// There is no such row.
#[must_use]
pub fn horizontal(results: &Value, scheme: &str, t_min: u64) -> f64 {
    let rows = results["rows"].as_array().expect("results have rows");
    let row = rows
        .iter()
        .find(|r| r["scheme"] == scheme && r["t_min"] == t_min)
        .expect("every scheme has a row at every time");
    row["horizontal_m"].as_f64().expect("an error is a number")
}

/// Folder with recorded data: `LRNN_DATA` if it is set, else `../shared/data` beside the project.
/// `None` if that folder does not exist.
#[must_use]
pub fn data_dir() -> Option<PathBuf> {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("LRNN_DATA").map_or_else(beside, PathBuf::from);
    folder.is_dir().then_some(folder)
}
