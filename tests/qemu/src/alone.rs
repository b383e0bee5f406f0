//! `lrnn-nostd` in a crate of its own (`tests/alone`, a workspace of its own, as a user has it):
//! how it is built for each core and level of optimisation, and what it costs there.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, ensure};

use crate::count::{self, Counts};
use crate::images::{apart, installed, target_directory};
use crate::machine::{self, Clock, Machine, QEMU_RISCV, Run};
use crate::size::Size;
pub use xtask::needs::{ALONE as TARGETS, REMEDY_RISCV};

/// Profiles of `tests/alone`: opt-level 3 first, and those of small images with link-time
/// optimisation.
pub const LEVELS: [&str; 8] = [
    REFERENCE, "o1", "o2", SMALL, "oz", "o3-lto", "os-lto", "oz-lto",
];

/// Opt-level 3, with which the others are compared.
pub const REFERENCE: &str = "o3";

/// Opt-level "s", which most images of this kind have.
pub const SMALL: &str = "os";

/// A core: its build target, and the QEMU machine that has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Core {
    /// Its name in `budgets.toml`.
    pub name: &'static str,
    /// Its name in tables.
    pub what: &'static str,
    /// The target triple.
    pub target: &'static str,
    /// The machine.
    pub machine: Machine,
}

/// The core that is measured at every level.
pub const M4F: Core = Core {
    name: "m4f",
    what: "Cortex-M4F",
    target: "thumbv7em-none-eabihf",
    machine: machine::MPS2_AN386,
};

/// Every core; the last two compute in software.
pub const CORES: [Core; 5] = [
    M4F,
    Core {
        name: "m7",
        what: "Cortex-M7",
        target: "thumbv7em-none-eabihf",
        machine: machine::MPS2_AN500,
    },
    Core {
        name: "m33",
        what: "Cortex-M33 with FPU",
        target: "thumbv8m.main-none-eabihf",
        machine: machine::MPS2_AN505,
    },
    Core {
        name: "m0",
        what: "Cortex-M0+ (its code on a Cortex-M3)",
        target: "thumbv6m-none-eabi",
        machine: machine::MPS2_AN385,
    },
    Core {
        name: "riscv32imac",
        what: "RISC-V RV32IMAC",
        target: "riscv32imac-unknown-none-elf",
        machine: machine::RISCV32,
    },
];

/// Bytes of flash that a network takes, without the program's start-up and exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flash {
    /// A network that only steps.
    pub step: u64,
    /// A network that also learns at each step.
    pub descent: u64,
}

/// Builds the example for a Cortex-M4F and returns its path.
///
/// # Errors
/// As [`Core::build`].
pub fn example() -> Result<PathBuf> {
    let target = Some(M4F.target);
    let mut build = apart("build", "lrnn-nostd/examples/cortex-m", "alone", target)?;
    build.arg("--release");
    let status = build.status().context("cannot start cargo")?;
    ensure!(status.success(), "building the example failed");
    Ok(target_directory()?
        .join("alone")
        .join(M4F.target)
        .join("release/lrnn-nostd-example"))
}

/// The programs of `tests/alone`, built for one core at one level.
#[derive(Clone, Debug)]
pub struct Built {
    core: Core,
    folder: PathBuf,
}

impl Core {
    /// Builds the programs.
    ///
    /// # Errors
    /// cargo cannot be started, or the build fails; cargo has printed why.
    pub fn build(self, level: &str) -> Result<Built> {
        let mut build = apart("build", "tests/alone", "alone", Some(self.target))?;
        build.args(["--bins", "--profile", level]);
        let status = build.status().context("cannot start cargo")?;
        ensure!(status.success(), "building for {} failed", self.target);
        let folder = target_directory()?
            .join("alone")
            .join(self.target)
            .join(level);
        Ok(Built { core: self, folder })
    }
}

impl Built {
    /// The path of one program.
    pub fn program(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Compares the digests of the shared vectors with the desktop's; exit code 0 when all are
    /// equal.
    ///
    /// # Errors
    /// QEMU cannot be started or does not end.
    pub fn agreement(&self) -> Result<Run> {
        let image = self.program("agreement");
        let limit = Duration::from_secs(120);
        machine::run(self.core.machine, &image, Clock::Free, limit)
    }

    /// Instructions of each piece of work. The counter is checked on a loop of known length.
    ///
    /// # Errors
    /// As [`count::run`]; or the loop was miscounted.
    pub fn count(&self) -> Result<Counts> {
        let (known, counts) = count::run(self.core.machine, &self.program("works"))?;
        known.check()?;
        Ok(counts)
    }

    /// Flash of a network.
    ///
    /// # Errors
    /// As [`Size::of`].
    pub fn flash(&self) -> Result<Flash> {
        let of = |name: &str| flash(&self.program(name));
        let without = of("nothing")?;
        Ok(Flash {
            step: of("step")? - without,
            descent: of("descent")? - without,
        })
    }
}

fn flash(image: &Path) -> Result<u64> {
    Ok(Size::of(image)?.flash)
}

/// What this machine lacks to build and run these programs, with the remedy.
pub fn missing() -> Option<String> {
    let target = TARGETS.into_iter().find(|target| !installed(target));
    if let Some(target) = target {
        return Some(format!(
            "target {target} is not installed; remedy: rustup target add {target}"
        ));
    }
    let emulators = CORES.map(|core| core.machine.emulator);
    let emulator = emulators.into_iter().find(|name| !machine::can_start(name));
    emulator.map(|name| {
        let remedy = if name == QEMU_RISCV {
            REMEDY_RISCV
        } else {
            machine::REMEDY
        };
        format!("{name} is not installed; remedy: {remedy}")
    })
}
