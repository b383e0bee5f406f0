//! The drives of a run, as the unit measures them with each group of errors.

use super::bench::Bench;
use super::schemes::{Case, Knowledge, Tuned};
use super::{Campaign, DriveOfRun, GATHER, Group, STANDSTILL_S, Seeds, causes};
use host_core::error::Error;
use host_core::inertial::gnss::Fix;
use host_core::inertial::session::Session;
use host_core::inertial::sins::Increment;
use host_core::simulator::gnss::GnssSpec;
use host_core::simulator::imu::{Draws, ErrorModelName, ImuSpec, UnitErrors};
use host_core::simulator::session::{Drive, SessionConfig, measured};
use host_core::simulator::truth::Vehicle;
use host_estimation::learning::device::Device;
use host_estimation::learning::teacher::Assumptions;
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

    /// The session with these errors and fixes, and the unit's errors.
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

/// Groups of errors whose sessions are in memory at the same time: the six of a campaign, and
/// noise.
const TOGETHER: usize = 7;

/// A drive as measured with one group of errors.
struct OfGroup {
    group: Group,
    spec: ImuSpec,
    session: Session,
    unit: UnitErrors,
    beyond: Vec<Increment>,
    increments: OnceCell<Vec<Increment>>,
    bench: Bench,
}

impl OfGroup {
    fn case<'a>(
        &'a self,
        (assumptions, device): (&'a Assumptions, &'a Device),
        part: &DriveOfRun,
    ) -> Case<'a> {
        Case {
            session: &self.session,
            increments: &self.increments,
            bench: &self.bench,
            knows: Knowledge {
                assumptions,
                device,
                simulated: &self.spec,
                unit: &self.unit,
                beyond: &self.beyond,
            },
            tuned: Tuned::default(),
            until: part.until as usize,
            fixes: part.fixes,
            memory: None,
        }
    }
}

impl Campaign {
    /// Calls `prepare` with several groups of errors at once, then `pass` with the drive as
    /// measured with each of them.
    pub(super) fn part(
        &self,
        imu: &ImuSpec,
        part: &DriveOfRun,
        groups: &[Group],
        prepare: impl Fn(&[(Group, Case<'_>)]) -> Result<(), Error>,
        mut pass: impl FnMut(Group, &Case<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let unit = self.scenario.unit();
        let known = (&Assumptions::of(unit), &Device::of_unit(unit)?);
        let gnss = self.scenario.receiver();
        let config = self.config(imu, &gnss, part.seeds, part.drive_s);
        let mut measuring = Measuring::of(&self.scenario.vehicle(), &config);
        for groups in groups.chunks(TOGETHER) {
            let of = |group: &Group| self.of_group(imu, part, *group, &mut measuring);
            let all: Vec<OfGroup> = groups.iter().map(of).collect();
            let each = all.iter().map(|of| (of.group, of.case(known, part)));
            let cases: Vec<(Group, Case<'_>)> = each.collect();
            prepare(&cases)?;
            cases
                .iter()
                .try_for_each(|(group, case)| pass(*group, case))?;
        }
        Ok(())
    }

    /// The drive as measured with one group of errors.
    fn of_group(
        &self,
        imu: &ImuSpec,
        part: &DriveOfRun,
        group: Group,
        measuring: &mut Measuring,
    ) -> OfGroup {
        let gnss = self.scenario.receiver();
        let oracle = part.judged && (self.wants("oracle") || self.wants("limit"));
        let spec = imu.error_model(group.sensors);
        let receiver = causes::receiver(&gnss, group);
        let config = self.config(imu, &receiver, part.seeds, part.drive_s);
        let mut fixes = causes::fixes(&measuring.drive, &gnss, group);
        if !part.fixes {
            let after = fixes.iter_mut().skip(part.until as usize + 1);
            after.for_each(|fix| *fix = None);
        }
        let (session, unit) = measuring.session(&config, &spec, &fixes);
        let beyond = match spec.without_environment() {
            plain if oracle && plain != spec => {
                causes::beside(&session, &measuring.session(&config, &plain, &[]).0)
            }
            _ => Vec::new(),
        };
        OfGroup {
            group,
            spec,
            session,
            unit,
            beyond,
            increments: OnceCell::new(),
            bench: Bench::default(),
        }
    }

    /// Errors of the sensors of run `k` in each second beside those of the datasheet, in each group
    /// of a single cause whose schemes know its size.
    pub(super) fn causes(&self, imu: &ImuSpec, k: u32) -> Vec<(Group, Vec<Increment>)> {
        let single = |group: &Group| ErrorModelName::CAUSES.contains(&group.sensors);
        let known = self
            .models
            .iter()
            .filter(|group| group.told && single(group));
        let known: Vec<Group> = known.copied().collect();
        if known.is_empty() {
            return Vec::new();
        }
        let gnss = self.scenario.receiver();
        let config = self.config(imu, &gnss, Seeds::of(k), self.aided().len() as u32);
        let mut measuring = Measuring::of(&self.scenario.vehicle(), &config);
        let mut of = |sensors| measuring.session(&config, &imu.error_model(sensors), &[]).0;
        let linear = of(ErrorModelName::Linear);
        let each = |group: Group| (group, causes::beside(&of(group.sensors), &linear));
        known.into_iter().map(each).collect()
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
