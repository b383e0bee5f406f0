//! The replay of a user's recording, from the samples to the outcome: for the command line, the
//! reports and Python.

use super::{LEAST_S, Plan};
use crate::experiment::correction::Correction;
use crate::experiment::outcome::Outcome;
use crate::experiment::protocol::Begins;
use crate::experiment::starting::{Started, Wishes, start};
use host_core::error::Error;
use host_core::inertial::session::Session;
use host_estimation::analysis::doubts::{Says, Warning};
use host_estimation::learning::device::Device;
use host_estimation::learning::teacher::Assumptions;
use host_io::recordings::record::Record;
use host_io::recordings::track::Track;
use host_unit::Unit;

/// Refused alignments of a device that does not navigate, from which on its samples and fixes are
/// said to contradict each other.
const CONTRADICTED: u32 = 5;
/// Residual of the state at which all navigators begin, from which on it is said too. That of 24
/// recorded sessions is at most 0.8.
const RESIDUAL: f64 = 5.0;

/// The user's choices.
#[derive(Debug, Clone)]
pub struct Wanted {
    /// Name of the recording's form.
    pub form: &'static str,
    /// The unit; `None`: its sensors count as those of 'medium'.
    pub unit: Option<Unit>,
    /// Seconds to learn from, standstill included; `None`: the standstill and half of the rest.
    pub learn_s: Option<usize>,
    /// The time offset of the fixes is estimated.
    pub estimate_time_offset: bool,
    /// Standard deviations of a given attitude, tilt and heading, rad.
    pub attitude_sigma: [f64; 2],
    /// Number of the part, counted from 1, that is used alone.
    pub part: Option<usize>,
    /// Each navigator begins the judged part at the state of its own aided navigator, and not all
    /// at one.
    pub own_start: bool,
    /// Name of the scheme whose corrections are wanted.
    pub corrected_by: Option<String>,
    /// How the user writes an option, for errors: `--learn-s`, or `learn_s`.
    pub option: fn(&str) -> String,
}

/// A step of the replay that begins.
#[derive(Debug)]
pub enum Step<'a> {
    /// The samples are compared with their description; these are the contradictions.
    Examined(&'a [Warning]),
    /// The attitude is sought.
    Starting,
    /// The schemes learn and navigate.
    Replaying,
}

/// What a replay gives.
#[derive(Debug)]
pub struct Replayed {
    /// The errors of all schemes.
    pub outcome: Outcome,
    /// The corrections by [`Wanted::corrected_by`].
    pub correction: Correction,
    /// Time of the first epoch on the IMU's clock, s.
    pub begin: f64,
    /// The recording, if corrections are wanted. Without them it is freed before the work: a day of
    /// samples is large.
    pub record: Option<Record>,
}

