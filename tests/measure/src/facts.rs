//! Facts about a release: the version numbers of the formats that devices and programs exchange and
//! store (docs/RELEASES.md), and the sizes of its images.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use qemu::size::Size;

/// Prints a line for each format, `NAME VERSION`, and for each image, `FLASH RAM` in bytes.
pub fn facts(images: &[PathBuf]) -> Result<ExitCode> {
    for (name, version) in formats() {
        println!("{name} {version}");
    }
    for image in images {
        let size = Size::of(image)?;
        println!("{} {}", size.flash, size.ram);
    }
    Ok(ExitCode::SUCCESS)
}

/// All formats with their versions, from the code.
fn formats() -> [(&'static str, u32); 6] {
    [
        ("command link", firmware::wire::command::WIRE_VERSION.into()),
        ("weight image", lrnn_nostd::image::VERSION.into()),
        ("store", firmware::store::VERSION),
        (
            "configuration record",
            firmware::configuration::SCHEMA.into(),
        ),
        ("memory of the unit", firmware::learn::unit::VERSION.into()),
        ("black box", firmware::app::blackbox::VERSION.into()),
    ]
}
