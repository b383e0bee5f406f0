//! CSV files of sensor output: plain or gzipped, a header line with the unit at the end of each name, numbers of equal number on each line.
//!
//! | name | is |
//! |---|---|
//! | `t_s`, `time_s` | time, rising in equal steps |
//! | `dtheta..._rad`, `dv..._mps` | increments a sample, as `host-sim simulate` writes them |
//! | `gyro..._pulses`, `accel..._pulses` | increments in the pulses of the recorded laser-gyro unit, 100 a second unless told |
//! | `..._radps`, `..._dps`, `..._dph` | rates |
//! | `..._mps2`, `..._g`, `..._ug` | specific forces |
//!
//! Other columns are passed over.

use super::deviation::LEAST_SAMPLES;
use super::{Kind, Series};
use crate::error::{Error, excerpt};
use crate::inertial::units::{DEG, DEG_PER_H, G0, UG};
use crate::recordings::{ACCEL_LSB_MPS, GYRO_LSB_RAD, RATE_HZ};
use std::path::Path;

/// A header we know, for messages.
const EXAMPLE: &str = "t_s,dtheta_x_rad,dtheta_y_rad,dtheta_z_rad,dv_x_mps,dv_y_mps,dv_z_mps";
/// A step of the time that differs by more than this part from the usual one is a gap.
const GAP: f64 = 0.5;

/// What to take from a file.
#[derive(Debug, Clone, Default)]
pub struct Choice {
    /// Columns by name; all we know when empty.
    pub columns: Vec<String>,
    /// Samples per second, instead of what time column or format say.
    pub rate_hz: Option<f64>,
}

/// One column that is a sensor's output.
#[derive(Debug, Clone)]
struct Sensor {
    place: usize,
    name: String,
    kind: Kind,
    /// SI value of one.
    scale: f64,
    /// Whether it is an increment already, or a rate.
    increment: bool,
    pulses: bool,
}

/// Reads the sensors of `file`.
///
/// # Errors
/// Any fault of the file, with line and column; a column that is not there; no way to know the sample rate; too few samples.
pub fn load(file: &Path, choice: &Choice) -> Result<Vec<Series>, Error> {
    let bytes = crate::recordings::read::read(file)?;
    let table = Table::parse(file, &bytes, choice)?;
    let rate_hz = table.rate(choice)?;
    let samples = table.values.first().map_or(0, Vec::len);
    if samples < LEAST_SAMPLES {
        return Err(Error::Option {
            option: file.display().to_string(),
            problem: format!("holds {samples} samples, too few for an Allan deviation"),
            remedy: format!(
                "give a recording at rest of at least {LEAST_SAMPLES} samples, better of hours"
            ),
        });
    }
    let series = table
        .sensors
        .iter()
        .zip(table.values)
        .map(|(sensor, values)| {
            let scale = if sensor.increment {
                sensor.scale
            } else {
                sensor.scale / rate_hz
            };
            Series {
                column: sensor.name.clone(),
                kind: sensor.kind,
                rate_hz,
                increments: values.into_iter().map(|value| value * scale).collect(),
            }
        });
    Ok(series.collect())
}

/// The sensor that a column of this name is; `named` says that the user asked for it, so that its unit is enough.
fn sensor(place: usize, name: &str, named: bool) -> Option<Sensor> {
    let begins = |parts: &[&str]| named || parts.iter().any(|part| name.starts_with(part));
    let (_, unit) = name.rsplit_once('_')?;
    let (kind, scale, increment) = match unit {
        "rad" if begins(&["dtheta"]) => (Kind::Gyro, 1.0, true),
        "mps" if begins(&["dv"]) => (Kind::Accel, 1.0, true),
        "pulses" if name.starts_with("gyro") => (Kind::Gyro, GYRO_LSB_RAD, true),
        "pulses" if name.starts_with("accel") => (Kind::Accel, ACCEL_LSB_MPS, true),
        "radps" => (Kind::Gyro, 1.0, false),
        "dps" => (Kind::Gyro, DEG, false),
        "dph" => (Kind::Gyro, DEG_PER_H, false),
        "mps2" => (Kind::Accel, 1.0, false),
        "g" => (Kind::Accel, G0, false),
        "ug" => (Kind::Accel, UG, false),
        _ => return None,
    };
    Some(Sensor {
        place,
        name: name.to_owned(),
        kind,
        scale,
        increment,
        pulses: unit == "pulses",
    })
}

/// The columns we want, with the time.
struct Table<'a> {
    file: &'a Path,
    sensors: Vec<Sensor>,
    time_name: Option<String>,
    values: Vec<Vec<f64>>,
    times: Vec<f64>,
}

