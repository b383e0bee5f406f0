//! A bag of ROS 2: a folder with `metadata.yaml` and one or several MCAP files, or such a file.

use crate::recordings::session::complain;
use host_core::error::Error;
use std::path::{Path, PathBuf};

/// First bytes of a `SQLite` database.
const SQLITE: &[u8] = b"SQLite format 3\0";

/// Remedy: how to convert a bag in another storage to MCAP. The key `all` is known to every version
/// of rosbag2 (its `record_options.cpp`).
const CONVERT: &str = "write these lines into convert.yaml: 'output_bags:', '- uri: new_bag', \
    '  storage_id: mcap', '  all: true'; then run 'ros2 bag convert -i OLD -o convert.yaml' and \
    give new_bag";

/// The files of a bag in the order of time.
///
/// # Errors
/// There is nothing at `path`; the folder holds no MCAP file; the bag is a database of `SQLite`.
pub(super) fn files(path: &Path) -> Result<Vec<PathBuf>, Error> {
    if !path.is_dir() {
        refuse_sqlite(path)?;
        return Ok(vec![path.to_path_buf()]);
    }
    let metadata = path.join("metadata.yaml");
    let mut files = match std::fs::read_to_string(&metadata) {
        Ok(text) => listed(&text).iter().map(|name| path.join(name)).collect(),
        Err(_) => Vec::new(),
    };
    if files.is_empty() {
        files = standing(path)?;
    }
    for file in &files {
        refuse_sqlite(file)?;
    }
    if files.is_empty() {
        let problem = "is not in this folder".to_owned();
        let remedy = "give the folder of a bag with its metadata.yaml, or an MCAP file";
        return Err(complain(path, "*.mcap", problem, remedy));
    }
    Ok(files)
}

fn refuse_sqlite(file: &Path) -> Result<(), Error> {
    use std::io::Read;
    let mut start = Vec::new();
    let opened = std::fs::File::open(file).map_err(|e| Error::reading(file, e))?;
    opened
        .take(SQLITE.len() as u64)
        .read_to_end(&mut start)
        .map_err(|e| Error::reading(file, e))?;
    if start == SQLITE {
        let problem = "is a ROS 2 bag in SQLite, which is not read".to_owned();
        return Err(complain(file, "storage", problem, CONVERT));
    }
    Ok(())
}

/// The entries of the list `relative_file_paths`. The YAML that rosbag2 writes has one on each
/// line.
fn listed(metadata: &str) -> Vec<String> {
    let mut lines = metadata.lines().map(str::trim);
    lines
        .by_ref()
        .find(|line| line.starts_with("relative_file_paths:"));
    let name = |line: &str| {
        Some(
            line.strip_prefix("- ")?
                .trim_matches(['"', '\'', ' '])
                .into(),
        )
    };
    lines.map_while(name).collect()
}

/// The MCAP and database files in a folder, in the order of the numbers in their names.
fn standing(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let entries = std::fs::read_dir(folder).map_err(|e| Error::reading(folder, e))?;
    let known = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.ends_with(".mcap") || name.ends_with(".mcap.zstd") || name.ends_with(".db3")
    };
    let mut files: Vec<PathBuf> = entries.flatten().map(|e| e.path()).filter(known).collect();
    files.sort_by_key(|file| {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        // A longer number is a larger one: bag_2 before bag_10.
        (name.len(), name.into_owned())
    });
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;
    use test_bench::recordings::message;

    #[test]
    fn a_folder_gives_its_files_in_order() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        let why = files(dir.path()).unwrap_err().to_string();
        assert!(why.contains("'*.mcap' is not in this folder"), "{why}");
        for name in ["bag_10.mcap", "bag_2.mcap", "notes.txt"] {
            std::fs::write(at(name), "x").unwrap();
        }
        assert_eq!(
            files(dir.path()).unwrap(),
            [at("bag_2.mcap"), at("bag_10.mcap")]
        );
        let metadata = "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  \
                        relative_file_paths:\n    - bag_10.mcap\n    - \"bag_2.mcap\"\n  duration:\n    \
                        nanoseconds: 5\n";
        std::fs::write(at("metadata.yaml"), metadata).unwrap();
        let both = [at("bag_10.mcap"), at("bag_2.mcap")];
        assert_eq!(files(dir.path()).unwrap(), both);
        assert_eq!(files(&at("bag_2.mcap")).unwrap(), [at("bag_2.mcap")]);
    }

    #[test]
    fn a_database_is_refused_with_the_lines_that_convert_it() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("in.db3");
        std::fs::write(&file, [SQLITE, &[0x10, 0]].concat()).unwrap();
        for path in [&file, dir.path()] {
            let why = message(&files(path).unwrap_err());
            assert!(
                why.starts_with("in.db3: 'storage' is a ROS 2 bag in SQLite"),
                "{why}"
            );
            assert!(why.contains("'  storage_id: mcap'"), "{why}");
            assert!(
                why.contains("ros2 bag convert -i OLD -o convert.yaml"),
                "{why}"
            );
        }
    }

    #[test]
    fn what_is_not_there_is_named() {
        let why = files(Path::new("no/such.mcap")).unwrap_err().to_string();
        assert!(why.starts_with("no/such.mcap: no such file"), "{why}");
    }
}
