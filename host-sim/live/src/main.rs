//! `host-sim-serve`: see `host-sim serve --help`.

use clap::CommandFactory;
use host_sim::cli::stdout;
use live::Options;
use std::process::ExitCode;

fn main() -> ExitCode {
    let options: Option<Options> = stdout::given(Options::command());
    let done = options.map_or(Ok(()), |options| live::serve(&options));
    stdout::ended("host-sim serve", done)
}
