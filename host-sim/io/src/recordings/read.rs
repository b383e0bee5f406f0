//! Reads whole files and unpacks those that are gzipped.

use crate::recordings::input::check_pointer;
use flate2::read::MultiGzDecoder;
use host_core::error::Error;
use std::io::Read;
use std::path::Path;

/// All bytes of a file. The first two bytes identify gzip, so the name of the file does not matter.
///
/// # Errors
/// [`Error::Missing`], [`Error::Unreadable`], [`Error::DamagedGzip`], [`Error::Pointer`].
pub fn read(file: &Path) -> Result<Vec<u8>, Error> {
    unpacked(file, false)
}

/// [`read`], but of a gzipped text that is cut what is there.
///
/// # Errors
/// As [`read`].
pub(super) fn read_to_cut(file: &Path) -> Result<Vec<u8>, Error> {
    unpacked(file, true)
}

fn unpacked(file: &Path, to_cut: bool) -> Result<Vec<u8>, Error> {
    let bytes = std::fs::read(file).map_err(|source| Error::reading(file, source))?;
    check_pointer(file, &bytes)?;
    match bytes.starts_with(&[0x1f, 0x8b]) {
        true => inflate(file, &bytes, to_cut),
        false => Ok(bytes),
    }
}

fn inflate(file: &Path, bytes: &[u8], to_cut: bool) -> Result<Vec<u8>, Error> {
    let mut text = Vec::with_capacity(8 * bytes.len());
    let Err(fault) = MultiGzDecoder::new(bytes).read_to_end(&mut text) else {
        return Ok(text);
    };
    let is_cut = fault.kind() == std::io::ErrorKind::UnexpectedEof;
    if is_cut && to_cut && !text.is_empty() {
        return Ok(text);
    }
    Err(Error::DamagedGzip {
        file: file.to_path_buf(),
        line: text.iter().filter(|&&byte| byte == b'\n').count(),
        fault: if is_cut { "cut short" } else { "damaged" },
    })
}
