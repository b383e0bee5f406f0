//! Tests of the built `host-sim` as its user sees it: output, files, exit codes. The tests are in
//! `tests/`.

use std::path::PathBuf;
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
