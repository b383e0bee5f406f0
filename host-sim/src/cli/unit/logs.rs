//! The logs of `unit from-log` and `unit six-position`.

use crate::cli::at_rest::{self, AtRest};
use crate::cli::options::{refused, within};
use crate::cli::progress;
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::units::DEG;
use host_estimation::analysis::allan::columns::Choice;
use host_estimation::analysis::standing::{Log, Temperature};
use host_lab::campaign::fleet::readings;
use std::path::{Path, PathBuf};

/// File of temperatures beside a log, as `simulate` writes it.
const TEMPERATURE: &str = "temperature.csv";

/// Recordings of one unit, and what they do not say.
#[derive(Debug, ClapArgs)]
pub(super) struct Logs {
    /// Recordings of any form that `allan` reads, one for each power-on
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// Meaning of the columns of CSV files, as for `replay csv`
    #[arg(long, value_name = "FILE.toml")]
    header: Option<PathBuf>,
    /// Latitude of the place, deg: gives gravity and the Earth's rotation, where no log has a site
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true)]
    latitude: Option<f64>,
    /// Height of the place above the ellipsoid, m
    #[arg(
        long,
        value_name = "METRES",
        default_value_t = 0.0,
        requires = "latitude"
    )]
    #[arg(allow_hyphen_values = true)]
    height: f64,
    /// Temperature of the sensor in each log, degrees C [default: temperature.csv beside the log,
    /// as `simulate` writes it; else unknown]
    #[arg(
        long,
        value_name = "DEGC,...",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    temperature: Vec<f64>,
    /// Options of `replay` for this form of recording, after --
    #[arg(last = true, value_name = "OPTIONS OF REPLAY")]
    options: Vec<String>,
}

impl Logs {
    /// Reads the logs.
    pub(super) fn read(&self) -> Result<Vec<Log>, Error> {
        if ![0, self.logs.len()].contains(&self.temperature.len()) {
            let problem = format!(
                "has {} values for {} logs",
                self.temperature.len(),
                self.logs.len()
            );
            return Err(refused("--temperature", problem, "give one for each log"));
        }
        for celsius in &self.temperature {
            within("--temperature", *celsius, [-100.0, 200.0])?;
        }
        for (k, file) in self.logs.iter().enumerate() {
            if self.logs[..k].contains(file) {
                let remedy = "give each log once: each counts as a power-on of its own";
                return Err(refused(
                    file.display().to_string(),
                    "is given twice",
                    remedy,
                ));
            }
        }
        let site = self.site()?;
        let numbered = self.logs.iter().enumerate();
        numbered.map(|(k, file)| self.log(k, file, site)).collect()
    }

    /// The site that was given.
    fn site(&self) -> Result<Option<Geodetic>, Error> {
        let Some(latitude) = self.latitude else {
            return Ok(None);
        };
        Ok(Some(Geodetic {
            lat: within("--latitude", latitude, [-90.0, 90.0])? * DEG,
            lon: 0.0,
            h: within("--height", self.height, [-1000.0, 20_000.0])?,
        }))
    }

    fn log(&self, number: usize, file: &Path, site: Option<Geodetic>) -> Result<Log, Error> {
        progress::scale_by(file);
        let choice = || Ok(Choice::default());
        let name = file.display().to_string();
        let mut log = match at_rest::read(
            Some(file),
            self.header.as_deref(),
            choice,
            &self.options,
            true,
        )? {
            AtRest::Record(record) => Log {
                name,
                ..Log::of_record(&record)
            },
            AtRest::Columns(columns, notes) => Log::of_columns(name, columns, notes)?,
        };
        log.site = site.or(log.site);
        log.temperature = match self.temperature.get(number) {
            Some(celsius) => Some(Temperature::Constant(*celsius)),
            None => beside(file, &log)?,
        };
        Ok(log)
    }
}

/// The temperatures in the file beside a log.
fn beside(file: &Path, log: &Log) -> Result<Option<Temperature>, Error> {
    let file = match file.is_dir() {
        true => file.join(TEMPERATURE),
        false => file.with_file_name(TEMPERATURE),
    };
    if !file.is_file() {
        return Ok(None);
    }
    let [begin, end] = [0, log.samples.len().max(1) - 1].map(|k| log.time(k));
    let begin = begin.floor();
    let seconds = (end - begin).ceil().clamp(1.0, 1e7) as usize;
    let each = readings(&file, begin, seconds)?.into_iter();
    let mean = each.map(|reading| reading.axes.mean()).collect();
    Ok(Some(Temperature::Seconds(begin, mean)))
}
