//! `host-sim replay`.

use super::blackbox::Blackbox;
use super::messages::{Euroc, Mcap, Ubx, Ulog};
use super::options::{UnitOption, refused};
use super::output::Output;
use super::progress;
use super::sessions::Sessions;
use super::source::{Csv, KfGins};
use super::user_recording::{NovatelArgs, RecordingArgs, no_attitude};
use clap::{Args as ClapArgs, Subcommand};
use host_core::error::Error;
use host_core::inertial::session::Session;
use host_io::recordings::{self, load};
use host_lab::experiment::outcome::Outcome;
use host_lab::experiment::results::Report;
use host_lab::experiment::{fog_mems, hybrid, kitti, lasergyro};
use std::path::PathBuf;

/// The stage of a replay that takes longest.
pub(super) const REPLAYING: &str = "aligning, learning, navigating";
/// The stages of several drives.
const DRIVES: [&str; 5] = ["drive 1", "drive 2", "drive 3", "drive 4", "further drives"];

/// Arguments of `replay`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    #[command(subcommand)]
    pub(super) what: Source,
}

#[derive(Debug, Subcommand)]
pub(super) enum Source {
    /// The real laser-gyro recording at rest (CSV of pulses, plain or gzipped)
    Lasergyro(Lasergyro),
    /// Raw MEMS beside a fibre-optic navigator on one vehicle, each part once in each role
    FogMems(FogMems),
    /// Road drives beside an OXTS navigator, each half once in each role
    Kitti(Kitti),
    /// The measured error of the laser-gyro recording added to simulated drives
    Hybrid(Hybrid),
    /// Your recording as CSV, with a TOML header that says what its columns mean
    Csv(RecordingArgs<Csv>),
    /// Your recording in the text form of KF-GINS
    KfGins(RecordingArgs<KfGins>),
    /// Your recording as a NovAtel binary log
    Novatel(NovatelArgs),
    /// Your recording as a bag of ROS 2 in MCAP
    Mcap(RecordingArgs<Mcap>),
    /// Your recording as a log of PX4 (ULog)
    Ulog(RecordingArgs<Ulog>),
    /// Your recording as a log of a u-blox receiver with an IMU (UBX)
    Ubx(RecordingArgs<Ubx>),
    /// Your recording as a folder in the form of the EuRoC MAV dataset
    Euroc(RecordingArgs<Euroc>),
    /// Several sessions of one unit, each from power-on to power-off, with what is remembered
    Sessions(Sessions),
    /// The black box of a device, against the same application here
    Blackbox(Blackbox),
}

#[derive(Debug, ClapArgs)]
pub(super) struct FogMems {
    /// MEMS increments at 100 Hz, axes right-forward-up
    pub(super) mems: PathBuf,
    /// Solution of the fibre-optic navigator at 10 Hz
    pub(super) fog: PathBuf,
    #[command(flatten)]
    unit: UnitOption,
    #[command(flatten)]
    output: Output,
}

#[derive(Debug, ClapArgs)]
pub(super) struct Kitti {
    /// Files of the drives
    #[arg(required = true)]
    pub(super) files: Vec<PathBuf>,
    /// Samples to leave out at the start of each drive
    #[arg(long, default_value_t = 0)]
    pub(super) skip: usize,
    #[command(flatten)]
    pub(super) unit: UnitOption,
    #[command(flatten)]
    output: Output,
}

#[derive(Debug, ClapArgs)]
pub(super) struct Hybrid {
    /// The laser-gyro recording at rest
    file: PathBuf,
    /// Seeds of the simulated roads
    #[arg(long, value_delimiter = ',', default_value = "1,2,3")]
    roads: Vec<u64>,
    #[command(flatten)]
    unit: UnitOption,
    #[command(flatten)]
    output: Output,
}

#[derive(Debug, ClapArgs)]
pub(super) struct Lasergyro {
    /// Recording: gyro_x_pulses ... accel_z_pulses at 100 Hz, axes right-forward-up
    pub(super) file: PathBuf,
    /// Seconds at the start to align on and to learn from
    #[arg(long, default_value_t = 480, value_name = "SECONDS")]
    learn_s: u32,
    #[command(flatten)]
    unit: UnitOption,
    #[command(flatten)]
    output: Output,
}

