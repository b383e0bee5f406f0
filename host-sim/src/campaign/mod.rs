//! Many units, turn-ons and drives, every scheme on identical data, and statistics with intervals.
//!
//! One run is one drive: a standstill, then 22 min with fixes, from which every scheme learns, then
//! 22 min without, on which it is judged. The same unit measures the same drive once for each group
//! of errors.

mod group;
mod parquet;
mod ratios;
mod results;
mod schemes;
pub mod start;
mod statistics;
mod store;
mod tuning;
mod zupt;

pub use self::parquet::to_parquet;
pub use group::{FixErrors, Group};
pub use ratios::{Ratio, ratios};
pub use results::results;
pub use schemes::{Case, Knowledge, SCHEMES, Scheme, Tuned, ablations, oracle, rnn_kalman};
pub use statistics::{Summary, summarise};
pub use store::{Merged, Row, merge};
pub use tuning::Tuning;

use crate::error::Error;
use crate::experiment::scenario::Scenario;
use crate::inertial::free_inertial::FreeInertial;
use crate::inertial::session::Session;
use crate::learning::teacher::Assumptions;
use crate::simulator::imu::{Draws, ErrorModelName, ImuSpec};
use crate::simulator::session::{SessionConfig, drive, measured};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::cell::OnceCell;
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
/// Whose learner `rnn-kalman` is: results of another are not mixed in.
const LEARNER: &str = "device";

/// What to run.
#[derive(Debug, Clone)]
pub struct Campaign {
    /// Scenario: IMU, place, road, receiver.
    pub scenario: Scenario,
    /// Runs, numbered from 0.
    pub runs: u32,
    /// Of them only those with `number % shards == shard`.
    pub shard: (u32, u32),
    /// Error groups.
    pub models: Vec<Group>,
    /// Directory of results.
    pub out: PathBuf,
    /// Keep the runs that are there already.
    pub resume: bool,
    /// Only these schemes; empty: all.
    pub schemes: Vec<String>,
    /// Also the parts of the bank: [`ablations`].
    pub ablation: bool,
    /// Units that the classical filters are tuned on, >= 1.
    pub tuning_units: u32,
}

/// What makes run `k` reproducible.
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

impl Seeds {
    /// Of run `k`.
    #[must_use]
    pub fn of(k: u32) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(u64::from(k));
        rng.set_stream(7);
        Self {
            heading: rng.random_range(0.0..std::f64::consts::TAU),
            unit: rng.random(),
            turn_on: rng.random(),
            drive: rng.random(),
        }
    }
}

impl Campaign {
    /// Runs what is missing on rayon's threads and gives all rows of this shard, ordered by run.
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

    /// Run `k` alone, all error groups and schemes, without a directory.
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
        let wanted = |name: &str| self.schemes.is_empty() || self.schemes.iter().any(|s| s == name);
        SCHEMES.iter().filter(move |(name, _)| wanted(name))
    }

    /// The parts of the bank, if they are wanted.
    fn ablations(&self) -> impl Iterator<Item = (String, u8)> {
        ablations().filter(|_| self.ablation)
    }

    /// All error groups and schemes of run `k`. The IMU with noise only, on the same drive, is the
    /// floor of every group.
    fn one(&self, imu: &ImuSpec, tuning: &Tuning, k: u32) -> Result<Vec<Row>, Error> {
        let mut rows = Vec::new();
        let mut floor = FreeInertial::default();
        self.sessions(imu, k, |model, case| {
            let case = Case {
                tuned: tuning.of(model),
                ..*case
            };
            let judge =
                |free: Option<FreeInertial>| free.ok_or_else(|| self.scenario.no_attitude());
            if model == ErrorModelName::Noise.into() {
                floor = judge(SCHEMES[0].1(&case))?;
            }
            if self.models.contains(&model) {
                for &(name, scheme) in self.schemes() {
                    rows.extend(store::row(model, k, name, &judge(scheme(&case))?));
                }
                for (name, enabled) in self.ablations() {
                    let free = judge(rnn_kalman(&case, enabled))?;
                    rows.extend(store::row(model, k, &name, &free));
                }
            }
            Ok(())
        })?;
        for group in &self.models {
            rows.extend(store::row(*group, k, "floor", &floor));
        }
        let history = imu.world.power.history_of(Seeds::of(k).turn_on);
        rows.iter_mut().for_each(|row| row.start = history.start);
        Ok(rows)
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
        mut judge: impl FnMut(Group, &Case<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let seeds = Seeds::of(k);
        let s = &self.scenario;
        let told = Assumptions::of(s.unit());
        let gnss = s.receiver();
        let config = SessionConfig {
            imu,
            gnss: &gnss,
            start: s.start(),
            heading: seeds.heading,
            standstill_s: f64::from(STANDSTILL_S),
            drive_s: f64::from(AIDED_S + FREE_S),
            segments: None,
            vibration: s.vibration,
            unit: seeds.unit,
            turn_on: seeds.turn_on,
            drive: seeds.drive,
        };
        let (truth, fixes) = drive(&config);
        let mut draws = Draws::of(seeds.turn_on, true);
        for model in self.measured() {
            let spec = imu.error_model(model.sensors);
            let (session, measured_by) = measured(&config, &spec, &truth, &fixes, draws);
            draws = measured_by.into_draws();
            let session = Session {
                gather: GATHER,
                ..session
            };
            let case = Case {
                session: &session,
                increments: &OnceCell::new(),
                knows: Knowledge {
                    told: &told,
                    simulated: &spec,
                },
                tuned: Tuned::default(),
                until: (STANDSTILL_S + AIDED_S) as usize,
            };
            judge(model, &case)?;
        }
        Ok(())
    }

    /// Names of the schemes and of the parts of the bank, in the order of the rows.
    fn names(&self) -> Vec<String> {
        let schemes = self.schemes().map(|(name, _)| (*name).to_owned());
        schemes
            .chain(self.ablations().map(|(name, _)| name))
            .collect()
    }

    /// A name for everything that decides the numbers, so that different campaigns are not mixed.
    fn fingerprint(&self) -> String {
        format!(
            "{}|{:?}|{RATE_HZ}|{GATHER}|{STANDSTILL_S}|{AIDED_S}|{FREE_S}|{LEARNER}|{:?}|{}|{:?}",
            env!("CARGO_PKG_VERSION"),
            self.scenario,
            self.models,
            self.tuning_units,
            self.names(),
        )
    }
}

