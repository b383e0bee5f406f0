//! Reads whole files and unpacks those that are packed.

use crate::recordings::input::Input;
use host_core::error::Error;
use std::io::{ErrorKind, Read};
use std::path::Path;

/// All bytes of a file. Its first bytes identify gzip and zstd, so its name does not matter.
///
/// # Errors
/// [`Error::Missing`], [`Error::Unreadable`], [`Error::Packed`], [`Error::OtherKind`].
pub fn read(file: &Path) -> Result<Vec<u8>, Error> {
    let mut input = Input::open(file, &|_, _| {})?;
    let mut all = Vec::new();
    match input.read_to_end(&mut all) {
        Ok(_) => Ok(all),
        Err(fault) if input.packed => Err(Error::unpacking(file, input.at, lines(&all), &fault)),
        Err(fault) => Err(Error::reading(file, fault)),
    }
}

/// The first bytes of a file, unpacked, as far as it is whole.
///
/// # Errors
/// [`Error::Missing`], [`Error::Unreadable`], [`Error::OtherKind`].
pub fn head(file: &Path, count: usize) -> Result<Vec<u8>, Error> {
    let mut head = Vec::new();
    let input = Input::open(file, &|_, _| {})?;
    // the reader of the whole file reports a damaged stream
    let _ = input.take(count as u64).read_to_end(&mut head);
    Ok(head)
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
