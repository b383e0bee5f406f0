//! Many units, turn-ons and drives, every scheme on identical data, and statistics with intervals.
//!
//! One run is one drive: a standstill, then 22 min with fixes, from which every scheme learns, then
//! 22 min without, on which it is judged. The same unit measures the same drive once for each group
//! of errors. Before it the unit may have had other drives, which schemes with a memory know. Then
//! the judged drive may also have no fixes.

mod against_none;
mod bench;
mod causes;
mod drives;
pub mod fleet;
mod group;
mod laws;
mod limit;
mod measuring;
mod memory;
mod ratios;
mod results;
mod rivals;
pub mod runs;
mod schemes;
pub mod start;
mod statistics;
mod store;
mod studies;
mod table;
mod tuning;
mod turn_on;
mod zupt;

pub use against_none::{AgainstNone, Decided, against_none, missing};
pub use group::{FixErrors, Group};
pub use host_estimation::learning::NONE;
pub use ratios::{Ratio, ratios};
pub use results::{ratios_csv, results};
pub use schemes::{Case, Knowledge, SCHEMES, Scheme, Tuned, ablations, hypotheses, oracle};
pub use statistics::{FEWEST, Summary, between, median as median_of, summarise};
pub use store::{Merged, Row, merge};
pub use studies::{Study, Topic, causes_csv, studies};
pub use table::{fingerprint, to_csv};
pub use tuning::{Setting, Simulated, Tuning};

use host_core::error::Error;
use host_core::inertial::free_inertial::FreeInertial;
use host_core::simulator::imu::{ErrorModelName, ImuSpec};
use host_unit::scenario::Scenario;
use rayon::prelude::*;
use std::path::PathBuf;

/// Standstill, aided drive, free-inertial drive: s.
const STANDSTILL_S: u32 = 300;
const AIDED_S: u32 = 22 * 60;
const FREE_S: u32 = 22 * 60;
/// Samples per second: enough for a land vehicle, in half the time of 200.
const RATE_HZ: u32 = 100;
/// Samples in one step of the desktop's navigators. Coning and sculling are computed at the full
/// rate. At 22 min no median changes by more than 0.5 % between steps of 10 ms and 50 ms, nor by
/// more than 0.4 % between 50 ms and these 100 ms.
const GATHER: usize = 10;
/// What `device` is, so that its results are not mixed with those of the learner's driver that once
/// had its place.
const DEVICE: &str = "the firmware's own application";

/// The settings of a campaign.
#[derive(Debug, Clone)]
pub struct Campaign {
    /// Scenario: IMU, location, vehicle, receiver.
    pub scenario: Scenario,
    /// Number of runs, numbered from 0.
    pub runs: u32,
    /// Shard and number of shards: only runs with `number % shards == shard` are done.
    pub shard: (u32, u32),
    /// Error groups.
    pub models: Vec<Group>,
    /// Directory of results.
    pub out: PathBuf,
    /// Whether to keep finished runs of an earlier start.
    pub resume: bool,
    /// Only these schemes; empty: all but the rivals of `replay sessions`.
    pub schemes: Vec<String>,
    /// Also the parts of the bank: [`ablations`].
    pub ablation: bool,
    /// Number of units on which the classical filters are tuned, >= 1.
    pub tuning_units: u32,
    /// Numbers of earlier drives after which the judged drive follows, ascending; `[0]` for none.
    pub drives: Vec<u32>,
    /// Whether the judged drive has fixes for 22 min. Otherwise they end with the standstill.
    pub fixes: bool,
}

/// A drive of a run.
struct DriveOfRun {
    seeds: Seeds,
    /// Duration of the drive after the standstill, s.
    drive_s: u32,
    /// Epoch at which the fixes end.
    until: u32,
    /// Whether they last longer than the standstill.
    fixes: bool,
    /// Whether schemes are judged on it.
    judged: bool,
}

