//! `host-sim serve`: the program `host-sim-serve`, which has a web server and so compiles apart.

use super::options::refused;
use crate::error::Error;
use clap::Args as ClapArgs;
use std::ffi::OsString;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::process::Command;

/// Name of the program.
const PROGRAM: &str = "host-sim-serve";

/// Arguments of `serve`.
#[derive(Debug, ClapArgs)]
#[command(disable_help_flag = true)]
pub struct Args {
    /// Arguments of host-sim-serve; `--help` lists them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    rest: Vec<OsString>,
}

impl Args {
    /// Runs the program that lies beside this one, or else in the path.
    pub(super) fn run(&self) -> Result<(), Error> {
        let mut command = Command::new(beside().unwrap_or_else(|| PROGRAM.into()));
        command.args(&self.rest);
        let error = replaced(&mut command);
        Err(match error.kind() {
            ErrorKind::NotFound => refused(
                "serve",
                format!("the program {PROGRAM} is neither beside host-sim nor in the path"),
                "build it: cargo build --release --package live",
            ),
            _ => refused("serve", format!("{PROGRAM}: {error}"), "build it anew"),
        })
    }
}

/// The program beside this one.
fn beside() -> Option<PathBuf> {
    let name = format!("{PROGRAM}{}", std::env::consts::EXE_SUFFIX);
    let file = std::env::current_exe().ok()?.with_file_name(name);
    file.is_file().then_some(file)
}

/// Becomes that program; so Ctrl-C reaches it alone. Comes back with an error only.
#[cfg(unix)]
fn replaced(command: &mut Command) -> std::io::Error {
    std::os::unix::process::CommandExt::exec(command)
}

/// Runs that program and ends as it does. Comes back with an error only.
#[cfg(not(unix))]
fn replaced(command: &mut Command) -> std::io::Error {
    match command.status() {
        Ok(status) => std::process::exit(status.code().unwrap_or(1)),
        Err(error) => error,
    }
}
