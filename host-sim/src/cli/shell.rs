//! `host-sim completions` and `host-sim manual`: what shells and `man` read.

use super::Cli;
use clap::{Args as ClapArgs, Command};
use clap_complete::Shell;
use clap_mangen::Man;
use host_core::error::Error;
use host_io::output::write_atomic;
use std::path::{Path, PathBuf};

const NAME: &str = "host-sim";

/// Arguments of `completions`.
#[derive(Debug, ClapArgs)]
pub struct Completions {
    /// The shell
    shell: Shell,
}

impl Completions {
    /// Prints the script.
    pub(super) fn run(&self) -> Result<(), Error> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::definition(), NAME, &mut script);
        print!("{}", String::from_utf8_lossy(&script));
        Ok(())
    }
}

/// Arguments of `manual`.
#[derive(Debug, ClapArgs)]
pub struct Manual {
    /// Directory of the pages: host-sim.1, and one for each command
    #[arg(long, value_name = "DIR", default_value = "out/man")]
    out: PathBuf,
}

impl Manual {
    /// Writes the pages.
    pub(super) fn run(&self) -> Result<(), Error> {
        let mut command = Cli::definition();
        command.build(); // sets their full names
        let pages = write(&command, NAME, &self.out)?;
        println!("{pages} pages: {}", self.out.display());
        Ok(())
    }
}

/// The page of a command and those below it. Returns their number.
fn write(command: &Command, name: &str, dir: &Path) -> Result<usize, Error> {
    let file = dir.join(format!("{name}.1"));
    let mut page = Vec::new();
    Man::new(command.clone())
        .title(name)
        .render(&mut page)
        .map_err(|error| Error::writing(&file, error))?;
    write_atomic(&file, &page)?;
    let below = command
        .get_subcommands()
        .filter(|sub| sub.get_name() != "help");
    let pages = below.map(|sub| write(sub, &format!("{name}-{}", sub.get_name()), dir));
    pages.sum::<Result<usize, Error>>().map(|pages| pages + 1)
}
