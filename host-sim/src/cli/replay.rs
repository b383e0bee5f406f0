//! `host-sim replay`.

use super::run::{Progress, finish};
use crate::error::Error;
use crate::output::write_atomic;
use crate::replay::outcome::{Outcome, table};
use crate::replay::{fog_mems, hybrid, kitti, lasergyro, load, novatel};
use clap::{Args as ClapArgs, Subcommand};
use std::path::{Path, PathBuf};

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
    /// What a NovAtel binary log holds
    Novatel(Novatel),
}

#[derive(Debug, ClapArgs)]
struct FogMems {
    /// MEMS increments at 100 Hz, axes right-forward-up
    mems: PathBuf,
    /// FOG solution at 10 Hz
    fog: PathBuf,
    /// Write the outcomes as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(Debug, ClapArgs)]
struct Kitti {
    /// Drives
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Samples to leave out at the start of each
    #[arg(long, default_value_t = 0)]
    skip: usize,
    /// Write the outcomes as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(Debug, ClapArgs)]
struct Hybrid {
    /// The laser-gyro recording at rest
    file: PathBuf,
    /// Seeds of the simulated roads
    #[arg(long, value_delimiter = ',', default_value = "1,2,3")]
    roads: Vec<u64>,
    /// Write the outcomes as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(Debug, ClapArgs)]
struct Novatel {
    /// Binary log
    file: PathBuf,
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
                let session = fog_mems::session(&args.mems, &args.fog)?;
                print(&fog_mems::replay(&session), args.json.as_deref())
            }
            What::Kitti(args) => args.run(),
            What::Hybrid(args) => {
                let outcomes = hybrid::replay(&load(&args.file)?, &args.roads);
                let outcomes = outcomes.ok_or_else(|| no_attitude(&args.file))?;
                print(&outcomes, args.json.as_deref())
            }
            What::Novatel(args) => args.run(),
        }
    }
}

fn no_attitude(file: &Path) -> Error {
    Error::Option {
        option: file.display().to_string(),
        problem: "the first part gives no attitude".into(),
        remedy: "the recording must start at rest with live accelerometers and gyros".into(),
    }
}

/// Prints outcomes as a table with their notes, and writes them.
fn print(outcomes: &[Outcome], json: Option<&Path>) -> Result<(), Error> {
    if let Some(file) = json {
        let text =
            serde_json::to_vec_pretty(outcomes).map_err(|e| Error::writing(file, e.into()))?;
        write_atomic(file, &text)?;
    }
    println!(
        "horizontal error in m, by seconds of free-inertial navigation\n\n{}",
        table(outcomes)
    );
    for outcome in outcomes {
        for note in &outcome.notes {
            println!("- {}, {}: {note}", outcome.recording, outcome.case);
        }
    }
    Ok(())
}

impl Kitti {
    fn run(&self) -> Result<(), Error> {
        let mut outcomes = Vec::new();
        for file in &self.files {
            let session = kitti::session(file, self.skip)?;
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
        print(&outcomes, self.json.as_deref())
    }
}

impl Novatel {
    fn run(&self) -> Result<(), Error> {
        let log = novatel::read(&self.file)?;
        for (number, count) in &log.messages {
            println!("message {number}: {count}");
        }
        println!(
            "damaged: {}, bytes of no message: {}",
            log.damaged, log.garbage
        );
        println!(
            "raw increments: {}, corrected increments: {}, INS solutions: {}",
            log.raw.len(),
            log.corrected.len(),
            log.ins.len()
        );
        Ok(())
    }
}

impl Lasergyro {
    fn run(&self) -> Result<(), Error> {
        let progress = Progress::new();
        progress.stage("reading the recording");
        let recording = load(&self.file)?;
        let seconds = recording.words.len() as f64 / recording.rate_hz;
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
