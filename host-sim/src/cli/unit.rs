//! `host-sim unit`.

mod base;
mod calibration;
mod from_log;
mod logs;
mod outputs;
mod six_position;

use super::options::refused;
use super::progress;
use clap::{Args as ClapArgs, Subcommand};
use host_core::error::Error;
use host_io::output::write_atomic;
use host_unit::{Finding, Sources, Unit, ask, examine, presets, schema};
use std::path::{Path, PathBuf};

/// Arguments of `unit`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Ask for the keys of a unit file, question by question, and write it
    New {
        /// Preset or unit file whose values are the defaults of the questions
        #[arg(long, value_name = "NAME|FILE.toml")]
        from: Option<String>,
        /// The file to write
        #[arg(long, value_name = "FILE.toml", default_value = "unit.toml")]
        output: PathBuf,
        /// Replace the file if it is there
        #[arg(long)]
        force: bool,
        /// Print JSON: the unit's name, the files, and the findings as of `unit check`
        #[arg(long)]
        json: bool,
    },
    /// Write a unit file from logs of the sensor at rest, and compare it with a preset
    FromLog(Box<from_log::Args>),
    /// Find bias, scale factors and skew of the accelerometers from six rests or more, by gravity
    SixPosition(Box<six_position::Args>),
    /// Read a calibration of Kalibr, imu_tk or imu_calib, and write it in other forms
    Calibration(Box<calibration::Args>),
    /// Print all faults and doubts of a unit file, with line, field and remedy
    Check {
        /// The file
        file: PathBuf,
        /// Print JSON: the unit's name, or null if it cannot be used, and the findings
        #[arg(long)]
        json: bool,
    },
    /// List the presets
    List {
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Print a preset with its comments, which name the sources
    Show {
        /// The preset
        name: String,
    },
    /// Print the JSON Schema, by which editors complete and check a unit file
    Schema,
}

impl Args {
    /// Runs the action.
    pub(super) fn run(&self) -> Result<(), Error> {
        match &self.action {
            Action::New {
                from,
                output,
                force,
                json,
            } => new(from.as_deref(), output, *force, *json),
            Action::FromLog(args) => args.run(),
            Action::SixPosition(args) => args.run(),
            Action::Calibration(args) => args.run(),
            Action::Check { file, json } => check(file, *json),
            Action::List { json: true } => {
                let preset = |(name, text): &(&str, &str)| {
                    let title = presets::title(text);
                    serde_json::json!({ "name": name, "title": title })
                };
                let all: Vec<_> = presets::PRESETS.iter().map(preset).collect();
                println!("{:#}", serde_json::Value::from(all));
                Ok(())
            }
            Action::List { json: false } => {
                let width = presets::names().iter().map(|name| name.len()).max();
                for (name, text) in presets::PRESETS {
                    let width = width.unwrap_or_default();
                    println!("{name:width$}  {}", presets::title(text));
                }
                Ok(())
            }
            Action::Show { name } => {
                let unknown = || Error::unknown("unit", name, &presets::names());
                print!("{}", presets::text(name).ok_or_else(unknown)?);
                Ok(())
            }
            Action::Schema => {
                print!("{}", schema::text());
                Ok(())
            }
        }
    }
}

fn new(from: Option<&str>, output: &Path, force: bool, json: bool) -> Result<(), Error> {
    free(output, force)?;
    let sources = from.map(sources).transpose()?.unwrap_or_default();
    let from = from.map(Unit::load).transpose()?;
    progress::say("an empty answer takes the value in brackets; ? explains the question");
    let mut input = std::io::stdin().lock();
    let asked = ask::interview(from.as_ref(), &sources, &mut input, &mut std::io::stderr());
    let asked = asked.map_err(|error| refused("unit new", error.to_string(), "answer again"))?;
    let Some(text) = asked else {
        return Err(refused(
            "unit new",
            "the answers ended before all that is required was given",
            "answer all questions; an empty answer takes the value in brackets",
        ));
    };
    let (unit, found) = examine(&text);
    let Some(unit) = unit else {
        progress::say("nothing is written, because the answers do not fit together:");
        let faults = found.into_iter().filter(|finding| !finding.doubt);
        return Err(Error::Several(faults.map(|f| f.error(output)).collect()));
    };
    write_atomic(output, text.as_bytes())?;
    let beside = output.with_file_name(schema::FILE);
    if !beside.exists() {
        write_atomic(&beside, schema::text().as_bytes())?;
    }
    if json {
        let of = serde_json::json!({
            "unit": unit.name, "file": output, "schema": beside,
            "findings": found.iter().map(finding).collect::<Vec<_>>(),
        });
        println!("{of:#}");
        return Ok(());
    }
    doubts(output, found);
    println!(
        "{} is written; editors complete it by {}",
        output.display(),
        beside.display()
    );
    Ok(())
}

/// Refuses to write over a file that is there.
fn free(output: &Path, force: bool) -> Result<(), Error> {
    if !output.exists() || force {
        return Ok(());
    }
    Err(refused(
        output.display().to_string(),
        "is there already",
        "give another --output, or --force to replace it",
    ))
}

/// The comments of a preset or a unit file.
fn sources(name: &str) -> Result<Sources, Error> {
    sources_of(name).map(|text| Sources::of(&text))
}

/// The text of a preset or a unit file.
fn sources_of(name: &str) -> Result<String, Error> {
    let preset = presets::text(name).map(|text| Ok(text.to_owned()));
    let text = preset.unwrap_or_else(|| std::fs::read_to_string(name));
    let text = text.map_err(|error| Error::reading(Path::new(name), error));
    // an unknown name is refused with the names that are known
    Unit::load(name).and(text)
}

fn check(file: &Path, json: bool) -> Result<(), Error> {
    let text = std::fs::read_to_string(file).map_err(|e| Error::reading(file, e))?;
    let (unit, found) = examine(&text);
    if json {
        return check_json(file, unit.as_ref(), found);
    }
    let (doubtful, wrong): (Vec<_>, Vec<_>) = found.into_iter().partition(|f| f.doubt);
    doubts(file, doubtful);
    match unit {
        Some(unit) => {
            println!("{}: '{}' can be used", file.display(), unit.name);
            Ok(())
        }
        None => Err(Error::Several(
            wrong.into_iter().map(|fault| fault.error(file)).collect(),
        )),
    }
}

fn finding(found: &Finding) -> serde_json::Value {
    serde_json::json!({
        "kind": if found.doubt { "doubt" } else { "fault" },
        "line": found.line,
        "field": found.key,
        "problem": found.problem,
        "remedy": found.remedy,
    })
}

fn check_json(file: &Path, unit: Option<&Unit>, found: Vec<Finding>) -> Result<(), Error> {
    let findings: Vec<_> = found.iter().map(finding).collect();
    let name = unit.map(|unit| &unit.name);
    println!(
        "{:#}",
        serde_json::json!({ "unit": name, "findings": findings })
    );
    if unit.is_some() {
        return Ok(());
    }
    let faults = found.into_iter().filter(|finding| !finding.doubt);
    Err(Error::Several(faults.map(|f| f.error(file)).collect()))
}

fn doubts(file: &Path, found: Vec<Finding>) {
    for finding in found {
        println!("doubtful: {}", finding.error(file));
    }
}
