//! Reads whole files and unpacks those that are gzipped.

use crate::recordings::input::{START, check_kind, in_utf8};
use flate2::read::MultiGzDecoder;
use host_core::error::Error;
use std::io::Read;
use std::path::Path;

/// All bytes of a file. The first two bytes identify gzip, so the name of the file does not matter.
///
/// # Errors
/// [`Error::Missing`], [`Error::Unreadable`], [`Error::Packed`], [`Error::OtherKind`].
pub fn read(file: &Path) -> Result<Vec<u8>, Error> {
    unpacked(file, false)
}

/// [`read`], but of a gzipped text that is cut what is there, and a text of UTF-16 as UTF-8.
///
/// # Errors
/// As [`read`].
pub(super) fn read_to_cut(file: &Path) -> Result<Vec<u8>, Error> {
    let mut text = Vec::new();
    let read = in_utf8(&unpacked(file, true)?[..]).read_to_end(&mut text);
    read.map_err(|source| Error::reading(file, source))?;
    Ok(text)
}

fn unpacked(file: &Path, to_cut: bool) -> Result<Vec<u8>, Error> {
    let bytes = std::fs::read(file).map_err(|source| Error::reading(file, source))?;
    check_kind(file, &bytes[..bytes.len().min(START)])?;
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
    let lines = text.iter().filter(|&&byte| byte == b'\n').count();
    Err(Error::unpacking(file, text.len() as u64, lines, &fault))
}
