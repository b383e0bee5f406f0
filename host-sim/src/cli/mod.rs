//! The command line: one file for each command, with its arguments and a `run`.
//!
//! Code that the commands share is in `options`, `output` and the crate `host-reading`. These
//! import none of the commands.

#[macro_use] // `print!` and `println!` of all commands
pub mod stdout;

mod abuse;
mod allan;
mod at_rest;
mod blackbox;
mod campaign;
mod convert;
mod corrected;
mod device;
mod examples;
mod fleet;
mod hil;
pub mod interrupt;
mod learnability;
mod options;
mod output;
mod replay;
mod report;
mod run;
mod serve;
mod sessions;
mod shell;
mod simulate;
pub mod simulated;
mod soak;
mod start;
mod unit;
mod user_recording;

use clap::{Arg, Command as Definition, CommandFactory, Parser, Subcommand};
use host_core::error::Error;
use host_reading::{messages, progress, record_options, source};

/// Simulate inertial sensors, replay recordings, and work with the IMU compensation co-processor.
///
/// Without a command it runs the default experiment: a vehicle drives for 22 minutes and navigates
/// once with the raw IMU and once through the compensator.
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
    /// Run the paper's experiment on simulated data (the default)
    Run(run::Args),
    /// Run recorded data through the same chain
    Replay(replay::Args),
    /// Compare all schemes over many units, turn-ons and drives, with intervals
    Campaign(campaign::Args),
    /// Try the device in a hostile world: what its corrections do when nothing is as configured
    Abuse(abuse::Args),
    /// Compute the Allan deviation of a recording or a preset, and fit noise coefficients
    Allan(allan::Args),
    /// Compute how well biases, scale factors and misalignments can be known, and what was reached
    Learnability(learnability::Args),
    /// Learn from many units of a type what a unit of it starts with: the table [prior] of its file
    Fleet(fleet::Args),
    /// Convert recordings: CSV, KF-GINS text, NovAtel logs, bags of ROS 2, logs of PX4 and
    /// u-blox, EuRoC folders
    Convert(convert::Args),
    /// Configure and watch a device over its command link
    Device(device::Args),
    /// Write the report of one unit from a recording or a device: a page that can be printed
    Report(report::Args),
    /// Send a drive to a board and compare its output with software in the loop
    Hil(hil::Args),
    /// Show what a device does, live: a page in the browser, Foxglove, MCAP recordings
    Serve(serve::Args),
    /// Write a simulated session as CSV files, for other tools
    Simulate(simulate::Args),
    /// Run the device for hours with random faults of every kind, and check what leaves
    Soak(soak::Args),
    /// Try how the device starts: success and heading error over classes of sensors and vehicles
    Start(start::Args),
    /// Make, check and show unit files: what is known of a sensor, in datasheet units
    Unit(unit::Args),
    /// Print the script that completes commands and options in a shell
    Completions(shell::Completions),
    /// Write the manual pages of all commands, for `man`
    Manual(shell::Manual),
}

impl Cli {
    /// All commands, with their examples.
    #[must_use]
    pub fn definition() -> Definition {
        negative_values(examples::with_examples(Self::command()))
    }

    /// The arguments of the program; see [`stdout::given`].
    #[must_use]
    pub fn given() -> Option<Self> {
        stdout::given(Self::definition())
    }

    /// Runs the command.
    ///
    /// # Errors
    /// Bad input or unwritable output, with file, line, field and remedy.
    pub fn execute(&self) -> Result<(), Error> {
        match &self.command {
            None => self.run.run(),
            Some(Command::Run(args)) => args.run(),
            Some(Command::Replay(args)) => args.run(),
            Some(Command::Campaign(args)) => args.run(),
            Some(Command::Abuse(args)) => args.run(),
            Some(Command::Allan(args)) => args.run(),
            Some(Command::Learnability(args)) => args.run(),
            Some(Command::Fleet(args)) => args.run(),
            Some(Command::Convert(args)) => args.run(),
            Some(Command::Device(args)) => args.run(),
            Some(Command::Report(args)) => args.run(),
            Some(Command::Hil(args)) => args.run(),
            Some(Command::Serve(args)) => args.run(),
            Some(Command::Simulate(args)) => args.run(),
            Some(Command::Soak(args)) => args.run(),
            Some(Command::Start(args)) => args.run(),
            Some(Command::Unit(args)) => args.run(),
            Some(Command::Completions(args)) => args.run(),
            Some(Command::Manual(args)) => args.run(),
        }
    }
}

/// A negative number after an option is its value, and is refused by what it may be.
fn negative_values(command: Definition) -> Definition {
    let takes = |arg: Arg| match arg.get_action().takes_values() {
        true => arg.allow_negative_numbers(true),
        false => arg,
    };
    command.mut_args(takes).mut_subcommands(negative_values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arguments_of_every_command_fit_together() {
        Cli::definition().debug_assert();
    }
}
