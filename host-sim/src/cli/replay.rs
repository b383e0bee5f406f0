//! `host-sim replay`.

use super::run::{Progress, finish};
use crate::error::Error;
use crate::replay::{lasergyro, load};
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
        }
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
            lasergyro::replay(&recording, self.learn_s).ok_or_else(|| Error::Option {
                option: self.file.display().to_string(),
                problem: "the first part gives no attitude".into(),
                remedy: "the recording must start at rest with live accelerometers and gyros"
                    .into(),
            })?;
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
