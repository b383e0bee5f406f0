//! Many units, turn-ons and drives; every scheme on identical data; statistics with intervals.
//!
//! One run is one drive: standstill, then 22 min with fixes, from which everybody learns, then 22 min free inertial, on which everybody
//! is judged. The same drive is measured by the same unit once for each group of errors.

mod schemes;
mod statistics;
mod store;
mod tuning;

pub use schemes::{Knowledge, Scheme, judge};
pub use statistics::{Summary, paired_ratio, summarise};
pub use store::{Row, merge};
pub use tuning::Tuning;

use crate::error::Error;
use crate::imu::{ErrorModelName, ImuSpec};
use crate::scenario::Scenario;
use crate::session::{Session, SessionConfig, drive, measure};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::path::PathBuf;

/// Standstill, aided drive, coasting: s.
const STANDSTILL_S: u32 = 300;
const AIDED_S: u32 = 22 * 60;
const COAST_S: u32 = 22 * 60;
/// Words per second: enough for a land vehicle, and half the time of 200.
const RATE_HZ: u32 = 100;

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
    pub models: Vec<ErrorModelName>,
    /// Directory of results.
    pub out: PathBuf,
    /// Keep the runs that are there already.
    pub resume: bool,
    /// Units that the classical filters are tuned on, >= 1.
    pub tuning_units: u32,
}

impl Campaign {
    /// Runs what is missing on rayon's threads and gives all rows of this shard, ordered by run. `progress` is told after each run.
    ///
    /// # Errors
    /// Unwritable directory; a directory of another campaign; a scenario without a valid IMU.
    pub fn execute(&self, progress: &(dyn Fn(u32) + Sync)) -> Result<Vec<Row>, Error> {
        let mut imu = self.scenario.imu_spec()?;
        imu.rate_hz = RATE_HZ;
        let tuning = Tuning::find(self, &imu)?;
        let store = store::Store::open(&self.out, self, self.resume)?;
        let wanted: Vec<u32> = (0..self.runs)
            .filter(|k| k % self.shard.1 == self.shard.0)
            .collect();
        let results: Result<Vec<Vec<Row>>, Error> = wanted
            .par_iter()
            .map(|k| {
                let rows = match store.load(*k)? {
                    Some(rows) => rows,
                    None => {
                        let rows = self.one(&imu, &tuning, *k)?;
                        store.save(*k, &rows)?;
                        rows
                    }
                };
                progress(*k);
                Ok(rows)
            })
            .collect();
        Ok(results?.into_iter().flatten().collect())
    }

    /// All error groups and schemes of run `k`.
    fn one(&self, imu: &ImuSpec, tuning: &Tuning, k: u32) -> Result<Vec<Row>, Error> {
        let sessions = self.sessions(imu, k, &self.models);
        let mut rows = Vec::new();
        for (model, spec, session) in &sessions {
            let tuned = tuning.of(*model);
            let knows = Knowledge {
                datasheet: imu,
                simulated: spec,
            };
            let words = session.increments();
            let schemes = [
                ("none", Scheme::None(tuned.none_factor)),
                ("ekf6", Scheme::Ekf6(tuning::DATASHEET_WALK)),
                ("ekf6-tuned", Scheme::Ekf6(tuned.walk)),
                ("ekf12", Scheme::Ekf12),
                ("ekf24", Scheme::Ekf24),
                ("ekf-ramp", Scheme::EkfRamp),
                ("oracle", Scheme::Oracle),
                ("rnn-window", Scheme::RnnWindow(tuned.rnn_factor)),
            ];
            for (name, scheme) in schemes {
                let coast = judge(scheme, session, &words, &knows, learn_epochs())
                    .ok_or_else(|| self.scenario.no_attitude())?;
                rows.extend(store::rows(*model, k, name, &coast));
            }
        }
        self.add_floor(imu, tuning, k, &mut rows)?;
        Ok(rows)
    }

    /// The noise-only IMU on the same drive, under every group's name.
    fn add_floor(
        &self,
        imu: &ImuSpec,
        tuning: &Tuning,
        k: u32,
        rows: &mut Vec<Row>,
    ) -> Result<(), Error> {
        for (_, spec, session) in &self.sessions(imu, k, &[ErrorModelName::Noise]) {
            let knows = Knowledge {
                datasheet: imu,
                simulated: spec,
            };
            let words = session.increments();
            let coast = judge(
                Scheme::None(tuning.of(ErrorModelName::Noise).none_factor),
                session,
                &words,
                &knows,
                learn_epochs(),
            )
            .ok_or_else(|| self.scenario.no_attitude())?;
            for group in &self.models {
                rows.extend(store::rows(*group, k, "floor", &coast));
            }
        }
        Ok(())
    }

    /// The drive of run `k` as measured with each group of errors.
    fn sessions(
        &self,
        imu: &ImuSpec,
        k: u32,
        models: &[ErrorModelName],
    ) -> Vec<(ErrorModelName, ImuSpec, Session)> {
        let mut rng = ChaCha8Rng::seed_from_u64(u64::from(k));
        rng.set_stream(7);
        let s = &self.scenario;
        let config = SessionConfig {
            imu,
            gnss: &s.gnss,
            start: s.start(),
            heading: rng.random_range(0.0..std::f64::consts::TAU),
            standstill_s: f64::from(STANDSTILL_S),
            drive_s: f64::from(AIDED_S + COAST_S),
            segments: None,
            vibration: s.vibration,
            unit: rng.random(),
            turn_on: rng.random(),
            drive: rng.random(),
        };
        let (truth, fixes) = drive(&config);
        models
            .iter()
            .map(|model| {
                let spec = imu.error_model(*model);
                let session = measure(&config, &spec, &truth, &fixes);
                (*model, spec, session)
            })
            .collect()
    }

    /// A name for everything that decides the numbers, so that results of another campaign are not mixed in.
    fn fingerprint(&self) -> String {
        format!(
            "{:?}|{RATE_HZ}|{STANDSTILL_S}|{AIDED_S}|{COAST_S}|{:?}|{}",
            self.scenario, self.models, self.tuning_units
        )
    }
}

/// Epoch at which the fixes end.
fn learn_epochs() -> usize {
    (STANDSTILL_S + AIDED_S) as usize
}