/// Replays a recording whose options and unit are applied. `each` hears of every step, and may end
/// the replay.
///
/// # Errors
/// No attitude, too short a recording, or samples and fixes that contradict each other: with the
/// remedy. Any error of `each`.
pub fn replay(
    mut record: Record,
    says: &Says,
    wanted: &Wanted,
    each: &mut dyn FnMut(Step<'_>) -> Result<(), Error>,
) -> Result<Replayed, Error> {
    let medium = Unit::default();
    let unit = wanted.unit.as_ref();
    let true_attitude = record.truth.as_ref().is_some_and(Track::has_attitude);
    let plan = Plan {
        begins: match (wanted.own_start, true_attitude) {
            (true, _) => Begins::Own,
            (false, true) => Begins::Reference,
            (false, false) => Begins::Smoothed,
        },
        assumptions: Assumptions::of(unit.unwrap_or(&medium)),
        device: Device::of_unit(unit.unwrap_or(&medium))?,
        learn: wanted.learn_s,
    };
    let estimates = wanted.estimate_time_offset;
    let (note, warnings) = plan.examine(&mut record, says, unit.is_some(), estimates);
    each(Step::Examined(&warnings))?;
    let wishes = Wishes::of(
        unit.unwrap_or(&medium),
        &record,
        wanted.attitude_sigma,
        wanted.part,
    );
    each(Step::Starting)?;
    let has_truth = record.truth.is_some();
    let (prepared, file) = (record.prepare()?, record.file.clone());
    let record = wanted.corrected_by.is_some().then_some(record);
    let started = start(prepared, &wishes, &plan.assumptions, &file)?;
    let Started {
        session,
        begin,
        notes,
    } = started;
    let split = plan
        .split(&session)
        .map_err(|range| wanted.unfit(&session, range))?;
    each(Step::Replaying)?;
    let by = wanted.corrected_by.as_deref();
    let outcome = plan.replay_and_correct(wanted.form, &session, &split, by)?;
    let (mut outcome, correction) = outcome.ok_or_else(|| wanted.lost(&session))?;
    outcome.warnings = warnings;
    let contradicted = outcome
        .bench
        .as_ref()
        .map_or(0, |bench| bench.course.contradicted);
    let residual = outcome.residual.filter(|residual| *residual > RESIDUAL);
    let contradiction = match residual {
        _ if contradicted >= CONTRADICTED => Some(format!(
            "{contradicted} times the device found no attitude at which samples and fixes agree"
        )),
        // what is wrong has been said
        Some(residual) if outcome.warnings.is_empty() => Some(format!(
            "around the start of the judged part their residual is {residual:.1}, where 1 is \
             expected"
        )),
        _ => None,
    };
    if let Some(what) = contradiction {
        let warning = wanted.contradiction(&what, says);
        each(Step::Examined(std::slice::from_ref(&warning)))?;
        outcome.warnings.push(warning);
    }
    outcome.notes.extend(note.into_iter().chain(notes));
    if let Some(bench) = &mut outcome.bench {
        bench.begin_s = begin;
        bench.reference_sigma_m = bench.reference_sigma_m.filter(|_| !has_truth);
    }
    Ok(Replayed {
        outcome,
        correction,
        begin,
        record,
    })
}

impl Wanted {
    /// Samples and fixes do not agree, as `what` shows.
    fn contradiction(&self, what: &str, says: &Says) -> Warning {
        Warning {
            file: says.file.clone(),
            field: "gnss".into(),
            problem: format!("and 'imu' contradict each other: {what}"),
            remedy: format!(
                "check, in this order, the clock of the fixes ({}), units and order of positions \
                 and velocities, axes, units of gyros and accelerometers, standard deviations of \
                 the fixes, the unit file",
                (self.option)("time-offset")
            ),
        }
    }

    /// The error when the session is too short for the wished parts.
    fn unfit(&self, session: &Session, (least, most): (usize, usize)) -> Error {
        let all = session.epochs();
        let problem = match self.learn_s {
            Some(s) => format!("{s} s of a recording of {all} s"),
            None => format!(
                "the recording has {all} s, {} of them standstill",
                session.standstill
            ),
        };
        let remedy = match least <= most {
            true if session.outages.is_empty() => format!("give {least} to {most}"),
            true => format!(
                "give {least} to {most}, with at least {LEAST_S} s before the next gap of samples, \
                 or use one part ({})",
                (self.option)("part")
            ),
            false => format!(
                "give a recording with {LEAST_S} s to learn from after the standstill and \
                 {LEAST_S} s to judge on"
            ),
        };
        Error::Option {
            option: (self.option)("learn-s"),
            problem,
            remedy,
        }
    }

    /// The error of a recording with which no navigator works.
    fn lost(&self, session: &Session) -> Error {
        let (problem, remedy) = if session.standstill > 0 {
            no_attitude()
        } else {
            (
                "samples and fixes contradict each other so much that the learner's navigator \
                 gives up"
                    .into(),
                format!(
                    "check axes, mounting, units, time offset ({}), the attitude at the start and \
                     the unit file",
                    (self.option)("estimate-time-offset")
                ),
            )
        };
        Error::Option {
            option: self.form.into(),
            problem,
            remedy,
        }
    }
}

/// Problem and remedy of a recording without a usable standstill.
#[must_use]
pub fn no_attitude() -> (String, String) {
    (
        "the first part gives no attitude".into(),
        "the recording must start at rest with live accelerometers and gyros".into(),
    )
}
