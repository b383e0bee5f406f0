//! `host-sim replay sessions`.

use super::options::{positive, refused};
use super::output::{JsonOption, check_ours, output_file};
use super::progress;
use super::stdout::width;
use super::user_recording::StartFrom;
use clap::Args as ClapArgs;
use firmware::app::blackbox::read::events;
use host_core::error::Error;
use host_device::hil::{MemoryFlash, blackbox};
use host_estimation::learning::device::Device;
use host_estimation::learning::teacher::Assumptions;
use host_io::output::write_atomic;
use host_lab::experiment::sessions::{self, Judged, PaperRow, Plan, Row, Timeline};
use host_unit::Unit;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Version of the JSON. 1 did not say where coasts `start`.
const SCHEMA: u32 = 2;
/// The text of a black box is shorter, bytes.
const MOST_OF_A_BLACK_BOX: u64 = 100_000;

/// Several sessions of one unit, each from power-on to power-off; the device's store goes from one
/// to the next.
#[derive(Debug, ClapArgs)]
pub(super) struct Sessions {
    /// The unit file (or a preset), or a table of sessions: a TOML file with `unit = "FILE.toml"`
    /// and for each session `[[session]]` with `file`, and perhaps `name`, `serial` and `date`
    #[arg(value_name = "UNIT.toml|TABLE.toml")]
    unit: String,
    /// The sessions in the order of time: headers of CSV files, or recordings of another form
    #[arg(value_name = "SESSION")]
    sessions: Vec<PathBuf>,
    /// Times without fixes, s
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "5,10,30,60",
        value_name = "SECONDS"
    )]
    horizons: Vec<f64>,
    /// No scheme has fixes
    #[arg(long)]
    no_fixes: bool,
    /// State from which coasts start
    #[arg(long, value_enum, default_value_t = StartFrom::Common, value_name = "WHICH")]
    start: StartFrom,
    /// Begin with the content of this device's flash, and write it back; a file that does not exist
    /// is a device that knows nothing yet
    #[arg(long, value_name = "FILE", value_parser = output_file())]
    memory: Option<PathBuf>,
    #[command(flatten)]
    json: JsonOption,
    /// Also make the paper's vehicle test on these drives, so long without fixes: learnt on a
    /// drive, judged on it, on its second half, and on the next drive
    #[arg(long, value_name = "SECONDS")]
    paper: Option<f64>,
    /// Write a page (HTML): the error of each session, and what is remembered
    #[arg(long, value_name = "FILE", value_parser = output_file())]
    page: Option<PathBuf>,
}

/// A table of sessions.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    unit: String,
    #[serde(default)]
    session: Vec<Entry>,
}

/// A session of a table.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    file: PathBuf,
    name: Option<String>,
    /// Serial number of the unit that recorded it.
    serial: Option<String>,
    /// Date, in any form that sorts as text.
    date: Option<toml::Value>,
}

/// The JSON.
#[derive(Debug, Serialize)]
struct Results<'a> {
    schema: u32,
    unit: &'a str,
    start: &'static str,
    verdict: &'a str,
    sessions: &'a [Judged],
    rows: Vec<&'a Row>,
    #[serde(skip_serializing_if = "Option::is_none")]
    paper: Option<Vec<PaperRow>>,
}

