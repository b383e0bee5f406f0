//! `host-sim report`.

mod device;
mod files;
mod input;
mod print;
pub(super) mod rest;

use super::options::{arguments, refused};
use super::output::{JsonOption, output_directory, output_file};
use super::progress::{self, WRITING};
use super::user_recording::STAGES;
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_core::simulator::gnss::GnssSpec;
use host_estimation::analysis::allan::findings::Findings;
use host_estimation::analysis::learnability::{Answer, Question, answer};
use host_reading::form::{self, Form};
use host_report::unit::{Contents, PartResult, Report};
use host_unit::Unit;
use input::ReportInput;
use std::path::PathBuf;

const NOISE: &str = "noise at rest";
const LEARNABLE: &str = "what can be learnt";

/// Longest drive whose bound is computed, min.
const LONGEST_MIN: u32 = 120;
/// Drive whose bound is computed where nothing was learnt from, min.
const USUAL_MIN: u32 = 30;

/// Arguments of `report`.
#[derive(Debug, ClapArgs)]
#[command(after_help = "Examples:
  host-sim report --unit unit.toml --from data/header.toml
  host-sim report --unit unit.toml --from drive.mcap -- --imu-topic /imu --standstill-s 120
  host-sim report --unit unit.toml --from imu.txt gnss.txt -- --standstill-s 120
  host-sim report --unit unit.toml --from device:/dev/ttyUSB0")]
pub struct Args {
    /// Unit: a unit file or a preset's name [default: that of the recording or of the device]
    #[arg(long, value_name = "NAME|FILE.toml")]
    unit: Option<String>,
    /// What to report on: a recording (a CSV header, KF-GINS text as IMU and fixes, a NovAtel or
    /// u-blox log, MCAP, ULog, a folder, a CSV at rest, and the known recordings), or device:PORT
    #[arg(long, required = true, num_args = 1..=2, value_name = "RECORDING|device:PORT")]
    from: Vec<PathBuf>,
    /// Bit rate of a device's command link; sockets ignore it
    #[arg(long, default_value_t = 921_600)]
    baud: u32,
    /// Date or note for the head of the report. Nothing else in it depends on the time
    #[arg(long, value_name = "TEXT")]
    date: Option<String>,
    #[command(flatten)]
    json: JsonOption,
    /// Directory of the page and the weights
    #[arg(
        long,
        value_name = "DIR",
        default_value = "out/report",
        value_parser = output_directory()
    )]
    out: PathBuf,
    /// Also print the page into this file, with Chromium, which must be installed
    #[arg(long, value_name = "FILE", value_parser = output_file())]
    pdf: Option<PathBuf>,
    /// Options of `replay` for this form of recording, after --
    #[arg(last = true, value_name = "OPTIONS OF REPLAY")]
    options: Vec<String>,
}

impl Args {
    /// Reads, computes, prints and writes.
    pub(super) fn run(&self) -> Result<(), Error> {
        if let Some(text) = self.date.as_ref().filter(|t| t.chars().count() > 200) {
            let problem = format!("has {} characters", text.chars().count());
            return Err(refused("--date", problem, "give at most 200"));
        }
        let unit = self.unit.as_deref().map(Unit::load).transpose()?;
        let last = [(NOISE, 0.2), (LEARNABLE, 0.2)];
        let shown =
            progress::plan(&[&STAGES[..STAGES.len() - 1], &last, &[(WRITING, 1.0)]].concat());
        let contents = match form::of(&self.from)? {
            Form::Device(port) => self.of_device(&port, unit)?,
            form => self.of_recording(&form, unit)?,
        };
        progress::stage(WRITING);
        let report = Report::of(&contents)?;
        let page = report.write(&self.out);
        let document = report.document();
        drop(shown);
        for sentence in document.verdict() {
            println!("{sentence}");
        }
        let page = page?;
        self.json.write(&document.json())?;
        println!("\nreport: {}", page.display());
        if let Some(pdf) = &self.pdf {
            print::print(&page, pdf)?;
            println!("printed: {}", pdf.display());
        }
        Ok(())
    }

