//! `host-sim device weights`.

use crate::cli::output::check_ours;
use clap::Subcommand as ClapSubcommand;
use host_core::error::Error;
use host_device::device::{Link, check_image, images, load};
use host_io::output::write_atomic;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Commands of `device weights`.
#[derive(Debug, ClapSubcommand)]
pub(super) enum Command {
    /// Read the weights in use into a file of 684 bytes
    Get {
        /// The file, which appears whole or not at all
        file: PathBuf,
    },
    /// Use the weights of a file that `weights get` has written
    Put {
        /// The file
        file: PathBuf,
    },
}

/// Result of a command.
#[derive(Serialize)]
pub(super) struct Written {
    /// The file.
    file: PathBuf,
    /// Its length, bytes.
    bytes: usize,
    /// The result in a sentence.
    pub says: String,
}

impl Command {
    /// Checks that a file can be put.
    pub(super) fn check_file(&self) -> Result<(), Error> {
        match self {
            Self::Get { .. } => Ok(()),
            Self::Put { file } => image(file).map(drop),
        }
    }

    /// Carries out the command.
    pub(super) fn run(&self, link: &mut Link) -> Result<Written, Error> {
        match self {
            Self::Get { file } => get(link, file),
            Self::Put { file } => put(link, file),
        }
    }
}

fn get(link: &mut Link, file: &Path) -> Result<Written, Error> {
    check_ours("weights get", file, |bytes| {
        check_image(file, bytes).is_ok()
    })?;
    let image = link.images()?;
    write_atomic(file, &image)?;
    Ok(Written {
        says: format!("the weights in use are in {}", file.display()),
        bytes: image.len(),
        file: file.to_owned(),
    })
}

/// A weight image that was read and checked. One without maps gets maps of zero, as in the device.
fn image(file: &Path) -> Result<Vec<u8>, Error> {
    let image = std::fs::read(file).map_err(|error| Error::reading(file, error))?;
    Ok(images(&check_image(file, &image)?))
}

fn put(link: &mut Link, file: &Path) -> Result<Written, Error> {
    let image = image(file)?;
    link.orders(&load(&image))?;
    if link.images()? != image {
        return Err(Error::Option {
            option: file.display().to_string(),
            problem: "the device holds other weights than it was sent".into(),
            remedy: "send them again; if that does not help, restart the device".into(),
        });
    }
    Ok(Written {
        says: format!(
            "the weights of {} are in use; `device store` keeps them",
            file.display()
        ),
        bytes: image.len(),
        file: file.to_owned(),
    })
}
