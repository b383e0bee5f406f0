//! The drives of a run, as the unit measures them with each group of errors.

use super::bench::Bench;
use super::schemes::{Case, Knowledge, Tuned};
use super::{Campaign, GATHER, Group, Part, STANDSTILL_S, Seeds, causes};
use crate::error::Error;
use crate::inertial::gnss::Fix;
use crate::inertial::session::Session;
use crate::inertial::sins::Increment;
use crate::learning::teacher::Assumptions;
use crate::simulator::gnss::GnssSpec;
use crate::simulator::imu::{Draws, ErrorModelName, ImuSpec, UnitErrors};
use crate::simulator::session::{Drive, SessionConfig, measured};
use crate::simulator::truth::Vehicle;
use std::cell::OnceCell;

/// One drive, measured by one unit with different errors: the random numbers are drawn once.
pub(super) struct Measuring {
    pub(super) drive: Drive,
    draws: Draws,
}

impl Measuring {
    pub(super) fn of(vehicle: &Vehicle, config: &SessionConfig<'_>) -> Self {
        Self {
            drive: Drive::of(vehicle, config),
            draws: Draws::of(config.turn_on, true),
        }
    }

    /// The session with these errors and fixes, and what the unit is.
    pub(super) fn session(
        &mut self,
        config: &SessionConfig<'_>,
        spec: &ImuSpec,
        fixes: &[Option<Fix>],
    ) -> (Session, UnitErrors) {
        let draws = std::mem::replace(&mut self.draws, Draws::of(0, false));
        let (session, by) = measured(config, spec, &self.drive.truth, fixes, draws);
        let unit = by.unit_errors();
        self.draws = by.into_draws();
        let session = Session {
            gather: GATHER,
            ..session
        };
        (session, unit)
    }
}

impl Campaign {
    /// Calls `pass` with a drive as measured with each of these groups of errors.
    pub(super) fn part(
        &self,
        imu: &ImuSpec,
        part: &Part,
        groups: &[Group],
        mut pass: impl FnMut(Group, &Case<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let told = Assumptions::of(self.scenario.unit());
        let gnss = self.scenario.receiver();
        let oracle = part.judged && (self.wants("oracle") || self.wants("limit"));
        let until = part.until as usize;
        let config = self.config(imu, &gnss, part.seeds, part.drive_s);
        let mut measuring = Measuring::of(&self.scenario.vehicle(), &config);
        for &group in groups {
            let spec = imu.error_model(group.sensors);
            let receiver = causes::receiver(&gnss, group);
            let config = self.config(imu, &receiver, part.seeds, part.drive_s);
            let mut fixes = causes::fixes(&measuring.drive, &gnss, group);
            if !part.fixes {
                fixes.iter_mut().skip(until + 1).for_each(|fix| *fix = None);
            }
            let (session, unit) = measuring.session(&config, &spec, &fixes);
            let beyond = match spec.without_environment() {
                plain if oracle && plain != spec => {
                    causes::beside(&session, &measuring.session(&config, &plain, &[]).0)
                }
                _ => Vec::new(),
            };
            let case = Case {
                session: &session,
                increments: &OnceCell::new(),
                bench: &Bench::default(),
                knows: Knowledge {
                    told: &told,
                    simulated: &spec,
                    unit: &unit,
                    beyond: &beyond,
                },
                tuned: Tuned::default(),
                until,
                fixes: part.fixes,
                memory: None,
            };
            pass(group, &case)?;
        }
        Ok(())
    }

    /// What the sensors of run `k` err by in each second beside what the datasheet tells of, in
    /// each group of a single cause whose schemes are told of it.
    pub(super) fn causes(&self, imu: &ImuSpec, k: u32) -> Vec<(Group, Vec<Increment>)> {
        let single = |group: &Group| ErrorModelName::CAUSES.contains(&group.sensors);
        let told = self
            .models
            .iter()
            .filter(|group| group.told && single(group));
        let told: Vec<Group> = told.copied().collect();
        if told.is_empty() {
            return Vec::new();
        }
        let gnss = self.scenario.receiver();
        let config = self.config(imu, &gnss, Seeds::of(k), self.aided().len() as u32);
        let mut measuring = Measuring::of(&self.scenario.vehicle(), &config);
        let mut of = |sensors| measuring.session(&config, &imu.error_model(sensors), &[]).0;
        let linear = of(ErrorModelName::Linear);
        let each = |group: Group| (group, causes::beside(&of(group.sensors), &linear));
        told.into_iter().map(each).collect()
    }

    /// A session: the campaign's standstill, then a drive of this length, s.
    pub(super) fn config<'a>(
        &'a self,
        imu: &'a ImuSpec,
        gnss: &'a GnssSpec,
        seeds: Seeds,
        drive_s: u32,
    ) -> SessionConfig<'a> {
        let s = &self.scenario;
        SessionConfig {
            imu,
            gnss,
            start: s.start(),
            heading: seeds.heading,
            standstill_s: f64::from(STANDSTILL_S),
            drive_s: f64::from(drive_s),
            segments: None,
            vibration: s.vibration,
            unit: seeds.unit,
            turn_on: seeds.turn_on,
            drive: seeds.drive,
        }
    }
}
