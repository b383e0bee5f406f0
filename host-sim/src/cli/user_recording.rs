//! `host-sim replay` of a user's recording: csv, kf-gins, novatel, and recordings of
//! messages.

use super::corrected::CorrectedOptions;
use super::messages::Messages;
use super::options::{UnitOption, refused, renamed, within};
use super::output::Output;
use super::progress::Stages;
use super::source::{Csv, KfGins, Novatel};
use crate::error::Error;
use crate::experiment::doubts::{Class, Says, Warning, doubts};
use crate::experiment::starting::{Started, Wishes, start};
use crate::experiment::time_offset::settle;
use crate::experiment::user_recording::{LEAST_S, Plan};
use crate::inertial::session::Session;
use crate::inertial::units::DEG;
use crate::learning::in_motion::Told;
use crate::learning::teacher::Assumptions;
use crate::recordings::corrected::Original;
use crate::recordings::novatel;
use crate::recordings::record::Record;
use crate::unit::Unit;
use clap::Args as ClapArgs;
use std::path::Path;

/// Assumptions on the sensors, and the part to learn from.
#[derive(Debug, ClapArgs)]
struct Options {
    /// Seconds from the start to learn from, standstill included [default: the standstill and half
    /// of the rest]
    #[arg(long, value_name = "SECONDS")]
    learn_s: Option<usize>,
    #[command(flatten)]
    unit: UnitOption,
    #[command(flatten)]
    old: OldWords,
    /// Stop if the samples contradict what is said of them, instead of a warning
    #[arg(long)]
    strict: bool,
    /// Standard deviations of a given attitude, deg
    #[arg(
        long,
        value_name = "TILT,HEADING",
        value_delimiter = ',',
        default_value = "0.1,0.5"
    )]
    attitude_sigma: Vec<f64>,
    #[command(flatten)]
    says: TellOptions,
    /// Use only this part of a recording with long gaps of samples, counted from 1 [default: all,
    /// each aligned anew]
    #[arg(long, value_name = "NUMBER")]
    part: Option<usize>,
    #[command(flatten)]
    corrected: CorrectedOptions,
    #[command(flatten)]
    output: Output,
}

/// What files of some formats cannot tell.
#[derive(Debug, ClapArgs)]
struct TellOptions {
    /// Added to the times of the fixes to give the IMU's, s
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    time_offset: Option<f64>,
    /// Estimate that offset from the motion, -5 to 5 s around what is told
    #[arg(long)]
    estimate_time_offset: bool,
    /// From the IMU to the antenna: forward, right, down, m [default: that of the recording, else
    /// of the unit]
    #[arg(
        long,
        value_name = "X,Y,Z",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    lever_arm: Vec<f64>,
    /// Rough heading at the first fix, deg clockwise from north, that helps to find the attitude
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true)]
    heading: Option<f64>,
    /// Its standard deviation, deg
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 10.0,
        requires = "heading"
    )]
    heading_sigma: f64,
}

impl TellOptions {
    /// Puts into `record` what the options tell, else what the unit tells.
    fn tell(&self, record: &mut Record, unit: &Unit) -> Result<(), Error> {
        if let Some(told) = self.time_offset {
            let told = within("--time-offset", told, [-1e9, 1e9])?;
            record.move_fixes(told - record.told_offset_s.unwrap_or(0.0));
            record.told_offset_s = Some(told);
        }
        let metres = |arm: &[f64; 3]| arm.iter().all(|x| x.abs() <= 100.0);
        match (
            <[f64; 3]>::try_from(&self.lever_arm[..]),
            &self.lever_arm[..],
        ) {
            (Ok(arm), _) if metres(&arm) => record.lever_arm_m = arm,
            (Err(_), []) if record.lever_arm_m == [0.0; 3] => {
                record.lever_arm_m = unit.receiver.lever_arm_m;
            }
            (Err(_), []) => {}
            _ => {
                return Err(refused(
                    "--lever-arm",
                    format!("is {:?}", self.lever_arm),
                    "give forward,right,down in m, each -100 to 100",
                ));
            }
        }
        if let Some(heading) = self.heading {
            let heading = within("--heading", heading, [-360.0, 360.0])?;
            let sigma = within("--heading-sigma", self.heading_sigma, [0.01, 180.0])?;
            record.rough_heading = Some([heading * DEG, sigma * DEG]);
        }
        Ok(())
    }
}

