//! Reads CSV files of sensor output, plain or gzipped. The header line gives the unit at the end of
//! each name.
//!
//! | column | meaning |
//! |---|---|
//! | `t_s`, `time_s` | time, rising in equal steps |
//! | `dtheta..._rad`, `dv..._mps` | increments per sample, as `host-sim simulate` writes them |
//! | `gyro..._pulses`, `accel..._pulses` | increments in pulses of the recorded laser-gyro IMU |
//! | `..._radps`, `..._dps`, `..._dph` | rates |
//! | `..._mps2`, `..._g`, `..._ug` | specific forces |
//!
//! Pulses come at 100 Hz unless the user gives another rate. Other columns are ignored.

use super::Kind;
use super::deviation::LEAST_SAMPLES;
use super::store::{Column, IN_MEMORY};
use host_core::error::{Error, excerpt};
use host_core::inertial::units::{DEG, DEG_PER_H, G0, UG};
use host_core::list::{Writer, median};
use host_io::recordings::table::{HEAD_LINES, Layout, Separator, Source, Table};
use host_io::recordings::{ACCEL_LSB_MPS, GYRO_LSB_RAD, RATE_HZ};
use std::path::Path;

/// Example of a header, for messages.
const EXAMPLE: &str = "t_s,dtheta_x_rad,dtheta_y_rad,dtheta_z_rad,dv_x_mps,dv_y_mps,dv_z_mps";
/// Columns of the time.
const TIMES: [&str; 2] = ["t_s", "time_s"];
/// Fewer samples a second than this are no recording of an IMU, Hz.
const SLOW_HZ: f64 = 0.5;
/// A time step that departs from the median by more than this share is a gap.
const GAP: f64 = 0.5;

/// The columns to read from a file, and their rate.
#[derive(Debug, Clone, Default)]
pub struct Choice {
    /// Names of the columns. If empty, all columns whose names are known.
    pub columns: Vec<String>,
    /// Samples per second, instead of those of the time column or of the format.
    pub rate_hz: Option<f64>,
    /// Lines before that of the names, which is looked for by default.
    pub skip_lines: Option<usize>,
}

/// A column with the output of a sensor.
#[derive(Debug, Clone)]
struct Sensor {
    /// Position among the columns of the file.
    index: usize,
    name: String,
    kind: Kind,
    /// Value in SI of one unit of the column.
    scale: f64,
    /// Whether values are increments. Otherwise they are rates.
    increment: bool,
    /// Whether the unit is a pulse.
    pulses: bool,
}

/// Reads the sensors of `file`. Only the times stay in memory while a long file is read. What is
/// left out is added to `notes`.
///
/// # Errors
/// Any fault of the file, with line and column; a column that does not exist; an unknown sample
/// rate; too few samples; long columns need temporary files, and they cannot be written.
pub fn load(file: &Path, choice: &Choice, notes: &mut Vec<String>) -> Result<Vec<Column>, Error> {
    let (source, before) = open(file, choice)?;
    let names = source.head()[before].clone();
    let sensors = choose(file, &names, choice)?;
    if before > 0 && choice.skip_lines.is_none() {
        let text = format!("the lines before line {} are left out", before + 1);
        notes.push(format!("{}: {text}", file.display()));
    }
    let times = names.iter().position(|name| TIMES.contains(&&**name));
    let times = times.filter(|_| choice.rate_hz.is_none());
    let indices = sensors.iter().map(|s| s.index);
    let wanted: Vec<usize> = times.into_iter().chain(indices).collect();
    let layout = Layout {
        skip: before + 1,
        names: &names,
        wanted: &wanted,
        gap: None,
        loose: usize::MAX,
        cut: true,
    };
    let mut lists: Vec<Writer<f64>> = sensors.iter().map(|_| Writer::new(IN_MEMORY)).collect();
    let retained = usize::from(times.is_some());
    let mut table = Table::read_first(&source, &layout, retained, |row| {
        let mut values = lists.iter_mut().zip(row);
        values.try_for_each(|(list, value)| list.push(*value))
    })?;
    notes.append(&mut table.notes);
    let pulses = sensors.iter().all(|sensor| sensor.pulses);
    let rate_hz = match (choice.rate_hz, times) {
        (Some(rate), _) => rate,
        (None, Some(_)) => {
            notes.extend(table.continue_weeks(0, "samples"));
            rate_of_times(&table)?
        }
        (None, None) if pulses => RATE_HZ,
        (None, None) => return Err(no_rate(file)),
    };
    if table.count() < LEAST_SAMPLES {
        return Err(too_short(file, table.count()));
    }
    let column = |(sensor, values): (Sensor, Writer<f64>)| Column {
        name: sensor.name,
        kind: sensor.kind,
        rate_hz,
        scale: match sensor.increment {
            true => sensor.scale,
            false => sensor.scale / rate_hz,
        },
        values,
    };
    Ok(sensors.into_iter().zip(lists).map(column).collect())
}

