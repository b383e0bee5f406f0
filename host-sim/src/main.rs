//! `host-sim`: see `host-sim --help`.

use host_sim::cli::{Cli, interrupt, stdout};
use std::process::ExitCode;

fn main() -> ExitCode {
    interrupt::watch();
    let done = Cli::given().map_or(Ok(()), |cli| cli.execute());
    stdout::ended("host-sim", done)
}
