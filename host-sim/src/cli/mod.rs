//! The command line: one file a subcommand, each with its arguments and a `run`.

mod allan;
mod campaign;
mod convert;
mod hil;
mod learnability;
mod outcomes;
mod own;
mod replay;
mod run;
mod simulate;
mod source;

use crate::error::Error;
use clap::{Parser, Subcommand};

/// Ring-laser-gyro SINS simulation and the desktop tools of the IMU compensation co-processor.
///
/// Without a command it runs the default experiment: a vehicle drives 22 minutes, once with the raw IMU and once through the
/// compensator.
#[derive(Debug, Parser)]
#[command(version, about, args_conflicts_with_subcommands = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: run::Args,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// The paper's experiment on simulated data (the default)
    Run(run::Args),
    /// Recorded data through the same chain
    Replay(replay::Args),
    /// Many units, turn-ons and drives, every scheme on identical data, with intervals
    Campaign(campaign::Args),
    /// Overlapping Allan deviation of a recording or of a preset, and the noise coefficients that fit it
    Allan(allan::Args),
    /// What can be known of biases, scale factors and misalignments at all, beside what was learnt
    Learnability(learnability::Args),
    /// Recordings from one form to another: CSV, KF-GINS text, NovAtel logs
    Convert(convert::Args),
    /// A board at its lines: a drive in, the corrected stream out, compared with software in the loop
    Hil(hil::Args),
    /// Write a simulated session as CSV files, for other tools
    Simulate(simulate::Args),
}

impl Cli {
    /// Runs what was asked for.
    ///
    /// # Errors
    /// Bad input or unwritable output, with file, line, field and remedy.
    pub fn execute(&self) -> Result<(), Error> {
        match &self.command {
            None => self.run.run(),
            Some(Command::Run(args)) => args.run(),
            Some(Command::Replay(args)) => args.run(),
            Some(Command::Campaign(args)) => args.run(),
            Some(Command::Allan(args)) => args.run(),
            Some(Command::Learnability(args)) => args.run(),
            Some(Command::Convert(args)) => args.run(),
            Some(Command::Hil(args)) => args.run(),
            Some(Command::Simulate(args)) => args.run(),
        }
    }
}
