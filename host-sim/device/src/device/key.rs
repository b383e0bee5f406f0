//! Key files: 64 hexadecimal digits and a line end, readable by their owner only.

use firmware::wire::command::key::{SECRET_LEN, Secret};
use host_core::error::Error;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::Path;

fn refused(file: &Path, problem: impl Into<String>, remedy: &str) -> Error {
    Error::Option {
        option: file.display().to_string(),
        problem: problem.into(),
        remedy: remedy.into(),
    }
}

/// Reads a key.
///
/// # Errors
/// No such file, it cannot be read, or it is not a key file.
pub fn read_key(file: &Path) -> Result<Secret, Error> {
    let text = std::fs::read(file).map_err(|source| Error::reading(file, source))?;
    parse(text.trim_ascii()).ok_or_else(|| {
        refused(
            file,
            "is not a key file: 64 hexadecimal digits",
            "give the file that `host-sim device provision --key-file FILE` (the device's key) or \
             `cargo xtask sign --new-key FILE` (a key that signs) has written",
        )
    })
}

fn parse(text: &[u8]) -> Option<Secret> {
    let digit = |byte: u8| char::from(byte).to_digit(16);
    let (pairs, rest) = text.as_chunks::<2>();
    if pairs.len() != SECRET_LEN || !rest.is_empty() {
        return None;
    }
    let mut secret = [0; SECRET_LEN];
    for (byte, [high, low]) in secret.iter_mut().zip(pairs) {
        *byte = (digit(*high)? * 16 + digit(*low)?) as u8;
    }
    Some(Secret(secret))
}

/// Makes a key from the system's random numbers and writes it to a new file.
///
/// # Errors
/// The file exists or cannot be written; the system has no random numbers.
pub fn make_key(file: &Path) -> Result<Secret, Error> {
    let mut secret = [0; SECRET_LEN];
    getrandom::fill(&mut secret).map_err(|error| {
        refused(
            file,
            format!("the system gives no random numbers ({error})"),
            "make the key on another computer",
        )
    })?;
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let written = options.open(file).and_then(|mut out| {
        let digits: String = secret.iter().map(|byte| format!("{byte:02x}")).collect();
        writeln!(out, "{digits}")?;
        out.sync_all()
    });
    match written {
        Ok(()) => Ok(Secret(secret)),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(refused(
            file,
            "exists already",
            "give the name of a new file, so that no key is lost",
        )),
        Err(source) => Err(Error::writing(file, source)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_written_once_for_its_owner_and_read_again() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("unit.key");
        let key = make_key(&file).unwrap();
        assert_eq!(read_key(&file).unwrap(), key);
        assert_ne!(make_key(&directory.path().join("other.key")).unwrap(), key);
        let error = make_key(&file).unwrap_err().to_string();
        assert!(error.contains("exists already"), "{error}");
        assert_eq!(read_key(&file).unwrap(), key);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = std::fs::metadata(&file).unwrap().permissions().mode();
            assert_eq!(mode & 0o777, 0o600);
        }
    }

    #[test]
    fn what_is_no_key_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("k");
        let good = "0123456789abcdefABCDEF0123456789".repeat(2);
        std::fs::write(&file, &good).unwrap();
        let Secret(bytes) = read_key(&file).unwrap();
        assert_eq!((bytes[0], bytes[7], bytes[31]), (0x01, 0xEF, 0x89));
        for bad in [&good[1..], &good[2..], "", &good.replace('a', "g")] {
            std::fs::write(&file, bad).unwrap();
            let error = read_key(&file).unwrap_err().to_string();
            assert!(error.contains("is not a key file"), "{error}");
        }
        let none = read_key(&directory.path().join("none")).unwrap_err();
        assert!(none.to_string().contains("no such file"), "{none}");
    }
}
