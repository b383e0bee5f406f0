//! `host-sim convert`.

use super::messages::{Euroc, Mcap, Messages, Ubx, Ulog};
use super::options::refused;
use super::output::{JsonOption, WrittenRecording, check_free, output_directory};
use super::progress::{self, ProgressLine};
use super::source::{Csv, KfGins, Novatel};
use clap::{Args as ClapArgs, Subcommand, ValueEnum};
use host_core::error::Error;
use host_core::words::{agrees, counted};
use host_io::recordings::record::Record;
use host_io::recordings::{generic, kfgins};
use std::path::PathBuf;

const WRITING: &str = "writing the files";

/// Arguments of `convert`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    #[command(subcommand)]
    from: From,
}

#[derive(Debug, Subcommand)]
enum From {
    /// CSV with a TOML header, as `simulate` writes it
    Csv {
        #[command(flatten)]
        source: Csv,
        #[command(flatten)]
        target: Target,
    },
    /// KF-GINS text files
    KfGins {
        #[command(flatten)]
        source: KfGins,
        #[command(flatten)]
        target: Target,
    },
    /// A NovAtel binary log
    Novatel {
        #[command(flatten)]
        source: Novatel,
        #[command(flatten)]
        target: Target,
    },
    /// A bag of ROS 2 in MCAP
    Mcap {
        #[command(flatten)]
        source: Mcap,
        #[command(flatten)]
        target: Target,
    },
    /// A log of PX4 (ULog)
    Ulog {
        #[command(flatten)]
        source: Ulog,
        #[command(flatten)]
        target: Target,
    },
    /// A log of a u-blox receiver with an IMU (UBX)
    Ubx {
        #[command(flatten)]
        source: Ubx,
        #[command(flatten)]
        target: Target,
    },
    /// A folder in the form of the EuRoC MAV dataset
    Euroc {
        #[command(flatten)]
        source: Euroc,
        #[command(flatten)]
        target: Target,
    },
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Format {
    /// imu.csv, gnss.csv, header.toml
    Csv,
    /// imu.txt, gnss.txt
    KfGins,
}

#[derive(Debug, ClapArgs)]
struct Target {
    /// Form of the output files
    #[arg(long, value_name = "FORM")]
    to: Format,
    /// Directory of the output files
    #[arg(long, value_name = "DIR", value_parser = output_directory())]
    out: PathBuf,
    /// KF-GINS: added to all times to make them seconds of the week, s
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 0.0,
        allow_hyphen_values = true
    )]
    shift: f64,
    /// KF-GINS: keep velocities, in files of 13 columns
    #[arg(long)]
    velocity: bool,
    /// Replace files that are there
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    json: JsonOption,
}

impl Args {
    /// Reads and writes.
    pub(super) fn run(&self) -> Result<(), Error> {
        let shown = progress::plan(&[(progress::READING, 3.0), (WRITING, 1.5)]);
        match &self.from {
            From::Csv { source, target } => target.write(|| source.record(), shown),
            From::KfGins { source, target } => target.write(|| source.record(), shown),
            From::Novatel { source, target } => target.write(|| source.record(), shown),
            From::Mcap { source, target } => target.write(|| source.record(None), shown),
            From::Ulog { source, target } => target.write(|| source.record(None), shown),
            From::Ubx { source, target } => target.write(|| source.record(None), shown),
            From::Euroc { source, target } => target.write(|| source.record(None), shown),
        }
    }
}

impl Target {
    fn write(
        &self,
        read: impl FnOnce() -> Result<Record, Error>,
        shown: ProgressLine,
    ) -> Result<(), Error> {
        let files: &[&str] = match self.to {
            Format::Csv => &["imu.csv", "gnss.csv", "header.toml"],
            Format::KfGins => &["imu.txt", "gnss.txt"],
        };
        if matches!(self.to, Format::Csv) {
            let given = [
                ("--shift", self.shift != 0.0),
                ("--velocity", self.velocity),
            ];
            if let Some((option, _)) = given.into_iter().find(|(_, given)| *given) {
                let problem = "is for the text of KF-GINS, and --to is csv";
                return Err(refused(
                    option,
                    problem,
                    "leave it out, or give --to kf-gins",
                ));
            }
        }
        check_free(&self.out, files, self.force)?;
        let record = read()?;
        progress::stage(WRITING);
        let mut notes = record.notes.clone();
        let all = record.fixes.len();
        let mut written = all;
        match self.to {
            Format::Csv => generic::write(&record, None, &self.out)?,
            Format::KfGins => {
                let form = kfgins::Form {
                    shift_s: self.shift,
                    velocity: self.velocity,
                };
                let [imu, gnss] = ["imu.txt", "gnss.txt"].map(|name| self.out.join(name));
                written = kfgins::write(&record, form, &imu, &gnss)?;
                notes.extend(self.lost(&record, written));
            }
        }
        let outside = record.fixes_outside();
        if outside > 0 {
            notes.push(format!(
                "{outside} of {} {} outside the time of the samples.",
                counted(all, "fix"),
                agrees(outside, "is", "are")
            ));
        }
        let of = WrittenRecording::of(&self.out, files, &record, written, &notes);
        self.json.write(&of)?;
        drop(shown);
        for note in &notes {
            println!("- {note}");
        }
        println!(
            "{}, {} in {}",
            counted(of.samples, "sample"),
            counted(written, "fix"),
            self.out.display()
        );
        Ok(())
    }

    /// Notes on what the text of KF-GINS does not hold.
    fn lost(&self, record: &Record, written: usize) -> Vec<String> {
        let mut notes = Vec::new();
        let has_velocity = record.fixes.iter().any(|fix| fix.has(3..6));
        if has_velocity && !self.velocity {
            notes.push("velocities are left out; --velocity keeps them in 13 columns".to_owned());
        }
        let all = record.fixes.len();
        if written < all {
            let lacking = if self.velocity {
                "height or velocity"
            } else {
                "height"
            };
            notes.push(format!(
                "{} of {} {} position, {lacking} or a standard deviation of them: left out, \
                 because the text has no empty cells; --to csv keeps them",
                all - written,
                counted(all, "fix"),
                agrees(all - written, "lacks", "lack")
            ));
        }
        notes
    }
}
