//! Fixes from a file beside the recording of an IMU, on the command line.

use crate::progress;
use clap::{Args as ClapArgs, ValueEnum};
use firmware::wire::receiver::ReceiverFormat;
use host_core::error::Error;
use host_core::words::counted;
use host_io::recordings::record::Record;
use host_io::recordings::{Progress, gpsd, receiver, rtklib};
use indicatif::ProgressBar;
use std::path::{Path, PathBuf};

/// A progress bar for reading a file.
pub(crate) fn reading_bar() -> ProgressBar {
    progress::bar(0, "{bar:40} {bytes} of {total_bytes}, {eta} left")
}

/// Fixes of a receiver beside the IMU.
#[derive(Debug, ClapArgs)]
#[group(skip)] // several sources have it
pub struct Beside {
    /// Log of a receiver (UBX, NMEA, NovAtel or SBF), reports of gpsd (lines of JSON), or solutions
    /// of RTKLIB (.pos), whose fixes replace those of the recording
    #[arg(long, value_name = "FILE")]
    fixes: Option<PathBuf>,
    /// Protocol of that log; of NMEA also sentences without a checksum are read then [default: that
    /// with the better fixes]
    #[arg(long, value_name = "PROTOCOL", requires = "fixes")]
    fixes_protocol: Option<Protocol>,
}

/// Protocol of a receiver, by the names of the unit file.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Protocol {
    Ubx,
    Nmea,
    Novatel,
    Sbf,
}

impl From<Protocol> for ReceiverFormat {
    fn from(protocol: Protocol) -> Self {
        match protocol {
            Protocol::Ubx => Self::Ubx,
            Protocol::Nmea => Self::Nmea,
            Protocol::Novatel => Self::Novatel,
            Protocol::Sbf => Self::Sbf,
        }
    }
}

impl Beside {
    /// Whether fixes are given.
    pub(crate) fn is_given(&self) -> bool {
        self.fixes.is_some()
    }

    /// Replaces the fixes if others are given. `origin_s` is UTC at time 0 of the recording.
    pub(crate) fn replace(&self, record: &mut Record, origin_s: Option<f64>) -> Result<(), Error> {
        let Some(file) = &self.fixes else {
            return Ok(());
        };
        let bar = reading_bar();
        let shown = |read, length| {
            bar.set_length(length);
            bar.set_position(read);
        };
        let read = self.read(file, &shown, record, origin_s);
        bar.finish_and_clear();
        let (name, notes) = read?;
        let times = record.fixes.first().zip(record.fixes.last());
        let (from, to) = times.map_or((0.0, 0.0), |(a, b)| (a.time, b.time));
        let ends = record.time.start().zip(record.time.end());
        let step = 1.0 / record.rate_hz.max(1) as f64;
        let among = |time: f64| {
            ends.is_some_and(|(start, end)| (start - step..=end + step).contains(&time))
        };
        let outside = record.fixes.iter().filter(|fix| !among(fix.time)).count();
        let beyond = match outside {
            0 => String::new(),
            count => format!("; {count} of them before or after the samples"),
        };
        let count = record.fixes.len();
        let file = file.display();
        progress::say(&format!(
            "{file}: {} ({name}) from {from:.3} to {to:.3} s on the IMU's clock{beyond}",
            counted(count, "fix")
        ));
        for note in notes {
            progress::say(&format!("{file}: {note}"));
        }
        Ok(())
    }

    /// Reads the fixes into the recording. Returns the name of their form, and notes.
    fn read(
        &self,
        file: &Path,
        shown: Progress<'_>,
        record: &mut Record,
        origin_s: Option<f64>,
    ) -> Result<(&'static str, Vec<String>), Error> {
        let given = self.fixes_protocol.map(ReceiverFormat::from);
        if rtklib::is_one(file) {
            rtklib::read(file)?.beside(record, origin_s);
            return Ok(("RTKLIB", Vec::new()));
        }
        let reports = given.is_none() && gpsd::is_one(file);
        let reports = reports.then(|| gpsd::read(file, shown));
        let mut log = match reports {
            Some(Ok(reports)) => {
                reports.beside(record, origin_s);
                return Ok(("gpsd", Vec::new()));
            }
            // `gpspipe -r`: the sentences of the receiver behind a few lines of JSON
            Some(Err(none)) => receiver::read(file, given, shown).map_err(|_| none)?,
            None => receiver::read(file, given, shown)?,
        };
        let notes = std::mem::take(&mut log.notes);
        let name = receiver::name(log.format);
        log.beside(record, origin_s);
        Ok((name, notes))
    }
}
