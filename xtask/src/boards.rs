//! The boards over third-party drivers (`firmware/boards`, a workspace of its own): how they are
//! built.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::images::{TARGET, apart, target_directory};
use crate::stage::succeed;

/// The target of a Cortex-M33 with FPU.
pub const M33: &str = "thumbv8m.main-none-eabihf";

/// A board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Family {
    /// Its package, and its entry in `budgets.toml`.
    pub name: &'static str,
    /// Its product name.
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
    /// The board of this name.
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
    let mut build = apart("build", "firmware/boards", "boards", Some(target))?;
    succeed(build.args(["--release", "--package", package]))?;
    let directory = target_directory()?.join("boards");
    Ok(directory.join(target).join("release").join(package))
}

/// The board of a name.
///
/// # Errors
/// There is none; the error lists the existing ones.
pub fn named(name: &str) -> Result<Family> {
    let names = FAMILIES.map(|family| family.name).join(", ");
    Family::named(name)
        .with_context(|| format!("no board `{name}`; remedy: stm32f405 or one of {names}"))
}

/// A board that takes updates over the command link.
#[derive(Clone, Copy, Debug)]
pub struct Updatable {
    /// Its package.
    pub name: &'static str,
    /// The package of its loader.
    pub loader: &'static str,
    /// The target triple.
    pub target: &'static str,
    /// Addresses of its slots; a probe flashes the first.
    pub slots: [u32; 2],
}

/// Every board that takes updates.
const UPDATABLE: [Updatable; 1] = [Updatable {
    name: "h743",
    loader: "boot-h743",
    target: TARGET,
    slots: [0x0802_0000, 0x0810_0000],
}];

impl Updatable {
    /// The board of this name.
    ///
    /// # Errors
    /// There is none that takes updates; the error lists those.
    pub fn named(name: &str) -> Result<Self> {
        let names = UPDATABLE.map(|board| board.name).join(", ");
        let found = UPDATABLE.into_iter().find(|board| board.name == name);
        found.with_context(|| format!("board `{name}` takes no updates; remedy: {names}"))
    }

    /// Builds its image for a slot, which expects updates signed for the public key of a file;
    /// without one, for the development key.
    ///
    /// # Errors
    /// As [`Family::build`].
    pub fn build(&self, slot: u32, key: Option<&Path>) -> Result<PathBuf> {
        self.build_with("", slot, key)
    }

    /// [`Self::build`] with a feature of its package.
    ///
    /// # Errors
    /// As [`Family::build`].
    pub fn build_with(&self, feature: &str, slot: u32, key: Option<&Path>) -> Result<PathBuf> {
        let mut build = apart("build", "firmware/boards", "boards", Some(self.target))?;
        build.args(["--release", "--package", self.name]);
        build.args(["--features", feature]);
        build.env("LRNN_SLOT", format!("{slot:#x}"));
        match key {
            Some(key) => build.env("LRNN_UPDATE_KEY", key),
            None => build.env_remove("LRNN_UPDATE_KEY"),
        };
        succeed(&mut build)?;
        let directory = target_directory()?.join("boards");
        Ok(directory.join(self.target).join("release").join(self.name))
    }
}

/// Examples of a custom main loop, which only have to build.
const EXAMPLES: [&str; 2] = ["loop-embassy", "loop-rtic"];

/// Programs over third-party drivers for the chip model (`tests/chip`): feature and name.
pub const DRIVERS: [(&str, &str); 2] = [("hal", "chip-hal"), ("embassy", "chip-embassy")];

/// Builds the examples.
///
/// # Errors
/// As [`build`].
pub fn examples() -> Result<()> {
    EXAMPLES
        .iter()
        .try_for_each(|name| build(name, TARGET).map(drop))
}

/// Runs Clippy over the packages with a workspace of their own, in the folders of their builds:
/// each board alone, since it needs its chip's features, the judges of the chip model, the emulator
/// for the Pico 2, and `lrnn-nostd` alone.
pub fn lints() -> Result<()> {
    let loaders = UPDATABLE.map(|board| (board.loader, board.target));
    let boards = FAMILIES.map(|family| (family.name, family.target));
    let boards = boards.into_iter().chain(loaders);
    let examples = EXAMPLES.map(|example| (example, TARGET));
    for (package, target) in boards.chain(examples) {
        let of = ["--release", "--package", package];
        clippy("firmware/boards", "boards", Some(target), &of)?;
    }
    for (feature, program) in DRIVERS.into_iter().chain([("cases", "stm32-cases")]) {
        let of = ["--features", feature, "--bin", program];
        clippy("tests/chip", "chip", Some(TARGET), &of)?;
    }
    clippy("tests/rp2350", "rp2350", None, &[])?;
    clippy(
        "tests/alone",
        "alone",
        Some(TARGET),
        &["--release", "--bins"],
    )
}

/// Runs Clippy over a workspace, for a target or for this machine, in its own `folder` of the
/// target directory.
fn clippy(workspace_of: &str, folder: &str, target: Option<&str>, of: &[&str]) -> Result<()> {
    let mut clippy = apart("clippy", workspace_of, folder, target)?;
    succeed(clippy.args(of).args(["--", "-D", "warnings"]))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use crate::images::workspace;

    /// Each line of the worked diff is in one of the two boards' files, and each line that differs
    /// is in the diff.
    #[test]
    fn the_worked_diff_is_of_these_boards() {
        let text = |path: &str| fs::read_to_string(workspace().join(path)).expect(path);
        let all = |board: &str| {
            ["Cargo.toml", "memory.x", "src/main.rs"]
                .map(|file| text(&format!("firmware/boards/{board}/{file}")))
                .concat()
        };
        let (from, to) = (all("f405"), all("f446"));
        let page = text("docs/add-a-board.md");
        let (mut within, mut seen) = (false, 0);
        for line in page.lines() {
            match (line.starts_with("```"), line.split_at_checked(1)) {
                (true, _) => within = line == "```diff",
                (_, Some((sign, rest))) if within => {
                    let of = if sign == "-" { &from } else { &to };
                    assert!(of.lines().any(|line| line == rest), "{line}");
                    seen += 1;
                }
                _ => {}
            }
        }
        assert!(seen > 30, "{seen} lines");
        // ... and the diffs are complete, but for comments and the package's name
        let comment = |line: &str| line.starts_with("//") || line.starts_with("/*");
        let names = |line: &str| line.starts_with("name =") || line.starts_with("description =");
        let page: Vec<&str> = page.lines().collect();
        for (sign, of, other) in [("-", &from, &to), ("+", &to, &from)] {
            let own = of.lines().filter(|line| !other.lines().any(|l| l == *line));
            let own = own.filter(|line| !comment(line) && !names(line));
            for line in own.filter(|line| !line.starts_with("   program begins")) {
                assert!(page.contains(&&*format!("{sign}{line}")), "{sign}{line}");
            }
        }
    }
}
