//! `host-sim replay` of a user's recording: csv, kf-gins, novatel, and recordings of
//! messages.

use super::messages::Messages;
use super::options::{UnitOption, refused, renamed};
use super::output::Output;
use super::progress::Stages;
use super::source::{Csv, KfGins, Novatel};
use crate::error::Error;
use crate::experiment::doubts::{Class, Says, Warning, doubts};
use crate::experiment::user_recording::{LEAST_S, Plan};
use crate::inertial::session::Session;
use crate::inertial::units::DEG;
use crate::learning::teacher::Assumptions;
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
    output: Output,
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
        self.options
            .replay("csv", (&record, &says), &record.session()?, named)
    }
}

impl KfGinsArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        let (record, session) = self.source.session()?;
        let says = self.source.says();
        self.options
            .replay("kf-gins", (&record, &says), &session, None)
    }
}

impl<S: ClapArgs + Messages> MessagesArgs<S> {
    pub(super) fn run(&self) -> Result<(), Error> {
        let unit = self.options.unit.load()?;
        let record = self.source.record(unit.as_ref())?;
        let says = self.source.says();
        self.options
            .replay(S::NAME, (&record, &says), &record.session()?, None)
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
        let (record, session) = self.source.session(&log)?;
        let says = self.source.says(&record);
        self.options
            .replay("novatel", (&record, &says), &session, None)
    }
}

impl Options {
    /// `named`: the unit that the recording itself names.
    fn replay(
        &self,
        name: &str,
        (record, says): (&Record, &Says),
        session: &Session,
        named: Option<Unit>,
    ) -> Result<(), Error> {
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
            attitude_sigma: self.attitude_sigma()?,
            learn: self.learn_s,
        };
        let class = Class {
            assumed: &plan.assumptions,
            given: is_given,
        };
        let warnings = self.warn(record, says, class)?;
        let learn = plan.learn(session).map_err(|(least, most)| {
            let all = session.epochs();
            let problem = match self.learn_s {
                Some(s) => format!("{s} s of a recording of {all} s"),
                None => format!(
                    "the recording has {all} s, {} of them standstill",
                    session.standstill
                ),
            };
            let remedy = match least <= most {
                true => format!("give {least} to {most}"),
                false => format!(
                    "give a recording with {LEAST_S} s to learn from after the standstill and \
                     {LEAST_S} s to judge on"
                ),
            };
            refused("--learn-s", problem, remedy)
        })?;
        let stages = Stages::new();
        stages.begin("aligning, learning, navigating");
        let outcome = plan.replay(name, session, learn);
        stages.end();
        let mut outcome = outcome.ok_or_else(|| no_attitude(Path::new(name)))?;
        outcome.warnings = warnings;
        self.output.leave_outcomes(name, &[outcome])
    }

    /// Tells where the samples contradict what is said of them.
    fn warn(&self, record: &Record, says: &Says, class: Class<'_>) -> Result<Vec<Warning>, Error> {
        let warnings = doubts(record, says, class);
        for warning in &warnings {
            eprintln!("{warning}");
        }
        if self.strict && !warnings.is_empty() {
            let problem = format!("was given, and there are {} warnings", warnings.len());
            let remedy = "see the remedies above, or leave the option out";
            return Err(refused("--strict", problem, remedy));
        }
        Ok(warnings)
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

/// The error of a recording without a usable standstill.
pub(super) fn no_attitude(file: &Path) -> Error {
    refused(
        file.display().to_string(),
        "the first part gives no attitude",
        "the recording must start at rest with live accelerometers and gyros",
    )
}