impl Args {
    /// Replays the recording.
    pub(super) fn run(&self) -> Result<(), Error> {
        match &self.what {
            Source::Lasergyro(args) => args.run(),
            Source::FogMems(args) => {
                let shown = progress::plan(&[(REPLAYING, 2.3), (progress::WRITING, 0.7)]);
                let (_, outcomes) = args.outcomes()?;
                args.output.leave_outcomes("fog-mems", &outcomes, shown)
            }
            Source::Kitti(args) => args.run(),
            Source::Hybrid(args) => {
                let roads = args.roads.len() as f64;
                let stages = [
                    (progress::READING, 0.4),
                    (REPLAYING, 1.2 * roads),
                    (progress::WRITING, 0.2 * roads),
                ];
                let shown = progress::plan(&stages);
                let outcomes = {
                    let unit = args.unit.load_or(lasergyro::UNIT)?;
                    let recording = load(&args.file)?;
                    progress::stage(REPLAYING);
                    hybrid::replay(&recording, &args.roads, &unit)?
                };
                let outcomes = outcomes.ok_or_else(|| no_attitude(&args.file))?;
                args.output.leave_outcomes("hybrid", &outcomes, shown)
            }
            Source::Csv(args) => args.run(),
            Source::KfGins(args) => args.run(),
            Source::Novatel(args) => args.run(),
            Source::Mcap(args) => args.run(),
            Source::Ulog(args) => args.run(),
            Source::Ubx(args) => args.run(),
            Source::Euroc(args) => args.run(),
            Source::Sessions(args) => args.run(),
            Source::Blackbox(args) => args.run(),
        }
    }
}

impl FogMems {
    /// The recording and its outcomes.
    pub(super) fn outcomes(&self) -> Result<(Session, Vec<Outcome>), Error> {
        let unit = self.unit.load_or(fog_mems::UNIT)?;
        let session = recordings::fog_mems::session(&self.mems, &self.fog)?;
        let outcomes = fog_mems::replay(&session, &unit)?;
        Ok((session, outcomes))
    }
}

impl Kitti {
    fn run(&self) -> Result<(), Error> {
        // the stages that have names of their own; the last one stands for all others
        let drives = DRIVES.map(|name| (name, 0.8));
        let known = &drives[..self.files.len().min(DRIVES.len())];
        let stages = [known, &[(progress::WRITING, 0.2 * self.files.len() as f64)]].concat();
        let shown = progress::plan(&stages);
        let drives = self.outcomes()?;
        let outcomes: Vec<Outcome> = drives.into_iter().flat_map(|(_, of)| of).collect();
        self.output.leave_outcomes("kitti", &outcomes, shown)
    }

    /// Each drive and its outcomes.
    pub(super) fn outcomes(&self) -> Result<Vec<(Session, Vec<Outcome>)>, Error> {
        let unit = self.unit.load_or(kitti::UNIT)?;
        let drive = |(k, file): (usize, &PathBuf)| {
            progress::stage(DRIVES[k.min(DRIVES.len() - 1)]);
            let session = recordings::kitti::session(file, self.skip)?;
            let name = file
                .file_name()
                .map_or_else(String::new, |n| n.to_string_lossy().into_owned());
            let name = name.trim_start_matches("kitti-");
            let name = name.split('.').next().unwrap_or("drive");
            let outcomes = kitti::replay(name, &session, &unit)?;
            Ok((session, outcomes))
        };
        self.files.iter().enumerate().map(drive).collect()
    }
}

impl Lasergyro {
    fn run(&self) -> Result<(), Error> {
        let stages = [
            (progress::READING, 0.4),
            (REPLAYING, 0.8),
            (progress::WRITING, 0.4),
        ];
        let shown = progress::plan(&stages);
        let report = self.report()?;
        self.output.leave_report("replay-lasergyro", &report, shown)
    }

    /// The report of the recording.
    pub(super) fn report(&self) -> Result<Report, Error> {
        let unit = self.unit.load_or(lasergyro::UNIT)?;
        progress::stage(progress::READING);
        let recording = load(&self.file)?;
        let seconds = recording.pulses.len() as f64 / recording.rate_hz;
        let longest = (seconds - 300.0).max(0.0) as u32;
        if !(lasergyro::LEAST_LEARN_S..=longest).contains(&self.learn_s) {
            return Err(refused(
                "--learn-s",
                format!("{} s of a recording of {seconds:.0} s", self.learn_s),
                format!(
                    "give {} to {longest}; at least 300 s must be left to judge on",
                    lasergyro::LEAST_LEARN_S
                ),
            ));
        }
        progress::stage(REPLAYING);
        let report = lasergyro::replay(&recording, self.learn_s, &unit)?;
        let mut report = report.ok_or_else(|| no_attitude(&self.file))?;
        let unit = self.unit.unit.as_ref();
        let command = format!(
            "cargo run --release -- replay lasergyro {} --learn-s {}{}",
            self.file.display(),
            self.learn_s,
            unit.map_or(String::new(), |name| format!(" --unit {name}"))
        );
        report.set_up.push(("command".into(), command));
        Ok(report)
    }
}
