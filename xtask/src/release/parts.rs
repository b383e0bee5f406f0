//! Builds the parts of a release.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::boards::{FAMILIES, M33};
use crate::images::{
    Image, STM32F405, STM32F405_WINDOW, TARGET, cargo, installed, target_directory, without_paths,
    workspace,
};
use anyhow::{Context, Result, ensure};

use super::{Release, sums};
use crate::flash::CHIP;
use crate::stage::succeed;
use crate::{load, measure, needs, supply, wheel};

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

/// Builds and signs the update of the board that takes updates, with its loader.
pub fn update(release: &Release, key: &Path) -> Result<()> {
    let mut sign = measure("sign");
    sign.arg("--key").arg(key).arg("--out").arg(&release.folder);
    succeed(&mut sign)
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

/// Where released programs of Linux run: any distribution, since they need no library.
const STATIC: [&str; 2] = ["x86_64-unknown-linux-musl", "aarch64-unknown-linux-musl"];

/// Builds the desktop's programs without this machine's paths in them: on Linux for both
/// processors, elsewhere for this machine.
pub fn programs(release: &Release) -> Result<()> {
    if cfg!(target_os = "linux") {
        for target in STATIC {
            needs::core_library(target)?;
            programs_for(release, target)?;
        }
        return Ok(());
    }
    programs_for(release, &release.host)
}

fn programs_for(release: &Release, target: &str) -> Result<()> {
    let directory = target_directory()?.join("dist");
    let ending = std::env::consts::EXE_SUFFIX;
    for (package, folder, program) in PROGRAMS {
        let name = format!("{program}-{target}{ending}");
        eprintln!("{name}");
        let mut build = cargo();
        build
            .args(["build", "--quiet", "--locked", "--release"])
            .args(["--package", package, "--bin", program])
            .args(["--target", target, "--target-dir"])
            .arg(&directory);
        without_paths(&mut build, &workspace());
        if STATIC.contains(&target) {
            // the toolchain's own linker and C library: no other compiler is needed
            let linker = target.replace('-', "_").to_uppercase();
            build.env(format!("CARGO_TARGET_{linker}_LINKER"), "rust-lld");
        }
        succeed(&mut build)?;
        let built = directory.join(format!("{target}/release/{program}{ending}"));
        if STATIC.contains(&target) {
            ensure!(
                is_static(&fs::read(&built)?)?,
                "{name} needs an interpreter"
            );
        }
        fs::copy(&built, release.folder.join(&name)).with_context(|| name.clone())?;
        let bill = release.folder.join(format!("{name}.cdx.json"));
        supply::bill(folder, target, &bill)?;
    }
    Ok(())
}

/// Whether an ELF program names no interpreter, and so runs without any library.
fn is_static(program: &[u8]) -> Result<bool> {
    use object::read::elf::{FileHeader as _, ProgramHeader as _};
    let header = object::elf::FileHeader64::<object::Endianness>::parse(program)?;
    let endian = header.endian()?;
    let segments = header.program_headers(endian, program)?;
    Ok(segments
        .iter()
        .all(|segment| segment.p_type(endian) != object::elf::PT_INTERP))
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

#[cfg(test)]
mod tests {
    use super::is_static;

    #[test]
    fn a_program_with_an_interpreter_is_not_static() {
        // an ELF header and one program header, of a type
        let program = |kind: u8| {
            let mut bytes = vec![0; 64 + 56];
            bytes[..8].copy_from_slice(&[0x7f, b'E', b'L', b'F', 2, 1, 1, 0]);
            bytes[32] = 64; // where the program headers begin
            bytes[54] = 56; // bytes of each
            bytes[56] = 1;
            bytes[64] = kind;
            bytes
        };
        assert!(is_static(&program(1)).unwrap(), "a segment to load");
        assert!(!is_static(&program(3)).unwrap(), "an interpreter");
        assert!(is_static(b"no program").is_err());
    }
}
