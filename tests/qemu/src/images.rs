//! Builds the images with a nested cargo, into a build directory of their own so that it never
//! waits for the lock of the cargo that runs the tests. `cargo xtask test` has built them before,
//! and the nested build finds nothing to do.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};

use crate::machine::{self, Machine};

/// The one target triple.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// Profile of images: as on the board.
pub const PROFILE: &str = "firmware";

/// Environment variable that makes a missing emulator or target an error instead of a skipped test.
pub const REQUIRE: &str = "LRNN_REQUIRE_QEMU";

/// A program that can be built: package and binary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Image {
    package: &'static str,
    /// Name of the binary and of its entry in `budgets.toml`.
    pub name: &'static str,
}

/// The board image.
pub const STM32F405: Image = Image {
    package: "firmware",
    name: "stm32f405",
};
/// The same without the learner from fixes.
pub const STM32F405_WINDOW: Image = Image {
    package: "firmware",
    name: "stm32f405_window",
};
/// The second board's.
pub const MPS2: Image = Image {
    package: "firmware",
    name: "mps2",
};
/// The shared vectors, compared with the desktop's digests.
pub const AGREEMENT: Image = Image {
    package: "qemu",
    name: "agreement",
};
/// The application over a recording in a file.
pub const REPLAY: Image = Image {
    package: "qemu",
    name: "replay",
};
/// Compares with a wrong constant and has to fail.
pub const DIFFERENT: Image = Image {
    package: "qemu",
    name: "different",
};
/// Counts instructions.
pub const INSTRUCTIONS: Image = Image {
    package: "qemu",
    name: "instructions",
};
/// Counts cycles on a board with an STM32F4, F7 or H7.
pub const BENCH: Image = Image {
    package: "silicon",
    name: "stm32-bench",
};
/// Counts instructions of work of growing size.
pub const GROWTH: Image = Image {
    package: "qemu",
    name: "growth",
};
/// Nothing but inference.
pub const INFERENCE: Image = Image {
    package: "qemu",
    name: "inference",
};
/// Every image.
pub const ALL: [Image; 10] = [
    STM32F405,
    STM32F405_WINDOW,
    MPS2,
    AGREEMENT,
    REPLAY,
    DIFFERENT,
    INSTRUCTIONS,
    GROWTH,
    INFERENCE,
    BENCH,
];

/// A board: its image and the machine that stands for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    /// Name in reports.
    pub name: &'static str,
    /// What is flashed.
    pub image: Image,
    /// What runs it here.
    pub machine: Machine,
}

/// Every board.
pub const BOARDS: [Board; 4] = [
    Board {
        name: "stm32f405",
        image: STM32F405,
        machine: machine::NETDUINOPLUS2,
    },
    Board {
        name: "mps2-an386",
        image: MPS2,
        machine: machine::MPS2_AN386,
    },
    Board {
        name: "mps2-an500",
        image: MPS2,
        machine: machine::MPS2_AN500,
    },
    Board {
        name: "stm32f405_window",
        image: STM32F405_WINDOW,
        machine: machine::NETDUINOPLUS2,
    },
];

/// Top of the workspace, where `memory.x` and `budgets.toml` are.
pub fn workspace() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap_or(here).to_path_buf()
}

impl Image {
    /// Builds it and says where it is.
    ///
    /// # Errors
    /// cargo cannot be started, or the build fails; cargo has told why on standard error.
    pub fn build(self) -> Result<PathBuf> {
        let directory = target_directory()?.join("images");
        let status = cargo()
            .args(["build", "--quiet", "--profile", PROFILE, "--target", TARGET])
            .args([
                "--package",
                self.package,
                "--bin",
                self.name,
                "--target-dir",
            ])
            .arg(&directory)
            .env_remove("RUSTFLAGS") // flags of a host run (coverage, sanitizers) are not for the target
            .env_remove("CARGO_ENCODED_RUSTFLAGS")
            .status()
            .context("cannot start cargo")?;
        ensure!(status.success(), "building image {} failed", self.name);
        Ok(directory.join(TARGET).join(PROFILE).join(self.name))
    }

    /// For tests: the built image, or `None`, with a line on standard error, on a machine that
    /// cannot run it.
    ///
    /// # Panics
    /// The build fails; or the machine cannot run it and [`REQUIRE`] is set.
    pub fn build_or_skip(self) -> Option<PathBuf> {
        match missing() {
            None => Some(
                self.build()
                    .expect("images build with the committed sources"),
            ),
            Some(what) if std::env::var_os(REQUIRE).is_some() => panic!("{what}"),
            Some(what) => {
                // Not eprintln, which the test harness swallows when the test passes.
                let _ = std::io::Write::write_all(
                    &mut std::io::stderr(),
                    format!("skipped: {what}\n").as_bytes(),
                );
                None
            }
        }
    }
}

/// What this machine lacks to build and run images, with the remedy.
pub fn missing() -> Option<String> {
    if !target_installed() {
        return Some(format!(
            "target {TARGET} is not installed; remedy: rustup target add {TARGET}"
        ));
    }
    (!machine::available()).then(|| {
        format!(
            "{} is not installed; remedy: {}",
            machine::QEMU,
            machine::REMEDY
        )
    })
}

/// Whether the toolchain of this workspace has the target's core library.
pub fn target_installed() -> bool {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let sysroot = Command::new(rustc)
        .args(["--print", "sysroot"])
        .current_dir(workspace())
        .output();
    sysroot.is_ok_and(|output| {
        let sysroot = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        Path::new(&sysroot)
            .join("lib/rustlib")
            .join(TARGET)
            .join("lib")
            .is_dir()
    })
}

/// The cargo that runs us, in the workspace, without input.
pub fn cargo() -> Command {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(workspace()).stdin(Stdio::null());
    cargo
}

/// Where cargo builds by default: `CARGO_TARGET_DIR`, the configuration file, or `target`.
///
/// # Errors
/// `cargo metadata` fails.
pub fn target_directory() -> Result<PathBuf> {
    let output = cargo()
        .args(["metadata", "--no-deps", "--format-version", "1"])
        .output()
        .context("cannot start cargo")?;
    let metadata: serde_json::Value =
        serde_json::from_slice(&output.stdout).with_context(|| {
            format!(
                "cargo metadata: {}",
                String::from_utf8_lossy(&output.stderr)
            )
        })?;
    let directory = metadata["target_directory"]
        .as_str()
        .context("cargo metadata names no target directory")?;
    Ok(directory.into())
}
