//! `host-sim device`.

mod blackbox;
mod configure;
mod print;
mod simulate;
mod update;
mod weights;
mod wheels;

use super::interrupt::asked;
use super::options::refused;
use super::simulated::SIMULATED;
use super::stdout;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args as ClapArgs, Subcommand};
use firmware::control::Mode;
use firmware::fix::Heading;
use firmware::wire::command::Request;
use host_core::error::Error;
use host_device::device::{
    Link, MODES, Update, Watch, commit, info, mode_name, open_by_choice, provision, read_key,
    store, watch,
};
use serde::Serialize;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Arguments of `device`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    /// Port at the device's command link: a serial device (/dev/ttyUSB0, COM3) or tcp:HOST:PORT
    #[arg(long, value_name = "PORT", required_unless_present = "simulate")]
    #[arg(conflicts_with = "listen", conflicts_with_all = SIMULATED)]
    port: Option<String>,
    /// Bit rate of the command link; sockets ignore it
    #[arg(long, default_value_t = 921_600)]
    baud: u32,
    /// File of the device's key: commands that change the device are sealed with it
    #[arg(long, value_name = "FILE", env = "LRNN_KEY", global = true)]
    key: Option<PathBuf>,
    /// Print JSON: one object; `watch` prints one object a line
    // not named `json`: the default command has an argument of that name and another type
    #[arg(long = "json", global = true)]
    as_json: bool,
    #[command(flatten)]
    simulation: simulate::Args,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Print versions, board, clocks and bit rates, and whether the device is configured
    Info,
    /// Configure the device with a unit, read the configuration back, and store it; frames are lost
    /// for up to two seconds while it stores
    Configure {
        /// Unit file, or name of a preset (host-sim unit list)
        #[arg(value_name = "FILE|PRESET")]
        unit: String,
        /// Do not store: the configuration is lost when the device is switched off
        #[arg(long)]
        no_store: bool,
    },
    /// Print the configuration in use as a unit file
    Show,
    /// Print the mode, or set it
    Mode {
        /// The mode to set
        #[arg(value_parser = mode_parser())]
        mode: Option<Mode>,
    },
    /// Read the weights in use into a file, or write those of a file
    Weights {
        #[command(subcommand)]
        command: weights::Command,
    },
    /// Use what the device has learnt
    Learnt {
        #[command(subcommand)]
        command: Learnt,
    },
    /// Give the heading of the vehicle, for the learner's alignment in progress
    Heading {
        /// Where the forward axis points, from north to east, deg
        #[arg(allow_negative_numbers = true)]
        deg: f64,
        /// Standard deviation, deg
        #[arg(long, value_name = "DEG")]
        sigma: f64,
    },
    /// Send speeds of the wheels from standard input, one a line, m/s, negative in reverse
    ///
    /// The unit file needs the table [wheels]. Send some ten a second, as they are measured.
    Wheels,
    /// Read the black box, for `replay blackbox`; the stream goes on
    Blackbox {
        /// The file, which appears whole or not at all
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
        /// Let it record again afterwards
        #[arg(long)]
        release: bool,
    },
    /// Store configuration and weights over a power cycle; frames are lost for up to two seconds
    Store,
    /// Give the device its key, once, or another one with --key; frames are lost for up to four
    /// seconds
    Provision {
        /// File of the key to give; it is made if it is not there
        #[arg(long, value_name = "FILE", required_unless_present = "open")]
        key_file: Option<PathBuf>,
        /// No key, by choice: anybody at the command link may change the device
        #[arg(long, conflicts_with = "key_file")]
        open: bool,
    },
    /// Update the firmware, in mode bypass; bytes pass meanwhile, until the device restarts with it
    Update {
        /// The update: BOARD.update of a release, or of `cargo xtask sign`
        file: PathBuf,
        /// Take one that is older than the firmware that runs
        #[arg(long)]
        older: bool,
        /// Do not restart: the next start tries it
        #[arg(long)]
        no_restart: bool,
    },
    /// Print mode, faults, rates and learner once a second
    Watch {
        /// How long, s; without it until Ctrl-C
        #[arg(long)]
        seconds: Option<u32>,
    },
}

#[derive(Debug, Subcommand)]
enum Learnt {
    /// Use the weights of the promoted hypothesis, from the next block on
    Commit,
}

/// The modes by their names.
fn mode_parser() -> impl TypedValueParser<Value = Mode> {
    let names = MODES.map(mode_name);
    PossibleValuesParser::new(names).try_map(|name| {
        let mode = MODES.into_iter().find(|mode| mode_name(*mode) == name);
        mode.ok_or(name)
    })
}

