//! Rows on disk, one small file for each finished run. An interrupted campaign loses at most the
//! runs in progress.

use super::runs::{Runs, Stamp, apart, gathered, parse, same_stamp, write_json};
use super::{Campaign, Group, Tuning};
use crate::experiment;
use crate::experiment::run::TIMES_MIN;
use host_core::error::Error;
use host_core::inertial::free_inertial::FreeInertial;
use host_core::simulator::imu::world::StartName;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Horizontal errors of one scheme in one run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Group of errors.
    pub error_model: Group,
    /// Number of the run.
    pub run: u32,
    /// Scheme.
    pub scheme: String,
    /// Horizontal error at each of [`TIMES_MIN`], m.
    pub horizontal_m: [f64; TIMES_MIN.len()],
    /// Its part to the north, m.
    pub north_m: [f64; TIMES_MIN.len()],
    /// Its part to the east, m.
    pub east_m: [f64; TIMES_MIN.len()],
    /// Temperature of the unit at power-on: cold, warm or hot.
    #[serde(default)]
    pub start: StartName,
    /// Number of earlier drives of the unit.
    #[serde(default)]
    pub drives: u32,
}

#[cfg(test)]
impl Row {
    /// An error to the north, the same at all times.
    pub(crate) fn north(group: impl Into<Group>, run: u32, scheme: &str, m: f64) -> Self {
        Self {
            error_model: group.into(),
            run,
            scheme: scheme.into(),
            horizontal_m: [m; TIMES_MIN.len()],
            north_m: [m; TIMES_MIN.len()],
            east_m: [0.0; TIMES_MIN.len()],
            start: StartName::Cold,
            drives: 0,
        }
    }
}

/// The row of a solution, if it lasts long enough: group of errors, run, earlier drives.
pub(super) fn row(
    (error_model, run, drives): (Group, u32, u32),
    scheme: &str,
    free: &FreeInertial,
) -> Option<Row> {
    let mut out = Row {
        error_model,
        run,
        scheme: scheme.to_string(),
        horizontal_m: [0.0; TIMES_MIN.len()],
        north_m: [0.0; TIMES_MIN.len()],
        east_m: [0.0; TIMES_MIN.len()],
        start: StartName::Cold,
        drives,
    };
    for (i, t) in TIMES_MIN.into_iter().enumerate() {
        let at = experiment::results::Row::of(free, scheme, 60 * t)?;
        out.horizontal_m[i] = at.horizontal_m;
        out.north_m[i] = at.d_north_m;
        out.east_m[i] = at.d_east_m;
    }
    Some(out)
}

/// The content of one or more directories.
#[derive(Debug, Clone)]
pub struct Merged {
    /// All rows, ordered by run.
    pub rows: Vec<Row>,
    /// The tuned parameters of the filters.
    pub tuning: Tuning,
    /// The settings on which the results depend.
    pub fingerprint: String,
}

/// A campaign's directory. Several shards may share one.
pub(super) struct Store {
    dir: PathBuf,
    runs: Runs,
}

const STAMP: Stamp = Stamp {
    file: "campaign.txt",
    other: "holds another campaign (other version, scenario, drives, schemes or error models)",
    foreign: "holds a directory 'runs' that is not a campaign's",
};
const TUNING: &str = "tuning.json";

impl Store {
    /// Opens or creates the directory. Unless the campaign resumes, it removes old runs of the same
    /// campaign and shard, and those beyond the number of runs. Runs of other shards and of another
    /// campaign are never touched.
    pub(super) fn open(dir: &Path, campaign: &Campaign) -> Result<Self, Error> {
        let runs = Runs::open(dir, &STAMP, &campaign.fingerprint())?;
        match (campaign.resume, campaign.shard.1) {
            (true, _) => {}
            (false, 1) => runs.forget_all(Some(TUNING))?,
            (false, _) => runs.forget(&campaign.wanted())?,
        }
        runs.begin()?;
        let dir = dir.to_path_buf();
        Ok(Self { dir, runs })
    }

    /// The tuning by an earlier start, or by another shard in the same directory.
    pub(super) fn tuning(&self) -> Result<Option<Tuning>, Error> {
        let file = self.dir.join(TUNING);
        if !file.exists() {
            return Ok(None);
        }
        parse(&file).map(Some)
    }

    pub(super) fn save_tuning(&self, tuning: &Tuning) -> Result<(), Error> {
        write_json(&self.dir.join(TUNING), tuning)
    }

    /// The rows of a run, if it is finished.
    pub(super) fn load(&self, run: u32) -> Result<Option<Vec<Row>>, Error> {
        self.runs.load(run)
    }

    pub(super) fn save(&self, run: u32, rows: &[Row]) -> Result<(), Error> {
        self.runs.save(run, rows)
    }
}

/// All rows of the runs in some campaign directories, ordered by run. A run that is found twice
/// counts once.
///
/// # Errors
/// A directory that is not a campaign's, campaigns that do not belong together, or a broken file.
pub fn merge(dirs: &[impl AsRef<Path>]) -> Result<Merged, Error> {
    let fingerprint = same_stamp(dirs, &STAMP)?;
    let mut first: Option<Tuning> = None;
    for dir in dirs {
        let dir = dir.as_ref();
        let found: Tuning = parse(&dir.join(TUNING))?;
        if *first.get_or_insert_with(|| found.clone()) != found {
            return Err(apart(dir, "holds a campaign with another tuning"));
        }
    }
    Ok(Merged {
        rows: gathered(dirs)?,
        tuning: first.unwrap_or_default(),
        fingerprint,
    })
}
