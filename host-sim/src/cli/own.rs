//! `host-sim replay` of a user's own recording: csv, kf-gins, novatel.

use super::outcomes::{Output, no_attitude};
use super::run::Progress;
use super::source::{Csv, KfGins, Novatel};
use crate::error::Error;
use crate::experiment::own::{LEAST_S, Plan};
use crate::inertial::session::Session;
use crate::inertial::units::{DEG, DEG_PER_H, DEG_PER_SQRT_H, UG, UG_PER_SQRT_HZ};
use crate::learning::teacher::Assumptions;
use crate::recordings::novatel;
use crate::simulator::imu::{ImuSpec, PRESETS};
use clap::Args as ClapArgs;
use std::path::Path;

/// What is assumed of the sensors, and what is learnt from.
#[derive(Debug, ClapArgs)]
struct Options {
    /// Seconds from the start to learn from, standstill included [default: standstill and half of what follows]
    #[arg(long, value_name = "SECONDS")]
    learn_s: Option<usize>,
    /// The sensors are taken to be of this class (medium, nav, tactical)
    #[arg(long, value_name = "NAME", default_value = "medium")]
    preset: String,
    /// Gyro bias to be expected, deg/h [default: the preset's]
    #[arg(long, value_name = "DEG_PER_H")]
    gyro_bias: Option<f64>,
    /// Accelerometer bias to be expected, ug [default: the preset's]
    #[arg(long, value_name = "UG")]
    accel_bias: Option<f64>,
    /// Angle random walk, deg/sqrt(h) [default: the preset's]
    #[arg(long, value_name = "DEG_PER_SQRT_H")]
    arw: Option<f64>,
    /// Velocity random walk, ug/sqrt(Hz) [default: the preset's]
    #[arg(long, value_name = "UG_PER_SQRT_HZ")]
    vrw: Option<f64>,
    /// Standard deviations of an attitude that is given, deg
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

/// `replay novatel`.
#[derive(Debug, ClapArgs)]
pub(super) struct NovatelArgs {
    #[command(flatten)]
    source: Novatel,
    /// Only say what the log holds
    #[arg(long)]
    inventory: bool,
    #[command(flatten)]
    options: Options,
}

impl CsvArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        let session = self.source.record()?.session()?;
        self.options.replay("csv", &session)
    }
}

impl KfGinsArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        self.options.replay("kf-gins", &self.source.session()?)
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
        match self.inventory {
            true => Ok(()),
            false => self.options.replay("novatel", &self.source.session(&log)?),
        }
    }
}

impl Options {
    fn replay(&self, name: &str, session: &Session) -> Result<(), Error> {
        let plan = Plan {
            assumptions: self.assumptions()?,
            attitude_sigma: self.attitude_sigma()?,
            learn: self.learn_s,
        };
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
                    "give a recording with {LEAST_S} s to learn from after the standstill and {LEAST_S} s to judge on"
                ),
            };
            option("--learn-s", problem, &remedy)
        })?;
        let progress = Progress::new();
        progress.stage("aligning, learning, navigating");
        let outcome = plan.replay(name, session, learn);
        progress.end();
        let outcome = outcome.ok_or_else(|| no_attitude(Path::new(name)))?;
        self.output.print(name, &[outcome])
    }

    /// The preset's datasheet, with what was given instead.
    fn assumptions(&self) -> Result<Assumptions, Error> {
        let names = PRESETS.map(|(name, _)| name);
        let spec = ImuSpec::preset(&self.preset)
            .ok_or_else(|| Error::unknown("preset", &self.preset, &names))?;
        let mut a = Assumptions::of(&spec);
        let fields = [
            (
                "--gyro-bias",
                self.gyro_bias,
                &mut a.prior.gyro_bias,
                DEG_PER_H,
            ),
            ("--accel-bias", self.accel_bias, &mut a.prior.accel_bias, UG),
            ("--arw", self.arw, &mut a.noise.gyro, DEG_PER_SQRT_H),
            ("--vrw", self.vrw, &mut a.noise.accel, UG_PER_SQRT_HZ),
        ];
        for (name, given, field, unit) in fields {
            if let Some(value) = given {
                if !(value.is_finite() && value > 0.0) {
                    return Err(option(name, format!("is {value}"), "give a number above 0"));
                }
                *field = value * unit;
            }
        }
        Ok(a)
    }

    fn attitude_sigma(&self) -> Result<[f64; 2], Error> {
        match self.attitude_sigma[..] {
            [tilt, heading] if [tilt, heading].iter().all(|s| *s > 0.0 && *s <= 90.0) => {
                Ok([tilt * DEG, heading * DEG])
            }
            _ => Err(option(
                "--attitude-sigma",
                format!("is {:?}", self.attitude_sigma),
                "give tilt,heading in degrees, above 0 and at most 90",
            )),
        }
    }
}

fn option(name: &str, problem: String, remedy: &str) -> Error {
    Error::Option {
        option: name.into(),
        problem,
        remedy: remedy.into(),
    }
}