impl Args {
    /// Runs the command and prints.
    pub(super) fn run(&self) -> Result<(), Error> {
        let Some(command) = self.command()? else {
            return self.simulation.run();
        };
        if let Command::Watch { seconds } = *command {
            return self.watch(seconds);
        }
        check_files(command)?;
        let mut link = self.open()?;
        let link = &mut link;
        match command {
            Command::Info => {
                let info = info(link)?;
                self.print(&info, || print::info(&info))
            }
            Command::Configure { unit, no_store } => {
                let info = configure::run(link, unit, !no_store)?;
                self.print(&info, || print::info(&info))
            }
            Command::Show => self.show(link),
            Command::Mode { mode } => self.mode(link, *mode),
            Command::Weights { command } => {
                link.version()?;
                let written = command.run(link)?;
                self.print(&written, || println!("{}", written.says))
            }
            Command::Learnt {
                command: Learnt::Commit,
            } => {
                link.version()?;
                let says = commit(link)?;
                self.print(&Done::new(&says), || println!("{says}"))
            }
            Command::Heading { deg, sigma } => {
                link.version()?;
                link.order(&Request::Heading(Heading {
                    angle: deg.to_radians() as f32,
                    sigma: sigma.to_radians() as f32,
                }))?;
                let says = "the heading is taken for the alignment in progress";
                self.print(&Done::new(says), || println!("{says}"))
            }
            Command::Wheels => {
                let [taken, not_yet] = wheels::run(link, io::stdin().lock())?;
                let says = format!(
                    "{taken} speeds of the wheels were taken, {not_yet} came while it did not learn"
                );
                self.print(&Done::new(&says), || println!("{says}"))
            }
            Command::Blackbox { output, release } => {
                let saved = blackbox::run(link, output, *release)?;
                self.print(&saved, || println!("{}", saved.says))
            }
            Command::Store => {
                link.version()?;
                let mode = link.health()?.mode;
                store(link, mode)?;
                let says = "configuration and weights are stored";
                self.print(&Done::new(says), || println!("{says}"))
            }
            Command::Provision { key_file, .. } => self.provision(link, key_file.as_deref()),
            Command::Update {
                file,
                older,
                no_restart,
            } => {
                let done = update::run(link, file, *older, !no_restart, &mut || self.open())?;
                self.print(&done, || println!("{}", done.says))
            }
            Command::Watch { .. } => Ok(()), // above
        }
    }

    /// The command; `None` for a simulated device.
    fn command(&self) -> Result<Option<&Command>, Error> {
        match (&self.command, self.simulation.simulate) {
            (None, true) => Ok(None),
            (Some(command), false) => Ok(Some(command)),
            (Some(_), true) => Err(refused(
                "device --simulate",
                "it runs until Ctrl-C and takes no command",
                "run it alone, and give the command to its port in another terminal",
            )),
            (None, false) => Err(refused(
                "device",
                "a command is missing",
                "give one, for example `host-sim device --port PORT info`; \
                 `host-sim device --help` lists them",
            )),
        }
    }

    fn open(&self) -> Result<Link, Error> {
        let key = self.key.as_deref().map(read_key).transpose()?;
        let port = self.port.as_deref().unwrap_or_default();
        Ok(Link::open("--port", port, self.baud)?.with_key(key))
    }

    fn provision(&self, link: &mut Link, file: Option<&Path>) -> Result<(), Error> {
        let says = match file {
            Some(file) => {
                provision(link, file)?;
                "the device has the key and has stored it; keep the file: without it only a debug \
                 probe opens the device again"
            }
            None => {
                open_by_choice(link)?;
                "the device is open by choice: anybody at its command link can change it"
            }
        };
        self.print(&Done::new(says), || println!("{says}"))
    }

    /// Prints a value as JSON, or in the words of `print`.
    fn print<T: Serialize>(&self, value: &T, print: impl FnOnce()) -> Result<(), Error> {
        if self.as_json {
            let text = serde_json::to_string_pretty(value)
                .map_err(|error| refused("--json", error.to_string(), "report it"))?;
            println!("{text}");
        } else {
            print();
        }
        Ok(())
    }

    fn show(&self, link: &mut Link) -> Result<(), Error> {
        let unit = configure::show(link)?;
        let text =
            toml::to_string(&unit).map_err(|error| link.error(error.to_string(), "report it"))?;
        self.print(&unit, || print!("{text}"))
    }

    fn mode(&self, link: &mut Link, mode: Option<Mode>) -> Result<(), Error> {
        #[derive(Serialize)]
        struct ModeReport {
            mode: &'static str,
        }
        link.version()?;
        if let Some(mode) = mode {
            link.order(&Request::SetMode(mode))?;
        }
        let mode = mode_name(link.health()?.mode);
        self.print(&ModeReport { mode }, || println!("{mode}"))
    }

    fn watch(&self, seconds: Option<u32>) -> Result<(), Error> {
        let stop = asked();
        let in_place = io::stdout().is_terminal();
        watch(&mut Watch {
            open: &mut || self.open(),
            lasts: seconds.map(|seconds| Duration::from_secs(seconds.into())),
            stop: &stop,
            report: &mut |event| {
                let text = if self.as_json {
                    serde_json::to_string(event)? + "\n"
                } else {
                    print::event(event, in_place)
                };
                stdout::print_now(&text)
            },
        })
    }
}

/// Refuses a bad file before anything is sent.
fn check_files(command: &Command) -> Result<(), Error> {
    match command {
        Command::Configure { unit, .. } => configure::of_unit(unit).map(drop),
        Command::Weights { command } => command.check_file(),
        Command::Update { file, .. } => Update::read(file).map(drop),
        _ => Ok(()),
    }
}

/// Result of a command that only prints a sentence.
#[derive(Serialize)]
struct Done<'a> {
    done: bool,
    says: &'a str,
}

impl<'a> Done<'a> {
    fn new(says: &'a str) -> Self {
        Self { done: true, says }
    }
}
