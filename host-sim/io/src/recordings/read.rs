//! Reads whole files and unpacks those that are packed.

use crate::recordings::input::{Input, START, check_kind};
use flate2::read::MultiGzDecoder;
use host_core::error::Error;
use std::io::{ErrorKind, Read};
use std::path::Path;

/// All bytes of a file. The first two bytes identify gzip, so the name of the file does not matter.
///
/// # Errors
/// [`Error::Missing`], [`Error::Unreadable`], [`Error::Packed`], [`Error::OtherKind`].
pub fn read(file: &Path) -> Result<Vec<u8>, Error> {
    let bytes = std::fs::read(file).map_err(|source| Error::reading(file, source))?;
    check_kind(file, &bytes[..bytes.len().min(START)])?;
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(bytes);
    }
    let mut all = Vec::with_capacity(8 * bytes.len());
    match MultiGzDecoder::new(&bytes[..]).read_to_end(&mut all) {
        Ok(_) => Ok(all),
        Err(fault) => Err(Error::unpacking(
            file,
            all.len() as u64,
            lines(&all),
            &fault,
        )),
    }
}

/// A text of UTF-16 as UTF-8, unpacked as tables are; of a packed text that is cut what is there.
///
/// # Errors
/// As [`read`].
pub(super) fn read_to_cut(file: &Path) -> Result<Vec<u8>, Error> {
    let mut input = Input::text(file, &|_, _| {})?;
    let mut text = Vec::new();
    match input.read_to_end(&mut text) {
        Err(fault) if fault.kind() != ErrorKind::UnexpectedEof || text.is_empty() => {
            Err(match input.packed {
                true => Error::unpacking(file, input.at, lines(&text), &fault),
                false => Error::reading(file, fault),
            })
        }
        _ => Ok(text),
    }
}

fn lines(text: &[u8]) -> usize {
    text.iter().filter(|&&byte| byte == b'\n').count()
}
