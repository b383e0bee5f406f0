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
    let bytes = std::fs::read(file).map_err(|source| Error::reading(file, source))?;
    check_pointer(file, &bytes)?;
    if bytes.starts_with(&[0x1f, 0x8b]) {
        inflate(file, &bytes)
    } else {
        Ok(bytes)
    }
}

fn inflate(file: &Path, bytes: &[u8]) -> Result<Vec<u8>, Error> {
    let mut text = Vec::with_capacity(8 * bytes.len());
    MultiGzDecoder::new(bytes)
        .read_to_end(&mut text)
        .map_err(|fault| Error::DamagedGzip {
            file: file.to_path_buf(),
            line: text.iter().filter(|&&byte| byte == b'\n').count(),
            fault: if fault.kind() == std::io::ErrorKind::UnexpectedEof {
                "cut short"
            } else {
                "damaged"
            },
        })?;
    Ok(text)
}
