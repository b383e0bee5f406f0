//! Tests of the built `host-sim` as its user sees it: output, files, exit codes. The tests are in `tests/`.
//!
//! The package depends on `host-sim` only so that cargo builds the binary's library first; the binary itself is built on demand by
//! [`host_sim_binary`].

use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

/// Path of the `host-sim` executable, built once a test process in the profile for releases (the simulation is slow without).
///
/// # Panics
/// When cargo cannot build it.
#[must_use]
pub fn host_sim_binary() -> &'static PathBuf {
    static BINARY: OnceLock<PathBuf> = OnceLock::new();
    BINARY.get_or_init(|| {
        let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let status = Command::new(cargo)
            .args([
                "build",
                "--quiet",
                "--release",
                "--package",
                "host-sim",
                "--bin",
                "host-sim",
            ])
            .current_dir(&root)
            .status();
        assert!(
            status.is_ok_and(|s| s.success()),
            "cargo build --release --package host-sim failed"
        );
        let target =
            std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from);
        target
            .join("release")
            .join(format!("host-sim{}", std::env::consts::EXE_SUFFIX))
    })
}
