//! Abuse: the device's own code, bytes in and bytes out, in a hostile world.
//!
//! A run is one unit. It drives with fixes, while a case disturbs it, and the device learns. Then
//! the fixes end, and a navigation computer behind the device navigates free inertial: once with
//! the device's output, once with the sensor's. Then the same unit is switched on again, and the
//! stored networks act from the first sample on. Again a navigation computer is judged with and
//! without them. Corrected errors should never exceed the raw ones.

mod act;
mod begin;
mod case;
mod computer;
mod configured;
mod device;
mod line;
mod markdown;
mod motion;
mod names;
#[cfg(test)]
mod page_tests;
mod receiver;
mod rests;
mod run;
mod sensor;
mod summary;
mod table;
#[cfg(test)]
mod tests;
mod times;
mod world;

pub use begin::Begin;
pub use case::{Case, chosen};
pub use markdown::{csv, markdown};
pub use names::{Activation, Computer, Sensor};
pub use run::{Judged, Teach, fix_learner};
pub use summary::{LIMITS, Summary, summarise};
pub use table::at_power_on;
pub use times::{RECOVERY_S, Times};

use crate::campaign::runs::{Runs, Stamp, apart, gathered, same_stamp};
use host_core::error::Error;
use motion::Motion;
use rayon::prelude::*;
use run::Bench;
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Number of cases in one piece. An interruption loses at most this many.
const PIECE: usize = 12;

const STAMP: Stamp = Stamp {
    file: "abuse.txt",
    other: "holds runs of 'abuse' with another version, or other cases, sensors or times",
    foreign: "holds a directory 'runs' that is not of 'abuse'",
};

/// The settings of a command: the cases, and how to run them.
#[derive(Debug, Clone)]
pub struct Abuse {
    /// Cases, each once.
    pub cases: Vec<Case>,
    /// Kinds of sensors.
    pub sensors: Vec<Sensor>,
    /// Navigation computers.
    pub computers: Vec<Computer>,
    /// When corrections act.
    pub activations: Vec<Activation>,
    /// Durations of the parts of a drive.
    pub times: Times,
    /// Number of units, numbered from 0.
    pub runs: u32,
    /// Shard and number of shards: only units with `number % shards == shard` run.
    pub shard: (u32, u32),
    /// Directory of results.
    pub out: PathBuf,
    /// Whether to keep finished runs of an earlier start.
    pub resume: bool,
}

/// Some cases of one unit with one kind of sensor and one motion.
struct Piece<'a> {
    /// Number of the file with its rows.
    number: u32,
    run: u32,
    sensor: Sensor,
    cases: Vec<&'a Case>,
}

impl Abuse {
    /// Runs the missing cases on rayon's threads and returns all rows of this shard. Calls
    /// `progress` after each case of each unit and sensor. After `stop` no further case starts, and
    /// the rows are incomplete.
    ///
    /// # Errors
    /// Unwritable directory; a directory of other runs; values that a device rejects.
    pub fn execute(
        &self,
        teach: Teach<'_>,
        stop: &AtomicBool,
        progress: &(dyn Fn() + Sync),
    ) -> Result<Vec<Judged>, Error> {
        let pieces = self.pieces();
        let runs = Runs::open(&self.out, &STAMP, &self.fingerprint())?;
        match (self.resume, self.shard.1) {
            (true, _) => {}
            (false, 1) => runs.forget_all(None)?,
            (false, _) => {
                let numbers: Vec<u32> = pieces.iter().map(|piece| piece.number).collect();
                runs.forget(&numbers)?;
            }
        }
        runs.begin()?;
        let done: Result<Vec<Vec<Judged>>, Error> = pieces
            .into_par_iter()
            .with_max_len(1)
            .map(|piece| {
                if let Some(rows) = runs.load(piece.number)? {
                    piece.cases.iter().for_each(|_| progress());
                    return Ok(rows);
                }
                let bench = Bench::new(self, piece.sensor, piece.run, teach);
                let mut rows = Vec::new();
                for case in &piece.cases {
                    if stop.load(Ordering::Relaxed) {
                        return Ok(Vec::new());
                    }
                    rows.extend(bench.judge(case)?);
                    progress();
                }
                runs.save(piece.number, &rows)?;
                Ok(rows)
            })
            .collect();
        Ok(done?.into_iter().flatten().collect())
    }

    /// Number of cases of units and sensors in this shard.
    #[must_use]
    pub fn length(&self) -> u64 {
        self.pieces()
            .iter()
            .map(|piece| piece.cases.len() as u64)
            .sum()
    }

    /// All pieces of this shard.
    fn pieces(&self) -> Vec<Piece<'_>> {
        let mut groups: Vec<(Motion, Vec<&Case>)> = Vec::new();
        for case in &self.cases {
            let motion = case.motion().after();
            let room = groups.iter_mut().rev();
            let mut room = room.filter(|(of, cases)| *of == motion && cases.len() < PIECE);
            match room.next() {
                Some((_, cases)) => cases.push(case),
                None => groups.push((motion, vec![case])),
            }
        }
        let each = (groups.len() * self.sensors.len()) as u32;
        let wanted = (0..self.runs).filter(|run| run % self.shard.1 == self.shard.0);
        wanted
            .flat_map(|run| {
                let of = |sensor: Sensor| groups.iter().map(move |group| (sensor, group));
                let all = self.sensors.iter().flat_map(move |&sensor| of(sensor));
                all.enumerate()
                    .map(move |(index, (sensor, (_, cases)))| Piece {
                        number: run * each + index as u32,
                        run,
                        sensor,
                        cases: cases.clone(),
                    })
            })
            .collect()
    }

    /// The settings on which the results depend, as text.
    fn fingerprint(&self) -> String {
        let cases: Vec<String> = self
            .cases
            .iter()
            .map(|case| format!("{case} {:?}", case.acts))
            .collect();
        format!(
            "{}|{}|{:?}|{:?}|{:?}|{:?}",
            crate::version(),
            cases.join("|"),
            self.sensors,
            self.computers,
            self.activations,
            self.times,
        )
    }
}

/// All rows in the directories of shards, of one command or of several with other rows.
///
/// # Errors
/// Directories that are not of `abuse`, are of other versions or have the same rows; broken files.
pub fn merge(dirs: &[impl AsRef<Path>]) -> Result<Vec<Judged>, Error> {
    let mut commands: BTreeMap<String, Vec<&Path>> = BTreeMap::new();
    for dir in dirs {
        let stamp = same_stamp(&[dir], &STAMP)?;
        let version = stamp.split('|').next();
        let same = |other: &String| other.split('|').next() == version;
        if !commands.keys().all(same) {
            return Err(apart(dir.as_ref(), "holds runs of another version"));
        }
        commands.entry(stamp).or_default().push(dir.as_ref());
    }
    let mut rows: Vec<Judged> = Vec::new();
    let mut known = HashSet::new();
    for dirs in commands.values() {
        for row in gathered::<Judged>(dirs)? {
            let of = (row.case.clone(), row.sensor, row.computer, row.activation);
            if !known.insert((of, row.run)) {
                return Err(apart(dirs[0], "holds runs that are there already"));
            }
            rows.push(row);
        }
    }
    Ok(rows)
}