impl<'a> Table<'a> {
    fn parse(file: &'a Path, bytes: &[u8], choice: &Choice) -> Result<Self, Error> {
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes); // byte order mark of some spreadsheets
        let text = text.strip_suffix(b"\n").unwrap_or(text);
        let empty = |found| Error::Empty {
            file: file.to_path_buf(),
            found,
            expected: EXAMPLE.to_owned(),
        };
        if text.trim_ascii().is_empty() {
            return Err(empty("is empty"));
        }
        let mut lines = text.split(|&byte| byte == b'\n').map(<[u8]>::trim_ascii);
        let header = String::from_utf8_lossy(lines.next().unwrap_or_default()).into_owned();
        let names: Vec<&str> = header.split(',').map(str::trim).collect();
        let sensors = Self::choose(file, &header, &names, choice)?;
        let time = names
            .iter()
            .position(|name| ["t_s", "time_s"].contains(name));
        let mut table = Self {
            file,
            values: vec![vec![]; sensors.len()],
            sensors,
            time_name: time.map(|place| names[place].to_owned()),
            times: vec![],
        };
        // column of the file -> where its value goes: a sensor, the time, nowhere
        let mut wanted = vec![None; names.len()];
        for (i, sensor) in table.sensors.iter().enumerate() {
            wanted[sensor.place] = Some(i);
        }
        let time = time.filter(|_| choice.rate_hz.is_none());
        for (number, line) in (2..).zip(lines) {
            check_count(file, number, line, &names)?;
            for (place, field) in line.split(|&byte| byte == b',').enumerate() {
                if let Some(i) = wanted[place] {
                    table.values[i].push(number_in(file, number, names[place], field)?);
                } else if Some(place) == time {
                    table
                        .times
                        .push(number_in(file, number, names[place], field)?);
                }
            }
        }
        if table.values[0].is_empty() {
            Err(empty("has a header and no data"))
        } else {
            Ok(table)
        }
    }

    fn choose(
        file: &Path,
        header: &str,
        names: &[&str],
        choice: &Choice,
    ) -> Result<Vec<Sensor>, Error> {
        let known = |named| {
            names
                .iter()
                .enumerate()
                .filter_map(move |(place, name)| sensor(place, name, named))
        };
        if let Some(missing) = choice
            .columns
            .iter()
            .find(|wanted| !known(true).any(|sensor| sensor.name == **wanted))
        {
            let all: Vec<String> = known(true).map(|sensor| sensor.name).collect();
            let all: Vec<&str> = all.iter().map(String::as_str).collect();
            return Err(Error::unknown("sensor column", missing, &all));
        }
        let sensors: Vec<Sensor> = match choice.columns.as_slice() {
            [] => known(false).collect(),
            columns => known(true)
                .filter(|sensor| columns.contains(&sensor.name))
                .collect(),
        };
        if sensors.is_empty() {
            return Err(Error::Header {
                file: file.to_path_buf(),
                found: excerpt(header),
                expected: EXAMPLE.to_owned(),
            });
        }
        Ok(sensors)
    }

    /// Samples per second: as told, of the time column, or of the format.
    fn rate(&self, choice: &Choice) -> Result<f64, Error> {
        if let Some(rate) = choice.rate_hz {
            return Ok(rate);
        }
        match &self.time_name {
            Some(name) => self.rate_of_times(name),
            None if self.sensors.iter().all(|sensor| sensor.pulses) => Ok(RATE_HZ),
            None => Err(Error::Option {
                option: "--rate".to_owned(),
                problem: format!(
                    "{} has no column 't_s' or 'time_s' to tell the sample rate",
                    self.file.display()
                ),
                remedy: "give the samples per second, for example --rate 200".to_owned(),
            }),
        }
    }

    fn rate_of_times(&self, name: &str) -> Result<f64, Error> {
        let steps = || self.times.windows(2).map(|pair| pair[1] - pair[0]);
        let mut sorted: Vec<f64> = steps().collect();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted.get(sorted.len() / 2).copied().unwrap_or(1.0);
        for (i, step) in steps().enumerate() {
            let (line, before, now) = (i + 3, self.times[i], self.times[i + 1]);
            let (file, field) = (self.file.to_path_buf(), name.to_owned());
            if step <= 0.0 {
                return Err(Error::TimeBack {
                    file,
                    line,
                    field,
                    before,
                    now,
                });
            }
            if (step - usual).abs() > GAP * usual {
                return Err(Error::Value {
                    file,
                    line,
                    field,
                    text: now.to_string(),
                    fault: "not one step after the line before",
                    remedy: format!(
                        "cut the file there (a step is {} s), or give --rate HZ to pass over the times",
                        (usual * 1e9).round() / 1e9
                    ),
                });
            }
        }
        let span = self.times.last().unwrap_or(&1.0) - self.times.first().unwrap_or(&0.0);
        let rate = (self.times.len() - 1).max(1) as f64 / span;
        // times are rounded in files: 200.0000003 is 200
        Ok(if (rate - rate.round()).abs() < 1e-5 * rate {
            rate.round()
        } else {
            rate
        })
    }
}

/// As many values on a line as the header has `names`.
fn check_count(file: &Path, number: usize, line: &[u8], names: &[&str]) -> Result<(), Error> {
    let commas = line.iter().filter(|&&byte| byte == b',').count();
    let found = if line.is_empty() { 0 } else { commas + 1 };
    if found == names.len() {
        return Ok(());
    }
    Err(Error::ColumnCount {
        file: file.to_path_buf(),
        line: number,
        found,
        expected: names.len(),
        columns: excerpt(&names.join(",")),
    })
}

fn number_in(file: &Path, line: usize, name: &str, field: &[u8]) -> Result<f64, Error> {
    let text = std::str::from_utf8(field.trim_ascii()).unwrap_or("\u{fffd}");
    let fault = match text.parse::<f64>() {
        Ok(number) if number.is_finite() => return Ok(number),
        Ok(_) => "not finite",
        Err(_) if text.is_empty() => "missing",
        Err(_) => "not a number",
    };
    Err(Error::Value {
        file: file.to_path_buf(),
        line,
        field: name.to_owned(),
        text: excerpt(text),
        fault,
        remedy: "give a finite decimal number".to_owned(),
    })
}