impl Sessions {
    pub(super) fn run(&self) -> Result<(), Error> {
        if let Some(file) = &self.page {
            check_ours("--page", file, host_report::page::is_ours)?;
        }
        let (unit_name, entries) = self.entries()?;
        let unit = Unit::load(&unit_name)?;
        in_order(&entries, &unit)?;
        let horizons = self.horizons()?;
        let paper_s = self.paper.map(|horizon_s| positive("--paper", horizon_s));
        let paper_s = paper_s.transpose()?;
        let configuration = unit.configuration().map_err(|wrong| Error::Option {
            option: format!("{unit_name}: {}", wrong.key),
            problem: wrong.problem,
            remedy: wrong.remedy,
        })?;
        let device = match &self.memory {
            Some(file) if file.exists() => Some(remembered(file, &configuration)?),
            _ => None,
        };
        let plan = Plan {
            assumptions: Assumptions::of(&unit),
            configuration,
            horizons,
            no_fixes: self.no_fixes,
            own_start: self.start == StartFrom::Own,
        };
        let (mut of_unit, mut drives) = (sessions::Unit::new(plan.clone(), device), Vec::new());
        let bar = progress::bar(
            entries.len() as u64,
            "{elapsed} session {pos} of {len}, about {eta} left",
        );
        let mut all: Vec<Judged> = Vec::new();
        let judged = entries.iter().try_for_each(|entry| {
            let options = ["--unit".to_owned(), unit_name.clone()];
            no_black_box(&entry.file)?;
            let opened = host_reading::open(std::slice::from_ref(&entry.file), &options)?;
            let timeline = Timeline::of(&entry.name(), &opened.record)?;
            drop(opened);
            if paper_s.is_some() {
                drives.push(timeline.clone());
            }
            all.push(of_unit.next(timeline)?);
            bar.inc(1);
            Ok(())
        });
        bar.finish_and_clear();
        if all.is_empty() {
            return judged;
        }
        // what is done stays, whatever comes then
        if let Some(file) = &self.memory {
            write_atomic(file, &of_unit.device().flash().0)?;
        }
        let paper = paper_s.map(|horizon_s| sessions::paper(drives, &plan, horizon_s));
        let paper = paper.transpose()?;
        let rows = all.iter().flat_map(|of| &of.rows).collect();
        let said = host_report::sessions::verdict(&all);
        let results = Results {
            schema: SCHEMA,
            unit: &unit.name,
            start: plan.start(),
            verdict: said.first().map_or("", String::as_str),
            sessions: &all,
            rows,
            paper,
        };
        print!(
            "{}",
            host_report::sessions::text(&all, plan.start(), width())
        );
        if let Some(rows) = &results.paper {
            print!("{}", host_report::sessions::paper(rows, width()));
        }
        self.json.write(&results)?;
        if let Some(file) = &self.page {
            let page = host_report::sessions::document(&unit.name, &all, plan.start()).page()?;
            write_atomic(file, page.as_bytes())?;
        }
        judged
    }

    /// The unit, and the sessions.
    fn entries(&self) -> Result<(String, Vec<Entry>), Error> {
        let mut found = (self.unit.clone(), Vec::new());
        if self.sessions.is_empty() {
            found = table(Path::new(&self.unit))?;
        }
        found.1.extend(self.sessions.iter().map(|file| Entry {
            file: file.clone(),
            name: None,
            serial: None,
            date: None,
        }));
        Ok(found)
    }

    fn horizons(&self) -> Result<Vec<f64>, Error> {
        let mut horizons = self.horizons.clone();
        for horizon in &horizons {
            positive("--horizons", *horizon)?;
        }
        horizons.sort_by(f64::total_cmp);
        horizons.dedup();
        Ok(horizons)
    }
}

impl Entry {
    /// Its name: as given, else the folder of its header, else the file.
    fn name(&self) -> String {
        let folder = || self.file.parent()?.file_name();
        let stem = || self.file.file_stem();
        let is_header = self
            .file
            .file_name()
            .is_some_and(|name| name == "header.toml");
        let own = if is_header { folder() } else { stem() };
        let own = own.map(|name| name.to_string_lossy().into_owned());
        self.name
            .clone()
            .or(own)
            .unwrap_or_else(|| "session".into())
    }
}

