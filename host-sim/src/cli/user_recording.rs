//! `host-sim replay` of a user's recording: csv, kf-gins, novatel.

use super::options::{positive, preset, refused};
use super::output::Output;
use super::progress::Stages;
use super::source::{Csv, KfGins, Novatel};
use crate::error::Error;
use crate::experiment::user_recording::{LEAST_S, Plan};
use crate::inertial::session::Session;
use crate::inertial::units::{DEG, DEG_PER_H, DEG_PER_SQRT_H, UG, UG_PER_SQRT_HZ};
use crate::learning::teacher::Assumptions;
use crate::recordings::novatel;
use clap::Args as ClapArgs;
use std::path::Path;

/// Assumptions on the sensors, and the part to learn from.
#[derive(Debug, ClapArgs)]
struct Options {
    /// Seconds from the start to learn from, standstill included [default: the standstill and half
    /// of the rest]
    #[arg(long, value_name = "SECONDS")]
    learn_s: Option<usize>,
    /// Assumed class of the sensors: medium, nav or tactical
    #[arg(long, value_name = "NAME", default_value = "medium")]
    preset: String,
    /// Expected gyro bias, deg/h [default: the preset's]
    #[arg(long, value_name = "DEG_PER_H")]
    gyro_bias: Option<f64>,
    /// Expected accelerometer bias, ug [default: the preset's]
    #[arg(long, value_name = "UG")]
    accel_bias: Option<f64>,
    /// Angle random walk, deg/sqrt(h) [default: the preset's]
    #[arg(long, value_name = "DEG_PER_SQRT_H")]
    arw: Option<f64>,
    /// Velocity random walk, ug/sqrt(Hz) [default: the preset's]
    #[arg(long, value_name = "UG_PER_SQRT_HZ")]
    vrw: Option<f64>,
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
    /// Only list what the log contains
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
        let outcome = outcome.ok_or_else(|| no_attitude(Path::new(name)))?;
        self.output.leave_outcomes(name, &[outcome])
    }

    /// The preset's datasheet, with the given values in place of its own.
    fn assumptions(&self) -> Result<Assumptions, Error> {
        let mut a = Assumptions::of(&preset(&self.preset)?);
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
                *field = positive(name, value)? * unit;
            }
        }
        Ok(a)
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