/// Seeds of a run, which make it reproducible.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seeds {
    /// Heading at the start, rad.
    pub heading: f64,
    /// Seed of the device.
    pub unit: u64,
    /// Seed of turn-on and noise.
    pub turn_on: u64,
    /// Seed of road and fixes.
    pub drive: u64,
}

impl Campaign {
    /// One run of all schemes without earlier drives, to be executed by [`Self::run`].
    #[must_use]
    pub fn single(scenario: Scenario, models: &[ErrorModelName]) -> Self {
        Self {
            scenario,
            runs: 1,
            shard: (0, 1),
            models: models.iter().copied().map(Group::from).collect(),
            out: PathBuf::new(),
            resume: false,
            schemes: Vec::new(),
            ablation: false,
            tuning_units: 1,
            drives: vec![0],
            fixes: true,
        }
    }

    /// Does the missing runs on rayon's threads and returns all rows of this shard, ordered by run.
    /// Calls `progress` after each unit and run.
    ///
    /// # Errors
    /// Unwritable directory; a directory of another campaign.
    pub fn execute(&self, progress: &(dyn Fn(Progress) + Sync)) -> Result<Merged, Error> {
        let imu = self.imu();
        let store = store::Store::open(&self.out, self)?;
        let tuning = match store.tuning()? {
            Some(found) => found,
            None => {
                let found = Tuning::find(self, &imu, &|| progress(Progress::TuningUnit))?;
                store.save_tuning(&found)?;
                found
            }
        };
        let results: Result<Vec<Vec<Row>>, Error> = self
            .wanted()
            .into_par_iter()
            .map(|k| {
                let rows = match store.load(k)? {
                    Some(rows) => rows,
                    None => {
                        let rows = self.one(&imu, &tuning, k)?;
                        store.save(k, &rows)?;
                        rows
                    }
                };
                progress(Progress::Run);
                Ok(rows)
            })
            .collect();
        Ok(Merged {
            rows: results?.into_iter().flatten().collect(),
            tuning,
            fingerprint: self.fingerprint(),
        })
    }

    /// Does run `k` alone, with all error groups and schemes, without a directory.
    ///
    /// # Errors
    /// A scenario whose standstill gives no attitude.
    pub fn run(&self, tuning: &Tuning, k: u32) -> Result<Vec<Row>, Error> {
        self.one(&self.imu(), tuning, k)
    }

    fn imu(&self) -> ImuSpec {
        let mut imu = self.scenario.imu_spec();
        imu.rate_hz = RATE_HZ;
        imu
    }

    /// Numbers of this shard's runs.
    #[must_use]
    pub fn wanted(&self) -> Vec<u32> {
        (0..self.runs)
            .filter(|k| k % self.shard.1 == self.shard.0)
            .collect()
    }

