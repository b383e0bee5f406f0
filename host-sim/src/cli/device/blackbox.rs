//! `host-sim device blackbox`.

use host_core::error::Error;
use host_device::device::{Link, fetch};
use host_device::hil::blackbox::write;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Result of `device blackbox`.
#[derive(Serialize)]
pub(super) struct Saved {
    /// The file.
    file: PathBuf,
    /// Pages that the device has begun since its memory was blank.
    pages: u32,
    /// The result in a sentence.
    pub says: String,
}

/// Reads the black box into a file.
pub(super) fn run(link: &mut Link, file: &Path, release: bool) -> Result<Saved, Error> {
    let fetched = fetch(link, release)?;
    write(file, &fetched)?;
    let after = if release {
        "it records again"
    } else {
        "it holds this until `device blackbox --release`"
    };
    let name = file.display();
    Ok(Saved {
        file: file.to_owned(),
        pages: fetched.recording.pages,
        says: format!("the black box is in {name}; {after}. `replay blackbox {name}` plays it"),
    })
}
