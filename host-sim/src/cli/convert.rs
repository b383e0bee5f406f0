//! `host-sim convert`.

use super::messages::{Euroc, Mcap, Messages, Ubx, Ulog};
use super::progress::{self, Shown};
use super::source::{Csv, KfGins, Novatel};
use clap::{Args as ClapArgs, Subcommand, ValueEnum};
use host_core::error::Error;
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
    #[arg(long, value_name = "DIR")]
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
}

impl Args {
    /// Reads and writes.
    pub(super) fn run(&self) -> Result<(), Error> {
        let shown = progress::plan(&[(progress::READING, 3.0), (WRITING, 1.5)]);
        match &self.from {
            From::Csv { source, target } => target.write(&source.record()?, shown),
            From::KfGins { source, target } => target.write(&source.record()?, shown),
            From::Novatel { source, target } => target.write(&source.record()?, shown),
            From::Mcap { source, target } => target.write(&source.record(None)?, shown),
            From::Ulog { source, target } => target.write(&source.record(None)?, shown),
            From::Ubx { source, target } => target.write(&source.record(None)?, shown),
            From::Euroc { source, target } => target.write(&source.record(None)?, shown),
        }
    }
}

impl Target {
    fn write(&self, record: &Record, shown: Shown) -> Result<(), Error> {
        progress::stage(WRITING);
        let mut note = None;
        match self.to {
            Format::Csv => generic::write(record, None, &self.out)?,
            Format::KfGins => {
                let form = kfgins::Form {
                    shift_s: self.shift,
                    velocity: self.velocity,
                };
                let [imu, gnss] = ["imu.txt", "gnss.txt"].map(|name| self.out.join(name));
                kfgins::write(record, form, &imu, &gnss)?;
                if record.has_velocity() && !self.velocity {
                    note = Some("- velocities are left out; --velocity keeps them in 13 columns");
                }
            }
        }
        drop(shown);
        if let Some(note) = note {
            println!("{note}");
        }
        println!(
            "{} samples, {} fixes in {}",
            record.samples.len(),
            record.fixes.len(),
            self.out.display()
        );
        Ok(())
    }
}
