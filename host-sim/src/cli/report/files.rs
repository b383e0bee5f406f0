//! The files of a recording, with their hashes.

use host_core::error::Error;
use host_report::unit::hash;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Names within a folder whose files are read.
const READ: [&str; 4] = ["csv", "mcap", "yaml", "toml"];

/// Path and SHA-256 of each file: of a CSV header those that it names, too, and of a folder those
/// that can be read.
pub(super) fn hashes(of: &[PathBuf], more: &[PathBuf]) -> Result<Vec<(String, String)>, Error> {
    let mut all = vec![];
    for path in of {
        match path.is_dir() {
            true => within(path, &mut all)?,
            false => all.push(path.clone()),
        }
        if path.extension().is_some_and(|end| end == "toml") {
            all.extend(named(path));
        }
    }
    all.extend(more.iter().filter(|path| path.is_file()).cloned());
    let mut out: Vec<(String, String)> = vec![];
    for path in all {
        let name = path.display().to_string();
        if out.iter().all(|(there, _)| *there != name) {
            let opened = File::open(&path).and_then(|file| hash(BufReader::new(file)));
            out.push((name, opened.map_err(|error| Error::reading(&path, error))?));
        }
    }
    Ok(out)
}

fn within(folder: &Path, all: &mut Vec<PathBuf>) -> Result<(), Error> {
    let failed = |error| Error::reading(folder, error);
    let entries = std::fs::read_dir(folder).map_err(failed)?;
    let paths = entries.map(|entry| entry.map(|entry| entry.path()));
    let mut paths = paths.collect::<Result<Vec<_>, _>>().map_err(failed)?;
    paths.sort();
    for path in paths {
        let read = path
            .extension()
            .is_some_and(|end| READ.iter().any(|r| end == *r));
        match path.is_dir() {
            true => within(&path, all)?,
            false if read => all.push(path),
            false => {}
        }
    }
    Ok(())
}

/// The files that a header names: each value of a key `file`, `truth` or `unit` that is one.
fn named(header: &Path) -> Vec<PathBuf> {
    let text = std::fs::read_to_string(header).unwrap_or_default();
    let Ok(table) = text.parse::<toml::Table>() else {
        return vec![]; // the reader of the header reports the fault
    };
    let mut names = vec![];
    collect(&table, &mut names);
    let beside = names.iter().map(|name| header.with_file_name(name));
    beside.filter(|path| path.is_file()).collect()
}

fn collect(table: &toml::Table, names: &mut Vec<String>) {
    for (key, value) in table {
        match value {
            toml::Value::Table(inner) => collect(inner, names),
            toml::Value::String(name) if ["file", "truth", "unit"].contains(&key.as_str()) => {
                names.push(name.clone());
            }
            _ => {}
        }
    }
}
