//! Checksums of a folder, in the format of `sha256sum`.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use sha2::{Digest, Sha256};

/// Name of the file.
pub const NAME: &str = "SHA256SUMS";

/// SHA-256 in hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    let sum = Sha256::digest(bytes);
    sum.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The names of the files of a folder, in order.
pub fn names(folder: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let name = entry?.file_name().into_string();
        names.push(name.ok().context("a name that is no text")?);
    }
    names.sort();
    Ok(names)
}

/// Writes the checksums of all files of the folder into it, for `sha256sum --check`.
pub fn write(folder: &Path) -> Result<()> {
    let mut lines = String::new();
    for name in names(folder)?.iter().filter(|name| *name != NAME) {
        let bytes = fs::read(folder.join(name)).with_context(|| name.clone())?;
        lines += &format!("{}  {name}\n", hex(&bytes));
    }
    fs::write(folder.join(NAME), lines).context(NAME)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// FIPS 180-2, appendix B.1, and the line as `sha256sum` prints it.
    #[test]
    fn a_line_is_that_of_sha256sum() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("b"), "abc").expect("written");
        fs::write(folder.path().join("a"), "").expect("written");
        for _ in 0..2 {
            write(folder.path()).expect("written"); // the second time it is there itself
            let text = fs::read_to_string(folder.path().join(NAME)).expect("text");
            assert_eq!(
                text,
                "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855  a\n\
                 ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  b\n"
            );
        }
    }
}
