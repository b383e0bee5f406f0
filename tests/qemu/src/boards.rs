//! The boards over other people's drivers (`firmware/boards`, a workspace of its own): how they are
//! built.

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};

use crate::images::{TARGET, cargo, target_directory, without_paths, workspace};

/// The target of a Cortex-M33 with FPU.
pub const M33: &str = "thumbv8m.main-none-eabihf";

/// A board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Family {
    /// Its package, and its entry in `budgets.toml`.
    pub name: &'static str,
    /// Its name on the box.
    pub board: &'static str,
    /// The target triple.
    pub target: &'static str,
    /// The chip by the name that probe-rs uses.
    pub chip: &'static str,
    /// Bytes of memory for variables and stack.
    pub memory: u64,
}

/// Every board.
pub const FAMILIES: [Family; 6] = [
    Family {
        name: "f405",
        board: "STM32F405 over embassy-stm32",
        target: TARGET,
        chip: "STM32F405RGTx",
        memory: 128 * 1024,
    },
    Family {
        name: "f446",
        board: "Nucleo-F446RE",
        target: TARGET,
        chip: "STM32F446RETx",
        memory: 128 * 1024,
    },
    Family {
        name: "f767",
        board: "Nucleo-F767ZI",
        target: TARGET,
        chip: "STM32F767ZITx",
        memory: 512 * 1024,
    },
    Family {
        name: "h743",
        board: "Nucleo-H743ZI2",
        target: TARGET,
        chip: "STM32H743ZITx",
        memory: (512 + 128) * 1024,
    },
    Family {
        name: "pico2",
        board: "Raspberry Pi Pico 2",
        target: M33,
        chip: "RP235x",
        memory: 512 * 1024,
    },
    Family {
        name: "nrf52840",
        board: "nRF52840-DK",
        target: TARGET,
        chip: "nRF52840_xxAA",
        memory: 256 * 1024,
    },
];

impl Family {
    /// The one of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        FAMILIES.into_iter().find(|family| family.name == name)
    }

    /// Builds its image and returns the path. All boards share a build directory.
    ///
    /// # Errors
    /// cargo cannot be started, or the build fails; cargo has printed why.
    pub fn build(self) -> Result<PathBuf> {
        build(self.name, self.target)
    }
}

/// Builds a package of the boards' workspace and returns the path of its image.
///
/// # Errors
/// As [`Family::build`].
pub fn build(package: &str, target: &str) -> Result<PathBuf> {
    let directory = target_directory()?.join("boards");
    let mut build = cargo();
    build
        .args(["build", "--quiet", "--locked", "--release"])
        .args(["--target", target, "--package", package])
        .arg("--manifest-path")
        .arg(workspace().join("firmware/boards/Cargo.toml"))
        .arg("--target-dir")
        .arg(&directory);
    without_paths(&mut build, &workspace());
    let status = build.status().context("cannot start cargo")?;
    ensure!(status.success(), "building board {package} failed");
    Ok(directory.join(target).join("release").join(package))
}
