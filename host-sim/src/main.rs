//! `host-sim`: see `host-sim --help`.

use std::io::{Write, stderr};
use std::process::ExitCode;

fn main() -> ExitCode {
    host_sim::cli::interrupt::watch();
    match host_sim::cli::Cli::given().execute() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(stderr(), "host-sim: {error}"); // nobody may be reading
            ExitCode::from(error.code())
        }
    }
}
