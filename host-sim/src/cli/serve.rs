//! `host-sim serve`: the program `host-sim-serve`, which has a web server and so compiles apart.

use super::options::refused;
use clap::Args as ClapArgs;
use host_core::error::Error;
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
    /// Runs the program beside this one, or else in the path.
    pub(super) fn run(&self) -> Result<(), Error> {
        let mut command = Command::new(beside().unwrap_or_else(|| PROGRAM.into()));
        command.args(&self.rest);
        let error = replaced(&mut command);
        Err(match error.kind() {
            ErrorKind::NotFound
                if self
                    .rest
                    .iter()
                    .any(|word| word == "--help" || word == "-h") =>
            {
                println!(
                    "Shows a device, a recording or a simulation live in a browser: {PROGRAM}, \
                     which is not\nbeside host-sim. Build it: cargo build --release --package live"
                );
                return Ok(());
            }
            ErrorKind::NotFound => refused(
                "serve",
                format!("the program {PROGRAM} is neither beside host-sim nor in the path"),
                "build it: cargo build --release --package live; or take host-sim-serve of the same \
                 release and put it beside host-sim",
            ),
            _ => refused("serve", format!("{PROGRAM}: {error}"), "build it again"),
        })
    }
}

/// The program beside this one, from a build or from a release.
fn beside() -> Option<PathBuf> {
    let own = std::env::current_exe().ok()?;
    let names = names(own.file_name()?.to_str()?);
    let mut files = names.into_iter().map(|name| own.with_file_name(name));
    files.find(|file| file.is_file())
}

/// Names that the server may have beside a program of this name. A release has the target in both
/// names: `host-sim-TARGET` and `host-sim-serve-TARGET`.
fn names(own: &str) -> Vec<String> {
    let plain = format!("{PROGRAM}{}", std::env::consts::EXE_SUFFIX);
    let rest = own.strip_prefix("host-sim-");
    let released = rest.map(|target| format!("{PROGRAM}-{target}"));
    released.into_iter().chain([plain]).collect()
}

/// Replaces this process by that program, so that Ctrl-C reaches it alone. Returns only on an
/// error.
#[cfg(unix)]
fn replaced(command: &mut Command) -> std::io::Error {
    std::os::unix::process::CommandExt::exec(command)
}

/// Runs that program and ends with its exit code. Returns only on an error.
#[cfg(not(unix))]
fn replaced(command: &mut Command) -> std::io::Error {
    match command.status() {
        Ok(status) => std::process::exit(status.code().unwrap_or(1)),
        Err(error) => error,
    }
}

#[cfg(test)]
mod tests {
    use super::names;

    #[test]
    fn the_server_of_a_release_has_the_target_in_its_name() {
        let suffix = std::env::consts::EXE_SUFFIX;
        let plain = format!("host-sim-serve{suffix}");
        let found = names("host-sim-x86_64-unknown-linux-gnu");
        assert_eq!(found[0], "host-sim-serve-x86_64-unknown-linux-gnu");
        assert_eq!(found[1..], names(&format!("host-sim{suffix}")));
        assert_eq!(found[1..], [plain]);
    }
}
