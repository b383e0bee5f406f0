//! Standard output. What the commands print with `print!` and `println!` goes through here.
//!
//! A reader may close the pipe (`host-sim campaign | head`): what is printed then is dropped. If
//! standard output cannot be written for another reason, the rest is dropped too and the command
//! goes on until its files are written, but the program ends with that error.

use clap::{Command, Parser};
use host_core::error::Error;
use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write, stderr};
use std::path::Path;
use std::process::ExitCode;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The first failure.
static FAILED: Mutex<Option<io::Error>> = Mutex::new(None);

/// Replaces the macro of the standard library, which panics.
macro_rules! print {
    ($($text:tt)*) => { $crate::cli::stdout::print(format_args!($($text)*)) };
}

/// Replaces the macro of the standard library, which panics.
macro_rules! println {
    () => { print!("\n") };
    ($($text:tt)*) => { print!("{}\n", format_args!($($text)*)) };
}

/// Columns that a table may have: those that `COLUMNS` gives, else those of the terminal. A file or
/// a pipe has no limit.
pub(super) fn width() -> usize {
    let given = std::env::var("COLUMNS")
        .ok()
        .and_then(|text| text.parse().ok());
    let terminal = || Some(usize::from(console::Term::stdout().size_checked()?.1));
    given
        .filter(|columns| *columns >= 20)
        .or_else(terminal)
        .unwrap_or(usize::MAX)
}

fn failed() -> MutexGuard<'static, Option<io::Error>> {
    FAILED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Stores the first failure.
fn keep(written: io::Result<()>) -> io::Result<()> {
    written.map_err(|error| {
        let kind = error.kind();
        if kind != ErrorKind::BrokenPipe {
            failed().get_or_insert(error);
        }
        kind.into()
    })
}

/// Prints, unless that has failed before.
pub fn print(text: Arguments<'_>) {
    if failed().is_none() {
        let _ = keep(anstream::stdout().write_fmt(text)); // the first failure is stored
    }
}

/// Prints at once, without buffering or conversion.
///
/// # Errors
/// The reader is gone, or standard output cannot be written; then a program that only prints may
/// end.
pub(super) fn print_now(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    keep(out.write_all(text.as_bytes()).and_then(|()| out.flush()))
}

/// Asks the system whether standard output can be written. The standard library treats a descriptor
/// that cannot be written as missing, and drops the output.
#[cfg(unix)]
fn open() -> io::Result<()> {
    use std::os::fd::AsFd;
    let own = io::stdout().as_fd().try_clone_to_owned()?;
    std::fs::File::from(own).write(&[]).map(drop)
}

#[cfg(not(unix))]
fn open() -> io::Result<()> {
    Ok(())
}

/// Writes the output that is still buffered.
///
/// # Errors
/// Something printed could not be written.
pub fn finish() -> Result<(), Error> {
    let _ = keep(io::stdout().flush().and_then(|()| open())); // the first failure is stored
    let failed = failed().take();
    failed.map_or(Ok(()), |source| {
        Err(Error::writing(Path::new("standard output"), source))
    })
}

/// The arguments of a program. `None`: help or version was asked for, and is printed. Wrong
/// arguments end the program.
#[must_use]
pub fn given<P: Parser>(definition: Command) -> Option<P> {
    let matches = definition.try_get_matches();
    match matches.and_then(|mut matches| P::from_arg_matches_mut(&mut matches)) {
        Ok(given) => Some(given),
        Err(wrong) if wrong.use_stderr() => wrong.exit(),
        Err(asked) => {
            let _ = keep(asked.print()); // the first failure is stored
            None
        }
    }
}

/// Ends the program of this name: writes the errors to standard error, one a line. The first gives
/// the exit code.
#[must_use]
pub fn ended(name: &str, done: Result<(), Error>) -> ExitCode {
    let errors = [done.err(), finish().err()];
    for error in errors.iter().flatten() {
        let _ = writeln!(stderr(), "{name}: {error}"); // nobody may be reading
    }
    let first = errors.iter().flatten().next();
    first.map_or(ExitCode::SUCCESS, |error| ExitCode::from(error.code()))
}
