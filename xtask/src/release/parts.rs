//! Builds the parts of a release.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use crate::boards::{FAMILIES, M33};
use crate::images::{
    Image, STM32F405, STM32F405_WINDOW, TARGET, cargo, installed, target_directory, without_paths,
    workspace,
};
use anyhow::{Context, Result};

use super::{Release, sums};
use crate::flash::CHIP;
use crate::stage::succeed;
use crate::{load, supply, wheel};

/// Our own images, with descriptions.
const OWN: [(Image, &str); 2] = [
    (STM32F405, "STM32F405, the whole learner"),
    (
        STM32F405_WINDOW,
        "STM32F405, frozen networks and learning from references",
    ),
];
/// The package over embassy for the chip of `stm32f405`: it exists for comparison.
const COMPARED: &str = "f405";

/// A released image.
pub struct Firmware {
    /// Its file name without extension.
    pub name: &'static str,
    /// The board in words.
    pub board: &'static str,
    /// Its chip as probe-rs calls it.
    pub chip: &'static str,
    /// Path of the built image.
    pub built: PathBuf,
    /// Bytes of flash and of memory, as `tests/measure` finds them.
    pub bytes: [String; 2],
    /// Address of the first byte of the `.bin` file, where there is one.
    pub start: Option<u32>,
    /// Extension of the file for the chip's boot loader, where it has one.
    pub loader: Option<&'static str>,
}

/// Builds our own board's images into the folder.
pub fn own_images(release: &Release) -> Result<Vec<Firmware>> {
    let built = OWN.into_iter().map(|(image, board)| {
        eprintln!("image {}", image.name);
        let (what, from) = ((image.name, board, CHIP), ("firmware", TARGET));
        hand_out(release, what, image.build()?, from)
    });
    built.collect()
}

/// Builds the images of the boards over third-party drivers. Those that cannot be built here are
/// named in `left_out`.
pub fn board_images(release: &Release, left_out: &mut Vec<String>) -> Result<Vec<Firmware>> {
    let mut all = Vec::new();
    for family in FAMILIES {
        let (name, target) = (family.name, family.target);
        if name == COMPARED {
            continue;
        }
        if !installed(target) {
            left_out.push(format!(
                "image {name}: target {target} is not installed; remedy: rustup target add {target}"
            ));
            continue;
        }
        eprintln!("image {name}");
        let (what, package) = (
            (name, family.board, family.chip),
            format!("firmware/boards/{name}"),
        );
        all.push(hand_out(
            release,
            what,
            family.build()?,
            (&package, target),
        )?);
    }
    Ok(all)
}

/// Copies an image in all its forms, with its bill of materials.
fn hand_out(
    release: &Release,
    (name, board, chip): (&'static str, &'static str, &'static str),
    built: PathBuf,
    (package, target): (&str, &str),
) -> Result<Firmware> {
    let path = |ending: &str| release.folder.join(format!("{name}.{ending}"));
    fs::copy(&built, path("elf")).with_context(|| built.display().to_string())?;
    let start = load::bin(&built, &path("bin"))?;
    let loader = if target == M33 {
        load::uf2(&built, &path("uf2"))?;
        Some("uf2")
    } else if chip.starts_with("STM32") {
        load::dfu(&built, &path("dfu"))?;
        Some("dfu")
    } else {
        None
    };
    supply::bill(package, target, &path("cdx.json"))?;
    Ok(Firmware {
        name,
        board,
        chip,
        built,
        bytes: Default::default(),
        start,
        loader,
    })
}

/// The programs of the desktop: package, its folder, and name.
const PROGRAMS: [(&str, &str, &str); 2] = [
    ("host-sim", "host-sim", "host-sim"),
    ("live", "host-sim/live", "host-sim-serve"),
];

/// Builds the desktop's programs for this machine, without its paths in them.
pub fn programs(release: &Release) -> Result<()> {
    let directory = target_directory()?.join("dist");
    let ending = std::env::consts::EXE_SUFFIX;
    for (package, folder, program) in PROGRAMS {
        eprintln!("{program}");
        let mut build = cargo();
        build
            .args(["build", "--quiet", "--locked", "--release"])
            .args(["--package", package, "--bin", program])
            .arg("--target-dir")
            .arg(&directory);
        without_paths(&mut build, &workspace());
        succeed(&mut build)?;
        let built = directory.join(format!("release/{program}{ending}"));
        let name = format!("{program}-{}{ending}", release.host);
        fs::copy(&built, release.folder.join(&name)).with_context(|| name.clone())?;
        let bill = release.folder.join(format!("{name}.cdx.json"));
        supply::bill(folder, &release.host, &bill)?;
    }
    Ok(())
}

/// Builds the Python wheel with maturin in a virtual environment; or returns the reason why not.
pub fn python(release: &Release) -> Result<Option<String>> {
    let package = workspace().join(wheel::PACKAGE);
    eprintln!("wheel");
    let venv = match wheel::environment() {
        Ok(venv) => venv,
        Err(error) => return Ok(Some(format!("wheel: {error:#}"))),
    };
    let mut build = Command::new(venv.program("maturin"));
    build
        .args(["build", "--quiet", "--release", "--locked", "--interpreter"])
        .arg(venv.program("python"))
        .arg("--out")
        .arg(&release.folder)
        .current_dir(&package)
        .env("CARGO_TARGET_DIR", target_directory()?.join("dist"))
        .stdin(Stdio::null());
    without_paths(&mut build, &workspace());
    succeed(&mut build)?;
    let names = sums::names(&release.folder)?;
    let built = names.iter().find(|name| name.ends_with(".whl"));
    let built = built.context("maturin has written no wheel")?;
    let bill = release.folder.join(format!("{built}.cdx.json"));
    supply::bill(wheel::PACKAGE, &release.host, &bill)?;
    Ok(None)
}
