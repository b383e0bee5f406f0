//! Tests of the built `host-sim` from the user's side: output, files, exit codes. The tests are in
//! `tests/`.

use serde_json::Value;
use std::path::{Path, PathBuf};

/// Path of the `host-sim` executable.
///
/// It is a binary of this package, made from the same `main.rs`, because cargo builds the binaries
/// of a package before it runs the tests of that package. So it is never out of date, and nothing
/// is compiled twice for it. It is built in the profile of the tests; a release build gives the
/// same figures, bit for bit.
///
/// # Panics
/// The running test is not in a directory of cargo's.
#[must_use]
pub fn host_sim_binary() -> PathBuf {
    let test = std::env::current_exe().expect("a test knows where it is");
    let profile = test.ancestors().nth(2).expect("target/PROFILE/deps/TEST");
    let name = format!("host-sim-under-test{}", std::env::consts::EXE_SUFFIX);
    profile.join(name)
}

/// Compares a table with that of `fixtures/tried.md`, or writes it there (`LRNN_WRITE_TABLES`).
/// `heading`: its first two lines, with which `table` begins.
///
/// # Panics
/// The file has no such table, or another one.
pub fn compare_table(heading: &str, table: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/tried.md");
    let text = std::fs::read_to_string(&path).expect("there is such a file");
    let (before, rest) = text.split_once(heading).expect("the file has the table");
    let end = rest.find("\n\n").map_or(rest.len(), |at| at + 1);
    if format!("{heading}{}", &rest[..end]) == table {
        return;
    }
    assert!(
        std::env::var_os("LRNN_WRITE_TABLES").is_some(),
        "the table of fixtures/tried.md is to be:\n{table}(LRNN_WRITE_TABLES=1 writes it)"
    );
    std::fs::write(path, format!("{before}{table}{}", &rest[end..])).expect("it can be written");
}

/// The contents of a JSON file.
///
/// # Panics
/// There is no such file, or it is not JSON.
#[must_use]
pub fn json(file: &Path) -> Value {
    let bytes = std::fs::read(file).expect("the file was written");
    serde_json::from_slice(&bytes).expect("it is JSON")
}

/// The horizontal error of `scheme` at `t_min` in the results of `run` or `replay`.
///
/// # Panics
/// There is no such row.
#[must_use]
pub fn horizontal(results: &Value, scheme: &str, t_min: u64) -> f64 {
    let rows = results["rows"].as_array().expect("results have rows");
    let row = rows
        .iter()
        .find(|r| r["scheme"] == scheme && r["t_s"] == 60 * t_min)
        .expect("every scheme has a row at every time");
    row["horizontal_m"].as_f64().expect("an error is a number")
}

/// Folder with recorded data: `LRNN_DATA` if it is set, else `../shared/data` beside the project.
/// `None` if that folder does not exist.
#[must_use]
pub fn data_dir() -> Option<PathBuf> {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("LRNN_DATA").map_or_else(beside, PathBuf::from);
    folder.is_dir().then_some(folder)
}

/// Checks that all elements of a page are closed correctly.
///
/// # Errors
/// The first position where they are not.
pub fn well_formed(page: &str) -> Result<(), String> {
    const VOID: [&str; 3] = ["meta", "br", "link"];
    let (mut open, mut rest) = (vec![], page);
    while let Some(at) = rest.find('<') {
        rest = &rest[at + 1..];
        let Some(end) = rest.find('>') else {
            return Err(rest.to_owned());
        };
        let (tag, after) = (&rest[..end], &rest[end + 1..]);
        rest = after;
        let name = tag
            .trim_start_matches('/')
            .split([' ', '\n', '/'])
            .next()
            .unwrap_or_default();
        if tag.starts_with('!') || tag.ends_with('/') || VOID.contains(&name) {
            continue;
        }
        if tag.starts_with('/') {
            if open.pop() != Some(name) {
                return Err(format!("</{name}> ends nothing"));
            }
            continue;
        }
        if ["script", "style"].contains(&name) {
            let close = format!("</{name}>");
            let Some(at) = rest.find(&close) else {
                return Err(close);
            };
            rest = &rest[at + close.len()..];
            continue;
        }
        open.push(name);
    }
    if open.is_empty() {
        Ok(())
    } else {
        Err(format!("{open:?} never end"))
    }
}
