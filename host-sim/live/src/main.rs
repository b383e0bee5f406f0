//! `host-sim-serve`: see `host-sim serve --help`.

use clap::Parser;
use std::io::{Write, stderr};
use std::process::ExitCode;

fn main() -> ExitCode {
    match live::serve(&live::Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(stderr(), "host-sim serve: {error}"); // nobody may be reading
            ExitCode::from(2)
        }
    }
}
