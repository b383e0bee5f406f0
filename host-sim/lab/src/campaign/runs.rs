//! A directory of finished runs, one small file for each. An interrupted command loses at most the
//! runs in progress. Several shards may share a directory.

use host_core::error::Error;
use host_io::output::write_atomic;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The kind of runs: distinguishes them from those of other commands and settings.
#[derive(Debug, Clone, Copy)]
pub struct Stamp {
    /// Name of the file with the settings on which the results depend.
    pub file: &'static str,
    /// Words of the error message for a directory with other settings: its content.
    pub other: &'static str,
    /// Words of the error message for a directory with runs and without such a file: its content.
    pub foreign: &'static str,
}

/// The directory.
#[derive(Debug, Clone)]
pub struct Runs {
    dir: PathBuf,
    runs: PathBuf,
}

impl Runs {
    /// Opens or creates the directory of the runs with this `fingerprint`.
    ///
    /// # Errors
    /// A directory with other runs, which are never touched; an unwritable directory.
    pub fn open(dir: &Path, stamp: &Stamp, fingerprint: &str) -> Result<Self, Error> {
        let of = Self {
            dir: dir.to_path_buf(),
            runs: dir.join("runs"),
        };
        let file = dir.join(stamp.file);
        let foreign = of.runs.exists();
        match std::fs::read_to_string(&file) {
            Ok(found) if found == fingerprint => Ok(of),
            Ok(_) => Err(of.not_ours(stamp.other)),
            Err(_) if foreign => Err(of.not_ours(stamp.foreign)),
            // The stamp comes first: where there are runs there is a stamp, also when shards start
            // at the same time.
            Err(_) => write_atomic(&file, fingerprint.as_bytes()).map(|()| of),
        }
    }

    fn not_ours(self, holds: &'static str) -> Error {
        let dir = self.dir;
        Error::NotOurs { dir, holds }
    }

    /// Creates the directory for runs.
    ///
    /// # Errors
    /// An unwritable directory.
    pub fn begin(&self) -> Result<(), Error> {
        std::fs::create_dir_all(&self.runs).map_err(|e| Error::writing(&self.runs, e))
    }

    /// Removes these runs.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub fn forget(&self, runs: &[u32]) -> Result<(), Error> {
        runs.iter().try_for_each(|&run| {
            let file = self.file(run);
            gone(std::fs::remove_file(&file), &file)
        })
    }

    /// Removes all runs, and a file beside them.
    ///
    /// # Errors
    /// A file that cannot be removed; a directory that cannot be read.
    pub fn forget_all(&self, beside: Option<&str>) -> Result<(), Error> {
        if let Some(name) = beside {
            gone(std::fs::remove_file(self.dir.join(name)), &self.dir)?;
        }
        gone(std::fs::remove_dir_all(&self.runs), &self.runs)
    }

    fn file(&self, run: u32) -> PathBuf {
        self.runs.join(format!("{run:06}.json"))
    }

    /// The rows of a run, if it is finished.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn load<R: DeserializeOwned>(&self, run: u32) -> Result<Option<Vec<R>>, Error> {
        let file = self.file(run);
        if !file.exists() {
            return Ok(None);
        }
        parse(&file).map(Some)
    }

    /// Writes the rows of a run.
    ///
    /// # Errors
    /// An unwritable directory.
    pub fn save<R: Serialize>(&self, run: u32, rows: &[R]) -> Result<(), Error> {
        write_json(&self.file(run), rows)
    }
}

/// The result of a removal. A missing file is no error.
fn gone(result: std::io::Result<()>, path: &Path) -> Result<(), Error> {
    match result {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::writing(path, e)),
        _ => Ok(()),
    }
}

/// All rows of the runs in some directories, ordered by run. A run that is found twice counts once.
///
/// # Errors
/// A directory or a file that cannot be read.
pub fn gathered<R: DeserializeOwned>(dirs: &[impl AsRef<Path>]) -> Result<Vec<R>, Error> {
    let mut files = BTreeMap::new();
    for dir in dirs {
        let runs = dir.as_ref().join("runs");
        for entry in std::fs::read_dir(&runs).map_err(|e| Error::reading(&runs, e))? {
            let path = entry.map_err(|e| Error::reading(&runs, e))?.path();
            if path.extension().is_some_and(|e| e == "json") {
                files.insert(path.file_name().map(std::ffi::OsStr::to_os_string), path);
            }
        }
    }
    let rows: Result<Vec<Vec<R>>, Error> = files.values().map(|f| parse(f)).collect();
    Ok(rows?.into_iter().flatten().collect())
}

pub(super) fn write_json(file: &Path, value: &(impl Serialize + ?Sized)) -> Result<(), Error> {
    let text = serde_json::to_vec(value).map_err(|e| Error::writing(file, e.into()))?;
    write_atomic(file, &text)
}

pub(super) fn parse<T: DeserializeOwned>(file: &Path) -> Result<T, Error> {
    let made_again = |problem: String, remedy: &str| Error::Option {
        option: file.display().to_string(),
        problem,
        remedy: format!("{remedy}give the command that made it again, with --resume"),
    };
    let text = std::fs::read(file).map_err(|e| match e.kind() {
        ErrorKind::NotFound => made_again("is missing".into(), ""),
        _ => Error::reading(file, e),
    })?;
    serde_json::from_slice(&text).map_err(|e| {
        let problem = format!("is damaged or of another version ({e})");
        made_again(problem, "remove it and ")
    })
}

/// The error of a directory that cannot be merged with those before it.
pub(crate) fn apart(dir: &Path, holds: &str) -> Error {
    Error::Option {
        option: dir.display().to_string(),
        problem: format!("{holds}, unlike the directory before it"),
        remedy: "merge only what commands of one version have left, each once".into(),
    }
}

/// The fingerprint of the runs in some directories, which must all have the same.
///
/// # Errors
/// A directory without a stamp, or with another.
pub fn same_stamp(dirs: &[impl AsRef<Path>], stamp: &Stamp) -> Result<String, Error> {
    let mut first: Option<String> = None;
    for dir in dirs {
        let dir = dir.as_ref();
        let file = dir.join(stamp.file);
        let found = match std::fs::read_to_string(&file) {
            Err(e) if [ErrorKind::NotFound, ErrorKind::NotADirectory].contains(&e.kind()) => {
                return Err(Error::Option {
                    option: dir.display().to_string(),
                    problem: format!("has no runs to be merged (no {})", stamp.file),
                    remedy: "give the directories (--out) of shards".into(),
                });
            }
            read => read.map_err(|e| Error::reading(&file, e))?,
        };
        if *first.get_or_insert_with(|| found.clone()) != found {
            return Err(apart(dir, stamp.other));
        }
    }
    Ok(first.unwrap_or_default())
}
