//! `host-sim replay`.

use super::outcomes::{Output, no_attitude};
use super::own::{CsvArgs, KfGinsArgs, NovatelArgs};
use super::run::{Progress, finish};
use crate::error::Error;
use crate::experiment::{fog_mems, hybrid, kitti, lasergyro};
use crate::recordings::{self, load};
use clap::{Args as ClapArgs, Subcommand};
use std::path::PathBuf;

/// Arguments of `replay`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// The real laser-gyro recording at rest (CSV of pulses, may be gzipped)
    Lasergyro(Lasergyro),
    /// Raw MEMS beside a FOG navigator on one vehicle: learnt on one part, judged on the other, and the other way round
    FogMems(FogMems),
    /// Road drives beside an OXTS navigator: both halves in both roles
    Kitti(Kitti),
    /// The measured error of the laser-gyro recording added to simulated drives
    Hybrid(Hybrid),
    /// Your own recording as CSV, with a TOML header that says what its columns mean
    Csv(CsvArgs),
    /// Your own recording in the text form of KF-GINS
    KfGins(KfGinsArgs),
    /// Your own recording as a NovAtel binary log
    Novatel(NovatelArgs),
}

#[derive(Debug, ClapArgs)]
struct FogMems {
    /// MEMS increments at 100 Hz, axes right-forward-up
    mems: PathBuf,
    /// FOG solution at 10 Hz
    fog: PathBuf,
    #[command(flatten)]
    output: Output,
}

#[derive(Debug, ClapArgs)]
struct Kitti {
    /// Drives
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Samples to leave out at the start of each
    #[arg(long, default_value_t = 0)]
    skip: usize,
    #[command(flatten)]
    output: Output,
}

#[derive(Debug, ClapArgs)]
struct Hybrid {
    /// The laser-gyro recording at rest
    file: PathBuf,
    /// Seeds of the simulated roads
    #[arg(long, value_delimiter = ',', default_value = "1,2,3")]
    roads: Vec<u64>,
    #[command(flatten)]
    output: Output,
}

#[derive(Debug, ClapArgs)]
struct Lasergyro {
    /// Recording: gyro_x_pulses ... accel_z_pulses at 100 Hz, axes right-forward-up
    file: PathBuf,
    /// Seconds at the start to align on and to learn from
    #[arg(long, default_value_t = 480, value_name = "SECONDS")]
    learn_s: u32,
    /// Write the table as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Directory of the report
    #[arg(long, value_name = "DIR", default_value = "out/replay-lasergyro")]
    out: PathBuf,
}

impl Args {
    /// Replays what was asked for.
    pub(super) fn run(&self) -> Result<(), Error> {
        match &self.what {
            What::Lasergyro(args) => args.run(),
            What::FogMems(args) => {
                let session = recordings::fog_mems::session(&args.mems, &args.fog)?;
                args.output.print("fog-mems", &fog_mems::replay(&session))
            }
            What::Kitti(args) => args.run(),
            What::Hybrid(args) => {
                let outcomes = hybrid::replay(&load(&args.file)?, &args.roads);
                let outcomes = outcomes.ok_or_else(|| no_attitude(&args.file))?;
                args.output.print("hybrid", &outcomes)
            }
            What::Csv(args) => args.run(),
            What::KfGins(args) => args.run(),
            What::Novatel(args) => args.run(),
        }
    }
}

impl Kitti {
    fn run(&self) -> Result<(), Error> {
        let mut outcomes = Vec::new();
        for file in &self.files {
            let session = recordings::kitti::session(file, self.skip)?;
            let name = file
                .file_name()
                .map_or_else(String::new, |n| n.to_string_lossy().into_owned());
            outcomes.extend(kitti::replay(
                name.trim_start_matches("kitti-")
                    .split('.')
                    .next()
                    .unwrap_or("drive"),
                &session,
            ));
        }
        self.output.print("kitti", &outcomes)
    }
}

impl Lasergyro {
    fn run(&self) -> Result<(), Error> {
        let progress = Progress::new();
        progress.stage("reading the recording");
        let recording = load(&self.file)?;
        let seconds = recording.pulses.len() as f64 / recording.rate_hz;
        let longest = (seconds - 300.0).max(0.0) as u32;
        if !(lasergyro::LEAST_LEARN_S..=longest).contains(&self.learn_s) {
            return Err(Error::Option {
                option: "--learn-s".into(),
                problem: format!("{} s of a recording of {seconds:.0} s", self.learn_s),
                remedy: format!(
                    "give {} to {longest}; at least 300 s must be left to judge on",
                    lasergyro::LEAST_LEARN_S
                ),
            });
        }
        progress.stage("aligning, learning, navigating");
        let mut report =
            lasergyro::replay(&recording, self.learn_s).ok_or_else(|| no_attitude(&self.file))?;
        let command = format!(
            "cargo run --release -- replay lasergyro {} --learn-s {}",
            self.file.display(),
            self.learn_s
        );
        report.set_up.push(("command".into(), command));
        progress.stage("writing the report");
        let done = finish(&report, &self.out, self.json.as_deref());
        progress.end();
        done
    }
}
