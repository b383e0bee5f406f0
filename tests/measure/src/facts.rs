//! What a release says of itself: the version numbers of what devices and programs exchange and
//! keep (docs/RELEASES.md), and the sizes of its images.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use qemu::size::Size;

/// Prints a line for each format, `NAME VERSION`, and for each image, `FLASH RAM` in bytes.
pub fn facts(images: &[PathBuf]) -> Result<ExitCode> {
    for format in formats() {
        println!("{} {}", format.name, format.version);
    }
    for image in images {
        let size = Size::of(image)?;
        println!("{} {}", size.flash, size.ram);
    }
    Ok(ExitCode::SUCCESS)
}

/// A format and its version.
pub struct Format {
    /// Its name in a quote (`figures`).
    pub key: &'static str,
    /// Its name for a reader.
    pub name: &'static str,
    pub version: u32,
}

/// All of them, as the code has them.
pub fn formats() -> [Format; 6] {
    let format = |key, name, version| Format { key, name, version };
    [
        format(
            "wire",
            "command link",
            firmware::wire::command::WIRE_VERSION.into(),
        ),
        format("image", "weight image", lrnn_nostd::image::VERSION.into()),
        format("store", "store", firmware::store::VERSION),
        format(
            "configuration",
            "configuration record",
            firmware::configuration::SCHEMA.into(),
        ),
        format(
            "memory",
            "memory of the unit",
            firmware::learn::unit::VERSION.into(),
        ),
        format(
            "blackbox",
            "black box",
            firmware::app::blackbox::VERSION.into(),
        ),
    ]
}
