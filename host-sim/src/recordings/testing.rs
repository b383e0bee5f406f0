//! What tests of recordings share.

use crate::error::Error;
use std::path::{Path, PathBuf};

/// A file called `name` with `bytes`, and the temporary folder that it lives in.
pub(crate) fn file(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (dir, path)
}

/// Folder with recorded data: `LRNN_DATA` if it is set, else `../shared/data` beside the project.
/// `None` if that folder does not exist.
pub(crate) fn data_dir() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let folder = std::env::var_os("LRNN_DATA").map_or_else(beside, PathBuf::from);
    folder.is_dir().then_some(folder)
}

/// A recorded file, if it is there; otherwise prints that the test is skipped.
pub(crate) fn recorded(name: &str) -> Option<PathBuf> {
    let path = data_dir().map(|dir| dir.join(name)).filter(|p| p.is_file());
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
