//! What tests of recordings share.

use crate::error::Error;
use std::path::PathBuf;

/// A file called `name` with `bytes`, and the temporary folder that it lives in.
pub(crate) fn file(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (dir, path)
}

/// A recorded file, if it is there; otherwise prints that the test is skipped.
pub(crate) fn recorded(name: &str) -> Option<PathBuf> {
    let path = super::data_dir()
        .map(|dir| dir.join(name))
        .filter(|p| p.is_file());
    if path.is_none() {
        println!("skipped: no {name} in ../shared/data or LRNN_DATA");
    }
    path
}

/// The message of an error from the name of the file on. It must have a remedy.
pub(crate) fn message(error: &Error) -> String {
    let text = error.to_string();
    assert!(text.contains("; remedy: "), "{text}");
    let start = text.find("/in.").map_or(0, |at| at + 1);
    text[start..].to_owned()
}
