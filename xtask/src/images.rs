//! Builds the images with a nested cargo, in a build directory of their own, so that it never waits
//! for the lock of the cargo that runs the tests. `cargo xtask test` and `cargo xtask check` build
//! them before, so the nested build then has nothing to do.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result};

use crate::needs;
use crate::stage::succeed;

/// The target triple.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// Profile of the images, the same as on the board.
pub const PROFILE: &str = "firmware";

/// Environment variable that makes a missing emulator or target an error instead of a skipped test.
pub const REQUIRE: &str = "LRNN_REQUIRE_QEMU";

/// Environment variable with the compiler's flags, a separator between them.
const FLAGS: &str = "CARGO_ENCODED_RUSTFLAGS";

/// A program that can be built: package and binary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Image {
    package: &'static str,
    /// Name of the binary and of its entry in `budgets.toml`.
    pub name: &'static str,
}

macro_rules! images {
    ($($(#[$doc:meta])+ $constant:ident = $package:literal / $name:literal;)+) => {
        $($(#[$doc])+
        pub const $constant: Image = Image { package: $package, name: $name };)+

        /// Every image.
        pub const ALL: [Image; [$($name),+].len()] = [$($constant),+];
    };
}

images! {
    /// The board image.
    STM32F405 = "firmware" / "stm32f405";
    /// The board image without the learner from fixes.
    STM32F405_WINDOW = "firmware" / "stm32f405_window";
    /// The image of the second board.
    MPS2 = "firmware" / "mps2";
    /// The shared vectors, compared with the desktop's digests.
    AGREEMENT = "qemu" / "agreement";
    /// The application over a recording in a file.
    REPLAY = "qemu" / "replay";
    /// Compares with a wrong constant and must fail.
    DIFFERENT = "qemu" / "different";
    /// Counts instructions.
    INSTRUCTIONS = "qemu" / "instructions";
    /// Counts cycles on a board with an STM32F4, F7 or H7.
    BENCH = "silicon" / "stm32-bench";
    /// Counts instructions of work of growing size.
    GROWTH = "qemu" / "growth";
    /// The soak.
    SOAK = "qemu" / "soaking";
    /// Inference alone.
    INFERENCE = "qemu" / "inference";
}

/// cargo for a workspace of its own below ours, such as `tests/chip`: a command, the folder of its
/// manifest, the folder below the target directory that it builds in, and the target if it is not
/// this machine. Options follow.
///
/// # Errors
/// As [`target_directory`].
pub fn apart(command: &str, manifest: &str, built: &str, target: Option<&str>) -> Result<Command> {
    let mut cargo = cargo();
    cargo
        .args([command, "--quiet", "--locked", "--manifest-path"])
        .arg(workspace().join(manifest).join("Cargo.toml"))
        .arg("--target-dir")
        .arg(target_directory()?.join(built));
    if let Some(target) = target {
        cargo.args(["--target", target]);
    }
    without_paths(&mut cargo, &workspace());
    Ok(cargo)
}

/// cargo for a package and the target, in the folder of the images with their profile: a command.
/// Options follow.
///
/// # Errors
/// As [`target_directory`].
pub fn for_target(command: &str, package: &str) -> Result<Command> {
    let mut cargo = cargo();
    cargo
        .args([command, "--quiet", "--target", TARGET])
        .args(["--profile", PROFILE, "--package", package, "--target-dir"])
        .arg(target_directory()?.join("images"));
    without_paths(&mut cargo, &workspace());
    Ok(cargo)
}

/// The cases for a board `stm32f405` (`tests/chip`), as the image names them.
pub const CASES: [&str; 5] = ["clock", "flash", "lines", "digests", "cycles"];

/// Builds the image of [`CASES`] and returns its path.
///
/// # Errors
/// cargo cannot be started, or the build fails; cargo has printed why.
pub fn cases() -> Result<PathBuf> {
    let mut build = apart("build", "tests/chip", "chip", Some(TARGET))?;
    build.args(["--profile", PROFILE, "--features", "cases"]);
    succeed(build.args(["--bin", "stm32-cases"]))?;
    let built = target_directory()?.join("chip").join(TARGET);
    Ok(built.join(PROFILE).join("stm32-cases"))
}

/// Top of the workspace, where `memory.x` and `budgets.toml` are.
pub fn workspace() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_path_buf()
}

impl Image {
    /// Builds the image and returns its path.
    ///
    /// # Errors
    /// cargo cannot be started, or the build fails; cargo has printed why.
    pub fn build(self) -> Result<PathBuf> {
        let mut build = for_target("build", self.package)?;
        succeed(build.args(["--bin", self.name]))?;
        let built = target_directory()?.join("images").join(TARGET);
        Ok(built.join(PROFILE).join(self.name))
    }

    /// For tests: the built image, or `None`, with a line on standard error, on a machine that
    /// cannot run it.
    ///
    /// # Panics
    /// The build fails; or the machine cannot run it and [`REQUIRE`] is set.
    pub fn build_or_skip(self) -> Option<PathBuf> {
        here_or_skip(missing()).then(|| {
            self.build()
                .expect("images build with the committed sources")
        })
    }
}

/// For tests: whether nothing is `missing`; else a line on standard error says what.
///
/// # Panics
/// Something is missing and [`REQUIRE`] is set.
pub fn here_or_skip(missing: Option<String>) -> bool {
    let Some(what) = missing else {
        return true;
    };
    assert!(std::env::var_os(REQUIRE).is_none(), "{what}");
    // Not eprintln, which the test harness swallows when the test passes.
    let _ = std::io::Write::write_all(
        &mut std::io::stderr(),
        format!("skipped: {what}\n").as_bytes(),
    );
    false
}

/// What this machine lacks to build and run images, with the remedy.
pub fn missing() -> Option<String> {
    if !target_installed() {
        return Some(format!(
            "target {TARGET} is not installed; remedy: rustup target add {TARGET}"
        ));
    }
    (!needs::available()).then(|| {
        format!(
            "{} is not installed; remedy: {}",
            needs::QEMU,
            needs::REMEDY
        )
    })
}

/// Whether the toolchain of this workspace has the target's core library.
pub fn target_installed() -> bool {
    installed(TARGET)
}

/// Whether the toolchain of this workspace has the core library of this target.
pub fn installed(target: &str) -> bool {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let sysroot = Command::new(rustc)
        .args(["--print", "sysroot"])
        .current_dir(workspace())
        .output();
    sysroot.is_ok_and(|output| {
        let sysroot = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        Path::new(&sysroot)
            .join("lib/rustlib")
            .join(target)
            .join("lib")
            .is_dir()
    })
}

/// Removes the paths of this machine from an image that is built from `sources`, so that it is the
/// same wherever it is built. Flags of a host run (coverage, sanitizers) do not apply to it.
pub fn without_paths(build: &mut Command, sources: &Path) {
    let home = |name: &str, usual: &str| {
        let set = std::env::var_os(name).map(PathBuf::from);
        set.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(usual)))
    };
    let folders = [
        (Some(sources.to_path_buf()), "source"),
        (home("CARGO_HOME", ".cargo"), "cargo"),
        (home("RUSTUP_HOME", ".rustup"), "rustup"),
    ];
    let flags = folders.into_iter().filter_map(|(from, to)| {
        let from = from?.into_os_string().into_string().ok()?;
        Some(format!("--remap-path-prefix={from}=/{to}"))
    });
    build
        .env_remove("RUSTFLAGS")
        .env(FLAGS, flags.collect::<Vec<_>>().join("\u{1f}"));
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
/// As [`metadata`].
pub fn target_directory() -> Result<PathBuf> {
    let metadata = metadata()?;
    let directory = metadata["target_directory"]
        .as_str()
        .context("cargo metadata names no target directory")?;
    Ok(directory.into())
}

/// Metadata of the workspace's packages, from cargo.
///
/// # Errors
/// `cargo metadata` fails.
pub fn metadata() -> Result<serde_json::Value> {
    let output = cargo()
        .args(["metadata", "--no-deps", "--format-version", "1"])
        .output()
        .context("cannot start cargo")?;
    serde_json::from_slice(&output.stdout).with_context(|| {
        format!(
            "cargo metadata: {}",
            String::from_utf8_lossy(&output.stderr)
        )
    })
}
