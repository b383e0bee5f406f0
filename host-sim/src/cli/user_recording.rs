//! `host-sim replay` of a user's recording: csv, kf-gins, novatel, and recordings of
//! messages.

use super::corrected::CorrectedOptions;
use super::options::{UnitOption, refused};
use super::output::Output;
use super::progress::{self, ProgressLine, READING, WRITING};
use super::record_options::RecordOptions;
use super::replay::REPLAYING;
use super::source::Novatel;
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_core::inertial::units::DEG;
use host_estimation::analysis::doubts::Warning;
use host_io::recordings::novatel;
use host_lab::experiment::outcome::Outcome;
use host_lab::experiment::user_recording::{self, Step, Wanted, replay};
use host_reading::{Loaded, Source};
use host_unit::Unit;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

const STARTING: &str = "finding the attitude";
/// Seconds of each stage of a CSV of 50 MB with 430 000 samples, on two busy cores.
pub(super) const STAGES: [(&str, f64); 4] = [
    (READING, 3.0),
    (STARTING, 1.0),
    (REPLAYING, 1.4),
    (WRITING, 0.6),
];

/// Where navigation without fixes starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum StartFrom {
    /// All rows from one state, which no row's corrections shape
    Common,
    /// Each row from the state of its own aided navigator
    Own,
}

/// Assumptions on the sensors, and the part to learn from.
#[derive(Debug, ClapArgs)]
pub(super) struct Options {
    /// Seconds from the start to learn from, standstill included [default: the standstill and half
    /// of the rest]
    #[arg(long, value_name = "SECONDS")]
    learn_s: Option<usize>,
    #[command(flatten)]
    unit: UnitOption,
    /// Stop if the samples contradict their description, instead of a warning
    #[arg(long)]
    strict: bool,
    /// Standard deviations of a given attitude, deg
    #[arg(
        long,
        value_name = "TILT,HEADING",
        value_delimiter = ',',
        default_value = "0.1,0.5"
    )]
    attitude_sigma: Vec<f64>,
    #[command(flatten)]
    recording: RecordOptions,
    /// Use only this part of a recording with long gaps of samples, counted from 1 [default: all,
    /// each aligned by itself]
    #[arg(long, value_name = "NUMBER")]
    part: Option<usize>,
    /// State from which navigation without fixes starts
    #[arg(long, value_enum, default_value_t = StartFrom::Common, value_name = "WHICH")]
    start: StartFrom,
    #[command(flatten)]
    corrected: CorrectedOptions,
    #[command(flatten)]
    output: Output,
}

/// `replay` of a recording of one form.
#[derive(Debug, ClapArgs)]
pub(super) struct RecordingArgs<S: Source> {
    #[command(flatten)]
    source: S,
    #[command(flatten)]
    pub(super) options: Options,
}

/// `replay novatel`.
#[derive(Debug, ClapArgs)]
pub(super) struct NovatelArgs {
    #[command(flatten)]
    source: Novatel,
    /// Only list what the log contains
    #[arg(long)]
    inventory: bool,
    #[command(flatten)]
    pub(super) options: Options,
}

impl<S: Source> RecordingArgs<S> {
    pub(super) fn load(&self) -> Result<Loaded, Error> {
        self.source.load(self.options.unit.load()?.as_ref())
    }

    pub(super) fn run(&self) -> Result<(), Error> {
        let shown = progress::plan(&STAGES);
        self.options.replay(self.load()?, shown)
    }
}

impl NovatelArgs {
    pub(super) fn load(&self) -> Result<Loaded, Error> {
        self.source.load(None)
    }

    pub(super) fn run(&self) -> Result<(), Error> {
        let shown = progress::plan(&STAGES);
        let log = novatel::read(&self.source.file)?;
        drop(shown);
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
        if self.inventory {
            return self.options.output.json.write(&Inventory::of(&log));
        }
        let shown = progress::plan(&STAGES);
        self.options.replay(self.source.loaded(&log)?, shown)
    }
}

/// Content of a log, for `--json`.
#[derive(Debug, Serialize)]
struct Inventory<'a> {
    /// Good messages by number.
    messages: &'a BTreeMap<u16, usize>,
    damaged: usize,
    bytes_of_no_message: usize,
    raw_increments: usize,
    corrected_increments: usize,
    ins_solutions: usize,
}

impl<'a> Inventory<'a> {
    fn of(log: &'a novatel::Recording) -> Self {
        Self {
            messages: &log.messages,
            damaged: log.damaged,
            bytes_of_no_message: log.garbage,
            raw_increments: log.raw.len(),
            corrected_increments: log.corrected.len(),
            ins_solutions: log.ins.len(),
        }
    }
}

impl Options {
    fn replay(&self, loaded: Loaded, shown: ProgressLine) -> Result<(), Error> {
        let name = loaded.name;
        let outcome = self.judge(loaded)?;
        self.output.leave_outcomes(name, &[outcome], shown)
    }

    /// Learns from one part and judges the other.
    pub(super) fn judge(&self, loaded: Loaded) -> Result<Outcome, Error> {
        let Loaded {
            name,
            mut record,
            says,
            named,
            original,
        } = loaded;
        let corrected = self.corrected.target(original, &record)?;
        let unit = self.unit.load()?.or(named);
        self.recording
            .apply(&mut record, unit.as_ref().unwrap_or(&Unit::default()))?;
        if unit.is_none() {
            progress::say(&format!(
                "{name}: no unit is given, so the sensors count as those of 'medium'; remedy: \
                 --unit FILE.toml"
            ));
        }
        let wanted = Wanted {
            form: name,
            unit,
            learn_s: self.learn_s,
            estimate_time_offset: self.recording.estimate_time_offset,
            attitude_sigma: self.attitude_sigma()?,
            part: self.part,
            own_start: self.start == StartFrom::Own,
            corrected_by: corrected
                .as_ref()
                .and(self.corrected.scheme())
                .map(str::to_owned),
            option: |name| format!("--{name}"),
        };
        let done = replay(record, &says, &wanted, &mut |step| {
            match step {
                Step::Examined(warnings) => self.warn(warnings)?,
                Step::Starting => progress::stage(STARTING),
                Step::Replaying => progress::stage(REPLAYING),
            }
            Ok(())
        })?;
        let mut outcome = done.outcome;
        if let Some((target, record)) = corrected.zip(done.record) {
            let note = target.write(&record, &done.correction, done.begin)?;
            outcome.notes.push(note);
        }
        Ok(outcome)
    }

    /// Prints warnings where the samples contradict their description.
    fn warn(&self, warnings: &[Warning]) -> Result<(), Error> {
        for warning in warnings {
            progress::say(&warning.to_string());
        }
        if self.strict && !warnings.is_empty() {
            let problem = format!("was given, and there are {} warnings", warnings.len());
            let remedy = "see the remedies above, or leave the option out";
            return Err(refused("--strict", problem, remedy));
        }
        Ok(())
    }

    fn attitude_sigma(&self) -> Result<[f64; 2], Error> {
        match self.attitude_sigma[..] {
            [tilt, heading] if [tilt, heading].iter().all(|s| *s > 0.0 && *s <= 90.0) => {
                Ok([tilt * DEG, heading * DEG])
            }
            _ => Err(refused(
                "--attitude-sigma",
                format!("is {:?}", self.attitude_sigma),
                "give tilt,heading in degrees, above 0 and at most 90",
            )),
        }
    }
}

/// The error of a recording without a usable standstill.
pub(super) fn no_attitude(file: &Path) -> Error {
    let (problem, remedy) = user_recording::no_attitude();
    refused(file.display().to_string(), problem, remedy)
}