    fn of_recording(&self, form: &Form, unit: Option<Unit>) -> Result<Contents, Error> {
        let ReportInput {
            unit,
            assumed,
            source,
            files,
            warnings,
            rest,
            outcomes,
            temperatures,
            command,
        } = input::read(form, unit, self.unit.as_deref(), &self.options)?;
        progress::stage(NOISE);
        let noise = noise(rest, &unit)?;
        progress::stage(LEARNABLE);
        let minutes = match &outcomes {
            Ok(outcomes) => learning_minutes(outcomes),
            Err(_) => USUAL_MIN,
        };
        let learnable = Ok(bound(&unit, minutes));
        let mut commands = vec![format!("host-sim {}", arguments())];
        commands.extend(command);
        commands.extend(self.parts_alone(minutes));
        Ok(Contents {
            unit_name: match assumed {
                true => None,
                false => Some(self.unit.clone().unwrap_or("the recording".into())),
            },
            unit,
            date: self.date.clone(),
            source,
            files,
            warnings,
            noise,
            learnable,
            outcomes,
            temperatures,
            device: None,
            commands,
        })
    }

    fn of_device(&self, port: &str, unit: Option<Unit>) -> Result<Contents, Error> {
        if !self.options.is_empty() {
            let problem = format!("'{}' belongs to a recording", self.options.join(" "));
            return Err(refused("--", problem, "leave it out for a device"));
        }
        progress::stage("asking the device");
        let read = device::read(port, self.baud, unit.as_ref());
        let device::DeviceData {
            unit: of_device,
            readout,
            source,
            warnings,
        } = read?;
        let known = unit.is_some() || of_device.is_some();
        let unit = unit.or(of_device).unwrap_or_default();
        progress::stage(LEARNABLE);
        let learnable = Ok(bound(&unit, USUAL_MIN));
        let cannot = |what: &str| format!("a device does not report {what} over its command link");
        let mut commands = vec![format!("host-sim {}", arguments())];
        commands.push(format!("host-sim device --port {port} info --json"));
        commands.extend(self.parts_alone(USUAL_MIN));
        Ok(Contents {
            unit_name: known.then(|| self.unit.clone().unwrap_or("the device".into())),
            unit,
            date: self.date.clone(),
            source,
            files: vec![],
            warnings,
            noise: Err(cannot(
                "its samples at rest; record them and report from the recording",
            )),
            learnable,
            outcomes: Err(cannot(
                "the course of its learning and no track; report from a recording of it",
            )),
            temperatures: Err(cannot("a course of temperatures")),
            device: Some(readout),
            commands,
        })
    }

    /// Commands that give parts of the report alone.
    fn parts_alone(&self, minutes: u32) -> impl Iterator<Item = String> {
        let unit = self.unit.as_ref().map(|unit| format!(" --unit {unit}"));
        let unit = unit.unwrap_or_default();
        [format!(
            "host-sim learnability{unit} --units 0 --minutes {minutes}"
        )]
        .into_iter()
    }
}

/// Minutes of the longest learning part, within what is computed.
fn learning_minutes(outcomes: &[host_lab::experiment::outcome::Outcome]) -> u32 {
    let benches = outcomes.iter().filter_map(|o| o.bench.as_deref());
    let longest = benches.map(|b| b.learn.len()).max().unwrap_or(0);
    (longest.div_ceil(60) as u32).clamp(2, LONGEST_MIN)
}

/// The noise at rest beside the datasheet. Coefficients that are no noise are left out.
fn noise(rest: PartResult<rest::Rest>, unit: &Unit) -> Result<PartResult<Findings>, Error> {
    let rest = match rest {
        Ok(rest) => rest,
        Err(why) => return Ok(Err(why)),
    };
    match Findings::of(rest.source, rest.columns, None) {
        Ok(findings) => {
            let mut findings = findings.beside(&unit.simulated());
            findings.notes.extend(rest.notes);
            Ok(Ok(findings))
        }
        Err(Error::Option { problem, .. }) => Ok(Err(problem)),
        Err(error) => Err(error),
    }
}

/// The bound of `host-sim learnability --units 0`.
fn bound(unit: &Unit, minutes: u32) -> Answer {
    let question = Question {
        imu: unit.simulated(),
        gnss: GnssSpec {
            horizontal_m: 1.0,
            vertical_m: 1.5,
            velocity_mps: 0.05,
            ..GnssSpec::default()
        },
        minutes,
        units: 0,
        seed: 1,
    };
    answer(&question, &|| ())
}
