//! Fixes from a file beside the recording of an IMU, on the command line.

use super::progress;
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_io::recordings::record::Record;
use host_io::recordings::{receiver, rtklib};
use indicatif::ProgressBar;
use std::path::PathBuf;

/// A progress bar for reading a file.
pub(super) fn reading_bar() -> ProgressBar {
    progress::bar(0, "{bar:40} {bytes} of {total_bytes}, {eta} left")
}

/// Fixes of a receiver beside the IMU.
#[derive(Debug, ClapArgs)]
#[group(skip)] // several sources have it
pub(super) struct Beside {
    /// Log of a receiver (UBX, NMEA, NovAtel or SBF), or solutions of RTKLIB (.pos), whose fixes
    /// replace those of the recording
    #[arg(long, value_name = "FILE")]
    fixes: Option<PathBuf>,
}

impl Beside {
    /// Whether fixes are given.
    pub(super) fn is_given(&self) -> bool {
        self.fixes.is_some()
    }

    /// Replaces the fixes if others are given. `origin_s` is UTC at time 0 of the recording.
    pub(super) fn replace(&self, record: &mut Record, origin_s: Option<f64>) -> Result<(), Error> {
        let Some(file) = &self.fixes else {
            return Ok(());
        };
        if rtklib::is_one(file) {
            let solutions = rtklib::read(file)?;
            let count = solutions.fixes.len();
            solutions.beside(record, origin_s);
            progress::say(&format!("{}: {count} fixes (RTKLIB)", file.display()));
            return Ok(());
        }
        let bar = reading_bar();
        let log = receiver::read(file, &|read, length| {
            bar.set_length(length);
            bar.set_position(read);
        });
        bar.finish_and_clear();
        let log = log?;
        let (count, format) = (log.fixes.len(), log.format);
        log.beside(record, origin_s);
        let times = record.fixes.first().zip(record.fixes.last());
        let (from, to) = times.map_or((0.0, 0.0), |(a, b)| (a.time, b.time));
        progress::say(&format!(
            "{}: {count} fixes ({format:?}) from {from:.3} to {to:.3} s on the IMU's clock",
            file.display()
        ));
        Ok(())
    }
}