/// Opens a file by the separator with which a line has most known names, and of equal ones most
/// cells. Returns also the number of the lines before it.
fn open(file: &Path, choice: &Choice) -> Result<(Source, usize), Error> {
    let known = |line: &Vec<String>| choose(file, line, choice).map_or(0, |known| known.len());
    let skip = choice.skip_lines;
    let mut best: Option<([usize; 2], Source, usize)> = None;
    for separator in [b',', b';', b'\t'].map(Separator::Char) {
        let source = Source::open(file, separator)?;
        let mut lines = source.head().iter().enumerate().skip(skip.unwrap_or(0));
        let found = lines.find_map(|(before, line)| match known(line) {
            0 => None,
            names => Some(([names, line.len()], before)),
        });
        let found = found.filter(|(_, before)| skip.is_none_or(|skip| skip == *before));
        if let Some((names, before)) = found
            && best.as_ref().is_none_or(|(most, ..)| names > *most)
        {
            best = Some((names, source, before));
        }
    }
    if let Some((_, source, before)) = best {
        return Ok((source, before));
    }
    // the line says what is wrong where none has the names
    let source = Source::open(file, Separator::COMMA)?;
    let _ = source.header(EXAMPLE)?;
    let before = skip.unwrap_or(0);
    if source.head().len() > before {
        return Ok((source, before));
    }
    Err(Error::Option {
        option: "--skip-lines".to_owned(),
        problem: format!("is {before}, and {} names no columns there", file.display()),
        remedy: format!(
            "give the number of lines before the names of the columns, at most {}",
            HEAD_LINES - 1
        ),
    })
}

fn no_rate(file: &Path) -> Error {
    Error::Option {
        option: "--rate".to_owned(),
        problem: format!(
            "{} has no column 't_s' or 'time_s' that gives the sample rate",
            file.display()
        ),
        remedy: "give the samples per second, for example --rate 200".to_owned(),
    }
}

fn too_short(file: &Path, samples: usize) -> Error {
    Error::Option {
        option: file.display().to_string(),
        problem: format!("holds {samples} samples, too few for an Allan deviation"),
        remedy: format!(
            "give a recording at rest of at least {LEAST_SAMPLES} samples, better of hours"
        ),
    }
}

/// The sensor whose output a column of this name holds. If the user has asked for columns by name
/// (`named`), the unit is enough.
fn sensor(index: usize, name: &str, named: bool) -> Option<Sensor> {
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
        index,
        name: name.to_owned(),
        kind,
        scale,
        increment,
        pulses: unit == "pulses",
    })
}

/// The sensors that the user wants of a file with the columns `names`.
fn choose(file: &Path, names: &[String], choice: &Choice) -> Result<Vec<Sensor>, Error> {
    let named = !choice.columns.is_empty();
    let columns = names.iter().enumerate();
    let known: Vec<Sensor> = columns
        .filter_map(|(index, name)| sensor(index, name, named))
        .collect();
    let is_known = |wanted: &&String| known.iter().any(|sensor| sensor.name == **wanted);
    if let Some(missing) = choice.columns.iter().find(|wanted| !is_known(wanted)) {
        let all: Vec<&str> = known.iter().map(|sensor| sensor.name.as_str()).collect();
        return Err(Error::unknown("sensor column", missing, &all));
    }
    if known.is_empty() {
        return Err(Error::Option {
            option: format!("{}:1", file.display()),
            problem: format!(
                "header is '{}', and no name states a sensor and its unit",
                excerpt(&names.join(","))
            ),
            remedy: format!(
                "name the columns as in '{EXAMPLE}', or describe the file by --header FILE.toml \
                 (docs/your-data.md)"
            ),
        });
    }
    let wanted = |sensor: &Sensor| !named || choice.columns.contains(&sensor.name);
    Ok(known.into_iter().filter(wanted).collect())
}

/// Samples per second of the times in the only column, which must rise in equal steps.
fn rate_of_times(table: &Table) -> Result<f64, Error> {
    table.check_rising(0)?;
    let times = table.values();
    let steps = || times.windows(2).map(|pair| pair[1] - pair[0]);
    let usual = median(steps);
    let mut steps = steps();
    if let Some(before) = steps.position(|step| (step - usual).abs() > GAP * usual) {
        let remedy = format!(
            "cut the file there (a step is {} s), or give --rate HZ to ignore the times",
            (usual * 1e9).round() / 1e9
        );
        let fault = "not one step after the line before";
        return Err(table.complain(before + 1, 0, fault, &remedy));
    }
    let span = times.last().unwrap_or(&1.0) - times.first().unwrap_or(&0.0);
    let rate = (times.len() - 1).max(1) as f64 / span;
    let in_unit = |(unit, of_s): &(&str, f64)| {
        let rate = of_s * rate;
        (4.0..=20_000.0)
            .contains(&rate)
            .then(|| format!("in {unit} they would be {rate:.0}"))
    };
    let smaller = [("ms", 1e3), ("us", 1e6), ("ns", 1e9)];
    let fits = smaller.iter().find_map(in_unit).filter(|_| rate < SLOW_HZ);
    if let Some(fits) = fits {
        let remedy =
            format!("give s: {fits} samples a second; or give --rate HZ to ignore the times");
        return Err(table.complain(1, 0, "a step that no IMU has", &remedy));
    }
    // times in files are rounded: 200.0000003 Hz is 200 Hz
    Ok(if (rate - rate.round()).abs() < 1e-5 * rate {
        rate.round()
    } else {
        rate
    })
}
