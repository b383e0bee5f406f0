//! `host-sim`: see `host-sim --help`.

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    match host_sim::cli::Cli::parse().execute() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("host-sim: {error}");
            ExitCode::from(2)
        }
    }
}