/// Options that the unit file has replaced.
#[derive(Debug, ClapArgs)]
struct OldWords {
    /// Refused
    #[arg(long, hide = true, value_parser = renamed("write gyro.bias_turn_on_dph into a unit file and give --unit FILE.toml"))]
    gyro_bias: Option<String>,
    /// Refused
    #[arg(long, hide = true, value_parser = renamed("write accel.bias_turn_on_ug into a unit file and give --unit FILE.toml"))]
    accel_bias: Option<String>,
    /// Refused
    #[arg(long, hide = true, value_parser = renamed("write gyro.angle_random_walk_dpsqrth into a unit file and give --unit FILE.toml"))]
    arw: Option<String>,
    /// Refused
    #[arg(long, hide = true, value_parser = renamed("write accel.velocity_random_walk_ugpsqrthz into a unit file and give --unit FILE.toml"))]
    vrw: Option<String>,
}

/// `replay csv`.
#[derive(Debug, ClapArgs)]
pub(super) struct CsvArgs {
    #[command(flatten)]
    source: Csv,
    #[command(flatten)]
    options: Options,
}

/// `replay kf-gins`.
#[derive(Debug, ClapArgs)]
pub(super) struct KfGinsArgs {
    #[command(flatten)]
    source: KfGins,
    #[command(flatten)]
    options: Options,
}

/// `replay` of a recording of messages.
#[derive(Debug, ClapArgs)]
pub(super) struct MessagesArgs<S: ClapArgs> {
    #[command(flatten)]
    source: S,
    #[command(flatten)]
    options: Options,
}

/// `replay novatel`.
#[derive(Debug, ClapArgs)]
pub(super) struct NovatelArgs {
    #[command(flatten)]
    source: Novatel,
    /// Only list what the log contains
    #[arg(long)]
    inventory: bool,
    #[command(flatten)]
    options: Options,
}

impl CsvArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        let named = self.source.unit()?;
        let record = self.source.record()?;
        let says = self.source.says(&record)?;
        let original = Some(self.source.original()?);
        self.options.replay("csv", record, &says, named, original)
    }
}

impl KfGinsArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        let record = self.source.record()?;
        let says = self.source.says();
        let original = Some(self.source.original());
        self.options
            .replay("kf-gins", record, &says, None, original)
    }
}

impl<S: ClapArgs + Messages> MessagesArgs<S> {
    pub(super) fn run(&self) -> Result<(), Error> {
        let unit = self.options.unit.load()?;
        let record = self.source.record(unit.as_ref())?;
        let says = self.source.says();
        let original = self.source.original(unit.as_ref())?;
        self.options.replay(S::NAME, record, &says, None, original)
    }
}

impl NovatelArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        let log = novatel::read(&self.source.file)?;
        for (number, count) in &log.messages {
            println!("message {number}: {count}");
        }
        println!(
            "damaged: {}, bytes of no message: {}",
            log.damaged, log.garbage
        );
        println!(
            "raw increments: {}, corrected increments: {}, INS solutions: {}",
            log.raw.len(),
            log.corrected.len(),
            log.ins.len()
        );
        if self.inventory {
            return Ok(());
        }
        let record = self.source.record_of(&log)?;
        let says = self.source.says(&record);
        let original = Some(self.source.original(&log)?);
        self.options
            .replay("novatel", record, &says, None, original)
    }
}