/// What has been done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// One of the units that filters are tuned on.
    TuningUnit,
    /// A run.
    Run,
}

#[cfg(test)]
mod oracle_tests;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::Unit;

    /// One run of the group `all` with the default scenario.
    pub(super) fn of_one_run() -> Campaign {
        Campaign {
            scenario: Scenario::load("medium").unwrap(),
            runs: 1,
            shard: (0, 1),
            models: vec![ErrorModelName::All.into()],
            out: PathBuf::new(),
            resume: false,
            schemes: Vec::new(),
            ablation: false,
            tuning_units: 1,
        }
    }

    /// Results of one unit are not mixed with those of another, whatever differs between them.
    #[test]
    fn the_fingerprint_contains_the_unit() {
        let with = |unit: Unit| {
            let mut scenario = Scenario::default();
            scenario.set_unit("u.toml", unit);
            Campaign {
                scenario,
                runs: 1,
                shard: (0, 1),
                models: vec![ErrorModelName::All.into()],
                out: PathBuf::new(),
                resume: false,
                schemes: Vec::new(),
                ablation: false,
                tuning_units: 1,
            }
            .fingerprint()
        };
        let medium = with(Unit::default());
        assert_eq!(medium, with(Unit::default()));
        let mut noisier = Unit::default();
        noisier.gyro.angle_random_walk_dpsqrth *= 1.000_001;
        assert_ne!(medium, with(noisier));
        let derived = Unit {
            simulation: None,
            ..Unit::default()
        };
        assert_ne!(medium, with(derived));
    }

    /// The campaign's steps against steps of one sample on the same samples. All random numbers
    /// follow from the number of the run alone.
    #[test]
    fn long_steps_do_not_change_the_errors() {
        let campaign = of_one_run();
        let imu = campaign.imu();
        let mut judged = 0;
        campaign
            .sessions(&imu, 5, |_, case| {
                let fine = Session {
                    gather: 1,
                    ..case.session.clone()
                };
                let fine = Case {
                    session: &fine,
                    increments: &OnceCell::new(),
                    ..*case
                };
                for (name, scheme) in &SCHEMES[..2] {
                    let [a, b] = [case, &fine].map(|c| {
                        crate::experiment::results::Row::of(&scheme(c).unwrap(), "", 22).unwrap()
                    });
                    let apart = (a.d_lat_m - b.d_lat_m).hypot(a.d_lon_m - b.d_lon_m);
                    assert!(
                        apart < 0.01 * b.horizontal_m,
                        "{name}: {apart} of {} m",
                        b.horizontal_m
                    );
                    judged += 1;
                }
                Ok(())
            })
            .unwrap();
        assert_eq!(judged, 4);
        assert_eq!(Seeds::of(5), Seeds::of(5));
        assert_ne!(Seeds::of(5), Seeds::of(6));
    }
}
