//! `host-sim unit from-log`.

use super::logs::Logs;
use super::{base, doubts, free};
use crate::cli::output::JsonOption;
use crate::cli::{progress, stdout};
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_estimation::analysis::standing::{LogResults, Sheet, nearest, sheet, shown};
use host_unit::{Sources, Unit, examine, presets};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Arguments of `unit from-log`.
#[derive(Debug, ClapArgs)]
pub(super) struct Args {
    #[command(flatten)]
    logs: Logs,
    /// Preset or unit file for what a log at rest cannot show, and to compare with [default: the
    /// preset with the nearest noise, for the errors alone]
    #[arg(long, value_name = "NAME|FILE.toml")]
    preset: Option<String>,
    /// The file to write
    #[arg(long, value_name = "FILE.toml", default_value = "unit.toml")]
    output: PathBuf,
    /// Replace the file if it is there
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    json: JsonOption,
}

/// The results for `--json`.
#[derive(Serialize)]
struct Written<'a> {
    file: &'a Path,
    #[serde(flatten)]
    sheet: &'a Sheet,
    #[serde(flatten)]
    shown: &'a LogResults,
}

const ANALYSING: &str = "computing the deviations";

impl Args {
    pub(super) fn run(&self) -> Result<(), Error> {
        free(&self.output, self.force)?;
        let given = self.preset.as_deref().map(Unit::load).transpose()?;
        let stages = [(progress::READING, 0.5), (ANALYSING, 0.5)];
        let progress = progress::plan(&stages);
        let logs = self.logs.read()?;
        progress::stage(ANALYSING);
        let shown = shown(&logs)?;
        let name = self.preset.as_deref().unwrap_or_else(|| nearest(&shown));
        let unit = given.map_or_else(|| Unit::load(name), Ok)?;
        let sheet = sheet(&shown, name, &unit);
        let (table, sources) = match self.preset.is_some() {
            true => base::given(name)?,
            false => bare(&shown, name, &unit),
        };
        let about = host_report::standing::about(&shown);
        let text = base::filled(table, sources, &sheet.numbers, &about);
        let (read, found) = examine(&text);
        if read.is_none() {
            let faults = found.into_iter().filter(|finding| !finding.doubt);
            return Err(Error::Several(
                faults.map(|f| f.error(&self.output)).collect(),
            ));
        }
        base::write(&self.output, &text)?;
        self.json.write(&Written {
            file: &self.output,
            sheet: &sheet,
            shown: &shown,
        })?;
        drop(progress);
        print!(
            "{}",
            host_report::standing::text(&shown, &sheet, stdout::width())
        );
        doubts(&self.output, found);
        println!("\n{} is written", self.output.display());
        if self.preset.is_none() {
            println!(
                "its sensor is to be detected: set [sensor], [mounting], [receiver] and \
                 [vehicle], or begin with --preset"
            );
        }
        Ok(())
    }
}

/// Tables with the errors of the nearest preset alone.
fn bare(shown: &LogResults, name: &str, unit: &Unit) -> (toml::Table, Sources) {
    let text = presets::text(name).unwrap_or_default();
    let of_preset: toml::Table = toml::from_str(&text).unwrap_or_default();
    let (mut table, mut sources) = (toml::Table::new(), Sources::default());
    let log = shown.logs.first();
    let file = log.map(|log| Path::new(&log.name));
    let stem = file
        .and_then(|f| f.file_stem())
        .unwrap_or_default()
        .to_string_lossy();
    let ascii: String = stem
        .chars()
        .filter(|c| c.is_ascii_graphic())
        .take(24)
        .collect();
    table.insert("name".into(), format!("from {ascii}").into());
    let mut sensor = toml::Table::new();
    sensor.insert("format".into(), "detect".into());
    let rate = log.map_or(unit.sensor.rate(), |log| log.rate_hz);
    sensor.insert("rate_hz".into(), ((rate * 1e3).round() / 1e3).into());
    table.insert("sensor".into(), sensor.into());
    for triad in ["gyro", "accel"] {
        let Some(toml::Value::Table(errors)) = of_preset.get(triad) else {
            continue;
        };
        for (key, value) in errors {
            let comment = format!("assumed: as preset {name}, whose noise is nearest");
            sources.put(&format!("{triad}.{key}"), value.clone(), comment);
        }
        table.insert(triad.into(), errors.clone().into());
    }
    (table, sources)
}