impl Options {
    /// `named`: the unit that the recording itself names. `original`: what corrected samples are
    /// written into.
    fn replay(
        &self,
        name: &str,
        mut record: Record,
        says: &Says,
        named: Option<Unit>,
        original: Option<Original>,
    ) -> Result<(), Error> {
        let corrected = self.corrected.target(original, &record)?;
        let given = self.unit.load()?.or(named);
        let is_given = given.is_some();
        let unit = given.unwrap_or_else(|| {
            eprintln!(
                "{name}: no unit is given, so the sensors count as those of 'medium'; remedy: --unit FILE.toml"
            );
            Unit::default()
        });
        let plan = Plan {
            assumptions: Assumptions::of(&unit),
            learn: self.learn_s,
        };
        let class = Class {
            assumed: &plan.assumptions,
            given: is_given,
        };
        self.says.tell(&mut record, &unit)?;
        let wanted = self.says.estimate_time_offset;
        let (note, warning) = settle(&mut record, wanted, "time offset");
        let mut warnings = doubts(&record, says, class);
        warnings.extend(warning);
        self.warn(&warnings)?;
        let wishes = Wishes {
            told: Told {
                vehicle: unit.vehicle.kind,
                heading: record.rough_heading,
            },
            attitude_sigma: self.attitude_sigma()?,
            part: self.part,
        };
        let stages = Stages::new();
        stages.begin("finding the attitude");
        let (prepared, file) = (record.prepare()?, record.file.clone());
        // the samples are in the session now, and a day of them is large
        let record = corrected.is_some().then_some(record);
        let started = start(prepared, &wishes, &plan.assumptions, &file);
        stages.end();
        let Started {
            session,
            begin,
            notes,
        } = started?;
        let split = plan
            .split(&session)
            .map_err(|range| self.unfit(&session, range))?;
        let stages = Stages::new();
        stages.begin("aligning, learning, navigating");
        let by = self.corrected.scheme();
        let outcome = plan.replay_and_correct(name, &session, &split, by);
        stages.end();
        let (mut outcome, correction) = outcome?.ok_or_else(|| lost(name, &session))?;
        outcome.warnings = warnings;
        outcome.notes.extend(note.into_iter().chain(notes));
        if let Some((target, record)) = corrected.zip(record) {
            outcome
                .notes
                .push(target.write(&record, &correction, begin)?);
        }
        self.output.leave_outcomes(name, &[outcome])
    }

    /// No part of the session can be learnt from and judged as the user wishes.
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
                 or use one part (--part)"
            ),
            false => format!(
                "give a recording with {LEAST_S} s to learn from after the standstill and \
                 {LEAST_S} s to judge on"
            ),
        };
        refused("--learn-s", problem, remedy)
    }

    /// Tells where the samples contradict what is said of them.
    fn warn(&self, warnings: &[Warning]) -> Result<(), Error> {
        for warning in warnings {
            eprintln!("{warning}");
        }
        if self.strict && !warnings.is_empty() {
            let problem = format!("was given, and there are {} warnings", warnings.len());
            let remedy = "see the remedies above, or leave the option out";
            return Err(refused("--strict", problem, remedy));
        }
        Ok(())
    }

    fn attitude_sigma(&self) -> Result<[f64; 2], Error> {
        match self.attitude_sigma[..] {
            [tilt, heading] if [tilt, heading].iter().all(|s| *s > 0.0 && *s <= 90.0) => {
                Ok([tilt * DEG, heading * DEG])
            }
            _ => Err(refused(
                "--attitude-sigma",
                format!("is {:?}", self.attitude_sigma),
                "give tilt,heading in degrees, above 0 and at most 90",
            )),
        }
    }
}

/// The error of a recording with which the navigators come to nothing.
fn lost(name: &str, session: &Session) -> Error {
    if session.standstill > 0 {
        return no_attitude(Path::new(name));
    }
    refused(
        name,
        "samples and fixes contradict each other so much that the learner's navigator gives up",
        "check axes, mounting, units, time offset (--estimate-time-offset), the attitude at the \
         start and the unit file",
    )
}

/// The error of a recording without a usable standstill.
pub(super) fn no_attitude(file: &Path) -> Error {
    refused(
        file.display().to_string(),
        "the first part gives no attitude",
        "the recording must start at rest with live accelerometers and gyros",
    )
}