    fn schemes(&self) -> impl Iterator<Item = &'static (&'static str, Scheme)> {
        SCHEMES.iter().filter(|(name, _)| self.wants(name))
    }

    /// Whether a scheme takes part.
    fn wants(&self, name: &str) -> bool {
        match self.schemes.is_empty() {
            true => !rivals::is_rival(name),
            false => self.schemes.iter().any(|s| s == name),
        }
    }

    /// Whether a classical filter takes part with a walk that is searched for.
    fn tunes(&self, filter: &str) -> bool {
        self.wants(&format!("{filter}{}", schemes::TUNED))
    }

    /// The seconds of a run with fixes.
    fn aided(&self) -> std::ops::Range<usize> {
        STANDSTILL_S as usize..(STANDSTILL_S + AIDED_S) as usize
    }

    /// The parts of the bank, if they are wanted.
    fn ablations(&self) -> impl Iterator<Item = (String, u8)> {
        ablations().filter(|_| self.ablation)
    }

    /// The rows of run `k` for all error groups and schemes. The floor of every group is the IMU
    /// with noise only on the same drive.
    fn one(&self, imu: &ImuSpec, tuning: &Tuning, k: u32) -> Result<Vec<Row>, Error> {
        let known = self.known(imu, tuning, k)?;
        let new = memory::Memory::default();
        let mut rows = Vec::new();
        let mut floor = FreeInertial::default();
        let prepare = |cases: &[(Group, Case<'_>)]| self.prepare(tuning, cases);
        let mut judge = |model: Group, case: &Case<'_>, drives: &[u32]| {
            case.tuned(tuning.of(model), |case| {
                if model == ErrorModelName::Noise.into() {
                    let free = SCHEMES[0].1(case);
                    floor = free.ok_or_else(|| self.scenario.no_attitude())?;
                }
                let drives = drives.iter().filter(|_| self.models.contains(&model));
                drives.copied().try_for_each(|drives| {
                    let mut known = known.iter();
                    let memory = known.find(|(after, of, _)| (*after, *of) == (drives, model));
                    let memory = Some(memory.map_or(&new, |(.., memory)| memory));
                    self.judge(&mut rows, &Case { memory, ..*case }, (model, k, drives))
                })
            })
        };
        let (stepping, same): (Vec<Group>, Vec<Group>) =
            self.measured().into_iter().partition(Group::steps);
        self.prepared((imu, &same), k, prepare, |model, case| {
            judge(model, case, &self.drives)
        })?;
        for drives in self.drives.iter().filter(|_| !stepping.is_empty()) {
            let imu = drives::turned_on(imu, *drives);
            self.prepared((&imu, &stepping), k, prepare, |model, case| {
                judge(model, case, &[*drives])
            })?;
        }
        for group in &self.models {
            for &drives in &self.drives {
                rows.extend(store::row((*group, k, drives), "floor", &floor));
            }
        }
        let history = imu.world.power.history_of(Seeds::of(k).turn_on);
        rows.iter_mut().for_each(|row| row.start = history.start);
        Ok(rows)
    }

    /// Adds the rows of all schemes after a number of earlier drives. A scheme without memory has
    /// the same row each time. Before the first drive a memory is empty.
    fn judge(
        &self,
        rows: &mut Vec<Row>,
        case: &Case<'_>,
        of: (Group, u32, u32),
    ) -> Result<(), Error> {
        let (model, _, drives) = of;
        let lost = || self.scenario.no_attitude();
        case.bench.fly(case, &self.filters(case)).ok_or_else(lost)?;
        for &(name, scheme) in self.schemes() {
            let same = match memory::remembers(name) {
                false => Some(name),
                true if drives == 0 => memory::without_memory(name),
                true => None,
            };
            let same = same.and_then(|same| {
                let mut found = rows.iter();
                let of_now = |row: &Row| row.drives == drives || !model.steps();
                found.find(|row| row.error_model == model && row.scheme == same && of_now(row))
            });
            let row = match same {
                Some(row) => Some(Row {
                    scheme: name.to_owned(),
                    drives,
                    ..row.clone()
                }),
                None => store::row(of, name, &scheme(case).ok_or_else(lost)?),
            };
            rows.extend(row);
        }
        for (name, enabled) in self.ablations() {
            let free = hypotheses(case, enabled).ok_or_else(lost)?;
            rows.extend(store::row(of, &name, &free));
        }
        Ok(())
    }

    /// Runs the classical filters of all groups side by side.
    fn prepare(&self, tuning: &Tuning, cases: &[(Group, Case<'_>)]) -> Result<(), Error> {
        let judged = cases.iter().filter(|of| self.models.contains(&of.0));
        let judged = judged.map(|(group, case)| {
            let tuned = tuning.of(*group);
            (
                case,
                tuned,
                causes::enlarged(case.knows.assumptions, &tuned.cause),
            )
        });
        let judged: Vec<_> = judged.collect();
        let cases = judged
            .iter()
            .map(|(case, tuned, assumptions)| case.with(*tuned, assumptions));
        let cases: Vec<Case<'_>> = cases.collect();
        let wanted: Vec<_> = cases.iter().map(|case| self.filters(case)).collect();
        let each: Vec<_> = cases.iter().zip(wanted.iter().map(Vec::as_slice)).collect();
        bench::prepare(&each).ok_or_else(|| self.scenario.no_attitude())
    }

    /// The classical filters that take part, and their walks.
    fn filters(&self, case: &Case<'_>) -> Vec<(usize, f64)> {
        let walk = case.knows.assumptions.datasheet_walk();
        let each = schemes::FILTERS.iter().enumerate();
        let of = |(filter, name): (usize, &&str)| {
            let plain = self.wants(name).then_some((filter, walk));
            let tuned = self
                .tunes(name)
                .then_some((filter, case.tuned.walks[filter]));
            plain.into_iter().chain(tuned)
        };
        let none = (bench::NONE, case.tuned.none_factor);
        let none = self.wants(NONE).then_some(none);
        each.flat_map(of).chain(none).collect()
    }

    /// Error groups of the campaign, and noise for the floor.
    fn measured(&self) -> Vec<Group> {
        let mut models = self.models.clone();
        let noise = ErrorModelName::Noise.into();
        if !models.contains(&noise) {
            models.push(noise);
        }
        models
    }

    /// Calls `judge` with the drive of run `k` as measured with each group of errors.
    fn sessions(
        &self,
        imu: &ImuSpec,
        k: u32,
        judge: impl FnMut(Group, &Case<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        self.prepared((imu, &self.measured()), k, |_| Ok(()), judge)
    }

    /// The same, but first calls `prepare` with several groups at once.
    fn prepared(
        &self,
        (imu, groups): (&ImuSpec, &[Group]),
        k: u32,
        prepare: impl Fn(&[(Group, Case<'_>)]) -> Result<(), Error>,
        judge: impl FnMut(Group, &Case<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let aided_s = if self.fixes { AIDED_S } else { 0 };
        let part = DriveOfRun {
            seeds: Seeds::of(k),
            drive_s: aided_s + FREE_S,
            until: STANDSTILL_S + aided_s,
            fixes: self.fixes,
            judged: true,
        };
        self.part(imu, &part, groups, prepare, judge)
    }

    /// Names of the schemes and of the parts of the bank, in the order of the rows.
    fn names(&self) -> Vec<String> {
        let schemes = self.schemes().map(|(name, _)| (*name).to_owned());
        schemes
            .chain(self.ablations().map(|(name, _)| name))
            .collect()
    }

    /// Names of the unit and the vehicle.
    fn simulated(&self) -> Simulated {
        Simulated {
            unit: self.scenario.unit_name.clone(),
            vehicle: self.scenario.vehicle_name.to_string(),
        }
    }

    /// The common setting of all its runs.
    fn setting(&self) -> Setting {
        Setting {
            start: self.scenario.power.start,
            drives: self.drives.clone(),
            fixes: self.fixes,
        }
    }

    /// All settings on which the results depend, as text, so that different campaigns are not
    /// mixed.
    fn fingerprint(&self) -> String {
        format!(
            "{}|{:?}|{:?}|{RATE_HZ}|{GATHER}|{STANDSTILL_S}|{AIDED_S}|{FREE_S}|{DEVICE}|{:?}|\
             {}|{:?}",
            crate::version(),
            self.scenario,
            self.setting(),
            self.models,
            self.tuning_units,
            self.names(),
        )
    }
}

/// A finished piece of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// One of the units that filters are tuned on.
    TuningUnit,
    /// A run.
    Run,
}

#[cfg(test)]
mod causes_tests;
#[cfg(test)]
mod coverage_tests;
#[cfg(test)]
mod oracle_tests;

#[cfg(test)]
mod memory_tests;
#[cfg(test)]
mod tests;
