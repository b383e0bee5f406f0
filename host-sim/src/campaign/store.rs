//! Rows on disk: one small file a finished run, so that an interrupted campaign loses at most the runs that were under way.

use super::Campaign;
use crate::coast::Coast;
use crate::error::Error;
use crate::experiment::TIMES_MIN;
use crate::imu::ErrorModelName;
use crate::output::write_atomic;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Horizontal errors of one scheme in one run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Group of errors.
    pub error_model: ErrorModelName,
    /// Number of the run.
    pub run: u32,
    /// Scheme.
    pub scheme: String,
    /// Horizontal error at each of [`TIMES_MIN`], m.
    pub horizontal_m: [f64; 5],
}

/// The row of a coast, if it lasted.
pub(super) fn rows(
    error_model: ErrorModelName,
    run: u32,
    scheme: &str,
    coast: &Coast,
) -> Option<Row> {
    let mut horizontal_m = [0.0; 5];
    for (h, t) in horizontal_m.iter_mut().zip(TIMES_MIN) {
        *h = coast.row(scheme, t)?.horizontal_m;
    }
    Some(Row {
        error_model,
        run,
        scheme: scheme.to_string(),
        horizontal_m,
    })
}

/// A campaign's directory.
pub(super) struct Store {
    runs: PathBuf,
}

const STAMP: &str = "campaign.txt";

impl Store {
    /// Opens or makes the directory. Without `resume` old runs of the same campaign are removed; another campaign's are never touched.
    pub(super) fn open(dir: &Path, campaign: &Campaign, resume: bool) -> Result<Self, Error> {
        let runs = dir.join("runs");
        let stamp = dir.join(STAMP);
        let fingerprint = campaign.fingerprint();
        match std::fs::read_to_string(&stamp) {
            Ok(found) if found != fingerprint => {
                return Err(Error::NotOurs {
                    dir: dir.to_path_buf(),
                    holds: "holds another campaign (other scenario or error models)",
                });
            }
            Ok(_) if !resume => {
                std::fs::remove_dir_all(&runs).map_err(|e| Error::writing(&runs, e))?;
            }
            Ok(_) => {}
            Err(_) if runs.exists() => {
                return Err(Error::NotOurs {
                    dir: dir.to_path_buf(),
                    holds: "holds a directory 'runs' that is no campaign's",
                });
            }
            Err(_) => {}
        }
        std::fs::create_dir_all(&runs).map_err(|e| Error::writing(&runs, e))?;
        write_atomic(&stamp, fingerprint.as_bytes())?;
        Ok(Self { runs })
    }

    fn file(&self, run: u32) -> PathBuf {
        self.runs.join(format!("{run:06}.json"))
    }

    /// The rows of a run, if it is finished.
    pub(super) fn load(&self, run: u32) -> Result<Option<Vec<Row>>, Error> {
        let file = self.file(run);
        if !file.exists() {
            return Ok(None);
        }
        parse(&file).map(Some)
    }

    pub(super) fn save(&self, run: u32, rows: &[Row]) -> Result<(), Error> {
        let file = self.file(run);
        let text = serde_json::to_vec(rows).map_err(|e| Error::writing(&file, e.into()))?;
        write_atomic(&file, &text)
    }
}

fn parse(file: &Path) -> Result<Vec<Row>, Error> {
    let text = std::fs::read(file).map_err(|e| Error::reading(file, e))?;
    serde_json::from_slice(&text).map_err(|e| Error::Unreadable {
        file: file.to_path_buf(),
        source: e.into(),
    })
}

/// All rows of the runs in some campaign directories, ordered by run; a run that is there twice counts once.
///
/// # Errors
/// A directory that is no campaign's, campaigns that do not belong together, or a broken file.
pub fn merge(dirs: &[impl AsRef<Path>]) -> Result<Vec<Row>, Error> {
    let mut files = std::collections::BTreeMap::new();
    let mut stamp: Option<String> = None;
    for dir in dirs {
        let dir = dir.as_ref();
        let file = dir.join(STAMP);
        let found = std::fs::read_to_string(&file).map_err(|e| Error::reading(&file, e))?;
        if *stamp.get_or_insert_with(|| found.clone()) != found {
            return Err(Error::NotOurs {
                dir: dir.to_path_buf(),
                holds: "holds a campaign with another scenario or other error models",
            });
        }
        let runs = dir.join("runs");
        for entry in std::fs::read_dir(&runs).map_err(|e| Error::reading(&runs, e))? {
            let path = entry.map_err(|e| Error::reading(&runs, e))?.path();
            if path.extension().is_some_and(|e| e == "json") {
                files.insert(path.file_name().map(std::ffi::OsStr::to_os_string), path);
            }
        }
    }
    let rows: Result<Vec<Vec<Row>>, Error> = files.values().map(|f| parse(f)).collect();
    Ok(rows?.into_iter().flatten().collect())
}