fn table(file: &Path) -> Result<(String, Vec<Entry>), Error> {
    let named = file.display().to_string();
    let text = std::fs::read_to_string(file).map_err(|error| Error::reading(file, error))?;
    let table: Table = host_unit::text::parse(file, &text, |_| {
        "give the unit file and then the sessions, or a TOML file with unit = \"FILE.toml\" and \
         [[session]] entries with file = \"...\""
            .into()
    })?;
    if table.session.is_empty() {
        let remedy = "add [[session]] entries with file = \"...\"";
        return Err(refused(named, "has no session", remedy));
    }
    let folder = file.parent().unwrap_or(Path::new("")).to_path_buf();
    let unit = if table.unit.ends_with(".toml") {
        folder.join(&table.unit).display().to_string()
    } else {
        table.unit
    };
    let sessions = table.session.into_iter().map(|entry| Entry {
        file: folder.join(&entry.file),
        ..entry
    });
    Ok((unit, sessions.collect()))
}

/// Checks that all sessions are of the unit, in the order of time.
fn in_order(entries: &[Entry], unit: &Unit) -> Result<(), Error> {
    for entry in entries {
        if let Some(serial) = entry
            .serial
            .as_ref()
            .filter(|serial| **serial != unit.serial)
        {
            let own = match unit.serial.as_str() {
                "" => "has no serial number".to_owned(),
                own => format!("has '{own}'"),
            };
            let problem = format!("is of the unit with serial '{serial}', and the unit file {own}");
            let remedy = match unit.serial.is_empty() {
                true => "write the serial number into the unit file, if it is of this unit",
                false => "give only sessions of one unit, with its unit file",
            };
            return Err(refused(entry.file.display().to_string(), problem, remedy));
        }
    }
    for (k, entry) in entries.iter().enumerate() {
        if entries[..k].iter().any(|other| other.file == entry.file) {
            let remedy = "give each session once, in the order of time";
            let file = entry.file.display().to_string();
            return Err(refused(file, "is given twice", remedy));
        }
    }
    let dated = entries.iter().filter_map(|entry| {
        let date = entry.date.as_ref()?;
        let text = date.as_str().map(str::to_owned);
        Some((entry, text.unwrap_or_else(|| date.to_string())))
    });
    let dated: Vec<_> = dated.collect();
    match dated.windows(2).find(|pair| pair[1].1 < pair[0].1) {
        None => Ok(()),
        Some(pair) => {
            let problem = format!(
                "is of {}, before the session above it ({})",
                pair[1].1, pair[0].1
            );
            let remedy = "put the sessions into the order of time";
            Err(refused(
                pair[1].0.file.display().to_string(),
                problem,
                remedy,
            ))
        }
    }
}

/// Refuses the file of a black box, which holds far less than a session.
fn no_black_box(file: &Path) -> Result<(), Error> {
    let small = file
        .metadata()
        .is_ok_and(|of| of.is_file() && of.len() < MOST_OF_A_BLACK_BOX);
    let Some((configuration, memory)) = small.then(|| blackbox::read(file).ok()).flatten() else {
        return Ok(());
    };
    let pages = blackbox::play(configuration.as_ref(), &memory);
    let bytes: usize = pages.iter().map(|page| page.bytes).sum();
    let seen = events(&memory).count();
    let problem = format!(
        "is a black box: {bytes} bytes of the sensor's line in {} pages and {seen} events, and no \
         fixes; a session needs the samples and fixes of a whole drive",
        pages.len()
    );
    let remedy = "record both lines of the drive for a session; `host-sim replay blackbox FILE` plays \
                  what this file holds";
    Err(refused(file.display().to_string(), problem, remedy))
}

/// The device whose flash is in a file.
fn remembered(
    file: &Path,
    configuration: &firmware::configuration::Configuration,
) -> Result<Device, Error> {
    let bytes = std::fs::read(file).map_err(|error| Error::reading(file, error))?;
    Device::of_flash(configuration, MemoryFlash(bytes)).map_err(|(problem, remedy)| {
        refused(format!("--memory {}", file.display()), problem, remedy)
    })
}
